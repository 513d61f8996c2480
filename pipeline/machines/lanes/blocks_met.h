// The blocks that a plan's samples may lie in, and which of them cannot be seen.
#pragma once

#include "pipeline/machines/lanes/empty_space.h"
#include "pipeline/plan/plan.h"
#include "pipeline/render.h"

#include <cstdint>
#include <memory>

namespace squint::lanes {

/// With a margin of a slab's reach and one more.
BlockBox blocks_met(const Plan& plan);

/// Whether rays may meet a block of CellBlocks, of so many along each axis: some block in it lies in the box and, where
/// empty space is known, at most `apart` from something visible.
bool may_be_met(const BlockBox& box, const EmptySpace* empty, const Index3& cell_blocks, std::int64_t block,
                int apart);

/// Whether empty space may be left out, and slabs are short enough for it to pay.
bool may_skip(const Plan& plan);

/// Bytes for what is kept beside the volume: as asked, or half of what the system could give.
std::int64_t room_of(const RenderOptions& options);

/// The plan's empty space, cached per volume; null where it may not be left out, or takes more than `room` bytes.
std::shared_ptr<const EmptySpace> empty_space_of(const Plan& plan, std::int64_t room);

}  // namespace squint::lanes
