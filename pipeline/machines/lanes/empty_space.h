// Which parts of a volume cannot be seen: block minima and maxima once per volume, occupancy once per
// transfer function, and each block's distance to the nearest visible one.
#pragma once

#include "core/transfer_function.h"
#include "core/volume.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace squint::lanes {

inline constexpr int kBlockBits = 2;  // blocks of 4 x 4 x 4 cells
inline constexpr int kBlock = 1 << kBlockBits;

/// A box of blocks: from `low`, `size` along each axis.
struct BlockBox {
    Index3 low{0, 0, 0}, blocks{0, 0, 0};
    std::int64_t count() const { return blocks.x * blocks.y * blocks.z; }
    bool holds(const BlockBox& other) const;
};
BlockBox all_blocks_of(const Volume& volume);

/// The least and greatest scalar of any sample in a block's cells.  Cached per volume.
struct BlockRanges {
    BlockBox box;
    std::vector<std::uint16_t> smallest, largest;  // x fastest
};
/// For these blocks at least.  Of a volume larger than memory only the rendered part need be read.
std::shared_ptr<const BlockRanges> block_ranges(const Volume& volume, const BlockBox& box);

/// The Chebyshev distance in blocks to the nearest block that can be seen: 0 there, at most 255.
struct EmptySpace {
    BlockBox box;  // no ray leaves it
    std::vector<std::uint8_t> distance;
    Index3 corners{0, 0, 0};          // of the blocks: one more along each axis
    std::vector<std::uint8_t> clear;  // empty blocks about each corner on every side
    // Of each block, x fastest: bit x + 2 y + 4 z says whether one of the blocks up to x, y, z further on can be
    // seen.
    std::vector<std::uint8_t> spans;
    std::int64_t visible_blocks = 0;
    // A second look, at blocks of half that side, x fastest: bit i % 32 of word i / 32 says whether one of the
    // 2 x 2 x 2 from block i on can be seen.  Empty where there was none.
    std::vector<std::uint32_t> fine;
    std::uint8_t at(std::int64_t x, std::int64_t y, std::int64_t z) const {
        const Index3 &low = box.low, &n = box.blocks;
        return distance[static_cast<std::size_t>(((z - low.z) * n.y + y - low.y) * n.x + x - low.x)];
    }
    /// About how many bytes ranges and distances of these blocks take.
    static std::int64_t bytes_for(const BlockBox& box) {
        return (box.count() <= kMostInHalves ? 8 : 7) * box.count();
    }
    static constexpr std::int64_t kMostInHalves = 1 << 19;  // blocks that may be looked at again
};

/// `reach`: how many blocks apart two neighbouring samples may be, where the method sees the range between
/// them; else 0.  `entry_reach`: how many entries beside a slab's own its colour may depend on.
EmptySpace find_empty_space(const BlockRanges& ranges, const Entries& entries, int reach,
                            int entry_reach = 0);
/// Finds EmptySpace::fine, of samples that are classified each for itself.
void look_again(const Volume& volume, const Entries& entries, EmptySpace& space);

}  // namespace squint::lanes
