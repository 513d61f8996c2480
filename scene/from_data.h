// Makes a scene from data alone, for a volume that is given in place of a scene.
#pragma once

#include "scene/scene.h"

#include <string>
#include <vector>

namespace squint {

/// The scene that a user asked for.  `file` is a scene, or a volume, which makes a scene of its own, or empty: the
/// built-in scene, or, where `overrides` (key=value) set volume.file, one that this volume makes.  The preset file is
/// merged in.  A scene that a volume makes has no transfer function until complete_from_data().  Throws InputError.
Scene scene_asked_for(const std::string& file, const std::vector<std::string>& overrides);
/// Whether that is a scene of its own, made by a volume: frame_data() is for those.
bool is_of_data(const std::string& file, const std::vector<std::string>& overrides);

/// A scene without a transfer function for the volume in `file`: a headlight, the first-order power series of
/// pre-integration (pips), and a camera that shows the whole volume until frame_data() aims it.
Scene scene_of_data(const std::string& file);

/// Whether a scene has a transfer function.
bool has_transfer_function(const Scene& scene);

/// Gives a scene without a transfer function one from its data.  CT in Hounsfield units (stated, or
/// recognised by its air and soft tissue) gets one for skin and bone, other data one from the histogram.
/// `notes` receives a line that says which.
void complete_from_data(Scene& scene, const Volume& volume, std::vector<std::string>& notes);

/// Aims an orthographic camera without a place or a height of its own at what the scene's function shows: that fills
/// the picture.
void frame_data(Scene& scene, const Volume& volume);

}  // namespace squint
