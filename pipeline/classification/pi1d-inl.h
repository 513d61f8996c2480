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
