// Stage 4, PIPS(1): pre-integration by the first-order power series (Lee & Shin 2013, equations 8 and 22).
// inputs at both ends (I.F) -> straight colour K (1.F), opacity (1.F):
//
//     x = length (T(s_b) - T(s_f)) / |s_b - s_f|     alpha = 1 - exp(-x)     K = (X(s_b) - X(s_f)) / (T(s_b)
//     - T(s_f))
//
// Exact in alpha.  K is the mean colour weighted by extinction: it cannot tell front from back, and errs by
// x^2 dc / 8 for a colour that changes by dc inside the slab.  Between rows the colour is their mean: where
// that shows, an entry has several rows.
#ifndef SQUINT_PIPELINE_CLASSIFICATION_PIPS_H
#define SQUINT_PIPELINE_CLASSIFICATION_PIPS_H

#include "pipeline/classification/prefix.h"

namespace squint {

struct PowerSeriesOfOrder1 {
    static constexpr bool kPremultiplied = false;
    static constexpr bool kNeedsBack = true;
    PrefixLookup prefix;
    Table moment;  // three columns: X[i], colour over depth, a row for every row of T
    Rescale to_ratio;
    std::int64_t one_ratio = 0;

    template <class V>
    void visit(V&& v) {
        prefix.visit(v), v(moment), v(to_ratio);
    }
    void describe(ClassificationReport& report) const {
        prefix.describe(report);
        report.add("X1", moment, "prefix sums of colour over depth");
    }
};
PowerSeriesOfOrder1 build_power_series_of_order_1(const ClassificationInputs& inputs);

}  // namespace squint
#endif

#include "pipeline/classification/prefix.h"

#include <hwy/highway.h>
#if defined(SQUINT_PIPELINE_CLASSIFICATION_PIPS_TARGET) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_PIPS_TARGET
#undef SQUINT_PIPELINE_CLASSIFICATION_PIPS_TARGET
#else
#define SQUINT_PIPELINE_CLASSIFICATION_PIPS_TARGET
#endif
HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

template <class W>
HWY_INLINE Slab<W> classify(const PowerSeriesOfOrder1& m, W front, W back, W length) {
    const CutSlab<W> cut = cut_at_wall(m.prefix, front, back);
    const SlabDepth<W> d = slab_depth(m.prefix, cut, length);
    const W some = max(d.straight, constant<W>(1)), one = constant<W>(m.one_ratio);
    const int bits = m.prefix.place_bits();
    Slab<W> slab;
    slab.alpha = opacity_of_depth(m.prefix.entries.opacity, d.depth);
    for (int c = 0; c < 3; ++c) {
        const W colored =
            absolute(prefix_at(m.moment, d.end, c, bits) - prefix_at(m.moment, d.front, c, bits));
        slab.color[static_cast<std::size_t>(c)] = min(divide(colored, some, m.to_ratio), one);
    }
    return finish_straight(m.prefix, cut, front, length, slab);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
