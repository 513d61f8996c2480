// Stages 3 and 5 in lanes, over the samples that a light falls on.
#include "pipeline/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/lanes/kernels_shading.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/lanes.h"
#include "pipeline/gradient.h"
#include "pipeline/lanes/kernels.h"
#include "pipeline/shading.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

/// A neighbourhood whose voxels are loaded as they are asked for.
template <class L>
struct StoredNeighbourhood {
    const lanes::Batch* pair;
    int place;
    L at(int x, int y, int z) const {
        const L both = load<L>(pair[(z * 4 + y) * 2 + x / 2].v + place);
        return {hn::And(x % 2 ? hn::ShiftRight<16>(both.v) : both.v, constant<L>(0xffff).v)};
    }
};

template <class L>
HWY_INLINE std::array<L, 3> stored_gradient(const GradientStage& s, const lanes::LitSamples& lit, int end,
                                            int at) {
    const StoredNeighbourhood<L> near{lit.pair[end], at};
    const std::array<L, 3> weight{load<L>(lit.weight[end][0].v + at), load<L>(lit.weight[end][1].v + at),
                                  load<L>(lit.weight[end][2].v + at)};
    std::array<L, 3> gradient;
    for (int axis = 0; axis < 3; ++axis)
        gradient[static_cast<std::size_t>(axis)] = to_world(s, voxel_difference(s, near, weight, axis), axis);
    return gradient;
}

template <class L>
void shade_samples(const Plan& plan, int count, lanes::LitSamples& lit) {
    const GradientStage stage = plan.gradient;
    const ShadingStage& shading = plan.shading;
    const bool per_ray = shading.half_per_ray || shading.model == ShadingModel::phong;
    for (int at = 0; at < count; at += static_cast<int>(L::count())) {
        std::array<L, 3> gradient = stored_gradient<L>(stage, lit, 0, at);
        if (plan.needs_back) {
            const std::array<L, 3> other = stored_gradient<L>(stage, lit, 1, at);
            for (std::size_t a = 0; a < 3; ++a) gradient[a] = gradient[a] + other[a];
        }
        const std::array<L, 3> normal = normalise(stage, gradient);
        RayWords<L> ray;
        if (per_ray)
            for (std::size_t a = 0; a < 3; ++a) {
                ray.view[a] = load<L>(lit.view[a].v + at);
                for (std::size_t l = 0; l < static_cast<std::size_t>(shading.lights); ++l)
                    ray.half[l][a] = load<L>(lit.half[l][a].v + at);
            }
        std::array<L, 3> color{load<L>(lit.color[0].v + at), load<L>(lit.color[1].v + at),
                               load<L>(lit.color[2].v + at)};
        shade(shading, ray, normal, load<L>(lit.alpha.v + at), color);
        for (std::size_t c = 0; c < 3; ++c) store(color[c], lit.color[c].v + at);
    }
}

}  // namespace

void shading_kernel_of(const lanes::StageWay& way, lanes::StageKernels& kernels) {
    lanes::with_word<Lanes, KnownRescales::halves_to_even>(
        way, [&]<class L>() { kernels.shade = &shade_samples<L>; });
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void shading_kernel(std::int64_t target, const StageWay& way, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, shading_kernel_of, way, kernels)
}
}  // namespace squint::lanes
#endif
