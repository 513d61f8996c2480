// Counts rays and slabs in lanes, for packets that look at nothing.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/ray_counts.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/lanes-inl.h"
#include "pipeline/machines/lanes/packet_rays-inl.h"
#include "pipeline/machines/lanes/ray_counts.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

lanes::RayCounts count_slabs(const Plan& plan, const lanes::PacketPlace& place) {
    Reals slabs(0.0), rays(0.0);
    for (int r = 0; r < lanes::kRays; r += Reals::count()) {
        const RaySetupOf<Reals> ray = set_up_packet_rays(plan, place, r);
        slabs = slabs + ray.slabs, rays = rays + one_where_met(ray);
    }
    return {static_cast<std::int64_t>(sum_of(rays)), static_cast<std::int64_t>(sum_of(slabs))};
}

}  // namespace

lanes::CountSlabs slab_counter_of() {
    return &count_slabs;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
CountSlabs slab_counter(std::int64_t target) {
    SQUINT_CALL_TARGET(target, slab_counter_of)
    return nullptr;
}
}  // namespace squint::lanes
#endif
