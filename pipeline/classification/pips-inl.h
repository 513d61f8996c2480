// The maths of pips.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_CLASSIFICATION_PIPS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_PIPS_INL_H
#undef SQUINT_PIPELINE_CLASSIFICATION_PIPS_INL_H
#else
#define SQUINT_PIPELINE_CLASSIFICATION_PIPS_INL_H
#endif

#include "pipeline/classification/pips.h"

#include "fixedpoint/unrolled-inl.h"
#include "pipeline/classification/prefix-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// T and X1 in rows `row` and `row + 1`.
template <class W>
HWY_INLINE std::array<std::array<W, 4>, 2> prefix_rows(const PowerSeriesOfOrder1& m, W row) {
    const auto at = [&](W r) {
        return std::array<W, 4>{gather(m.prefix.depth, r, 0), gather(m.moment, r, 0), gather(m.moment, r, 1),
                                gather(m.moment, r, 2)};
    };
    return {at(row), at(row + constant<W>(1))};
}
/// What the method computes of one sample: the back of a slab is the front of the next.
template <class W>
struct PrefixSample {
    W input;
    std::array<PrefixPlace<W>, 4> sums;  // T and X1
    Wide<W> bend;                        // what the bend of T takes from it
};
template <class W>
HWY_INLINE PrefixSample<W> sample_of(const PowerSeriesOfOrder1& m, W input) {
    const EntryPosition<W> at = sub_entry_position(m.prefix.entries, m.prefix.sub_entry_bits, input);
    const std::array<std::array<W, 4>, 2> rows = prefix_rows(m, at.entry);
    const auto place = [&](std::size_t c) SQUINT_WRITTEN_OUT {
        return prefix_place(rows[0][c], rows[1][c], at.fraction, m.prefix.place_bits(), m.most_rise);
    };
    PrefixSample<W> s{input, {place(0), place(1), place(2), place(3)}, {}};
    if (m.prefix.curved) s.bend = bend_at(m.prefix, at);
    return s;
}

/// Classifies the slab up to its end, whether a wall cuts it or not.
template <class W>
HWY_INLINE Slab<W> classify(const PowerSeriesOfOrder1& m, const PrefixSample<W>& front,
                            const PrefixSample<W>& end, const CutSlab<W>& cut, W length) {
    const int bits = m.prefix.place_bits();
    const Wide<W> straight = prefix_difference(front.sums[0], end.sums[0], bits);
    Wide<W> depth = straight;
    if (m.prefix.curved) depth = shift_left(straight, bits + 1) - (end.bend - front.bend);
    depth = absolute(depth);
    const W zero = constant<W>(0), one = constant<W>(m.one_ratio);
    Slab<W> slab{{zero, zero, zero}, zero};
    if (any_positive(depth))
        slab.alpha = opacity_of_depth(m.prefix.entries.opacity,
                                      depth_of(m.prefix, depth, widen(divisor<W>(cut.span)), length));
    if (any(zero < slab.alpha)) {  // an invisible slab may have any colour
        const Wide<W> some = divisor<W>(absolute(straight));
        const auto colored = [&](std::size_t c) SQUINT_WRITTEN_OUT {
            return absolute(prefix_difference(front.sums[c + 1], end.sums[c + 1], bits));
        };
        slab.color =
            divide_three(std::array<Wide<W>, 3>{colored(0), colored(1), colored(2)}, some, m.to_ratio);
        for_three([&](std::size_t c) SQUINT_WRITTEN_OUT { slab.color[c] = min(slab.color[c], one); });
    }
    return finish_straight(m.prefix, cut, front.input, length, slab);
}
template <class W>
HWY_INLINE Slab<W> classify(const PowerSeriesOfOrder1& m, const PrefixSample<W>& front,
                            const PrefixSample<W>& back, W length) {
    const CutSlab<W> cut = cut_at_wall(m.prefix, front.input, back.input);
    PrefixSample<W> end = back;
    if (m.prefix.predicts && any(constant<W>(0) < cut.wall)) end = sample_of(m, cut.end_input);
    return classify(m, front, end, cut, length);
}
template <class W>
HWY_INLINE Slab<W> classify(const PowerSeriesOfOrder1& m, W front, W back, W length) {
    if constexpr (std::is_same_v<W, Real<double>>)
        if (m.exact && !m.moment.active && !m.prefix.depth.active)
            return exact_slab_of(m.prefix.entries, *m.exact, front, back, length);
    return classify(m, sample_of(m, front), sample_of(m, back), length);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
