// Stage 4 in lanes, for methods whose slabs come from rows of tables.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_classification.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/all_lanes-inl.h"
#include "pipeline/classification/methods-inl.h"
#include "pipeline/machines/lanes/classify_rows-inl.h"
#include "pipeline/machines/lanes/kernels.h"

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

void classification_kernel_of(const Plan& plan, const lanes::StageWay& way, lanes::StageKernels& kernels) {
    std::visit(
        [&]<class M>(const M&) {
            // Entries never meet limits; depths of prefix sums may.
            constexpr KnownRescales kKnown = std::is_same_v<M, PostClassification>
                                                 ? KnownRescales::halves_up
                                                 : KnownRescales::halves_to_even;
            if constexpr (!std::is_same_v<M, MomentSeries>)
                choose_classification<M, kKnown, true>(plan, way, kernels);
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
