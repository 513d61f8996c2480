#include "pipeline/stages/inside.h"

#include "core/portable_math.h"
#include "pipeline/classification/entries.h"
#include "pipeline/stages/gradient.h"
#include "pipeline/stages/inputs.h"
#include "pipeline/stages/location.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace squint {
namespace {

// The difference of two places along a slab; it may be negative.
Rescale to_way(const StageInputs& in, Wire wire, int bits) {
    Spec spec = in.specs[wire];
    spec.format.is_signed = true, spec.overflow = Overflow::sat;
    return Rescale(fraction(in, wire) + bits, spec, wire_index(wire));
}

// The light e^-t of even matter over its depth t in [0, x]: 1 - 2 mean / x and 2 spread / x.
std::array<double, 2> lean_and_spread(double x) {
    if (x < 0x1p-6)  // to 1e-9
        return {x / 6 - x * x * x / 360, 2 * std::sqrt(1.0 / 12 - x * x / 240)};
    const double e = portable::expm1(x);
    return {1 - 2 * (1 / x - 1 / e), 2 * std::sqrt(1 / (x * x) - (e + 1) / (e * e))};
}
EvenMatter build_even_matter(const StageInputs& in) {
    EvenMatter even;
    even.depth_fraction = fraction(in, Wire::slab_depth);
    even.row_bits = std::min(even.depth_fraction, std::clamp(even.depth_fraction - kShareBits, 4, 8));
    const Spec share{{1, kShareBits, false}, Rounding::rnd_conv, Overflow::sat};
    even.to_row = Rescale(kShareBits + even.depth_fraction - even.row_bits, share);
    if (!lights_between_ends(in.inside)) return even;
    const int last = static_cast<int>(std::ldexp(EvenMatter::kDeepest, even.row_bits));
    even.rows = Table(last + 1, 2);
    for (int i = 0; i <= last; ++i) {
        const std::array<double, 2> row = lean_and_spread(std::ldexp(i, -even.row_bits));
        for (int c = 0; c < 2; ++c) even.rows.set(i, c, row[static_cast<std::size_t>(c)], share);
    }
    return even;
}

}  // namespace

int bits_of_pieces(const InsideStage& inside, const GradientStage& gradient) {
    return gradient.fades ? inside.gained_bits : 0;
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
    const Format input = in.specs[Wire::classification_input].format;  // as InputStage::highest
    s.highest_input =
        std::min(static_cast<std::int64_t>(in.entries.size() - 1) << input.fraction_bits, input.largest());
    s.one_alpha = in.specs[Wire::slab_alpha].format.one();
    s.lit = in.lit, s.premultiplied = in.premultiplied;
    s.color_wire = in.lit ? Wire::lit_color : in.premultiplied ? Wire::slab_color : Wire::slab_ratio;
    s.finer = fraction(in, s.color_wire) - fraction(in, Wire::slab_alpha);
    s.largest_color = in.specs[s.color_wire].format.largest();
    // Premultiplied colours that are lit may exceed their opacities: pieces then sum to as many times more.
    s.most_light = (in.premultiplied ? std::int64_t{1} << kMostCuts : 1) * s.one_alpha * s.largest_color;
    s.least_cut = std::max<std::int64_t>(s.one_alpha >> 10, 32);
    const Format gradient = in.specs[Wire::gradient].format;
    s.way_between = way_bits(gradient);
    s.gained_bits = std::countr_zero(static_cast<std::uint64_t>(gradient_scale(s.rule, gradient)));
    s.to_way_between = Rescale(kWayBits, {{1, s.way_between.kept, false}, Rounding::rnd_conv, Overflow::sat});
    const int most = std::max(31, gradient.integer_bits + gradient.fraction_bits);
    s.to_between = Rescale(s.way_between.dropped, {{most, 0, true}, Rounding::rnd_conv, Overflow::sat});
    s.even = build_even_matter(in);
    // These belong to no wire: they say where gradients are taken.
    const Spec share{{1, kShareBits, false}, Rounding::rnd_conv, Overflow::sat},
        way{{1, kWayBits, false}, Rounding::rnd_conv, Overflow::sat};
    s.to_share = Rescale(0, share), s.to_way = Rescale(0, way);
    s.to_depth_share = Rescale(0, {{1, kDepthShareBits, false}, Rounding::rnd_conv, Overflow::sat});
    s.to_depth_share.divides = s.to_share.divides = s.to_way.divides = true;
    s.to_along = Rescale(2 * kWayBits, way), s.to_ahead = Rescale(kShareBits + kWayBits, way);
    s.to_square = Rescale(2 * kShareBits, share);
    s.to_moment = Rescale(2 * kShareBits, {{4, kShareBits, true}, Rounding::rnd_conv, Overflow::sat});
    s.to_place = Rescale(kShareBits, way);
    s.to_place.divides = true;
    s.to_behind = Rescale(fraction(in, Wire::slab_alpha), share);
    s.to_parts = Rescale(fraction(in, Wire::lit_color) + kShareBits, in.specs[Wire::lit_color],
                         wire_index(Wire::lit_color));
    const Spec signed_share{{1, kShareBits, true}, Rounding::rnd_conv, Overflow::sat};
    s.to_shift = Rescale(kShareBits + kMeanBits + 1, signed_share);
    s.to_color = rescale(in, fraction(in, Wire::slab_ratio) + kShareBits, Wire::slab_ratio);
    s.to_white = rescale(in, kShareBits, Wire::slab_ratio);
    s.to_scaled = rescale(in, fraction(in, Wire::slab_ratio), Wire::slab_ratio);
    s.to_scaled.divides = true;
    s.to_cut_length = rescale(in, fraction(in, Wire::length) + kWayBits, Wire::length);
    s.full_length = in.specs[Wire::length].format.one();
    s.one_color = in.specs[Wire::slab_ratio].format.one();
    s.to_part = rescale(in, 2 * fraction(in, Wire::slab_alpha), Wire::slab_alpha);
    // Belongs to no wire: intervals cannot see that a mean of lit colours needs no limit.
    const int gained = in.premultiplied ? fraction(in, Wire::slab_alpha) : 0;
    s.to_whole = Rescale(fraction(in, s.color_wire) + gained, in.specs[s.color_wire]);
    s.to_whole.divides = !in.premultiplied;
    return s;
}

}  // namespace squint
