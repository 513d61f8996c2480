// Which parts of a volume cannot be seen: block minima and maxima once per volume, occupancy once per
// transfer function, and for each block how far the nearest visible one is.
#pragma once

#include "core/transfer_function.h"
#include "core/volume.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace squint::lanes {

inline constexpr int kBlockBits = 2;  // blocks of 4 x 4 x 4 cells
inline constexpr int kBlock = 1 << kBlockBits;

/// Least and greatest scalar any sample inside a block's cells can take.  Kept per volume.
struct BlockRanges {
    Index3 blocks{0, 0, 0};
    std::vector<std::uint16_t> smallest, largest;  // x fastest
    std::int64_t index(std::int64_t x, std::int64_t y, std::int64_t z) const {
        return (z * blocks.y + y) * blocks.x + x;
    }
};
std::shared_ptr<const BlockRanges> block_ranges(const Volume& volume);

/// Chebyshev distance in blocks to the nearest block in which anything can be seen; 0 there, at most 255.
struct EmptySpace {
    Index3 blocks{0, 0, 0};
    std::vector<std::uint8_t> distance;
    std::int64_t visible_blocks = 0;
    std::uint8_t at(std::int64_t x, std::int64_t y, std::int64_t z) const {
        return distance[static_cast<std::size_t>((z * blocks.y + y) * blocks.x + x)];
    }
};

/// `reach`: blocks that two neighbouring samples may lie apart, where the method sees the range between them;
/// 0 where it does not. `entry_reach`: entries on either side of a slab's own that its colour may come from.
EmptySpace find_empty_space(const BlockRanges& ranges, const Entries& entries, int reach,
                            int entry_reach = 0);

}  // namespace squint::lanes
