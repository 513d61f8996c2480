// MIP, MinIP and average in lanes: adds a ray's samples to the one scalar that represents it.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_projection.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/lanes-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/stages/projection-inl.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

using lanes::kRays;

template <CompositingMode kMode>
void extreme_of_rows(const lanes::RayPacket& packet, int steps, const lanes::Samples& samples,
                     lanes::ProjectionPacket& projection) {
    using L = Lanes<std::int32_t>;
    for (int r = 0; r < kRays; r += static_cast<int>(L::count())) {
        const L slabs = load<L>(packet.slabs.v + r);
        L extreme = load<L>(projection.extreme.v + r);
        for (int row = 0; row < steps; ++row) {
            const L front = load<L>(samples.input.v + row * kRays + r),
                    back = load<L>(samples.input.v + (row + 1) * kRays + r);
            const L next = merge_samples(kMode, extreme, merge_samples(kMode, front, back));
            extreme = select(constant<L>(samples.first + row) < slabs, next, extreme);
        }
        store(extreme, projection.extreme.v + r);
    }
}

/// A ray has at most 16 million slabs; that many sums of two inputs of 31 bits fit 64 bits.
void sum_of_rows(const lanes::RayPacket& packet, int steps, const lanes::Samples& samples,
                 lanes::ProjectionPacket& projection) {
    using L = Lanes<std::int64_t>;
    constexpr CompositingMode kAverage = CompositingMode::average;
    const hn::ScalableTag<std::int64_t> d;
    for (int r = 0; r < kRays; r += static_cast<int>(L::count())) {
        const L last = load<L>(packet.slabs.v + r) - constant<L>(1), zero = constant<L>(0);
        L sum{hn::Load(d, projection.sum + r)}, last_ends{hn::Load(d, projection.last_ends + r)};
        for (int row = 0; row < steps; ++row) {
            const L k = constant<L>(samples.first + row);
            const L ends = merge_samples(kAverage, load<L>(samples.input.v + row * kRays + r),
                                         load<L>(samples.input.v + (row + 1) * kRays + r));
            sum = merge_samples(kAverage, sum, select(k < last, ends, zero));
            last_ends = select(k == last, ends, last_ends);
        }
        hn::Store(sum.v, d, projection.sum + r), hn::Store(last_ends.v, d, projection.last_ends + r);
    }
}

}  // namespace

void projection_kernel_of(const Plan& plan, lanes::StageKernels& kernels) {
    const CompositingMode mode = plan.scene.compositing.mode;
    kernels.project = mode == CompositingMode::mip     ? &extreme_of_rows<CompositingMode::mip>
                      : mode == CompositingMode::minip ? &extreme_of_rows<CompositingMode::minip>
                                                       : &sum_of_rows;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void projection_kernel(std::int64_t target, const Plan& plan, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, projection_kernel_of, plan, kernels)
}
}  // namespace squint::lanes
#endif
