// The maths of pi1d.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_CLASSIFICATION_PI1D_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_PI1D_INL_H
#undef SQUINT_PIPELINE_CLASSIFICATION_PI1D_INL_H
#else
#define SQUINT_PIPELINE_CLASSIFICATION_PI1D_INL_H
#endif

#include "pipeline/classification/pi1d.h"

#include "pipeline/classification/prefix-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// mean_of(column, to): the mean of a column over the slab's span, quantised to a wire.
template <class W, class MeanOf>
HWY_INLINE Slab<W> classify_means(const PreIntegrated1D& m, const CutSlab<W>& cut, W front, W length,
                                  const MeanOf& mean_of) {
    Slab<W> slab;
    const W one = constant<W>(m.prefix.entries.one_alpha);
    slab.alpha = m.is_opacity ? min(mean_of(PreIntegrated1D::value, m.to_alpha), one)
                              : opacity_of_depth(m.prefix.entries.opacity,
                                                 mean_of(PreIntegrated1D::value, m.to_depth));
    const W limit = largest_color(m.premultiplied, slab.alpha);
    for (int c = 0; c < 3; ++c) slab.color[static_cast<std::size_t>(c)] = min(mean_of(c, m.to_color), limit);
    take_own_depth(m.prefix, m.premultiplied, cut, length, is_shorter(m.prefix.entries, length), slab);
    return finish_premultiplied(m.prefix, m.premultiplied, cut, front, length, slab);
}
/// Without rounding: means of values that are linear between entries.
template <class W>
HWY_INLINE Slab<W> classify_exactly(const PreIntegrated1D& m, W front, W back, W length) {
    const EntryLookup& e = m.prefix.entries;
    const CutSlab<W> cut = cut_at_wall(m.prefix, front, back);
    const bool ascending = front < cut.end_input;
    const double part = absolute(cut.end_input - front).v / divisor<W>(cut.span).v;
    const auto value_at = [&](double entry) {
        const W i{entry};
        const double depth =
            gather(e.matter, i, EntryLookup::extinction).v * power_of_two<double>(-e.extinction_fraction);
        const bool opaque = std::fmod(gather(e.matter, i, EntryLookup::opaque).v, 2) != 0;
        return opaque ? 1 : m.is_opacity ? -portable::expm1(-depth) : std::min(depth, 1.0);
    };
    const auto mean_of = [&](int column, Rescale to) {
        const auto at = [&](double i) {
            if (column == PreIntegrated1D::value) return value_at(i);
            const W row{i * power_of_two<double>(e.row_bits)};
            return value_at(i) * gather(e.table, row, column).v *
                   power_of_two<double>(-e.table_color_fraction);
        };
        const auto between = [&](double i, double j) {
            return (gather(m.sums, W{j}, column).v - gather(m.sums, W{i}, column).v) *
                   power_of_two<double>(-m.sum_fraction);
        };
        const double mean = mean_between(ascending ? cut.front : cut.end, ascending ? cut.end : cut.front,
                                         e.input_fraction, at, between);
        // to.shift holds sum_fraction and the bits gained at a place, minus an input's and the wire's own.
        const int gained = m.curved ? e.input_fraction + 1 : 0;
        to.shift -= m.sum_fraction + gained;
        return quantise(W{mean * part}, to);
    };
    return classify_means(m, cut, front, length, mean_of);
}
template <class W>
HWY_INLINE Slab<W> classify(const PreIntegrated1D& m, W front, W back, W length) {
    if constexpr (std::is_same_v<W, Real<double>>)
        if (!m.sums.active && !m.prefix.depth.active) return classify_exactly(m, front, back, length);
    const CutSlab<W> cut = cut_at_wall(m.prefix, front, back);
    const Wide<W> span = widen(divisor<W>(cut.span));
    const int bits = m.prefix.entries.input_fraction;
    const auto mean_of = [&](int column, const Rescale& to) SQUINT_WRITTEN_OUT {
        Wide<W> sum = prefix_difference(m.sums, cut.front, cut.end, column, bits, m.most_rise);
        if (m.curved) {
            const int bend = PreIntegrated1D::columns + column;
            sum = shift_left(sum, bits + 1) -
                  (bend_at(m.sums, cut.end, bend, bits) - bend_at(m.sums, cut.front, bend, bits));
        }
        return divide(absolute(sum), span, to);
    };
    return classify_means(m, cut, front, length, mean_of);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
