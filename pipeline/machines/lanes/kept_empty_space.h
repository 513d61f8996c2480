// Empty space from frame to frame: found anew only where a transfer function shows other scalars.
#pragma once

#include "pipeline/machines/lanes/empty_space.h"

#include <memory>

namespace squint::lanes {

/// find_empty_space of these blocks at least, kept per volume.  `from_zero`: a block's scalars count as reaching
/// down to zero, for MIP: a block changes a ray where its greatest scalar or any below can be seen; else no
/// sample of it is the ray's largest, or the largest is as transparent as whatever stands in its place.
std::shared_ptr<const EmptySpace> kept_empty_space(const Volume& volume, const BlockBox& box,
                                                   const Entries& entries, int reach, int entry_reach,
                                                   bool from_zero);

}  // namespace squint::lanes
