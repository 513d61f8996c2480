// What PI1D and PI2D lose where a slab is shorter than the one their tables are for: a ray's last, and in PI2D the one
// that a wall ends.  Its opacity is exact; its colour keeps the self-attenuation of a full slab.
#pragma once

#include "pipeline/plan/plan.h"

namespace squint {

/// The most that one such slab of matter of depth share y and colour c(y) in [0, 1] is off by: the full slab's
/// straight colour, seen through x of depth, in place of its own, seen through x' <= longest x, times its opacity:
///
///     max over x' of (1 - e^-x') TV(p_x, p_x'),    p_x(y) = x e^-xy / (1 - e^-x),  0 <= y <= 1;
///
/// attained by a step of colour where both densities are equal.  TV: total variation.
double shorter_slab_error(double depth, double longest = 1);

inline constexpr const char* kShorterSlabs = "the colour of a ray's last slab";

/// The most that the colour of a ray's shorter slab is off by, of 255, over all slabs whose ends the data reaches: of
/// its method, against the exact integral (pi2d, pi1d) or against tables for its own length (where they know no
/// self-attenuation).  Nothing for methods that classify a slab with its own length.
Approximation shorter_slabs(const Plan& plan);

}  // namespace squint
