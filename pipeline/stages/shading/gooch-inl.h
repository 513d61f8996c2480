// Gooch: from a cool to a warm tone as a surface turns to the light; no side is dark (Guetat et al. 2010,
// equation 11, with the part that does not depend on N.L).  Several lights: the sum of N.L, clamped to [-1,
// 1]. Compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_SHADING_GOOCH_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_SHADING_GOOCH_INL_H
#undef SQUINT_PIPELINE_STAGES_SHADING_GOOCH_INL_H
#else
#define SQUINT_PIPELINE_STAGES_SHADING_GOOCH_INL_H
#endif

#include "pipeline/stages/shading/lights-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

struct Gooch {
    static constexpr bool kHeldToOpacity = true, kHasHighlights = false;
};

template <class W>
HWY_INLINE Reflection<W> reflect(Gooch, const ShadingStage& s, const RayWords<W>&,
                                 const std::array<W, 3>& normal, W confidence) {
    const GoochTones& g = s.gooch;
    const W one_dot = constant<W>(std::int64_t{1} << s.dot_fraction), zero = constant<W>(0);
    W facing = zero;
    for (std::size_t l = 0; l < static_cast<std::size_t>(s.lights); ++l) {
        const W here = dot(normal, light_vector<W>(s, l), s.to_dot);
        facing = facing + (s.two_sided ? absolute(here) : here);
    }
    facing = clamp(facing, zero - one_dot, one_dot);
    if (s.fades) facing = quantise(facing * confidence, g.to_faded);
    if (g.cool_to_light) facing = zero - facing;
    const W one = constant<W>(std::int64_t{1} << s.intensity_fraction);
    const W warm = clamp(quantise(one_dot + facing, g.to_side), zero, one), cool = one - warm;
    const auto blended = [&](const std::array<std::int64_t, 2>& raw,
                             const std::array<double, 2>& exact) SQUINT_WRITTEN_OUT {
        const auto side = [&](std::size_t i) {
            return stage_constant<W>(raw[i], exact[i], s.material_fraction, s.active, Wire::material);
        };
        return clamp(quantise(side(0) * cool + side(1) * warm, s.to_diffuse), zero, one);
    };
    const W diffuse = blended(g.share, g.share_exact);
    return {{diffuse, diffuse, diffuse},
            {blended(g.tone[0], g.tone_exact[0]), blended(g.tone[1], g.tone_exact[1]),
             blended(g.tone[2], g.tone_exact[2])},
            false};
}
}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
