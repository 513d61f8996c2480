// Blinn-Phong: the highlight is (N.H)^p (Squeeze, equation 11).  Compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_SHADING_BLINN_PHONG_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_SHADING_BLINN_PHONG_INL_H
#undef SQUINT_PIPELINE_STAGES_SHADING_BLINN_PHONG_INL_H
#else
#define SQUINT_PIPELINE_STAGES_SHADING_BLINN_PHONG_INL_H
#endif

#include "pipeline/stages/shading/lights-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

struct BlinnPhong {
    static constexpr bool kHeldToOpacity = false, kHasHighlights = true;
};

template <class W>
HWY_INLINE Reflection<W> reflect(BlinnPhong, const ShadingStage& s, const RayWords<W>& ray,
                                 const std::array<W, 3>& normal, W confidence) {
    return lights_that_add_up(s, normal, confidence,
                              [&](std::size_t l, const std::array<W, 3>&, W)
                                  SQUINT_WRITTEN_OUT { return power(s, towards_half(s, ray, normal, l)); });
}
}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
