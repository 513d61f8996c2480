// Precision presets by name.  What they give a wire: pipeline/stages/presets.h.
#pragma once

#include "scene/scene.h"

#include <string_view>

namespace squint {

/// The presets that round no wire: `real` in double, `float32` in float.
bool rounds_nothing(std::string_view preset);

/// What a preset composites with where the scene does not say.
CompositingForm preset_form(std::string_view name);

}  // namespace squint
