// The maths of prefix.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_CLASSIFICATION_PREFIX_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_PREFIX_INL_H
#undef SQUINT_PIPELINE_CLASSIFICATION_PREFIX_INL_H
#else
#define SQUINT_PIPELINE_CLASSIFICATION_PREFIX_INL_H
#endif

#include "pipeline/classification/prefix.h"

#include "fixedpoint/quotients-inl.h"
#include "fixedpoint/unrolled-inl.h"
#include "pipeline/classification/entries-inl.h"

#include <hwy/highway.h>

#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// A prefix sum at a position, linear between rows, exact: it has `bits` more fraction bits than its words.
template <class W>
HWY_INLINE W prefix_at(const Table& table, const EntryPosition<W>& at, int column, int bits) {
    return blend(gather(table, at.entry, column), gather(table, at.entry + constant<W>(1), column),
                 at.fraction, bits);
}

/// T, exact, with gained_bits() more fraction bits than its words.  For tau linear over a row,
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

/// A prefix sum at a position between two rows: the first row's, and `bits` more fraction bits of what it has risen
/// since, by at most `most_rise` a row.
template <class W>
struct PrefixPlace {
    W sum, risen;
};
template <class W>
HWY_INLINE PrefixPlace<W> prefix_place(W sum, W next, W fraction, int bits, std::int64_t most_rise) {
    return {sum, within(fraction, 0, std::int64_t{1} << bits) * within(next - sum, 0, most_rise)};
}
/// The difference of a prefix sum between two positions, exact, with `bits` more fraction bits than its words.
template <class W>
HWY_INLINE Wide<W> prefix_difference(const PrefixPlace<W>& front, const PrefixPlace<W>& end, int bits) {
    return wide_sum(end.sum - front.sum, bits, end.risen - front.risen);
}
template <class W>
HWY_INLINE Wide<W> prefix_difference(const Table& table, const EntryPosition<W>& front,
                                     const EntryPosition<W>& end, int column, int bits,
                                     std::int64_t most_rise) {
    const auto place = [&](const EntryPosition<W>& at) SQUINT_WRITTEN_OUT {
        return prefix_place(gather(table, at.entry, column), gather(table, at.entry + constant<W>(1), column),
                            at.fraction, bits, most_rise);
    };
    return prefix_difference(place(front), place(end), bits);
}
/// What a prefix sum loses to its bend, for a change over a row by a column of `bends` (depth_at).
template <class W>
HWY_INLINE Wide<W> bend_at(W fraction, W bend, int place_bits) {
    const std::int64_t one = std::int64_t{1} << place_bits;
    const W part = within(fraction, 0, one);
    const W hollow = within(part * (constant<W>(one) - part), 0, one * one / 4);
    return wide_product(hollow, bend);
}
template <class W>
HWY_INLINE Wide<W> bend_at(const Table& bends, const EntryPosition<W>& at, int column, int place_bits) {
    return bend_at(at.fraction, gather(bends, at.entry, column), place_bits);
}
template <class W>
HWY_INLINE Wide<W> bend_at(const PrefixLookup& p, const EntryPosition<W>& at) {
    return bend_at(p.depth, at, 1, p.place_bits());
}

/// A slab cut at the first opaque entry that it meets, in either direction, both ends included.
template <class W>
struct CutSlab {
    EntryPosition<W> front, end;  // the translucent part
    W front_input, end_input;
    W span;  // |s_b - s_f| of the whole slab: its rate is kept; as printed, of the part
    W wall;  // 1 where an opaque entry ends the slab
    W wall_entry;
};
template <class W>
HWY_INLINE CutSlab<W> cut_at_wall(const PrefixLookup& p, W front, W back) {
    const int bits = p.entries.input_fraction;
    const W zero = constant<W>(0), one = constant<W>(1);
    CutSlab<W> cut{entry_position(p.entries, front), {}, front, back, absolute(back - front), zero, zero};
    W end = back;
    if (p.predicts) {
        const auto ascending = front < back;
        const W above =
            zero - floor_shift(zero - front, bits);  // the entry at or above, in words with fractions too
        const W wall =
            select(ascending, gather(p.walls, above, 0), gather(p.walls, floor_shift(front, bits), 1));
        const W place = shift_left(wall, bits);
        const auto hit = p.as_printed ? ascending & (place < back)
                                      : (ascending & (!(back < place))) | ((!ascending) & (!(place < back)));
        end = select(hit, place, back);
        if (p.as_printed) cut.span = absolute(end - front);
        cut.wall = select(hit, one, zero);
        cut.wall_entry = select(hit, wall, zero);
    }
    cut.end_input = end;
    cut.end = entry_position(p.entries, end);
    return cut;
}

