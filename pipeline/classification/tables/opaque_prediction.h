// Finds where a slab first meets an opaque entry: Lee & Shin, section 4.2, with three faults of its table P
// corrected: it looks in both directions, its tests include the ends, and the shortened slab keeps the rate d
// / |s_b - s_f| of the whole one.
#pragma once

#include "pipeline/classification/tables/linear_entries.h"

#include <optional>

namespace squint::preintegration {

struct OpaquePrediction {
    std::vector<int> up;    // up[i]: the nearest opaque entry >= i; size() where there is none
    std::vector<int> down;  // down[i]: the nearest opaque entry <= i; -1 where there is none
    bool any = false;       // false: nothing is opaque, and the pipeline leaves prediction out

    /// The first opaque coordinate on the way from `front` to `back`, both ends included.
    std::optional<double> first(double front, double back) const;
};

OpaquePrediction predict_opaque(const Entries& entries);

/// A slab cut at its first opaque coordinate: a translucent part, and the wall behind it.
struct RealCutSlab {
    double front, back,
        length;  // of the part before the wall, at the whole slab's rate; 0 when the front is opaque
    bool wall = false;
    Vec3 wall_color{0, 0, 0};

    /// The translucent part over the wall.
    SlabValue over_wall(const SlabValue& part) const;
};

/// Clamps both ends to the entries, and cuts the slab.
RealCutSlab cut_at_opaque(const Entries& entries, const OpaquePrediction& prediction, double front,
                          double back, double length);

}  // namespace squint::preintegration
