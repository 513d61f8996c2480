// Stage 3 in lanes: raw gradients and normals of packed samples.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_gradient.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/all_lanes-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/packing-inl.h"
#include "pipeline/stages/default_facts.h"
#include "pipeline/stages/gradient-inl.h"

#include <algorithm>
#include <array>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

/// A neighbourhood whose voxels are loaded as they are asked for.
template <class L>
struct StoredNeighbourhood {
    const lanes::Batch* pair;
    int place;
    bool cross;  // see LitSamples::pair
    L at(int x, int y, int z) const {
        if (cross && lanes::is_outer_row(y, z)) return half_of(words(0, y, z), x == 2);
        return half_of(words(x / 2, y, z), x % 2 != 0);
    }
    L along_x(const GradientStage& s, int y, int z, int axis, L weight) const {
        return lerped_difference(s, *this, y, z, axis, weight);
    }

  private:
    HWY_INLINE L words(int x, int y, int z) const { return load<L>(pair[(z * 4 + y) * 2 + x].v + place); }
};

#if HWY_TARGET != HWY_SCALAR
/// A neighbourhood by its central differences, two a word.
/// Under DefaultGradient's facts differences and weights fit 16 bits.
template <class L>
struct StoredDifferences {
    const lanes::Batch (&difference)[3][4];
    int place;
    HWY_INLINE L along_x(const GradientStage& s, int y, int z, int axis, L weight) const {
        const hn::ScalableTag<std::int32_t> d;
        const auto both = hn::Load(d, difference[axis][2 * (z - 1) + y - 1].v + place);
        return blend_pairs<L::kKnown>(both, pair_weights(weight.v, s.weight_bits), 0, s.to_first);
    }
};
#endif

/// F: what is known of the stage.
template <class L, class F>
HWY_INLINE std::array<L, 3> stored_gradient(const GradientStage& s, const lanes::LitSamples& lit, int at) {
    if (s.rule == GradientRule::central_samples) {
        const auto between = [&](int axis) SQUINT_WRITTEN_OUT {
            const auto& scalars = lit.beside[axis];
            const L behind = load<L>(scalars[0].v + at), ahead = load<L>(scalars[1].v + at);
            return to_world(s, sample_difference(s, ahead, behind), axis);
        };
        return {between(0), between(1), between(2)};
    }
    const std::array<L, 3> weight = load_three<L>(lit.weight, at);
#if HWY_TARGET != HWY_SCALAR
    if constexpr (!F::kNone) {
        const StoredDifferences<L> near{lit.difference, at};
        const auto along = [&](int axis) SQUINT_WRITTEN_OUT {
            return to_world(s, interpolated_difference(s, near, weight, axis), axis);
        };
        return {along(0), along(1), along(2)};
    }
#endif
    const StoredNeighbourhood<L> near{lit.pair, at, s.rule == GradientRule::central};
    const auto along = [&](int axis) SQUINT_WRITTEN_OUT {
        return to_world(s, voxel_difference(s, near, weight, axis), axis);
    };
    return {along(0), along(1), along(2)};
}

/// The first half of stage 3: raw gradients, as 32-bit words.  G: lanes whose lerps may need to be wider than
/// what follows.  It has a loop of its own because each vector is one long chain of operations: there, the
/// chains of several vectors overlap.
template <class G, class F>
void find_gradients(const Plan& plan, int count, lanes::LitSamples& lit) {
    GradientStage stage = plan.gradient;
    F::assume(stage);
    for (int at = 0; at < count; at += static_cast<int>(G::count())) {
        const std::array<G, 3> gradient = stored_gradient<G, F>(stage, lit, at);
        for (std::size_t a = 0; a < 3; ++a) store(gradient[a], lit.gradient[a].v + at);
    }
}

/// The second half of stage 3: normals.  Lengths have a loop of their own, for the same reason.
template <class L, class F>
void find_normals(const Plan& plan, int count, lanes::LitSamples& lit) {
    GradientStage stage = plan.gradient;
    F::assume(stage);
    [[maybe_unused]] lanes::Batch size[3], length;
    if constexpr (!RealWord<L>)
        for (int at = 0; at < count; at += static_cast<int>(L::count())) {
            const ScaledGradient<L> scaled = scaled_gradient(load_three<L>(lit.gradient, at));
            for (std::size_t a = 0; a < 3; ++a) store(scaled.size[a], size[a].v + at);
            store(scaled.length, length.v + at);
        }
    for (int at = 0; at < count; at += static_cast<int>(L::count())) {
        const std::array<L, 3> gradient = load_three<L>(lit.gradient, at);
        std::array<L, 3> normal;
        if constexpr (RealWord<L>)
            normal = normalise(stage, gradient);
        else
            normal = normal_of<L>(stage, gradient, {load_three<L>(size, at), load<L>(length.v + at)});
        for (std::size_t a = 0; a < 3; ++a) store(normal[a], lit.normal[a].v + at);
        if (stage.fades) store(confidence(stage, gradient), lit.confidence.v + at);
    }
}

}  // namespace

void gradient_kernels_of(const Plan& plan, const lanes::StageWays& ways, lanes::StageKernels& kernels) {
    using NoGradient = NoFacts<GradientStage>;
    constexpr KnownRescales kEven = KnownRescales::halves_to_even;
    const std::string missing = narrow_gradients_missing(plan.volume->largest, plan.gradient);
    kernels.no_differences = missing.empty() ? lanes::why_not_narrow(ways.gradient, kEven) : missing;
    if constexpr (HWY_TARGET == HWY_SCALAR) kernels.no_differences = "lanes are single";
    const bool narrow = kernels.no_differences.empty();
    lanes::with_word<Lanes, kEven>(ways.gradient, [&]<class G>() {
        kernels.find_gradients = &find_gradients<G, NoGradient>;
        if constexpr (std::is_same_v<G, Lanes<std::int32_t, kEven>>)
            if (narrow)
                kernels.find_gradients = &find_gradients<G, DefaultGradient>,
                kernels.fetch_lit = kernels.fetch_differences;
    });
    lanes::with_word<Lanes, kEven>(ways.shading, [&]<class L>() {
        kernels.find_normals = &find_normals<L, NoGradient>;
        if constexpr (std::is_same_v<L, Lanes<std::int32_t, kEven>>)
            if (missing.empty()) kernels.find_normals = &find_normals<L, DefaultGradient>;
    });
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void gradient_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, gradient_kernels_of, plan, ways, kernels)
}
}  // namespace squint::lanes
#endif
