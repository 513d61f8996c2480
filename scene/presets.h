// Precision presets by name.  pipeline/stages/presets.h has what they give each wire.
#pragma once

#include "scene/scene.h"

#include <string_view>

namespace squint {

/// The presets that round no wire: `real` in double, `float32` in float.
bool rounds_nothing(std::string_view preset);

/// Whether a scene sets every wire: `auto` has been chosen.
bool has_all_formats(const PrecisionSettings& precision);

/// The compositing form of a preset, for a scene that names none.
CompositingForm preset_form(std::string_view name);

}  // namespace squint
