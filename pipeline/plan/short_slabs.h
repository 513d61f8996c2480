// The error of PI1D and PI2D in slabs shorter than their tables': a ray's last, and in PI2D one that ends at
// a wall. Its opacity is exact; its colour keeps the self-attenuation of a full slab.
#pragma once

#include "pipeline/plan/plan.h"

namespace squint {

/// The largest error of one such slab, for colours c(y) in [0, 1] over the depth share y: it takes a full
/// slab's straight colour (depth x) in place of its own (depth x' <= longest x), times its opacity:
///
///     max over x' of (1 - e^-x') TV(p_x, p_x'),    p_x(y) = x e^-xy / (1 - e^-x),  0 <= y <= 1;
///
/// A step of colour where both densities are equal attains it.  TV: total variation.
double shorter_slab_error(double depth, double longest = 1);

inline constexpr const char* kShorterSlabs = "the colour of a ray's last slab";

/// The largest error, of 255, of the colour of a ray's shorter slab, over all slabs whose ends the data
/// reaches: against the exact integral (pi2d, pi1d), or against tables for its own length (methods without
/// self-attenuation).  Zero for methods that classify a slab with its own length.
Approximation shorter_slabs(const Plan& plan);

}  // namespace squint
