// Depths and normals of a picture: an observer of the composition collects them, or the lanes' own loop does.
#pragma once

#include "pipeline/plan/plan.h"
#include "pipeline/slab.h"

namespace squint {

/// Adds a visible slab to a pixel's depths.  `z`: the distance of its front from the ray's origin, in world
/// units; `before`, `after`: T in front of it and behind it, in the same unit.
template <class W>
void note_depth(double z, double before, double after, bool backwards, Pixel<W>& pixel) {
    if (backwards) {
        const double clear = before > 0 ? after / before : 1;
        pixel.weighted_distance = pixel.weighted_distance * clear + z * (1 - clear);
        pixel.weight = pixel.weight * clear + (1 - clear);
    } else {
        pixel.weighted_distance += z * (before - after);
        pixel.weight += before - after;
    }
    if (!pixel.first_hit || backwards) pixel.first_hit = z;
}

}  // namespace squint
