// How far the raw gradient turns from sample to sample (Guetat et al. 2010, figure 3).
#pragma once

#include "core/image.h"
#include "pipeline/plan/plan.h"

#include <atomic>

namespace squint::reproduce {

/// Channels of counts along each ray: `slabs`, visible by the plan's own classification and with a gradient at both
/// ends; `angle60` and `angle90`, those among them whose ends' gradients stand more than so many degrees apart.
/// Gradients by shading.gradient of a plan that rounds nothing (precision.preset = "real").  Throws Cancelled.
Image gradient_turns(const Plan& plan, int threads = 0, const std::atomic<bool>* cancelled = nullptr);

}  // namespace squint::reproduce
