// Finds what leaves a picture empty or with two values, before the first ray.
#pragma once

#include "pipeline/plan/plan.h"

#include <string>
#include <vector>

namespace squint {

/// A line each: a clip box outside the volume, a volume behind the eye or outside the picture, a transfer
/// function that shows no value of the data, or one that changes only within a hundredth of their range.
std::vector<std::string> findings_of(const Plan& plan);

}  // namespace squint
