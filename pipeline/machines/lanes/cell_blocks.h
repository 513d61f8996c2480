// The fast layout of a volume: the eight corners of each cell side by side, so that a sample is one load.  It
// takes eight times the voxels' memory, so cells form blocks, and only blocks that rays may meet are built.
#pragma once

#include "core/volume.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

namespace squint::lanes {

/// What a cell holds: its corners, x fastest, in the volume's own type; or, of voxels below 2^15, the central
/// differences at them in 16 bits, those along x before those along y and z.
enum class CellContent { corners, differences };

class CellBlocks {
  public:
    static constexpr int kBits = 3;  // blocks of 8 x 8 x 8 cells, x fastest
    static constexpr int kCells = 1 << 3 * kBits;
    static constexpr std::int64_t kDifferenceBytes = 48;  // of a cell

    /// Reserves `most_bytes` for cells, or enough for all.
    CellBlocks(const Volume& volume, std::int64_t most_bytes, CellContent content = CellContent::corners);
    ~CellBlocks();
    CellBlocks(const CellBlocks&) = delete;
    CellBlocks& operator=(const CellBlocks&) = delete;

    /// The bytes of all cells of a volume.
    static std::int64_t bytes_of_all(const Volume& volume, CellContent content = CellContent::corners);
    /// The bytes of the tables that say where blocks lie.
    static std::int64_t table_bytes_of(const Volume& volume, CellContent content = CellContent::corners);

    /// Builds the blocks that wanted(block) accepts and that are missing, while there is room.
    void build(const std::function<bool(std::int64_t)>& wanted);
    /// The first cell of each block, counted in cells from data(); -1 for a block that is not built.  Built
    /// blocks never move.
    std::vector<std::int32_t> slots() const;

    /// Of two neighbouring blocks along each axis, where the first cell of the volume would lie if all were in
    /// that block.  Number i is of the block whose number along axis a is odd where bit a of i is set.
    struct alignas(32) Near {
        std::int32_t start[8];
    };
    static constexpr std::int32_t kNotThere = -0x40000000;  // stays below zero for all cells
    /// For each block and those after it; null where blocks are too many, and of differences.
    std::shared_ptr<const std::vector<Near>> near() const;
    const std::uint8_t* data() const { return data_; }
    Index3 blocks() const { return blocks_; }
    /// Blocks built so far, and those there is room for.
    std::int64_t bytes() const;
    std::int64_t room() const { return room_ * block_bytes_; }

  private:
    template <class T>
    void fill(std::int64_t index, std::uint8_t* cells) const;
    template <class T>
    void fill_corners(const Index3& low, T* cells) const;
    template <class T>
    void fill_differences(const Index3& low, std::uint8_t* cells) const;
    void find_near();

    const Volume volume_;
    const CellContent content_;
    Index3 blocks_{0, 0, 0};
    std::int64_t block_bytes_ = 0, room_ = 0;  // room_ in blocks
    std::uint8_t* data_ = nullptr;             // reserved; the system adds pages as they are written
    mutable std::mutex mutex_;
    std::vector<std::int32_t> slots_;
    std::int64_t taken_ = 0;  // blocks
    std::shared_ptr<const std::vector<Near>> near_;
};

/// The cells of a volume, cached while its voxels live.  A later call may ask for other room: `strictly` for
/// no more than it says, otherwise for about as much.
std::shared_ptr<CellBlocks> cell_blocks(const Volume& volume, std::int64_t most_bytes, bool strictly,
                                        CellContent content = CellContent::corners);

}  // namespace squint::lanes
