// How far the raw gradient turns between neighbouring samples (Guetat et al. 2010, figure 3).
#pragma once

#include "core/image.h"
#include "pipeline/plan/plan.h"

#include <atomic>

namespace squint::reproduce {

/// Counts along each ray, as channels: `slabs` are those that the plan's own classification shows and that
/// have a gradient at both ends; `angle60` and `angle90` are those of them whose two gradients are more than
/// so many degrees apart. The plan rounds nothing (precision.preset = "real").  Throws Cancelled.
Image gradient_turns(const Plan& plan, int threads = 0, const std::atomic<bool>* cancelled = nullptr);

}  // namespace squint::reproduce
