// The transfer function between its entries: extinction and colour are linear, and it is opaque where both
// neighbours are (docs/conventions.md#scalars-and-transfer-function).  Coordinates are in entries and clamped
// to [0, size - 1].
#pragma once

#include "core/transfer_function.h"

#include <array>
#include <vector>

namespace squint::preintegration {

/// One value per entry for red, green and blue.
using Channels = std::array<std::vector<double>, 3>;

/// What one slab adds to a ray: premultiplied colour and opacity; 0 <= color <= alpha <= 1 for colours in [0,
/// 1].
struct SlabValue {
    Vec3 color{0, 0, 0};
    double alpha = 0;
};

double clamped_coordinate(const Entries& entries, double coordinate);
double extinction_at(const Entries& entries, double coordinate);  // per world unit
Vec3 color_at(const Entries& entries, double coordinate);
bool opaque_at(const Entries& entries, double coordinate);

/// The matter of one sample over `length` world units: alpha = 1 - exp(-tau d), C = c alpha; opaque where the
/// function is.
SlabValue point_slab(const Entries& entries, double coordinate, double length);

/// The same function with `per_entry` times as many entries: coordinate s becomes s * per_entry.  Both are in
/// entries.
Entries subdivided(const Entries& entries, int per_entry);

/// The largest optical depth of one entry (from its coordinate to the next) in a slab of `length` that spans
/// just that entry.
double deepest_entry(const Entries& entries, double length);

}  // namespace squint::preintegration
