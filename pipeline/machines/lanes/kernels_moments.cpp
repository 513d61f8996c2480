// Stage 4 in lanes, for power series of moments: as much code as the other methods together.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_moments.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/all_lanes-inl.h"
#include "pipeline/classification/methods-inl.h"
#include "pipeline/machines/lanes/classify_rows-inl.h"
#include "pipeline/machines/lanes/kernels.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

void moments_kernel_of(const Plan& plan, const lanes::StageWay& way, lanes::StageKernels& kernels) {
    // Their float words run in the model.
    if (std::holds_alternative<MomentSeries>(plan.method))
        choose_classification<MomentSeries, KnownRescales::halves_to_even, false>(plan, way, kernels);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void moments_kernel(std::int64_t target, const Plan& plan, const StageWay& way, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, moments_kernel_of, plan, way, kernels)
}
}  // namespace squint::lanes
#endif
