// The truth for every classification method: the exact integral of one slab in
// double, entries -> (colour, opacity). C = int c tau e^-t dt and alpha = 1 - e^-x,
// with the coordinate running linearly from front to back (Lee & Shin, equations 8
// and 9).
#pragma once

#include "pipeline/classification/tables/linear_entries.h"

namespace squint::preintegration {

/// Exact to about 1e-14: 8-point Gauss-Legendre on pieces of optical depth at most 1/2, cut at the entries.
/// `length` is in world units, >= 0.  The slab ends at the first opaque coordinate, in that coordinate's
/// colour; the rate length / |back - front| is the whole slab's.
SlabValue exact_slab(const Entries& entries, double front, double back, double length);

}  // namespace squint::preintegration
