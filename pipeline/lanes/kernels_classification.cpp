// Stage 4 in lanes: every method.
#include "pipeline/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/lanes/kernels_classification.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/lanes.h"
#include "pipeline/classification/methods.h"
#include "pipeline/lanes/kernels.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

template <class L, class M>
void classify_rows(const Plan& plan, int steps, lanes::Samples& samples) {
    const M& method = std::get<M>(plan.method);
    for (int at = 0; at < steps * lanes::kRays; at += static_cast<int>(L::count())) {
        const L front = load<L>(samples.input.v + at);
        const L back = M::kNeedsBack ? load<L>(samples.input.v + at + lanes::kRays) : front;
        const Slab<L> slab = classify(method, front, back, load<L>(samples.length.v + at));
        for (std::size_t c = 0; c < 3; ++c) store(slab.color[c], samples.color[c].v + at);
        store(slab.alpha, samples.alpha.v + at);
    }
}

}  // namespace

void classification_kernel_of(const Plan& plan, const lanes::StageWay& way, lanes::StageKernels& kernels) {
    std::visit(
        [&]<class M>(const M&) {
            lanes::with_word<Lanes, KnownRescales::halves_to_even>(
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
