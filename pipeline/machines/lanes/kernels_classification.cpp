// Stage 4 in lanes, for every method.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_classification.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/all_lanes-inl.h"
#include "pipeline/classification/methods-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/slabs-inl.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

static_assert(BlendsPairs<Lanes<std::int32_t>> && LoadsRows<Lanes<float>>,
              "lerp_rows has lost its fast ways");
static_assert(LoadsPairs<Lanes<std::int32_t>> && kInvertsOnce<WideLanes<KnownRescales::nothing>> &&
                  kInvertsOnce<Lanes<std::int64_t>>,
              "opacities or ratios have lost their fast ways");

/// The rows of pips.h, loaded as a whole.
template <KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<std::int32_t, K>, 4>, 2> prefix_rows(const PowerSeriesOfOrder1& m,
                                                                            Lanes<std::int32_t, K> row) {
    return load_two_rows(m.rows->data(), row);
}
template <KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<float, K>, 4>, 2> prefix_rows(const PowerSeriesOfOrder1& m,
                                                                     Lanes<float, K> row) {
    return load_two_rows(m.float_rows->data(), row);
}

namespace {

/// What a method computes of a sample: its input, for most.
template <class M, class L>
HWY_INLINE L sample_of(const M&, L input) {
    return input;
}

/// `samples` is nothing of the plan: what is stored there changes no constant of the method.
template <class L, class M>
void classify_rows(const Plan& plan, int steps, lanes::Samples& __restrict samples) {
    const M& method = std::get<M>(plan.method);
    const Unseen<L> unseen(plan);
    const L zero = constant<L>(0);
    for (int r = 0; r < lanes::kRays; r += static_cast<int>(L::count())) {
        L front_input = load<L>(samples.input.v + r);
        auto front = sample_of(method, front_input);
        bool has_front = true;
        for (int row = 0; row < steps; ++row) {
            const int at = row * lanes::kRays + r;
            const L back_input =
                load<L>(samples.input.v + at + (M::kNeedsBack || row + 1 < steps ? lanes::kRays : 0));
            if (unseen.holds(front_input, M::kNeedsBack ? back_input : front_input)) {
                store_slab<L>({{zero, zero, zero}, zero}, at, samples);
                has_front = false;
            } else {
                if (!has_front) front = sample_of(method, front_input);
                const auto back = sample_of(method, back_input);
                store_slab<L>(classify(method, front, back, load<L>(samples.length.v + at)), at, samples);
                front = back, has_front = true;
            }
            front_input = back_input;
        }
    }
}

}  // namespace

void classification_kernel_of(const Plan& plan, const lanes::StageWay& way, lanes::StageKernels& kernels) {
    const std::string name = "classify." + std::string(name_of(plan.scene.classification.method));
    const auto chose = [&](const std::string& kernel, std::string why_not_faster = {}) {
        kernels.chose(lanes::Segment::classify, kernel, std::move(why_not_faster));
    };
    std::visit(
        [&]<class M>([[maybe_unused]] const M& m) {
            // Entries never meet limits; depths of prefix sums may.
            constexpr KnownRescales kKnown = std::is_same_v<M, PostClassification>
                                                 ? KnownRescales::halves_up
                                                 : KnownRescales::halves_to_even;
            if constexpr (!std::is_same_v<M, MomentSeries>)  // its float words run in the model
                if (way.is_float) {
                    kernels.classify = &classify_rows<Lanes<float>, M>;
                    return chose(name);
                }
            lanes::with_integer_word<Lanes, kKnown>(
                way, [&]<class L>() { kernels.classify = &classify_rows<L, M>; });
            chose(name, lanes::why_not_narrow(way, kKnown));
        },
        plan.method);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void classification_kernel(std::int64_t target, const Plan& plan, const StageWay& way,
                           StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, classification_kernel_of, plan, way, kernels)
}
}  // namespace squint::lanes
#endif
