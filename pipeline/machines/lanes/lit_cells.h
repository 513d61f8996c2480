// Central differences side by side, where something is visible: a gradient is then one place in memory in place of the
// cells beside.  They take time and memory, so they are built once they have paid.
#pragma once

#include "pipeline/machines/lanes/cell_blocks.h"
#include "pipeline/machines/lanes/empty_space.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace squint::lanes {

class LitCells {
  public:
    struct Cells {
        const std::uint8_t* data;
        Index3 blocks;
        std::vector<std::int32_t> slots;  // as CellBlocks::slots
    };

    /// For what is visible in the box; `cells` hold differences.  Without empty space everything may be.
    LitCells(const BlockBox& box, std::shared_ptr<const EmptySpace> empty, std::shared_ptr<CellBlocks> cells);

    /// Null before they are built.
    const Cells* built() const { return built_.load(std::memory_order_acquire); }
    /// Counts gradients that were taken without them, in any thread and picture.  The one with whom they are enough
    /// builds the cells; others go on without them meanwhile.
    void add(std::int64_t gradients);
    void build();

    /// Blocks that are wanted; gradients until they are built.
    std::int64_t wanted() const { return wanted_; }
    std::int64_t to_come() const;
    std::int64_t bytes() const;
    bool are_of(const BlockBox& box, const EmptySpace* empty, const CellBlocks* cells) const;

  private:
    bool wants(std::int64_t block) const;

    BlockBox box_;
    std::shared_ptr<const EmptySpace> empty_;
    std::shared_ptr<CellBlocks> cells_;
    std::int64_t wanted_ = 0, enough_ = 0;
    std::atomic<std::int64_t> taken_{0};
    std::atomic<bool> claimed_{false};
    Cells made_;
    std::atomic<const Cells*> built_{nullptr};
};

/// Cached while a volume lives, for the last blocks that were asked for.
std::shared_ptr<LitCells> lit_cells(const Volume& volume, const BlockBox& box,
                                    const std::shared_ptr<const EmptySpace>& empty,
                                    const std::shared_ptr<CellBlocks>& cells);

}  // namespace squint::lanes
