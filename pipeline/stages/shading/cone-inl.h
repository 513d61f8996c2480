// Cone: the highlight is max(0, 1 - n (1 - N.H)), by Guetat et al. 2010 in place of (N.H)^p: with their n =
// p, or n = (p + 1) / 2, which keeps the lobe's energy.  Compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_SHADING_CONE_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_SHADING_CONE_INL_H
#undef SQUINT_PIPELINE_STAGES_SHADING_CONE_INL_H
#else
#define SQUINT_PIPELINE_STAGES_SHADING_CONE_INL_H
#endif

#include "pipeline/stages/shading/lights-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

struct Cone {
    static constexpr bool kHeldToOpacity = false, kHasHighlights = true;
};

template <class W>
HWY_INLINE Reflection<W> reflect(Cone, const ShadingStage& s, const RayWords<W>& ray,
                                 const std::array<W, 3>& normal, W confidence) {
    return lights_that_add_up(
        s, normal, confidence, [&](std::size_t l, const std::array<W, 3>&, W) SQUINT_WRITTEN_OUT {
            return cone_of(s, quantise(towards_half(s, ray, normal, l), s.to_power_input));
        });
}
}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
