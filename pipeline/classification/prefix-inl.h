// The maths of prefix.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_CLASSIFICATION_PREFIX_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_PREFIX_INL_H
#undef SQUINT_PIPELINE_CLASSIFICATION_PREFIX_INL_H
#else
#define SQUINT_PIPELINE_CLASSIFICATION_PREFIX_INL_H
#endif

#include "pipeline/classification/prefix.h"

#include "fixedpoint/unrolled-inl.h"
#include "pipeline/classification/entries-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// A quotient whatever its wire: where the wire has fewer fraction bits than the exact quotient, the
/// denominator is shifted.
template <class N>
HWY_INLINE auto divide(const N& numerator, const N& denominator, const Rescale& to) {
    if (to.shift <= 0) return quotient(numerator, denominator, to);
    Rescale whole = to;
    whole.shift = 0;
    return quotient(numerator, shift_left(denominator, to.shift), whole);
}

/// A prefix sum at a position, straight between rows and exact: `bits` more fraction bits than its words.
template <class W>
HWY_INLINE W prefix_at(const Table& table, const EntryPosition<W>& at, int column, int bits) {
    return blend(gather(table, at.entry, column), gather(table, at.entry + constant<W>(1), column),
                 at.fraction, bits);
}

/// Where an input stands between two sub-entries.
template <class W>
HWY_INLINE EntryPosition<W> sub_entry_position(const EntryLookup& e, int sub_entry_bits, W input) {
    const int bits = e.input_fraction - sub_entry_bits;
    const std::int64_t last = (static_cast<std::int64_t>(e.last_segment + 1) << sub_entry_bits) - 1;
    const W entry = min(floor_shift(input, bits), constant<W>(last));
    const std::int64_t one = std::int64_t{1} << bits;
    return {entry, within(min(input - shift_left(entry, bits), constant<W>(one)), 0, one)};
}

/// T, exact with gained_bits() more fraction bits than its words.  With tau linear over a row's reach,
///
///     T(u) = T_i + u (T_(i+1) - T_i) - u (1 - u) / 2 (tau_(i+1) - tau_i),    0 <= u <= 1.
template <class W>
HWY_INLINE W depth_at(const PrefixLookup& p, const EntryPosition<W>& at) {
    const int bits = p.place_bits();
    const W straight = prefix_at(p.depth, at, 0, bits);
    if (!p.curved) return straight;
    const std::int64_t one = std::int64_t{1} << bits;
    const W hollow = within(at.fraction * (constant<W>(one) - at.fraction), 0, one * one / 4);
    return within(shift_left(straight, bits + 1) - hollow * gather(p.depth, at.entry, 1), 0,
                  (p.total + 1) << p.gained_bits());
}

/// The difference of a prefix sum between two positions, exact with `bits` more fraction bits than its words,
/// which rise by `most_rise` from row to row.
template <class W>
HWY_INLINE Wide<W> prefix_difference(const Table& table, const EntryPosition<W>& front,
                                     const EntryPosition<W>& end, int column, int bits,
                                     std::int64_t most_rise) {
    const W from = gather(table, front.entry, column), to = gather(table, end.entry, column);
    const auto part = [&](const EntryPosition<W>& at, W sum) SQUINT_WRITTEN_OUT {
        const W rise = within(gather(table, at.entry + constant<W>(1), column) - sum, 0, most_rise);
        return within(at.fraction, 0, std::int64_t{1} << bits) * rise;
    };
    return wide_sum(to - from, bits, part(end, to) - part(front, from));
}
/// What T's bend takes from it (depth_at).
template <class W>
HWY_INLINE Wide<W> bend_at(const PrefixLookup& p, const EntryPosition<W>& at) {
    const std::int64_t one = std::int64_t{1} << p.place_bits();
    const W part = within(at.fraction, 0, one);
    const W hollow = within(part * (constant<W>(one) - part), 0, one * one / 4);
    return wide_product(hollow, gather(p.depth, at.entry, 1));
}

/// A slab cut where it first meets an opaque entry: in either direction, both ends included.
template <class W>
struct CutSlab {
    EntryPosition<W> front, end;  // the translucent part
    W end_input;
    W span;  // |s_b - s_f| of the whole slab: the rate is kept
    W wall;  // 1 where an opaque entry ends it
    W wall_entry;
};
template <class W>
HWY_INLINE CutSlab<W> cut_at_wall(const PrefixLookup& p, W front, W back) {
    const int bits = p.entries.input_fraction;
    const W zero = constant<W>(0), one = constant<W>(1);
    CutSlab<W> cut{entry_position(p.entries, front), {}, back, absolute(back - front), zero, zero};
    W end = back;
    if (p.predicts) {
        const auto ascending = front < back;
        const W above = floor_shift(front + constant<W>((std::int64_t{1} << bits) - 1), bits);
        const W wall =
            select(ascending, gather(p.walls, above, 0), gather(p.walls, floor_shift(front, bits), 1));
        const W place = shift_left(wall, bits);
        const auto hit = (ascending & (!(back < place))) | ((!ascending) & (!(place < back)));
        end = select(hit, place, back);
        cut.wall = select(hit, one, zero);
        cut.wall_entry = select(hit, wall, zero);
    }
    cut.end_input = end;
    cut.end = entry_position(p.entries, end);
    return cut;
}