/// The part of a slab's way up to the wall that ends it, or all of it, in 1.kWayBits.
template <class W>
HWY_INLINE W way_to_wall(const CutSlab<W>& cut, const Rescale& to_way) {
    const std::int64_t all = std::int64_t{1} << kWayBits;
    const auto has_wall = constant<W>(0) < cut.wall;
    if (!any(has_wall)) return constant<W>(all);
    const W way =
        within(quotient(absolute(cut.end_input - cut.front_input), divisor<W>(cut.span), to_way), 0, all);
    return select(has_wall, way, constant<W>(all));
}

/// The optical depth of a slab of `length` from a difference of T over a span of inputs, at least one.  N:
/// the word or its Wide.
template <class N, class W>
HWY_INLINE W depth_of(const PrefixLookup& p, const N& difference, const N& span, W length) {
    W depth = divide(difference, span, p.to_depth);
    const auto shorter = length < constant<W>(std::int64_t{1} << p.entries.length_fraction);
    if (any(shorter))
        depth = select(shorter, shortened(depth, length, p.entries.length_fraction, p.to_shorter), depth);
    return depth;
}
/// The mean of a curve through entries over [low, high], as a sum without cancellation.  at(i): the curve at
/// entry i; between(i, j): its integral from entry i to entry j.
template <class At, class Between>
double mean_between(const EntryPosition<Real<double>>& low, const EntryPosition<Real<double>>& high,
                    int input_fraction, const At& at, const Between& between) {
    const double unit = power_of_two<double>(-input_fraction);
    const double u = low.fraction.v * unit, v = high.fraction.v * unit;
    const auto value = [&](double entry, double way) {
        const double here = at(entry);
        return way == 0 ? here : here + way * (at(entry + 1) - here);
    };
    const double i = low.entry.v, j = high.entry.v;
    if (i == j) return (value(i, u) + value(i, v)) / 2;
    const double first = (1 - u) * (value(i, u) + at(i + 1)) / 2, last = v * (at(j) + value(j, v)) / 2;
    return (first + between(i + 1, j) + last) / ((j - i - 1) + (1 - u) + v);
}
/// Without rounding: the integral of extinction itself, linear between entries, over the part before the
/// wall, with its share of the span.
inline Real<double> exact_depth(const PrefixLookup& p, const CutSlab<Real<double>>& cut,
                                Real<double> length) {
    const bool ascending = cut.front_input < cut.end_input;
    const EntryPosition<Real<double>> front = entry_position(p.entries, cut.front_input),
                                      end = entry_position(p.entries, cut.end_input);
    const double rows = power_of_two<double>(p.sub_entry_bits);
    const double mean = mean_between(
        ascending ? front : end, ascending ? end : front, p.entries.input_fraction,
        [&](double i) { return gather(p.entries.matter, Real<double>{i}, EntryLookup::extinction).v; },
        [&](double i, double j) {
            return gather(p.depth, Real<double>{j * rows}, 0).v -
                   gather(p.depth, Real<double>{i * rows}, 0).v;
        });
    const double part = absolute(cut.end_input - cut.front_input).v / divisor<Real<double>>(cut.span).v;
    Rescale to = p.to_depth;
    to.shift += p.entries.input_fraction - p.gained_bits();
    return shortened(quantise(Real<double>{mean * part}, to), length, p.entries.length_fraction,
                     p.to_shorter);
}

/// Words that load two rows of a table of two columns at once.
template <class W>
concept LoadsTwoByTwo = requires(const Table& table, W word) {
    { load_two_by_two(table, word) } -> std::same_as<std::array<std::array<W, 2>, 2>>;
};
/// T at a position between two rows, and what it loses there to its bend.
template <class W>
struct DepthPlace {
    PrefixPlace<W> straight;
    Wide<W> bend;
};
template <class W>
HWY_INLINE DepthPlace<W> depth_place(const PrefixLookup& p, const EntryPosition<W>& at) {
    const int bits = p.place_bits();
    const auto place = [&](W sum, W next) SQUINT_WRITTEN_OUT {
        return prefix_place(sum, next, at.fraction, bits, p.most_rise);
    };
    if constexpr (LoadsTwoByTwo<W>)
        if (p.curved) {
            const auto rows = load_two_by_two(p.depth, at.entry);
            return {place(rows[0][0], rows[1][0]), bend_at(at.fraction, rows[0][1], bits)};
        }
    DepthPlace<W> there{place(gather(p.depth, at.entry, 0), gather(p.depth, at.entry + constant<W>(1), 0)),
                        {}};
    if (p.curved) there.bend = bend_at(p, at);
    return there;
}
/// The difference of T between two positions in its rows, exact, with gained_bits() more fraction bits than its
/// words.
template <class W>
HWY_INLINE Wide<W> depth_between(const PrefixLookup& p, const DepthPlace<W>& from, const DepthPlace<W>& to) {
    const int bits = p.place_bits();
    Wide<W> difference = prefix_difference(from.straight, to.straight, bits);
    if (p.curved) difference = shift_left(difference, bits + 1) - (to.bend - from.bend);
    return absolute(difference);
}
template <class W>
HWY_INLINE Wide<W> depth_between(const PrefixLookup& p, const EntryPosition<W>& from,
                                 const EntryPosition<W>& to) {
    return depth_between(p, depth_place(p, from), depth_place(p, to));
}

