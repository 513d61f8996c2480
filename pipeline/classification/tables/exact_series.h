// PIPS(n) and LEG(n) without rounding: the methods over the entries' own curves, extinction and colour linear
// between entries, by tables that do not cancel.  What the preset `real` evaluates where words have rows.
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
    int pieces = 4;   // that LEG cuts a deep slab in
    double step = 1;  // length of a full slab, in world units

    /// Any ends, in entries, and any length, in world units; equal ends are the point itself (PC).
    SlabValue slab(double front, double back, double length) const;

  private:
    SlabValue one_piece(double front, double back, double length) const;
    SlabValue in_pieces(double front, double back, double length, double depth) const;
};

/// Orders 1 to 5 of PIPS, 2 to 4 of LEG.  Without `predicts` slabs end at no wall.
ExactSeries build_exact_series(const Entries& entries, int order, bool legendre, bool predicts);

}  // namespace squint::preintegration
