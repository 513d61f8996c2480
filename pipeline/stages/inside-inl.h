// The maths of inside.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_INSIDE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_INSIDE_INL_H
#undef SQUINT_PIPELINE_STAGES_INSIDE_INL_H
#else
#define SQUINT_PIPELINE_STAGES_INSIDE_INL_H
#endif

#include "pipeline/stages/inside.h"

#include "fixedpoint/unrolled-inl.h"
#include "fixedpoint/words/range.h"
#include "pipeline/classification/prefix-inl.h"
#include "pipeline/stages/gradient-inl.h"

#include <hwy/highway.h>

#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// The location at `part` 2^-bits of the way from a slab's front to its back, rounded once.
template <class W>
HWY_INLINE std::array<W, 3> location_between(const InsideStage& s, const std::array<W, 3>& front,
                                             const std::array<W, 3>& back, int part, int bits) {
    std::array<W, 3> between;
    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
        const W apart = within(back[a] - front[a], -s.most_apart[a], s.most_apart[a]);
        const W way = quantise(apart * constant<W>(part), s.to_location[static_cast<std::size_t>(bits)]);
        between[a] = affine(front[a], constant<W>(1), way, 0, s.limit[a]);
    });
    return between;
}
/// The input there, on the straight line between the slab's ends.
template <class W>
HWY_INLINE W input_between(const InsideStage& s, W front, W back, int part, int bits) {
    const W way = quantise((back - front) * constant<W>(part), s.to_input[static_cast<std::size_t>(bits)]);
    return within(front + way, 0, s.highest_input);
}
/// The length of the slab up to there.
template <class W>
HWY_INLINE W length_up_to(const InsideStage& s, W length, int part, int bits) {
    return quantise(length * constant<W>(part), s.to_length[static_cast<std::size_t>(bits)]);
}

/// A gradient whose largest component is shifted to kTurnBits bits, and the floor of its length.
inline constexpr int kTurnBits = 12;
template <class W>
struct Turn {
    std::array<W, 3> gradient;
    W length;
};
template <class W>
HWY_INLINE Turn<W> turn_of(const std::array<W, 3>& gradient) {
    const W zero = constant<W>(0);
    std::array<W, 3> size;
    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT { size[a] = absolute(gradient[a]); });
    const W shift = constant<W>(kTurnBits) - bit_length(max(max(size[0], size[1]), size[2]));
    Turn<W> turn;
    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
        size[a] = within(shift_by(size[a], shift), 0, (std::int64_t{1} << kTurnBits) - 1);
        turn.gradient[a] = select(gradient[a] < zero, zero - size[a], size[a]);
    });
    turn.length = vector_length(size, 0);
    return turn;
}
template <RealWord W>
HWY_INLINE Turn<W> turn_of(const std::array<W, 3>& g) {
    return {g, square_root(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])};
}
/// log2 of the number of pieces in which a slab is lit, from the raw gradients at its ends: one piece up to
/// 14.4 degrees (cosine 31/32), two up to 44.0 (23/32), else four; one where either gradient is zero.  Angles
/// err by 0.1 degrees.
template <class W>
HWY_INLINE W cuts_between(const std::array<W, 3>& front, const std::array<W, 3>& back) {
    const Turn<W> f = turn_of(front), b = turn_of(back);
    const W dot = shift_left(
        f.gradient[0] * b.gradient[0] + f.gradient[1] * b.gradient[1] + f.gradient[2] * b.gradient[2], 5);
    const W lengths = f.length * b.length;
    const W zero = constant<W>(0), one = constant<W>(1), two = constant<W>(2);
    return select(dot < constant<W>(23) * lengths, two, select(dot < constant<W>(31) * lengths, one, zero));
}

/// Twice the mean of the gradients at a slab's ends: the same normal, and no bit lost.
template <class W>
HWY_INLINE std::array<W, 3> sum_of_ends(const std::array<W, 3>& front, const std::array<W, 3>& back) {
    return {front[0] + back[0], front[1] + back[1], front[2] + back[2]};
}
/// A piece's gradient: as long as those beside it, where lengths matter.
template <class W>
HWY_INLINE std::array<W, 3> for_pieces(const InsideStage& s, const GradientStage& g,
                                       const std::array<W, 3>& gradient) {
    const int bits = bits_of_pieces(s, g);
    return {shift_left(gradient[0], bits), shift_left(gradient[1], bits), shift_left(gradient[2], bits)};
}

