// The maths of pc.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_CLASSIFICATION_PC_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_PC_INL_H
#undef SQUINT_PIPELINE_CLASSIFICATION_PC_INL_H
#else
#define SQUINT_PIPELINE_CLASSIFICATION_PC_INL_H
#endif

#include "pipeline/classification/pc.h"

#include "pipeline/classification/entries-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

template <class W>
HWY_INLINE Slab<W> classify(const PostClassification& m, W front, W, W length) {
    return classify_point(m.entries, front, length);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
