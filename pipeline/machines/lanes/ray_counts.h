// Counts rays and their slabs without casting them.
#pragma once

#include "pipeline/machines/lanes/packet.h"
#include "pipeline/plan/plan.h"

#include <cstdint>

namespace squint::lanes {

/// The number of rays that meet the volume, and of their slabs.
struct RayCounts {
    std::int64_t rays = 0, slabs = 0;
};
using CountSlabs = RayCounts (*)(const Plan&, const PacketPlace&);
/// Counts what set_up would find for a packet, on a SIMD target (kernels.h).
CountSlabs slab_counter(std::int64_t target);

}  // namespace squint::lanes
