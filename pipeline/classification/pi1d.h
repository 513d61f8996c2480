// Stage 4, PI1D: one-dimensional tables for one slab length, without self-attenuation inside the slab.
// inputs at both ends (I.F) -> premultiplied colour (1.F), opacity (1.F):
//
//     kye    alpha = mean of a_i, C = mean of a_i c_i over the slab's entries, a_i = 1 - exp(-tau_i d)
//     engel  alpha = 1 - exp(-mean of v_i), C = mean of v_i c_i <= alpha, v_i = min(tau_i d, 1)
//
// (Kye et al. 2008; Engel's clamped variant, Lee & Shin, section 3.3).  Opaque entries count 1: one among n
// gives 1/n, unless opaque prediction ends the slab there.  Means are differences of prefix sums over |s_b -
// s_f|.
// A shorter slab: alpha exactly from T, the colour in proportion.
#ifndef SQUINT_PIPELINE_CLASSIFICATION_PI1D_H
#define SQUINT_PIPELINE_CLASSIFICATION_PI1D_H

#include "pipeline/classification/prefix.h"

namespace squint {

struct PreIntegrated1D {
    static constexpr bool kPremultiplied = true;
    static constexpr bool kNeedsBack = true;
    enum Column { value = 3, columns = 4 };  // red, green, blue before it
    PrefixLookup prefix;
    PremultipliedRules premultiplied;
    Table sums;                  // prefix sums of value times colour, and of value
    std::int64_t most_rise = 0;  // of any sum from row to row
    bool is_opacity = true;
    Rescale to_color;  // means
    Rescale to_alpha;
    Rescale to_depth;

    template <class V>
    void visit(V&& v) {
        prefix.visit(v), premultiplied.visit(v), v(sums), v(to_color), v(to_alpha), v(to_depth);
    }
    void describe(ClassificationReport& report) const {
        prefix.describe(report);
        report.add("sums", sums,
                   is_opacity ? "prefix sums of opacity and coloured opacity, for one slab length"
                              : "prefix sums of clamped depth and coloured depth, for one slab length");
    }
};
PreIntegrated1D build_pre_integrated_1d(const ClassificationInputs& inputs);

}  // namespace squint
#endif

#include "pipeline/classification/prefix.h"

#include <hwy/highway.h>
#if defined(SQUINT_PIPELINE_CLASSIFICATION_PI1D_TARGET) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_PI1D_TARGET
#undef SQUINT_PIPELINE_CLASSIFICATION_PI1D_TARGET
#else
#define SQUINT_PIPELINE_CLASSIFICATION_PI1D_TARGET
#endif
HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

template <class W>
HWY_INLINE Slab<W> classify(const PreIntegrated1D& m, W front, W back, W length) {
    const CutSlab<W> cut = cut_at_wall(m.prefix, front, back);
    const Wide<W> span = widen(max(cut.span, constant<W>(1)));
    const auto sum_of = [&](int column) SQUINT_WRITTEN_OUT {
        return absolute(prefix_difference(m.sums, cut.front, cut.end, column, m.prefix.entries.input_fraction,
                                          m.most_rise));
    };
    Slab<W> slab;
    const Wide<W> value = sum_of(PreIntegrated1D::value);
    const W one = constant<W>(m.prefix.entries.one_alpha);
    slab.alpha = m.is_opacity ? min(divide(value, span, m.to_alpha), one)
                              : opacity_of_depth(m.prefix.entries.opacity, divide(value, span, m.to_depth));
    const W limit = largest_color(m.premultiplied, slab.alpha);
    for (int c = 0; c < 3; ++c)
        slab.color[static_cast<std::size_t>(c)] = min(divide(sum_of(c), span, m.to_color), limit);
    const auto shorter = is_shorter(m.prefix.entries, length);
    if (any(shorter)) {
        const W depth = slab_depth(m.prefix, cut, length);
        const Slab<W> part =
            with_alpha(m.premultiplied, slab, opacity_of_depth(m.prefix.entries.opacity, depth));
        for (std::size_t c = 0; c < 3; ++c) slab.color[c] = select(shorter, part.color[c], slab.color[c]);
        slab.alpha = select(shorter, part.alpha, slab.alpha);
    }
    return finish_premultiplied(m.prefix, m.premultiplied, cut, front, length, slab);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
