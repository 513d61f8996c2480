// What a scene demands of formats: of the preset, before they are chosen, and of the user, where the chosen
// ones do not meet it.
#pragma once

#include "pipeline/plan/plan.h"
#include "pipeline/stages/presets.h"

namespace squint {

/// What the preset's formats depend on.  Reads scene, volume, entries, step_world and the box.
PresetInputs preset_inputs(const Plan& plan);

/// Adds warnings with figures where formats are too narrow: for matter they lose, short slabs and highlights
/// they blur, colours that may exceed their opacity.
void warn_of_formats(Plan& plan);

}  // namespace squint