/// The optical depth of a cut slab.
template <class W>
HWY_INLINE W slab_depth(const PrefixLookup& p, const CutSlab<W>& cut, W length) {
    if constexpr (std::is_same_v<W, Real<double>>)
        if (!p.depth.active) return exact_depth(p, cut, length);
    return depth_of(p, depth_between(p, cut.front, cut.end), widen(divisor<W>(cut.span)), length);
}

/// Without rounding: a slab of the curves between entries.
inline Slab<Real<double>> exact_slab_of(const EntryLookup& e, const preintegration::ExactSeries& series,
                                        Real<double> front, Real<double> back, Real<double> length) {
    const double input = power_of_two<double>(-e.input_fraction);
    const preintegration::SlabValue value = series.slab(
        front.v * input, back.v * input, length.v * power_of_two<double>(-e.length_fraction) * series.step);
    const double color = value.alpha > 0 ? power_of_two<double>(e.color_fraction) / value.alpha : 0;
    const auto channel = [&](int c) {
        return quantise_raw(Real<double>{value.color[c] * color}, e.to_color);
    };
    return {{channel(0), channel(1), channel(2)},
            quantise_raw(Real<double>{value.alpha * power_of_two<double>(e.alpha_fraction)}, e.to_alpha)};
}

/// The straight colour of the wall that ends a slab.
template <class W>
HWY_INLINE W wall_color(const EntryLookup& e, const CutSlab<W>& cut, int channel) {
    const W color = gather(e.table, shift_left(cut.wall_entry, e.row_bits), channel);
    return quantise(shift_left(color, e.input_fraction - e.row_bits), e.to_color);
}
/// Classifies slabs that are one point: equal ends, or an opaque front.
template <class W>
HWY_INLINE auto is_point(const PrefixLookup& p, const CutSlab<W>& cut) {
    const auto equal = cut.span == constant<W>(0);
    return p.predicts && !p.as_printed ? equal | is_opaque(p.entries, cut.front) : equal;
}

/// Finishes a slab: one with equal ends is classified as a point; behind a wall nothing is seen.  `part` is
/// straight.
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

/// The largest premultiplied colour that an opacity allows.
template <class W>
HWY_INLINE W largest_color(const PremultipliedRules& r, W alpha) {
    return r.finer >= 0 ? shift_left(alpha, r.finer) : floor_shift(alpha, -r.finer);
}
/// A premultiplied part with another opacity: C alpha' / alpha.
template <class W>
HWY_INLINE Slab<W> with_alpha(const PremultipliedRules& r, Slab<W> part, W alpha) {
    const Wide<W> some = widen(divisor<W>(part.alpha));
    const W limit = largest_color(r, alpha);
    for (W& color : part.color) color = min(divide(wide_product(color, alpha), some, r.to_scaled), limit);
    part.alpha = alpha;
    return part;
}
/// A premultiplied part whose opacity is that of its own depth where `other` than a full, whole slab's.
template <class W, class Mask>
HWY_INLINE void take_own_depth(const PrefixLookup& p, const PremultipliedRules& r, const CutSlab<W>& cut,
                               W length, const Mask& other, Slab<W>& part) {
    if (!any(other)) return;
    const W depth = slab_depth(p, cut, length);
    const Slab<W> own = with_alpha(r, part, opacity_of_depth(p.entries.opacity, depth));
    for (std::size_t c = 0; c < 3; ++c) part.color[c] = select(other, own.color[c], part.color[c]);
    part.alpha = select(other, own.alpha, part.alpha);
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
                const W behind = quantised_wide_product(wall_color(p.entries, cut, c), clear, r.to_product);
                color = select(wall, min(color + behind, constant<W>(r.one_color)), color);
            }
            part.alpha = select(wall, one, part.alpha);
        }
    }
    const auto point = is_point(p, cut);
    if (any(point)) {
        const Slab<W> here = classify_point(p.entries, front, length);
        for (std::size_t c = 0; c < 3; ++c)
            part.color[c] =
                select(point, quantised_wide_product(here.color[c], here.alpha, r.to_product), part.color[c]);
        part.alpha = select(point, here.alpha, part.alpha);
    }
    return part;
}
/// Classifies slabs shorter than a step.
template <class W>
HWY_INLINE auto is_shorter(const EntryLookup& e, W length) {
    return length < constant<W>(std::int64_t{1} << e.length_fraction);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
