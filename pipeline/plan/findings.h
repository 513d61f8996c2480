// What of a scene leaves its picture empty or with two values, found before the first ray.
#pragma once

#include "pipeline/plan/plan.h"

#include <string>
#include <vector>

namespace squint {

/// A line each: a clip box beside the volume, a volume behind the eye or beside the picture, a transfer function
/// that shows nothing of the data's values, or one that changes within a hundredth of their range alone.
std::vector<std::string> findings_of(const Plan& plan);

}  // namespace squint
