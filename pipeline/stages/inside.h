// Light inside a slab: where its gradients are taken (shading.inside), and how a slab in which the surface
// turns is lit in pieces.  docs/conventions.md#light; docs/papers/guetat.md.
//
//     mean       the mean of the raw gradients at both ends
//     front      the gradient at the front end
//     middle     one gradient, sampled at the slab's middle
//     linear     fades from the front end's to the back end's (Lum et al. 2004): pi2d's tables say how, or what
//                the method makes of the slab's quarters
//     nlpi       the same, the normal between them kept at length one by a quadratic (Guetat et al. 2010)
//     centroid   the gradient at the mean place of the slab's light, between those at its ends
//     two_point  half the light by the gradient at either of two places: that mean, less and more its spread
//     adaptive   up to an angle between the ends' gradients as mean; beyond it 2 or 4 pieces, each a slab of
//                the method's own tables with a gradient sampled at its middle
#pragma once

#include "fixedpoint/table.h"
#include "fixedpoint/words.h"
#include "pipeline/classification/entries.h"
#include "scene/scene.h"
#include "scene/wires.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace squint {

/// A slab is cut into at most 2^kMostCuts pieces.
inline constexpr int kMostCuts = 2;

/// Whether a rule wants tables of where light lies in a slab.
constexpr bool lights_fade(InsideRule rule) {
    return rule == InsideRule::linear || rule == InsideRule::nlpi;
}
/// Whether a rule lights by gradients at places between a slab's ends, as T between them says.
constexpr bool lights_at_places(InsideRule rule) {
    return rule == InsideRule::centroid || rule == InsideRule::two_point;
}
/// Whether a rule needs the gradients at a slab's ends, which neighbours share.
constexpr bool lights_by_ends(InsideRule rule) {
    return rule != InsideRule::front && rule != InsideRule::middle;
}
/// The rules that cut slabs need their inputs and lengths.
constexpr bool looks_into_slabs(InsideRule rule) {
    return rule == InsideRule::adaptive || lights_fade(rule) || lights_at_places(rule);
}
/// Whether a rule takes gradients on the straight line between those at a slab's ends.
constexpr bool lights_between_ends(InsideRule rule) {
    return lights_fade(rule) || lights_at_places(rule);
}
/// Bits of a way between two gradients: what 31 bits leave, seven at least; and the last bits which the gradient
/// there loses to them.
struct WayBits {
    int kept, dropped;
};
constexpr WayBits way_bits(const Format& gradient) {
    const int width = gradient.integer_bits + gradient.fraction_bits;
    const int kept = std::clamp(31 - width, 7, kWayBits);
    return {kept, std::clamp(width + kept - 31, 0, kept)};
}
/// How much longer than the gradient is the one that lights: the sum of two, or one between them.
constexpr std::int64_t gradient_scale(InsideRule rule, const Format& gradient) {
    const WayBits way = way_bits(gradient);
    if (lights_between_ends(rule)) return std::int64_t{1} << (way.kept - way.dropped);
    return lights_by_ends(rule) ? 2 : 1;
}

/// Where light lies in even matter of depth x: its mean is (1 - lean) / 2 of the way, its spread `spread` / 2.
/// Rows over x, straight between them: they err by 2e-5; beyond 16 it lies as there.
struct EvenMatter {
    static constexpr double kDeepest = 16;
    Table rows;  // lean, spread
    int row_bits = 0, depth_fraction = 0;
    Rescale to_row;
};
/// Fraction bits of lean and spread, and of shares of a slab's depth and light.
inline constexpr int kShareBits = 14;
/// Of a depth over another, so few that the products of its remainders fit a double.
inline constexpr int kDepthShareBits = 10;

