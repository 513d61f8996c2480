// PIPS(n) and LEG(n) without rounding: over the curves between entries, where extinction and colour are
// linear, by tables that do not cancel.  The preset `real` evaluates it where words have rows.
#pragma once

#include "pipeline/classification/tables/disjoint_tables.h"
#include "pipeline/classification/tables/opaque_prediction.h"
#include "pipeline/classification/tables/power_series.h"

namespace squint::preintegration {

struct ExactSeries {
    Entries entries;
    OpaquePrediction prediction;
    ColorRange range;
    DisjointTables tables;
    int order = 1;
    bool legendre = false;
    int pieces = 4;   // into which LEG cuts a deep slab
    double step = 1;  // length of a full slab, in world units

    /// Any ends, in entries, and any length, in world units; equal ends are one point (PC).
    SlabValue slab(double front, double back, double length) const;

  private:
    SlabValue one_piece(double front, double back, double length) const;
    SlabValue in_pieces(double front, double back, double length, double depth) const;
};

/// Orders 1 to 5 of PIPS, 2 to 4 of LEG.  Without `predicts` no slab ends at a wall.
ExactSeries build_exact_series(const Entries& entries, int order, bool legendre, bool predicts);

}  // namespace squint::preintegration