/// The gradient part of the way from a slab's front to its back, gradient_scale() as long.
template <class W>
HWY_INLINE std::array<W, 3> gradient_up_to(const InsideStage& s, const std::array<W, 3>& front,
                                           const std::array<W, 3>& back, W way) {
    const std::int64_t whole = std::int64_t{1} << s.way_between.kept;
    const W there = within(quantise(way, s.to_way_between), 0, whole);
    std::array<W, 3> gradient;
    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
        gradient[a] = quantise(blend(front[a], back[a], there, s.way_between.kept), s.to_between);
    });
    return gradient;
}

/// The optical depth of a slab up to its wall, of any method with prefix sums.
template <class W>
HWY_INLINE W depth_up_to_wall(const PrefixLookup& p, const CutSlab<W>& cut, const Wide<W>& difference,
                              W length) {
    if constexpr (std::is_same_v<W, Real<double>>)
        if (!p.depth.active && !(cut.span == constant<W>(0))) return exact_depth(p, cut, length);
    W depth = depth_of(p, difference, widen(divisor<W>(cut.span)), length);
    const auto point = cut.span == constant<W>(0);
    if (any(point)) depth = select(point, point_depth(p.entries, cut.front, length), depth);
    return depth;
}
/// The lean of even matter, or its lean and its spread (EvenMatter).
template <std::size_t N, class W>
HWY_INLINE std::array<W, N> even_matter(const EvenMatter& even, W depth) {
    const int fraction = even.depth_fraction - even.row_bits;
    const std::int64_t one = std::int64_t{1} << fraction;
    const W row = min(floor_shift(depth, fraction), constant<W>(even.rows.rows() - 2));
    const W rest = within(min(depth - shift_left(row, fraction), constant<W>(one)), 0, one);
    const auto between = [&](W here, W next) SQUINT_WRITTEN_OUT {
        return quantise(blend(here, next, rest, fraction), even.to_row);
    };
    std::array<W, N> numbers;
    if constexpr (LoadsTwoByTwo<W>) {
        const auto rows = load_two_by_two(even.rows, row);
        for (std::size_t c = 0; c < N; ++c) numbers[c] = between(rows[0][c], rows[1][c]);
    } else {
        for (std::size_t c = 0; c < N; ++c) {
            const int column = static_cast<int>(c);
            numbers[c] =
                between(gather(even.rows, row, column), gather(even.rows, row + constant<W>(1), column));
        }
    }
    return numbers;
}

