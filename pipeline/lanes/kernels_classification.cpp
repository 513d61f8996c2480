// Stage 4 in lanes: every method.
#include "pipeline/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/lanes/kernels_classification.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/float_lanes.h"
#include "fixedpoint/lane_quotients.h"
#include "fixedpoint/lane_tables.h"
#include "pipeline/classification/methods.h"
#include "pipeline/lanes/kernels.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// pips.h's rows by loads of whole ones.
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

/// What a method knows of a sample: its input, for most.
template <class M, class L>
HWY_INLINE L sample_of(const M&, L input) {
    return input;
}

template <class L, class M>
void classify_rows(const Plan& plan, int steps, lanes::Samples& samples) {
    const M& method = std::get<M>(plan.method);
    for (int r = 0; r < lanes::kRays; r += static_cast<int>(L::count())) {
        auto front = sample_of(method, load<L>(samples.input.v + r));
        for (int row = 0; row < steps; ++row) {
            const int at = row * lanes::kRays + r;
            const auto back = sample_of(
                method,
                load<L>(samples.input.v + at + (M::kNeedsBack || row + 1 < steps ? lanes::kRays : 0)));
            const Slab<L> slab = classify(method, front, back, load<L>(samples.length.v + at));
            for_three([&](std::size_t c)
                          SQUINT_WRITTEN_OUT { store(slab.color[c], samples.color[c].v + at); });
            store(slab.alpha, samples.alpha.v + at);
            front = back;
        }
    }
}

}  // namespace

void classification_kernel_of(const Plan& plan, const lanes::StageWay& way, lanes::StageKernels& kernels) {
    std::visit(
        [&]<class M>(const M&) {
            // Entries alone meet no limit; prefix sums' depths may.
            constexpr KnownRescales kKnown = std::is_same_v<M, PostClassification>
                                                 ? KnownRescales::halves_up
                                                 : KnownRescales::halves_to_even;
            if constexpr (!std::is_same_v<M, MomentSeries>)  // its float words run in the model
                if (way.is_float) {
                    kernels.classify = &classify_rows<Lanes<float>, M>;
                    return;
                }
            lanes::with_integer_word<Lanes, kKnown>(
                way, [&]<class L>() { kernels.classify = &classify_rows<L, M>; });
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
