// Expands a sweep file to the list of its points, in order.
#pragma once

#include "studies/sweep/sweep_file.h"

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace squint::sweep {

/// A point: its scene, and its value on each axis.
struct Point {
    std::size_t scene = 0;                                    // index into SweepFile::scenes
    std::vector<std::string> overrides;                       // of the axes, in order
    std::vector<WireEdit> edits;                              // applied after all overrides
    std::vector<std::pair<std::string, std::string>> values;  // axis -> label, as TOML
    std::string varied;  // mode one_at_a_time: the axis that differs from the base; "" for the base
};

/// All points: the scenes outermost, the last axis changing fastest.  `used` replaces "used" in [wires].
/// Throws InputError beyond ten million points.
std::vector<Point> expand(const SweepFile& sweep, const std::vector<Wire>& used);

}  // namespace squint::sweep