/// Where along a slab its light comes from: `share` of it, in 1.kShareBits, from `far`, the rest from `near`, both
/// in 1.kWayBits.
template <class W>
struct LightPlaces {
    W near, far, share;
};
/// With y the share of the slab's depth x in front of a place u, u is taken as straight in y, by its two first
/// moments (LEG(2) with u for a colour):
///
///     L_0 = int u dy = 1 - int y du,   L_1 = int u (2y - 1) dy = int y (1 - y) du,
///     u(y) = L_0 + 3 L_1 (2y - 1) at y = mean, mean - spread and mean + spread of even matter
///
/// Both integrals by Simpson's rule over the slab's quarters, of which T gives y: exact for even matter, and no
/// term is negative.  What a wall leaves of the light comes from the wall.
template <class W>
HWY_INLINE LightPlaces<W> places_of_light(const InsideStage& s, const PrefixLookup& p, W front, W back,
                                          W length) {
    constexpr std::int64_t kOne = std::int64_t{1} << kShareBits;
    constexpr std::int64_t kLeastSpan = 16;  // inputs between which quarters' own roundings are small
    const W zero = constant<W>(0), one = constant<W>(kOne);
    const CutSlab<W> cut = cut_at_wall(p, front, back);
    const auto depth_at_input = [&](W input) SQUINT_WRITTEN_OUT {
        EntryPosition<W> at = sub_entry_position(p.entries, p.sub_entry_bits, input);
        at.fraction = within(at.fraction, 0, std::int64_t{1} << p.place_bits());
        return depth_place(p, at);
    };
    const DepthPlace<W> start = depth_at_input(cut.front_input);
    const Wide<W> all = depth_between(p, start, depth_at_input(cut.end_input));
    const auto is_short = absolute(cut.end_input - cut.front_input) < constant<W>(kLeastSpan);
    const auto up_to = [&](int part) SQUINT_WRITTEN_OUT {
        return depth_between(p, start,
                             depth_at_input(input_between(s, cut.front_input, cut.end_input, part, 2)));
    };
    std::array<W, 3> y =
        divide_three(std::array<Wide<W>, 3>{up_to(1), up_to(2), up_to(3)}, divisor<W>(all), s.to_depth_share);
    for_three([&](std::size_t i) SQUINT_WRITTEN_OUT {
        const W share = min(y[i], constant<W>(std::int64_t{1} << kDepthShareBits));
        const auto part = static_cast<std::int64_t>(i) + 1;
        y[i] = select(is_short, constant<W>(kOne / kQuarters * part),
                      shift_left(share, kShareBits - kDepthShareBits));
    });
    const auto square = [&](W share) SQUINT_WRITTEN_OUT {
        return within(quantise(share * within(one - share, 0, kOne), s.to_square), 0, kOne / 4);
    };
    // 12 L_0 and 36 L_1.
    const W mean = constant<W>(11 * kOne) - shift_left(y[0] + y[2], 2) - shift_left(y[1], 1);
    const W turn = constant<W>(6) * (shift_left(square(y[0]) + square(y[2]), 1) + square(y[1]));
    const W depth = depth_up_to_wall(p, cut, all, length);
    const bool two = s.rule == InsideRule::two_point;
    const std::array<W, 2> even =
        two ? even_matter<2>(s.even, depth) : std::array<W, 2>{even_matter<1>(s.even, depth)[0], zero};
    const W lean = even[0], spread = even[1];
    const auto place = [&](W less) SQUINT_WRITTEN_OUT {
        const W twelvefold = clamp(mean - quantise(turn * less, s.to_moment), zero, constant<W>(12 * kOne));
        return min(divide(twelvefold, constant<W>(12), s.to_place), constant<W>(std::int64_t{1} << kWayBits));
    };
    LightPlaces<W> places{};
    if (two) {
        places = {place(min(lean + spread, one)), place(lean - spread), constant<W>(kOne / 2)};
    } else {
        places.near = places.far = place(lean), places.share = zero;
    }
    if (!p.predicts) return places;
    // A slab with an opaque front ends there, in front of the entry that ends it else.
    const auto starts_in_wall =
        zero < (p.as_printed ? zero : select(is_opaque(p.entries, cut.front), one, zero));
    const auto has_wall = (zero < cut.wall) | starts_in_wall;
    if (!any(has_wall)) return places;
    const W way = select(starts_in_wall, zero, way_to_wall(cut, s.to_way));
    const W behind =
        within(one - min(quantise(opacity_of_depth(p.entries.opacity, depth), s.to_behind), one), 0, kOne);
    const W before = min(quantise(place(lean) * way, s.to_along), way);
    if (two) {
        places.near = select(has_wall, before, places.near), places.far = select(has_wall, way, places.far);
        places.share = select(has_wall, behind, places.share);
    } else {
        const W ahead = within(way - before, 0, std::int64_t{1} << kWayBits);
        const W both = min(before + quantise(behind * ahead, s.to_ahead), way);
        places.near = places.far = select(has_wall, both, places.near);
    }
    return places;
}
/// The light of two places.
template <class W>
HWY_INLINE std::array<W, 3> light_of_places(const InsideStage& s, const std::array<W, 3>& near,
                                            const std::array<W, 3>& far, W share) {
    std::array<W, 3> color;
    for_three([&](std::size_t c) SQUINT_WRITTEN_OUT {
        color[c] = quantise(blend(near[c], far[c], share, kShareBits), s.to_parts);
    });
    return color;
}
/// How the light of a slab between two inputs, or of its part before a wall, leans to its front, as even matter's.
template <class W>
HWY_INLINE W lean_between(const InsideStage& s, const PrefixLookup& p, W near, W far, W length) {
    const CutSlab<W> part = cut_at_wall(p, near, far);
    const auto row_at = [&](W input) { return sub_entry_position(p.entries, p.sub_entry_bits, input); };
    const W depth = depth_up_to_wall(p, part, depth_between(p, row_at(near), row_at(part.end_input)), length);
    return even_matter<1>(s.even, depth)[0];
}
/// The lesser of what is not negative and a limit.
template <class W>
HWY_INLINE W at_most(W x, std::int64_t limit) {
    return min(x, constant<W>(limit));
}
/// What a part of the quarters' colour is of the slab's.
template <class W>
HWY_INLINE W part_of_color(const InsideStage& s, W part, W color, W quarters_color) {
    return divide(part * color, divisor<W>(quarters_color), s.to_scaled);
}
/// Where light lies in a slab of a method that classifies parts of slabs: in its quarters, each of even matter.  A
/// quarter's share of the light is what is seen of it; beside the slab's colour that of all quarters counts alone.
/// Parts are straight: they sum to the slab's colour, and white to one.  A wall's light lies at its place.
template <class W, class M>
HWY_INLINE FadingLight<W> fading_light_of_quarters(const InsideStage& s, const M& m, W front, W back,
                                                   W length, const Slab<W>& whole) {
    constexpr Quarters kCubic = bernstein_quarters(3), kLinear = bernstein_quarters(1);
    const Quarters& quarters = s.rule == InsideRule::linear ? kLinear : kCubic;
    const auto count = s.rule == InsideRule::linear ? std::size_t{2} : std::size_t{4};
    constexpr std::int64_t kOne = std::int64_t{1} << kShareBits;
    const W zero = constant<W>(0), one = constant<W>(s.one_color);
    const CutSlab<W> cut = cut_at_wall(m.prefix, front, back);
    const auto has_wall = zero < cut.wall;
    FadingLight<W> light{static_cast<int>(count), {}, way_to_wall(cut, s.to_way)};
    W whole_length = length;
    if (any(has_wall))
        whole_length = select(has_wall, min(quantise(length * light.end, s.to_cut_length), length), length);

    std::array<Slab<W>, kQuarters> quarter;
    std::array<W, kQuarters> seen, lean;
    W through = constant<W>(s.one_alpha), near = cut.front_input, near_length = zero;
    for (int i = 1; i <= kQuarters; ++i) {
        const auto at = static_cast<std::size_t>(i - 1);
        const W far = i == kQuarters ? cut.end_input : input_between(s, cut.front_input, cut.end_input, i, 2);
        const W far_length = i == kQuarters ? whole_length : length_up_to(s, whole_length, i, 2);
        const W part_length = within(far_length - near_length, 0, s.full_length);
        quarter[at] = classify(m, near, far, part_length);
        lean[at] = lean_between(s, m.prefix, near, far, part_length);
        seen[at] = min(quantise(through * quarter[at].alpha, s.to_part), through);
        through = within(through - seen[at], 0, s.one_alpha);
        near = far, near_length = far_length;
    }
    const W all = divisor<W>(constant<W>(s.one_alpha) - through);
    std::array<std::array<W, 4>, 4> sum{};
    for (auto& part : sum) part.fill(zero);
    for (std::size_t i = 0; i < kQuarters; ++i) {
        const W share = at_most(quotient(seen[i], all, s.to_share), kOne);
        const auto at_end = has_wall & (i + 1 == kQuarters ? zero == zero : zero < zero);
        for (std::size_t k = 0; k < count; ++k) {
            const W even = constant<W>(quarters.mean[k][i] << (kShareBits - kMeanBits)) -
                           quantise(lean[i] * constant<W>(quarters.rise[k][i]), s.to_shift);
            const W fade =
                clamp(select(at_end, constant<W>(k + 1 == count ? kOne : 0), even), zero, constant<W>(kOne));
            const W part = within(quantise(share * fade, s.to_square), 0, kOne);
            for (std::size_t c = 0; c < 3; ++c) sum[k][c] = sum[k][c] + part * quarter[i].color[c];
            sum[k][3] = sum[k][3] + part;
        }
    }
    for (std::size_t c = 0; c < 4; ++c) {
        std::array<W, 4> part;
        W quarters_color = zero;
        for (std::size_t k = 0; k < count; ++k) {
            part[k] = at_most(quantise(sum[k][c], c < 3 ? s.to_color : s.to_white), s.one_color);
            quarters_color = quarters_color + part[k];
        }
        const W color = c < 3 ? min(whole.color[c], one) : one;
        W left = color;
        for (std::size_t k = 1; k < count; ++k) {
            light.part[k][c] = min(part_of_color(s, part[k], color, quarters_color), left);
            left = within(left - light.part[k][c], 0, s.one_color);
        }
        light.part[0][c] = left;
    }
    return light;
}
/// Of two normals, one of which is zero, both become the other.
template <class W>
HWY_INLINE void share_normal(std::array<W, 3>& front, std::array<W, 3>& back) {
    const W zero = constant<W>(0);
    const auto is_zero = [&](const std::array<W, 3>& n) {
        return absolute(n[0]) + absolute(n[1]) + absolute(n[2]) == zero;
    };
    const auto front_is_zero = is_zero(front), back_is_zero = is_zero(back);
    for (std::size_t a = 0; a < 3; ++a) {
        const W from_front = front[a];
        front[a] = select(front_is_zero, back[a], front[a]);
        back[a] = select(back_is_zero, from_front, back[a]);
    }
}

