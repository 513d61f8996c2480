// Stage 5 in lanes, over packed samples.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_shading.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/all_lanes-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/packing-inl.h"
#include "pipeline/stages/default_facts.h"
#include "pipeline/stages/inside-inl.h"
#include "pipeline/stages/shading-inl.h"

#include <array>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

/// What shading asks of the ray of packed samples, where it asks.
template <class L>
HWY_INLINE RayWords<L> stored_ray(const ShadingStage& shading, const lanes::LitSamples& lit, int at) {
    RayWords<L> ray;
    if (!shading.needs_ray()) return ray;
    ray.view = load_three<L>(lit.view, at);
    for (std::size_t l = 0; l < static_cast<std::size_t>(shading.lights); ++l)
        ray.half[l] = load_three<L>(lit.half[l], at);
    return ray;
}

/// Stage 5 of the default's light, which is white and needs no ray.  Each vector is a chain of operations: in two loops
/// more of them overlap.
template <class L>
void shade_by_default(const Plan& plan, int count, lanes::LitSamples& lit) {
    ShadingStage shading;  // constants alone are copied, for the facts leave no use for the table
    static_cast<ShadingConstants&>(shading) = plan.shading;
    DefaultShading::assume(shading);
    lanes::Batch diffuse, specular;
    with_model(shading.model, [&](auto model) SQUINT_WRITTEN_OUT {
        const L nothing = constant<L>(0);
        for (int at = 0; at < count; at += static_cast<int>(L::count())) {
            const Reflection<L> light =
                reflect(model, shading, RayWords<L>{}, load_three<L>(lit.normal, at), nothing);
            store(light.diffuse[0], diffuse.v + at), store(light.specular[0], specular.v + at);
        }
        for (int at = 0; at < count; at += static_cast<int>(L::count())) {
            const Reflection<L> light{{load<L>(diffuse.v + at)}, {load<L>(specular.v + at)}, shading.white};
            std::array<L, 3> color = load_three<L>(lit.color, at);
            add_light(model, shading, light, opacity_of_light(shading, load<L>(lit.alpha.v + at)), color);
            for (std::size_t c = 0; c < 3; ++c) store(color[c], lit.color[c].v + at);
        }
    });
}

/// Stage 5.
template <class L>
void shade_samples(const Plan& plan, int count, lanes::LitSamples& lit) {
    const ShadingStage& shading = plan.shading;
    for (int at = 0; at < count; at += static_cast<int>(L::count())) {
        const RayWords<L> ray = stored_ray<L>(shading, lit, at);
        std::array<L, 3> color = load_three<L>(lit.color, at);
        const L certain = shading.fades ? load<L>(lit.confidence.v + at) : constant<L>(0);
        shade(shading, ray, load_three<L>(lit.normal, at), load<L>(lit.alpha.v + at), color, certain);
        for (std::size_t c = 0; c < 3; ++c) store(color[c], lit.color[c].v + at);
    }
}

/// Stage 5 of slabs whose light fades from one end to the other.
template <class L>
void shade_fading_slabs(const Plan& plan, int count, const lanes::SlabLight& light,
                        const lanes::LitSamples& far, lanes::LitSamples& lit) {
    const int parts = plan.inside.rule == InsideRule::linear ? 2 : 4;
    for (int at = 0; at < count; at += static_cast<int>(L::count())) {
        FadingNormals<L> ends{{load_three<L>(lit.normal, at), load_three<L>(far.normal, at)},
                              {constant<L>(0), constant<L>(0)}};
        if (plan.gradient.fades)
            ends.certain = {load<L>(lit.confidence.v + at), load<L>(far.confidence.v + at)};
        share_normal(ends.normal[0], ends.normal[1]);
        FadingLight<L> fades{parts, {}, constant<L>(0)};
        for (std::size_t k = 0; k < static_cast<std::size_t>(parts); ++k)
            for (std::size_t c = 0; c < 4; ++c) fades.part[k][c] = load<L>(light.part[k][c].v + at);
        std::array<L, 3> color;
        shade_fading(plan.shading, stored_ray<L>(plan.shading, lit, at), ends.normal, ends.certain, fades,
                     color);
        for (std::size_t a = 0; a < 3; ++a) {
            store(ends.normal[0][a], lit.normal[a].v + at);
            store(color[a], lit.color[a].v + at);
        }
    }
}

// Why light is not the default scene's; empty where it is.
std::string default_light_missing(const Plan& plan, const lanes::StageWays& ways, KnownRescales known) {
    for (const lanes::StageWay& way : {ways.gradient, ways.shading})
        if (std::string narrow = lanes::why_not_narrow(way, known); !narrow.empty()) return narrow;
    std::string gradient = narrow_gradients_missing(plan.volume->largest, plan.gradient);
    return gradient.empty() ? DefaultShading::missing(plan.shading) : gradient;
}

}  // namespace

void shading_kernels_of(const Plan& plan, const lanes::StageWays& ways, lanes::StageKernels& kernels) {
    constexpr KnownRescales kEven = KnownRescales::halves_to_even;
    if (!ways.gradient.is_float) {
        const std::string reason = default_light_missing(plan, ways, kEven);
        kernels.chose(lanes::Segment::light, reason.empty() ? "light.default" : "light", reason);
    }
    lanes::with_word<Lanes, kEven>(ways.shading, [&]<class L>() {
        kernels.shade = &shade_samples<L>;
        if constexpr (std::is_same_v<L, Lanes<std::int32_t, kEven>>)
            if (DefaultShading::hold(plan.shading)) kernels.shade = &shade_by_default<L>;
    });
    if (!lights_fade(plan.inside.rule)) return;
    lanes::with_word<Lanes, KnownRescales::nothing>(
        ways.shading, [&]<class L>() { kernels.shade_fading = &shade_fading_slabs<L>; });
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void shading_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, shading_kernels_of, plan, ways, kernels)
}
}  // namespace squint::lanes
#endif
