// The maths of inside.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_INSIDE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_INSIDE_INL_H
#undef SQUINT_PIPELINE_STAGES_INSIDE_INL_H
#else
#define SQUINT_PIPELINE_STAGES_INSIDE_INL_H
#endif

#include "pipeline/stages/inside.h"

#include "fixedpoint/unrolled-inl.h"
#include "pipeline/classification/prefix-inl.h"
#include "pipeline/stages/gradient.h"

#include <hwy/highway.h>

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
/// A piece's gradient: twice as long beside such sums, where lengths matter.
template <class W>
HWY_INLINE std::array<W, 3> for_pieces(const InsideStage& s, const GradientStage& g,
                                       const std::array<W, 3>& gradient) {
    return doubles_pieces(s, g) ? sum_of_ends(gradient, gradient) : gradient;
}

/// The gradient part of the way from a slab's front to its back.
template <class W>
HWY_INLINE std::array<W, 3> gradient_up_to(const InsideStage& s, const std::array<W, 3>& front,
                                           const std::array<W, 3>& back, W way) {
    std::array<W, 3> gradient;
    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
        gradient[a] = front[a] + quantise((back[a] - front[a]) * way, s.to_end);
    });
    return gradient;
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

/// The light of a slab's pieces, front to back, joined to one colour.
template <class W>
struct PieceLight {
    std::array<W, 3> light;
    W through;  // the transparency of the pieces so far
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
    });
    sum.through = within(sum.through - part, 0, s.one_alpha);
}
template <class W>
HWY_INLINE W opacity_of_pieces(const InsideStage& s, const PieceLight<W>& sum) {
    return constant<W>(s.one_alpha) - sum.through;
}
template <class W>
HWY_INLINE std::array<W, 3> color_of_pieces(const InsideStage& s, const PieceLight<W>& sum) {
    const W opacity = opacity_of_pieces(s, sum), seen = max(opacity, constant<W>(1));
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
    });
    return color;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
