// Which parts of a volume cannot be seen: block minima and maxima once per volume; once per transfer function,
// which blocks can be seen, and how far it is to the nearest of them.
#pragma once

#include "core/transfer_function.h"
#include "core/volume.h"

#include <cstdint>
#include <memory>
#include <variant>
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

/// The least and greatest scalar of any sample in a block's cells, in the volume's own type.  Cached per volume.
struct BlockRanges {
    template <class T>
    struct Of {
        std::vector<T> smallest, largest;  // x fastest
    };
    BlockBox box;
    std::variant<Of<std::uint8_t>, Of<std::uint16_t>> of;
};
/// For these blocks at least.  Of a volume larger than memory only the rendered part need be read.
std::shared_ptr<const BlockRanges> block_ranges(const Volume& volume, const BlockBox& box);

struct EmptySpace {
    BlockBox box;                     // no ray leaves it
    Index3 corners{0, 0, 0};          // of the blocks: one more along each axis
    std::vector<std::uint8_t> clear;  // empty blocks about each corner on every side, at most 255
    // Of each block, x fastest: bit x + 2 y + 4 z says whether one of the blocks up to x, y, z further on can be
    // seen.
    std::vector<std::uint8_t> spans;
    std::int64_t visible_blocks = 0;
    // A second look, at blocks of half that side, x fastest: bit i % 32 of word i / 32 says whether one of the
    // 2 x 2 x 2 from block i on can be seen.  Empty where there was none.
    std::vector<std::uint32_t> fine;
    /// Whether a block can be seen.
    bool visible(std::int64_t x, std::int64_t y, std::int64_t z) const {
        return (spans[place(box.blocks, x, y, z)] & 1) != 0;
    }
    /// Of the lowest corner of block x, y, z.
    int clear_at(std::int64_t x, std::int64_t y, std::int64_t z) const {
        return clear[place(corners, x, y, z)];
    }
    /// About how many bytes the ranges of these blocks take, and what can be seen of them.
    static std::int64_t bytes_for(const Volume& volume, const BlockBox& box) {
        const auto ranges = 2 * static_cast<std::int64_t>(volume.scalar_bytes());
        return (ranges + (box.count() <= kMostInHalves ? 3 : 2)) * box.count();
    }
    static constexpr std::int64_t kMostInHalves = 1 << 19;  // blocks that may be looked at again

  private:
    std::size_t place(const Index3& n, std::int64_t x, std::int64_t y, std::int64_t z) const {
        return static_cast<std::size_t>(((z - box.low.z) * n.y + y - box.low.y) * n.x + x - box.low.x);
    }
};

/// `reach`: how many blocks apart two neighbouring samples may be, where the method sees the range between
/// them; else 0.  `entry_reach`: how many entries beside a slab's own its colour may depend on.  `from_zero`:
/// scalars of every block reach down to zero.
EmptySpace find_empty_space(const BlockRanges& ranges, const Entries& entries, int reach, int entry_reach = 0,
                            bool from_zero = false);
/// Finds EmptySpace::fine, of samples that are classified each for itself.
void look_again(const Volume& volume, const Entries& entries, EmptySpace& space);

}  // namespace squint::lanes
