// Stages 3 and 5 in lanes, over the samples that a light falls on.
#include "pipeline/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/lanes/kernels_shading.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/float_lanes.h"
#include "fixedpoint/lane_quotients.h"
#include "fixedpoint/lane_tables.h"
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
    bool below_15_bits;  // every voxel
    L at(int x, int y, int z) const { return half_of(words(x / 2, y, z), x % 2 != 0); }
    L words(int x, int y, int z) const { return load<L>(pair[(z * 4 + y) * 2 + x].v + place); }
};

#if HWY_TARGET != HWY_SCALAR
/// gradient.h's, of differences in 16 bits: two of them a word.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> lerped_difference(const GradientStage& s,
                                                    const StoredNeighbourhood<Lanes<std::int32_t, K>>& n,
                                                    int y, int z, int axis, Lanes<std::int32_t, K> weight) {
    using L = Lanes<std::int32_t, K>;
    if (s.rule != GradientRule::central || !n.below_15_bits || s.weight_bits > 14)
        return lerped_difference<L, StoredNeighbourhood<L>>(s, n, y, z, axis, weight);
    const hn::ScalableTag<std::int32_t> d;
    const hn::ScalableTag<std::int16_t> d16;
    const auto less = [&](auto a, auto b) {
        return hn::BitCast(d, hn::Sub(hn::BitCast(d16, a), hn::BitCast(d16, b)));
    };
    const auto inner = [&](int py, int pz) {  // the cell's own two of a row of four
        const hn::ScalableTag<std::uint32_t> du;
        return hn::Or(hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(du, n.words(0, py, pz).v))),
                      hn::ShiftLeft<16>(n.words(1, py, pz).v));
    };
    const auto differences = axis == 0   ? less(n.words(1, y, z).v, n.words(0, y, z).v)
                             : axis == 1 ? less(inner(y + 1, z), inner(y - 1, z))
                                         : less(inner(y, z + 1), inner(y, z - 1));
    return blend_pairs<K>(differences, pair_weights(weight.v, s.weight_bits), 0, s.to_first);
}
#endif

template <class L>
HWY_INLINE std::array<L, 3> stored_gradient(const Plan& plan, const GradientStage& s,
                                            const lanes::LitSamples& lit, int end, int at) {
    if (s.rule == GradientRule::central_samples) {
        const auto between = [&](int axis) SQUINT_WRITTEN_OUT {
            const auto& scalars = lit.beside[end][axis];
            const L behind = load<L>(scalars[0].v + at), ahead = load<L>(scalars[1].v + at);
            return to_world(s, sample_difference(s, ahead, behind), axis);
        };
        return {between(0), between(1), between(2)};
    }
    const StoredNeighbourhood<L> near{lit.pair[end], at, plan.volume->largest < 1 << 15};
    const std::array<L, 3> weight{load<L>(lit.weight[end][0].v + at), load<L>(lit.weight[end][1].v + at),
                                  load<L>(lit.weight[end][2].v + at)};
    const auto along = [&](int axis) SQUINT_WRITTEN_OUT {
        return to_world(s, voxel_difference(s, near, weight, axis), axis);
    };
    return {along(0), along(1), along(2)};
}

/// The raw gradient of slabs: of their samples, or the sum of their two ends'.
template <class G>
HWY_INLINE std::array<G, 3> slab_gradient(const Plan& plan, const GradientStage& stage,
                                          const lanes::LitSamples& lit, int at) {
    std::array<G, 3> gradient = stored_gradient<G>(plan, stage, lit, 0, at);
    if (plan.needs_back) {
        const std::array<G, 3> other = stored_gradient<G>(plan, stage, lit, 1, at);
        for (std::size_t a = 0; a < 3; ++a) gradient[a] = gradient[a] + other[a];
    }
    return gradient;
}

/// G: the lanes of the raw gradient, whose lerps may need wider ones than all that follows: it passes through
/// 32-bit words, which hold whatever 32-bit lanes do.  Loops apart, for each vector's way through them is one
/// long chain: in a loop of its own the next vectors' run beside it.
template <class G, class L>
void shade_samples(const Plan& plan, int count, lanes::LitSamples& lit) {
    const GradientStage stage = plan.gradient;
    const ShadingStage& shading = plan.shading;
    const bool per_ray = shading.half_per_ray || shading.model == ShadingModel::phong;
    // 64-bit lanes' gradients need not fit 32-bit words.
    constexpr bool kStored = !std::is_same_v<L, Lanes<std::int64_t>>;
    if constexpr (kStored) {
        // To the end of the widest vector, which the loop behind reads whole.
        constexpr int kStep = static_cast<int>(std::max(G::count(), L::count()));
        for (int at = 0; at < (count + kStep - 1) / kStep * kStep; at += static_cast<int>(G::count())) {
            const std::array<G, 3> gradient = slab_gradient<G>(plan, stage, lit, at);
            for (std::size_t a = 0; a < 3; ++a) store(gradient[a], lit.gradient[a].v + at);
        }
    }
    const auto three = [](const lanes::Batch(&from)[3], int at) HWY_ATTR {
        return std::array<L, 3>{load<L>(from[0].v + at), load<L>(from[1].v + at), load<L>(from[2].v + at)};
    };
    for (int at = 0; at < count; at += static_cast<int>(L::count())) {
        std::array<L, 3> gradient;
        if constexpr (kStored)
            gradient = three(lit.gradient, at);
        else
            gradient = slab_gradient<L>(plan, stage, lit, at);
        const std::array<L, 3> normal = normalise(stage, gradient);
        for (std::size_t a = 0; a < 3; ++a) store(normal[a], lit.normal[a].v + at);
    }
    for (int at = 0; at < count; at += static_cast<int>(L::count())) {
        RayWords<L> ray;
        if (per_ray) {
            ray.view = three(lit.view, at);
            for (std::size_t l = 0; l < static_cast<std::size_t>(shading.lights); ++l)
                ray.half[l] = three(lit.half[l], at);
        }
        std::array<L, 3> color = three(lit.color, at);
        shade(shading, ray, three(lit.normal, at), load<L>(lit.alpha.v + at), color);
        for (std::size_t c = 0; c < 3; ++c) store(color[c], lit.color[c].v + at);
    }
}

}  // namespace

void shading_kernel_of(const lanes::StageWays& ways, lanes::StageKernels& kernels) {
    if (ways.gradient.is_float) {
        using L = Lanes<float, KnownRescales::nothing>;
        kernels.shade = &shade_samples<L, L>;
        return;
    }
    lanes::with_integer_word<Lanes, KnownRescales::halves_to_even>(ways.gradient, [&]<class G>() {
        lanes::with_integer_word<Lanes, KnownRescales::halves_to_even>(
            ways.shading, [&]<class L>() { kernels.shade = &shade_samples<G, L>; });
    });
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void shading_kernel(std::int64_t target, const StageWays& ways, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, shading_kernel_of, ways, kernels)
}
}  // namespace squint::lanes
#endif
