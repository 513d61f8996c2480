// MIP, MinIP and average: what stands for a ray, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_PROJECTION_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_PROJECTION_INL_H
#undef SQUINT_PIPELINE_STAGES_PROJECTION_INL_H
#else
#define SQUINT_PIPELINE_STAGES_PROJECTION_INL_H
#endif

#include "scene/scene.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// Adds the two ends of a slab, or what a ray has met, to what it has met before.
template <class W>
HWY_INLINE W merge_samples(CompositingMode mode, W kept, W next) {
    return mode == CompositingMode::mip     ? max(kept, next)
           : mode == CompositingMode::minip ? min(kept, next)
                                            : kept + next;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
