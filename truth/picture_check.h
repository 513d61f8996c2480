// How far a scene's words are from the same pipeline in double: whole pictures, from all sides, for one view says
// little.
#pragma once

#include "core/volume.h"
#include "scene/scene.h"

#include <memory>
#include <vector>

namespace squint {

struct PictureCheck {
    double largest = 0;                           // of R, G, B and A at any pixel, in LSB8
    int view = 0, size = 0, column = 0, row = 0;  // where
};

/// The scene with each of `sizes` pixels a side, seen from `views` azimuths of a full turn.  Throws InputError where no
/// plan can be made.
PictureCheck check_pictures(Scene scene, const std::shared_ptr<const Volume>& volume, int views,
                            const std::vector<int>& sizes);

}  // namespace squint
