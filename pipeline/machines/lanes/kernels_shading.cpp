// Stage 5 in lanes, over packed samples.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_shading.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/all_lanes-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/packing-inl.h"
#include "pipeline/stages/default_facts.h"
#include "pipeline/stages/shading-inl.h"

#include <array>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

/// Stage 5.
template <class L, class F>
void shade_samples(const Plan& plan, int count, lanes::LitSamples& lit) {
    // Constants alone are copied, for the facts leave no use for the table.
    ShadingStage copy;
    if constexpr (!F::kNone) static_cast<ShadingConstants&>(copy) = plan.shading, F::assume(copy);
    const ShadingStage& shading = F::kNone ? plan.shading : copy;
    const bool per_ray = shading.needs_ray();
    for (int at = 0; at < count; at += static_cast<int>(L::count())) {
        RayWords<L> ray;
        if (per_ray) {
            ray.view = load_three<L>(lit.view, at);
            for (std::size_t l = 0; l < static_cast<std::size_t>(shading.lights); ++l)
                ray.half[l] = load_three<L>(lit.half[l], at);
        }
        std::array<L, 3> color = load_three<L>(lit.color, at);
        const L certain = shading.fades ? load<L>(lit.confidence.v + at) : constant<L>(0);
        shade(shading, ray, load_three<L>(lit.normal, at), load<L>(lit.alpha.v + at), color, certain);
        for (std::size_t c = 0; c < 3; ++c) store(color[c], lit.color[c].v + at);
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
    using NoShading = NoFacts<ShadingStage>;
    constexpr KnownRescales kEven = KnownRescales::halves_to_even;
    if (!ways.gradient.is_float) {
        const std::string reason = default_light_missing(plan, ways, kEven);
        kernels.chose(lanes::Segment::light, reason.empty() ? "light.default" : "light", reason);
    }
    lanes::with_word<Lanes, kEven>(ways.shading, [&]<class L>() {
        kernels.shade = &shade_samples<L, NoShading>;
        if constexpr (std::is_same_v<L, Lanes<std::int32_t, kEven>>)
            if (DefaultShading::hold(plan.shading)) kernels.shade = &shade_samples<L, DefaultShading>;
    });
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
