// Which cells of a volume hold a wall, a bit each: slabs that meet one of them and no wall are looked at twice.
#pragma once

#include "pipeline/machines/lanes/empty_space.h"
#include "pipeline/stages/walls.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace squint::lanes {

/// Of the cells of a box of blocks, kBlock^3 each.
struct NearWalls {
    static constexpr int kWords = kBlock * kBlock * kBlock / 32;  // a block; x fastest

    BlockBox box;  // no ray leaves it
    std::vector<std::uint32_t> bits;
    // Cells in twos along each axis, a bit each, rows of words along x: whether one of the two, or one beside them,
    // holds a wall.  A first question that the second-level cache answers.
    std::vector<std::uint32_t> about;

    bool at(std::int64_t x, std::int64_t y, std::int64_t z) const {  // a cell
        const Index3 &low = box.low, &n = box.blocks;
        const std::int64_t block =
            (((z >> kBlockBits) - low.z) * n.y + (y >> kBlockBits) - low.y) * n.x + (x >> kBlockBits) - low.x;
        const std::int64_t cell = ((z % kBlock) * kBlock + y % kBlock) * kBlock + x % kBlock;
        return bits[static_cast<std::size_t>(block * kWords + cell / 32)] >> cell % 32 & 1;
    }
    bool about_at(std::int64_t x, std::int64_t y, std::int64_t z) const {  // a cell
        const std::int64_t two = x / 2 - 2 * box.low.x;
        const std::int64_t row = (z / 2 - 2 * box.low.z) * 2 * box.blocks.y + y / 2 - 2 * box.low.y;
        return about[static_cast<std::size_t>(row * words_a_row(box) + two / 32)] >> two % 32 & 1;
    }
    static std::int64_t words_a_row(const BlockBox& box) { return (2 * box.blocks.x + 31) / 32; }
    static std::int64_t words_about(const BlockBox& box) {
        return words_a_row(box) * 4 * box.blocks.y * box.blocks.z;
    }
    static std::int64_t bytes_for(const BlockBox& box) {
        return (box.count() * kWords + words_about(box)) * 4;
    }
};

/// For these blocks at least.  Cached per volume while walls stay the same.
std::shared_ptr<const NearWalls> near_walls(const Volume& volume, const BlockBox& box,
                                            const WallStage& walls);

}  // namespace squint::lanes
