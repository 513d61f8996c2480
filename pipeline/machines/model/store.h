// Where fixed point meets float: a finished pixel of any word into the channels of an image.
#pragma once

#include "core/image.h"
#include "pipeline/plan/plan.h"
#include "pipeline/slab.h"
#include "pipeline/stages/compositing-inl.h"

#include <array>
#include <cmath>
#include <limits>

namespace squint::model {

using namespace HWY_NAMESPACE;

template <class W>
Accumulated<double> in_doubles(const Accumulated<W>& pixel) {
    return {{to_double(pixel.color[0]), to_double(pixel.color[1]), to_double(pixel.color[2])},
            to_double(pixel.transparency)};
}

inline void put(Image& image, const char* name, std::size_t at, double value) {
    if (Channel* channel = image.find(name)) channel->values[at] = static_cast<float>(value);
}
template <class W>
void put_word(Image& image, const char* name, std::size_t at, W word) {
    if (Channel* channel = image.find(name))
        channel->words[at] =
            static_cast<std::uint32_t>(static_cast<std::int64_t>(std::floor(to_double(word) + 0.5)));
}

inline constexpr double kNoHit = std::numeric_limits<float>::max();  // Z where a ray meets nothing

template <class W>
void store(const Plan& plan, const Pixel<W>& pixel, int column, int row, Image& image) {
    const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                           static_cast<std::size_t>(column);
    const std::array<double, 4> color = color_of(plan.compositing, in_doubles(pixel.gathered));
    for (std::size_t c = 0; c < 4; ++c)
        image.channels[c].values[at] = static_cast<float>(color[c]);  // R G B A come first
    const OutputSettings& output = plan.scene.output;
    if (output.depth) {
        put(image, "Z", at, pixel.first_hit.value_or(kNoHit));
        put(image, "Z.mean", at, pixel.weight > 0 ? pixel.weighted_distance / pixel.weight : kNoHit);
    }
    if (output.normals) {
        const double one = std::ldexp(1.0, plan.gradient.normal_fraction);
        const auto& n = pixel.first_normal;
        const Vec3 normal = plan.volume->world_from_grid(
            Vec3(to_double(n[0]) / one, to_double(n[1]) / one, to_double(n[2]) / one));
        put(image, "N.x", at, normal.x), put(image, "N.y", at, normal.y), put(image, "N.z", at, normal.z);
    }
    if (output.samples) put(image, "samples", at, static_cast<double>(pixel.samples));
    if (output.transparency) put(image, "T", at, 1 - color[3]);
    if (output.fixed) {
        put_word(image, "fixed.R", at, pixel.gathered.color[0]),
            put_word(image, "fixed.G", at, pixel.gathered.color[1]);
        put_word(image, "fixed.B", at, pixel.gathered.color[2]),
            put_word(image, "fixed.T", at, transparency(plan.compositing, pixel.gathered));
    }
}

}  // namespace squint::model
