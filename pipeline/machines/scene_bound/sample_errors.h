// What a sample of any ray of a scene may be off by, before it is classified: docs/guarantees.md#the-scene-bound.
#pragma once

#include "fixedpoint/words/bounded.h"
#include "pipeline/plan/plan.h"

#include <algorithm>
#include <cmath>

namespace squint {

/// The last bit of a wire, of 1.0.
inline double last_bit(const Plan& plan, Wire wire) {
    return std::ldexp(1.0, -plan.specs[wire].format.fraction_bits);
}

/// The values of a cell: its eight corners, and the sum over the axes of its steepest edges, in levels.  Of lit scenes,
/// the most that v = g / max(|g|, g_0) changes by as the point does, a voxel, and as g does (light_errors.h).
struct CellValues {
    double low = 0, high = 0, edges = 0, turn = 0, weak = 0;
    bool flat() const { return low == high; }
    void take(const CellValues& other) {
        low = std::min(low, other.low), high = std::max(high, other.high),
        edges = std::max(edges, other.edges), turn = std::max(turn, other.turn),
        weak = std::max(weak, other.weak);
    }
};

struct SampleErrors {
    double displacement = 0;  // of the point, along each axis, in voxels
    double lerps = 0;         // levels, where a cell is not flat
    double rounding = 0;      // entries: of the input
    double scale = 1;         // entries a level
    bool scaled = false;      // then an input is rounded in flat cells, too
    bool two_products = false;
    Shares of_displacement, of_lerps, of_rounding;  // their causes

    /// Entries.
    double of(const CellValues& cell) const {
        const bool exact = cell.flat() && (!two_products || cell.high == 0);
        return (displacement * cell.edges + (exact ? 0 : lerps)) * scale + (exact && !scaled ? 0 : rounding);
    }
    Shares shares_of(const CellValues& cell) const {
        const bool exact = cell.flat() && (!two_products || cell.high == 0);
        Shares all;
        all.add(of_displacement, cell.edges * scale);
        if (!exact) all.add(of_lerps, scale);
        if (!exact || scaled) all.add(of_rounding, 1);
        return all;
    }
    /// How far beyond its cell's values an input may lie, in entries.
    double beyond() const { return (two_products ? lerps * scale : 0) + (scaled ? rounding : 0); }
};

SampleErrors sample_errors(const Plan& plan);

}  // namespace squint