/// The optical depth of a difference of T over a span of inputs, at least one, for a slab of `length`.  N:
/// the word or its Wide.
template <class N, class W>
HWY_INLINE W depth_of(const PrefixLookup& p, const N& difference, const N& span, W length) {
    W depth = divide(difference, span, p.to_depth);
    const auto shorter = length < constant<W>(std::int64_t{1} << p.entries.length_fraction);
    if (any(shorter)) depth = select(shorter, quantise(depth * length, p.to_shorter), depth);
    return depth;
}
/// The optical depth of a cut slab, where an entry has one row.
template <class W>
HWY_INLINE W slab_depth(const PrefixLookup& p, const CutSlab<W>& cut, W length) {
    const int bits = p.place_bits();
    Wide<W> difference = prefix_difference(p.depth, cut.front, cut.end, 0, bits, p.most_rise);
    if (p.curved)
        difference = shift_left(difference, bits + 1) - (bend_at(p, cut.end) - bend_at(p, cut.front));
    return depth_of(p, absolute(difference), widen(max(cut.span, constant<W>(1))), length);
}

/// The straight colour of the wall that ends a slab.
template <class W>
HWY_INLINE W wall_color(const EntryLookup& e, const CutSlab<W>& cut, int channel) {
    return quantise(shift_left(gather(e.table, cut.wall_entry, channel), e.input_fraction), e.to_color);
}
/// Slabs that are one point: both ends equal, or a front that is opaque itself.
template <class W>
HWY_INLINE auto is_point(const PrefixLookup& p, const CutSlab<W>& cut) {
    const auto equal = cut.span == constant<W>(0);
    return p.predicts ? equal | is_opaque(p.entries, cut.front) : equal;
}

/// The last word on a slab: where its ends are equal it is the point itself; behind a wall nothing is seen.
/// `part` is straight.
template <class W>
HWY_INLINE Slab<W> finish_straight(const PrefixLookup& p, const CutSlab<W>& cut, W front, W length,
                                   Slab<W> part) {
    if (p.predicts) {
        const auto wall = constant<W>(0) < cut.wall;
        if (any(wall)) {
            for (int c = 0; c < 3; ++c) {
                W& color = part.color[static_cast<std::size_t>(c)];
                color = select(wall,
                               quantise(blend(wall_color(p.entries, cut, c), color, part.alpha,
                                              p.entries.alpha_fraction),
                                        p.to_wall),
                               color);
            }
            part.alpha = select(wall, constant<W>(p.entries.one_alpha), part.alpha);
        }
    }
    const auto point = is_point(p, cut);
    if (any(point)) {
        const Slab<W> here = classify_point(p.entries, front, length);
        for (std::size_t c = 0; c < 3; ++c) part.color[c] = select(point, here.color[c], part.color[c]);
        part.alpha = select(point, here.alpha, part.alpha);
    }
    return part;
}

/// The largest premultiplied colour an opacity allows.
template <class W>
HWY_INLINE W largest_color(const PremultipliedRules& r, W alpha) {
    return r.finer >= 0 ? shift_left(alpha, r.finer) : floor_shift(alpha, -r.finer);
}
/// A premultiplied part with another opacity: C alpha' / alpha.
template <class W>
HWY_INLINE Slab<W> with_alpha(const PremultipliedRules& r, Slab<W> part, W alpha) {
    const W some = max(part.alpha, constant<W>(1)), limit = largest_color(r, alpha);
    for (W& color : part.color) color = min(divide(color * alpha, some, r.to_scaled), limit);
    part.alpha = alpha;
    return part;
}
/// finish_straight for a premultiplied part.
template <class W>
HWY_INLINE Slab<W> finish_premultiplied(const PrefixLookup& p, const PremultipliedRules& r,
                                        const CutSlab<W>& cut, W front, W length, Slab<W> part) {
    if (p.predicts) {
        const auto wall = constant<W>(0) < cut.wall;
        if (any(wall)) {
            const W one = constant<W>(p.entries.one_alpha), clear = one - part.alpha;
            for (int c = 0; c < 3; ++c) {
                W& color = part.color[static_cast<std::size_t>(c)];
                const W behind = quantise(wall_color(p.entries, cut, c) * clear, r.to_product);
                color = select(wall, min(color + behind, constant<W>(r.one_color)), color);
            }
            part.alpha = select(wall, one, part.alpha);
        }
    }
    const auto point = is_point(p, cut);
    if (any(point)) {
        const Slab<W> here = classify_point(p.entries, front, length);
        for (std::size_t c = 0; c < 3; ++c)
            part.color[c] = select(point, quantise(here.color[c] * here.alpha, r.to_product), part.color[c]);
        part.alpha = select(point, here.alpha, part.alpha);
    }
    return part;
}
/// Slabs shorter than a step.
template <class W>
HWY_INLINE auto is_shorter(const EntryLookup& e, W length) {
    return length < constant<W>(std::int64_t{1} << e.length_fraction);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
