// Exaggerated gradients of the fast path: place by place, in the model's words, for each needs 8^3 voxels of its own.
#pragma once

#include "pipeline/machines/lanes/packet.h"
#include "pipeline/plan/plan.h"

namespace squint::lanes {

/// Replaces the raw gradients at the first `count` packed places by their exaggerated ones.
void exaggerate(const Plan& plan, int count, LitSamples& places);

}  // namespace squint::lanes
