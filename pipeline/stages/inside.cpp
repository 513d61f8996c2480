#include "pipeline/stages/inside.h"

#include "pipeline/classification/entries.h"
#include "pipeline/stages/gradient.h"
#include "pipeline/stages/inputs.h"
#include "pipeline/stages/location.h"

#include <algorithm>
#include <cmath>

namespace squint {
namespace {

// The difference of two places along a slab; it may be negative.
Rescale to_way(const StageInputs& in, Wire wire, int bits) {
    Spec spec = in.specs[wire];
    spec.format.is_signed = true, spec.overflow = Overflow::sat;
    return Rescale(fraction(in, wire) + bits, spec, wire_index(wire));
}

}  // namespace

bool doubles_pieces(const InsideStage& inside, const GradientStage& gradient) {
    return gradient.fades && lights_by_ends(inside.rule);
}

InsideStage build_inside(const StageInputs& in, const LocationStage& location) {
    InsideStage s;
    s.rule = in.inside;
    for (int b = 0; b < static_cast<int>(s.to_location.size()); ++b)
        s.to_location[static_cast<std::size_t>(b)] = to_way(in, Wire::location, b);
    for (int b = 0; b <= kMostCuts; ++b) {
        const auto at = static_cast<std::size_t>(b);
        s.to_input[at] = to_way(in, Wire::classification_input, b);
        s.to_length[at] = rescale(in, fraction(in, Wire::length) + b, Wire::length);
    }
    // The ends of a slab are a step apart, plus their roundings.
    const double apart = in.scene.sampling.step + 2 * location.drift() + 1;
    const auto one = static_cast<double>(in.specs[Wire::location].format.one());
    s.limit = location.limit;
    for (std::size_t a = 0; a < 3; ++a)
        s.most_apart[a] =
            static_cast<std::int64_t>(std::min(static_cast<double>(s.limit[a]), std::ceil(apart * one)));
    s.highest_input = static_cast<std::int64_t>(in.entries.size() - 1)
                      << fraction(in, Wire::classification_input);
    s.one_alpha = in.specs[Wire::slab_alpha].format.one();
    s.lit = in.lit, s.premultiplied = in.premultiplied;
    s.color_wire = in.lit ? Wire::lit_color : in.premultiplied ? Wire::slab_color : Wire::slab_ratio;
    s.finer = fraction(in, s.color_wire) - fraction(in, Wire::slab_alpha);
    s.largest_color = in.specs[s.color_wire].format.largest();
    // Premultiplied colours that are lit may exceed their opacities: pieces then sum to as many times more.
    s.most_light = (in.premultiplied ? std::int64_t{1} << kMostCuts : 1) * s.one_alpha * s.largest_color;
    s.least_cut = std::max<std::int64_t>(s.one_alpha >> 10, 32);
    s.to_end = to_way(in, Wire::gradient, kWayBits);
    s.to_part = rescale(in, 2 * fraction(in, Wire::slab_alpha), Wire::slab_alpha);
    // Belongs to no wire: intervals cannot see that a mean of lit colours needs no limit.
    const int gained = in.premultiplied ? fraction(in, Wire::slab_alpha) : 0;
    s.to_whole = Rescale(fraction(in, s.color_wire) + gained, in.specs[s.color_wire]);
    s.to_whole.divides = !in.premultiplied;
    return s;
}

}  // namespace squint
