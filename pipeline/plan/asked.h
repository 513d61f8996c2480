// The plan of a scene that a user gave: a refusal names the place of the setting.
#pragma once

#include "pipeline/plan/plan.h"

#include <memory>

namespace squint {

/// make_plan(); its messages begin with the place of the setting that they are about
/// ("head.toml:7:8: sampling.step: ...").  Throws InputError.
Plan plan_asked_for(const Scene& scene, std::shared_ptr<const Volume> volume, int frame = 0);

}  // namespace squint
