// A scene made from data alone: what is rendered when a volume stands where a scene is expected.
#pragma once

#include "scene/scene.h"

#include <string>
#include <vector>

namespace squint {

/// A scene without a transfer function for the volume in `file`: a headlight, the least power series of the
/// pre-integration (pips), the whole volume in the picture.
Scene scene_of_data(const std::string& file);

/// Whether a scene says how its scalars are shown.
bool has_transfer_function(const Scene& scene);

/// Gives a scene without a transfer function the data's own: for CT in Hounsfield units (stated, or recognised by
/// its air and its soft tissue) one for skin and bone, otherwise one from the histogram.  `notes` gets one line that
/// says which.
void complete_from_data(Scene& scene, const Volume& volume, std::vector<std::string>& notes);

}  // namespace squint
