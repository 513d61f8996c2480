// Sets up the rays of a packet, as many at once as a vector has doubles.
#if defined(SQUINT_PIPELINE_MACHINES_LANES_PACKET_RAYS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_MACHINES_LANES_PACKET_RAYS_INL_H
#undef SQUINT_PIPELINE_MACHINES_LANES_PACKET_RAYS_INL_H
#else
#define SQUINT_PIPELINE_MACHINES_LANES_PACKET_RAYS_INL_H
#endif

#include "fixedpoint/words/lanes-inl.h"
#include "pipeline/machines/lanes/packet.h"
#include "pipeline/stages/ray_setup-inl.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// Rays r, r + 1, ... of a packet; rays outside the tile have no slabs.
HWY_INLINE RaySetupOf<Reals> set_up_packet_rays(const Plan& plan, const lanes::PacketPlace& place, int r) {
    alignas(64) static constexpr double kColumn[lanes::kRays] = {0, 1, 2, 3, 0, 1, 2, 3,
                                                                 0, 1, 2, 3, 0, 1, 2, 3};
    alignas(64) static constexpr double kRow[lanes::kRays] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
    static_assert(lanes::kSide == 4);
    const Reals column = Reals(place.left) + Reals(hn::LoadU(Reals::D(), kColumn + r)),
                row = Reals(place.top) + Reals(hn::LoadU(Reals::D(), kRow + r));
    RaySetupOf<Reals> ray = set_up_ray(plan, column, row);
    const auto inside = (column < Reals(place.right)) & (row < Reals(place.bottom));
    ray.slabs = choose(inside, ray.slabs, Reals(0.0));
    return ray;
}
/// One for each ray that meets the volume.
HWY_INLINE Reals one_where_met(const RaySetupOf<Reals>& ray) {
    return choose(Reals(0.0) < ray.slabs, Reals(1.0), Reals(0.0));
}
HWY_INLINE double sum_of(Reals x) {
    return hn::GetLane(hn::SumOfLanes(Reals::D(), x.v));
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