/// Bernstein polynomials of degree 3, or of degree 1, over the quarters of a way: their means there, exact with
/// kMeanBits fraction bits, and how much they rise.
inline constexpr int kQuarters = 4, kMeanBits = 8;
struct Quarters {
    std::array<std::array<std::int64_t, kQuarters>, 4> mean{}, rise{};
};
constexpr Quarters bernstein_quarters(int degree) {
    const auto term = [](int n, int k, int i) {  // C(n, k) i^k (4 - i)^(n - k)
        std::int64_t product = 1;
        for (int j = 0; j < k; ++j) product = product * (n - j) / (j + 1);
        for (int j = 0; j < k; ++j) product *= i;
        for (int j = k; j < n; ++j) product *= kQuarters - i;
        return product;
    };
    Quarters quarters;
    for (int k = 0; k <= degree; ++k)
        for (int i = 0; i < kQuarters; ++i) {
            const auto at = [&](auto& table) -> std::int64_t& {
                return table[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)];
            };
            // (n + 1) int b_k = sum_(j > k) of degree n + 1; times four, for a quarter.
            for (int j = k + 1; j <= degree + 1; ++j)
                at(quarters.mean) += term(degree + 1, j, i + 1) - term(degree + 1, j, i);
            at(quarters.rise) = term(degree, k, i + 1) - term(degree, k, i);
            if (degree == 1) at(quarters.mean) *= 32;  // 8ths
            at(quarters.rise) *= degree == 1 ? 64 : 4;
        }
    return quarters;
}

struct InsideStage {
    InsideRule rule = InsideRule::mean;
    // For places k 2^-b along a slab, by b: a piece's middle needs one bit more than its ends.
    std::array<Rescale, kMostCuts + 2> to_location;
    std::array<Rescale, kMostCuts + 1> to_input, to_length;
    std::array<std::int64_t, 3> most_apart{};  // of the two ends of a slab, as locations
    std::array<std::int64_t, 3> limit{};       // the last voxel centre
    std::int64_t highest_input = 0;
    std::int64_t least_cut = 0;  // slabs of less opacity are not cut: 2^-10, or 32 last bits
    std::int64_t one_alpha = 0;
    // Joining pieces: colours come in this wire's format, straight or premultiplied.
    Wire color_wire = Wire::lit_color;
    bool lit = false, premultiplied = false;
    int finer = 0;  // fraction bits of a colour above an opacity's
    std::int64_t largest_color = 0, most_light = 0;
    // Gradients on the way to the back, with so many more bits.
    WayBits way_between{};
    int gained_bits = 0;  // log2 of gradient_scale
    Rescale to_way_between, to_between;
    EvenMatter even;
    Rescale to_depth_share;  // a depth over another
    Rescale to_share;        // a quarter's light over the slab's
    Rescale to_square;       // a product of shares
    Rescale to_moment;       // 36 L_1 times a share
    Rescale to_place;
    Rescale to_way;     // a way over another
    Rescale to_along;   // a way along another
    Rescale to_ahead;   // a share of a way
    Rescale to_behind;  // an opacity, as a share
    Rescale to_parts;   // light from two places
    // Of light that fades over quarters.
    Rescale to_shift, to_color, to_white, to_scaled, to_cut_length;
    std::int64_t one_color = 0, full_length = 0;
    Rescale to_part;   // light behind earlier pieces
    Rescale to_whole;  // light of all pieces; straight: over their opacity

    bool needs_back() const { return rule != InsideRule::front; }
    /// Whether gradients are sampled between a slab's ends.
    bool samples_between() const { return rule == InsideRule::middle || rule == InsideRule::adaptive; }

    template <class V>
    void visit(V&& v) {
        for (Rescale& r : to_location) v(r);
        for (Rescale& r : to_input) v(r);
        for (Rescale& r : to_length) v(r);
        for (Rescale* r :
             {&to_way_between, &to_between, &even.to_row, &to_depth_share, &to_share,  &to_square, &to_moment,
              &to_place,       &to_way,     &to_along,    &to_ahead,       &to_behind, &to_parts,  &to_shift,
              &to_color,       &to_white,   &to_scaled,   &to_cut_length,  &to_part,   &to_whole})
            v(*r);
        v(even.rows);
    }
};

/// How many bits the gradients of pieces gain, to be as long as others where light fades in.
struct GradientStage;
int bits_of_pieces(const InsideStage& inside, const GradientStage& gradient);

struct LocationStage;
struct StageInputs;
InsideStage build_inside(const StageInputs& in, const LocationStage& location);

}  // namespace squint
