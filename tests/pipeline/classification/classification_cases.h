// Every classification method in fixed point, over given entries, one slab at a time.
#pragma once

#include "pipeline/classification/methods-inl.h"
#include "pipeline/classification/tables/linear_entries.h"
#include "pipeline/stages/presets.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace squint::cases {

struct MethodCase {
    Method method;
    int order = 1;
    std::string name() const {
        const bool ordered = method == Method::pips || method == Method::leg;
        return std::string(name_of(method)) + (ordered ? "_" + std::to_string(order) : "");
    }
};
inline std::vector<MethodCase> all_methods() {
    std::vector<MethodCase> methods{
        {Method::pc}, {Method::pi1d}, {Method::pi1d_engel}, {Method::pi2d}, {Method::pi2d_no_attenuation}};
    for (int n = 1; n <= 5; ++n) methods.push_back({Method::pips, n});
    for (int n = 2; n <= 4; ++n) methods.push_back({Method::leg, n});
    return methods;
}

/// A method's tables for full slabs of `step` world units, in a preset's formats.
struct Classifier {
    Entries entries;
    WireSpecs specs;
    ClassificationSettings settings;
    ClassificationMethod method;
    int input_fraction, color_fraction, alpha_fraction, length_fraction;
    bool premultiplied;

    std::int64_t input(double coordinate) const {
        return static_cast<std::int64_t>(std::floor(std::ldexp(coordinate, input_fraction) + 0.5));
    }
    std::int64_t length(double steps) const {
        return static_cast<std::int64_t>(std::floor(std::ldexp(steps, length_fraction) + 0.5));
    }
    template <class W>
    Slab<W> words(W front, W back, W length) const {
        return std::visit([&](const auto& m) { return HWY_NAMESPACE::classify(m, front, back, length); },
                          method);
    }
    /// Premultiplied, as real numbers.  Coordinates and length as the words hold them.
    template <class W = Int128>
    preintegration::SlabValue slab(double front, double back, double steps = 1) const {
        const Slab<W> s =
            words(constant<W>(input(front)), constant<W>(input(back)), constant<W>(length(steps)));
        preintegration::SlabValue value;
        value.alpha = std::ldexp(to_double(s.alpha), -alpha_fraction);
        for (int c = 0; c < 3; ++c)
            value.color[c] = std::ldexp(to_double(s.color[static_cast<std::size_t>(c)]), -color_fraction) *
                             (premultiplied ? 1 : value.alpha);
        return value;
    }
};

inline Classifier make_classifier(const Entries& entries, MethodCase which, const std::string& preset,
                                  int table_size = 0, double step = 1, bool prediction = true) {
    PresetInputs in;
    const auto bits_for = [](double v) {
        return v < 1 ? 1 : static_cast<int>(std::bit_width(static_cast<std::uint64_t>(v)));
    };
    in.entry_bits = bits_for(entries.size() - 1);
    in.scalar_bits = in.entry_bits;
    double deepest = 0, total = 0;
    for (const Entry& e : entries.entry) {
        deepest = std::max(deepest, e.extinction);
        total += e.opaque ? std::max(e.extinction, 1 / step) : e.extinction;
    }
    in.depth_bits = bits_for(deepest * step), in.total_depth_bits = bits_for(std::max(total, deepest) * step);
    Classifier c{entries, {}, {}, {}, 0, 0, 0, 0, false};
    preset_specs(preset, in, c.specs);
    c.settings.method = which.method, c.settings.order = which.order;
    c.settings.table_size = table_size > 0 ? table_size : std::max(64, entries.size());
    c.settings.opaque_prediction = prediction ? WallRule::ends : WallRule::none;
    const auto fraction = [&](Wire w) { return c.specs[w].format.fraction_bits; };
    c.input_fraction = fraction(Wire::classification_input);
    c.method = build_method({c.entries, c.specs, c.settings, step, c.input_fraction});
    c.premultiplied = std::visit([](const auto& m) { return m.kPremultiplied; }, c.method);
    c.color_fraction = fraction(c.premultiplied ? Wire::slab_color : Wire::slab_ratio);
    c.alpha_fraction = fraction(Wire::slab_alpha), c.length_fraction = fraction(Wire::length);
    return c;
}

/// Rows of inputs through a method in lanes of 32 or 64 bits, as many at a time as a vector holds: red,
/// green, blue, alpha.  Counts are multiples of 16.  (classification_lanes.cpp: words and lanes do not share
/// a file.)
std::array<std::vector<std::int32_t>, 4> classify_in_lanes(const ClassificationMethod& method, int bits,
                                                           const std::vector<std::int32_t>& front,
                                                           const std::vector<std::int32_t>& back,
                                                           const std::vector<std::int32_t>& length);

}  // namespace squint::cases
