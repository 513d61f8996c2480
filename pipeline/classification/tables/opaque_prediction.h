// Where a slab first meets an opaque entry (Lee & Shin, section 4.2, with the three faults of its table P
// mended: both directions, inclusive tests, and the rate d / |s_b - s_f| of the whole slab kept for the
// shortened one).
#pragma once

#include "pipeline/classification/tables/linear_entries.h"

#include <optional>

namespace squint::preintegration {

struct OpaquePrediction {
    std::vector<int> up;    // up[i]: the nearest opaque entry >= i; size() where there is none
    std::vector<int> down;  // down[i]: the nearest opaque entry <= i; -1 where there is none
    bool any = false;       // false: the prediction can be left out of the pipeline

    /// The coordinate where the way from `front` to `back` (both ends included) first meets an opaque one.
    std::optional<double> first(double front, double back) const;
};

OpaquePrediction predict_opaque(const Entries& entries);

/// A slab cut at its first opaque coordinate: its translucent part, and the wall behind it.
struct RealCutSlab {
    double front, back,
        length;  // the part before the wall, with the whole slab's rate; length 0 when the front is opaque
    bool wall = false;
    Vec3 wall_color{0, 0, 0};

    /// The translucent part over the wall.
    SlabValue over_wall(const SlabValue& part) const;
};

/// Clamps both ends to the entries and cuts.
RealCutSlab cut_at_opaque(const Entries& entries, const OpaquePrediction& prediction, double front,
                          double back, double length);

}  // namespace squint::preintegration
