// Phong: the highlight is (R.V)^p, R the light mirrored about the normal (Squeeze, equation 10).  Compiled once
// per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_SHADING_PHONG_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_SHADING_PHONG_INL_H
#undef SQUINT_PIPELINE_STAGES_SHADING_PHONG_INL_H
#else
#define SQUINT_PIPELINE_STAGES_SHADING_PHONG_INL_H
#endif

#include "pipeline/stages/shading/lights-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

struct Phong {
    static constexpr bool kHeldToOpacity = false, kHasHighlights = true;
};

template <class W>
HWY_INLINE Reflection<W> reflect(Phong, const ShadingStage& s, const RayWords<W>& ray,
                                 const std::array<W, 3>& normal, W confidence) {
    const W zero = constant<W>(0), one = constant<W>(std::int64_t{1} << s.dot_fraction);
    const W towards_eye = dot(normal, ray.view, s.to_dot);
    return lights_that_add_up(
        s, normal, confidence, [&](std::size_t, const std::array<W, 3>& light, W facing) SQUINT_WRITTEN_OUT {
            // R.V = 2 (N.L)(N.V) - L.V
            const W light_view = dot(light, ray.view, s.to_light_view);
            const W mirrored = quantise(
                shift_left(facing * towards_eye, 1) - shift_left(light_view, s.dot_fraction), s.to_reflected);
            // Where no light falls nothing is reflected; R is the same for both sides of a surface.
            const auto dark = s.two_sided ? facing == zero : !(zero < facing);
            return power(s, clamp(select(dark, zero, mirrored), zero, one));
        });
}
}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
