// Caches empty space between frames: it is found anew only where a transfer function shows other scalars.
#pragma once

#include "pipeline/machines/lanes/empty_space.h"

#include <memory>

namespace squint::lanes {

/// find_empty_space() for these blocks at least, cached per volume.  `from_zero`, for MIP: scalars reach down
/// to zero.  A block then changes a ray where its greatest scalar or any below can be seen; else no sample of
/// it is the ray's largest, or the largest is as transparent as what replaces it.
std::shared_ptr<const EmptySpace> kept_empty_space(const Volume& volume, const BlockBox& box,
                                                   const Entries& entries, int reach, int entry_reach,
                                                   bool from_zero);

}  // namespace squint::lanes
