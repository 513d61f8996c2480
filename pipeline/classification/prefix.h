// What the pre-integrated methods share: the prefix sum T of the entries' optical depths, and opaque
// prediction. Lee & Shin, equation 8 and section 4.2, as corrected (docs/classification.md).
#ifndef SQUINT_PIPELINE_CLASSIFICATION_PREFIX_H
#define SQUINT_PIPELINE_CLASSIFICATION_PREFIX_H

#include "pipeline/classification/entries.h"

namespace squint {

/// T at every entry, for one full step a unit of the coordinate, and the nearest opaque entries.
struct PrefixLookup {
    EntryLookup entries;
    Table depth;         // one column: T[i]; straight between entries
    Rescale to_part;     // the part of T inside an entry
    Rescale to_depth;    // slab's depth: (T(b) - T(f)) / |s_b - s_f|
    Rescale to_shorter;  // times the slab's length
    Rescale to_wall;     // colour in front of a wall over the wall's
    bool predicts = false;
    Table walls;  // up, down: the nearest opaque entry at or above, at or below; absent where none is opaque

    template <class V>
    void visit(V&& v) {
        entries.visit(v), v(depth), v(to_part), v(to_depth), v(to_shorter), v(to_wall), v(walls);
    }
    void describe(ClassificationReport& report) const {
        entries.describe(report);
        report.add("T", depth, "prefix sum of the entries' optical depths");
        report.add("walls", walls, "nearest opaque entry above and below");
        if (entries.has_opaque)
            report.notes.push_back(predicts
                                       ? "opaque prediction: the first opaque entry on a slab's way ends it"
                                       : "no opaque prediction, as asked: thin opaque surfaces are lost");
    }
};

PrefixLookup build_prefix_lookup(const ClassificationInputs& inputs);

/// What methods with premultiplied colours share.
struct PremultipliedRules {
    Rescale to_product;  // a straight colour times an opacity
    Rescale to_scaled;   // a colour times another opacity over its own
    int finer = 0;       // fraction bits of slab_color above slab_alpha's
    std::int64_t one_color = 0;

    template <class V>
    void visit(V&& v) {
        v(to_product), v(to_scaled);
    }
};
PremultipliedRules build_premultiplied_rules(const WireSpecs& specs);

}  // namespace squint
#endif

#include "pipeline/classification/entries.h"

#include <hwy/highway.h>
#if defined(SQUINT_PIPELINE_CLASSIFICATION_PREFIX_TARGET) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_PREFIX_TARGET
#undef SQUINT_PIPELINE_CLASSIFICATION_PREFIX_TARGET
#else
#define SQUINT_PIPELINE_CLASSIFICATION_PREFIX_TARGET
#endif
HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// A quotient whatever its wire: where the wire has fewer fraction bits than the exact quotient, the
/// denominator is shifted.
template <class W>
HWY_INLINE W divide(W numerator, W denominator, const Rescale& to) {
    if (to.shift <= 0) return quotient(numerator, denominator, to);
    Rescale whole = to;
    whole.shift = 0;
    return quotient(numerator, shift_left(denominator, to.shift), whole);
}

/// A prefix sum at a position: P[i] + q(f (P[i+1] - P[i])).
template <class W>
HWY_INLINE W prefix_at(const Table& table, const EntryPosition<W>& at, int column, const Rescale& to_part) {
    const W here = gather(table, at.entry, column);
    return within(
        here + quantise(at.fraction * (gather(table, at.entry + constant<W>(1), column) - here), to_part), 0,
        to_part.highest);
}

/// A slab cut where it first meets an opaque entry: in either direction, both ends included.
template <class W>
struct CutSlab {
    EntryPosition<W> front, end;  // the translucent part
    W end_input;                  // its end as an input
    W span;                       // |s_b - s_f| of the whole slab: the rate is kept
    W wall;                       // 1 where an opaque entry ends it
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

/// The optical depth of a cut slab, and T's difference that it comes from.
template <class W>
struct SlabDepth {
    W difference;  // |T(end) - T(front)|
    W depth;       // times length over span
};
/// The optical depth of a difference of T over a span of inputs, for a slab of `length`.
template <class W>
HWY_INLINE W depth_of(const PrefixLookup& p, W difference, W span, W length) {
    W depth = divide(difference, max(span, constant<W>(1)), p.to_depth);
    const auto shorter = length < constant<W>(std::int64_t{1} << p.entries.length_fraction);
    if (any(shorter)) depth = select(shorter, quantise(depth * length, p.to_shorter), depth);
    return depth;
}
template <class W>
HWY_INLINE SlabDepth<W> slab_depth(const PrefixLookup& p, const CutSlab<W>& cut, W length) {
    const W difference =
        absolute(prefix_at(p.depth, cut.end, 0, p.to_part) - prefix_at(p.depth, cut.front, 0, p.to_part));
    return {difference, depth_of(p, difference, cut.span, length)};
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