/// The normals between which light fades, and how far each is to be trusted.
template <class W>
struct FadingNormals {
    std::array<std::array<W, 3>, 2> normal;
    std::array<W, 2> certain;
};
template <class W>
HWY_INLINE FadingNormals<W> fading_normals(const GradientStage& s,
                                           const std::array<std::array<W, 3>, 2>& gradient) {
    const W zero = constant<W>(0);
    std::array<W, 3> front = normalise(s, gradient[0]), back = normalise(s, gradient[1]);
    share_normal(front, back);
    return {{front, back},
            {s.fades ? confidence(s, gradient[0]) : zero, s.fades ? confidence(s, gradient[1]) : zero}};
}

/// What intervals alone follow.
struct NotFollowed {};
template <class W>
using Followed = std::conditional_t<std::is_same_v<W, Range>, W, NotFollowed>;

/// The light of a slab's pieces, front to back, joined to one colour.
template <class W>
struct PieceLight {
    std::array<W, 3> light;
    W through;                // the transparency of the pieces so far
    Followed<W> brightest{};  // of any piece's colours
};
template <class W>
HWY_INLINE PieceLight<W> no_piece(const InsideStage& s) {
    const W zero = constant<W>(0);
    return {{zero, zero, zero}, constant<W>(s.one_alpha)};
}
/// Adds a piece.
template <class W>
HWY_INLINE void add_piece(const InsideStage& s, PieceLight<W>& sum, const std::array<W, 3>& color, W alpha) {
    const W part = min(quantise(sum.through * alpha, s.to_part), sum.through);
    const W weight = s.premultiplied ? sum.through : part;
    for_three([&](std::size_t c) SQUINT_WRITTEN_OUT {
        sum.light[c] = affine(sum.light[c], weight, color[c], 0, s.most_light);
        if constexpr (std::is_same_v<W, Range>) sum.brightest = max(sum.brightest, color[c]);
    });
    sum.through = within(sum.through - part, 0, s.one_alpha);
}
template <class W>
HWY_INLINE W opacity_of_pieces(const InsideStage& s, const PieceLight<W>& sum) {
    return constant<W>(s.one_alpha) - sum.through;
}
template <class W>
HWY_INLINE std::array<W, 3> color_of_pieces(const InsideStage& s, const PieceLight<W>& sum) {
    const W opacity = opacity_of_pieces(s, sum), seen = divisor<W>(opacity);
    const W largest = constant<W>(s.largest_color);
    // What is not lit is no brighter than opaque.
    const W limit = s.lit || !s.premultiplied ? largest
                    : s.finer >= 0            ? min(shift_left(opacity, s.finer), largest)
                                              : floor_shift(opacity, -s.finer);
    std::array<W, 3> color;
    for_three([&](std::size_t c) SQUINT_WRITTEN_OUT {
        color[c] =
            min(s.premultiplied ? quantise(sum.light[c], s.to_whole) : divide(sum.light[c], seen, s.to_whole),
                limit);
        // A mean of colours is no brighter than the brightest.
        if constexpr (std::is_same_v<W, Range>)
            if (!s.premultiplied) color[c] = min(color[c], sum.brightest);
    });
    return color;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
