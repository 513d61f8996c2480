// What a scene asks of the formats: of the preset before they are chosen, and of a user where the chosen ones
// do not hold it.
#pragma once

#include "pipeline/plan/plan.h"
#include "pipeline/stages/presets.h"

namespace squint {

/// What the preset's formats follow.  Reads scene, volume, entries, step_world and the box.
PresetInputs preset_inputs(const Plan& plan);

/// Warnings with their figures, for formats that are there: matter they lose, short slabs and highlights they
/// blur, colours that may pass their opacity.
void warn_of_formats(Plan& plan);

}  // namespace squint
