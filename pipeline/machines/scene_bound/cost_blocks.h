// Costs of slabs by place: the greatest of every block of cells, in blocks of blocks.
#pragma once

#include "pipeline/machines/scene_bound/slab_costs.h"

#include <array>
#include <cstdint>
#include <vector>

namespace squint {

/// Cells, from the first to the last, both included.
struct CellBox {
    std::array<std::int64_t, 3> first{}, last{};
};

class CostBlocks {
  public:
    /// Of the cells that the plan renders.  Uses the calling task arena.
    CostBlocks(const Plan& plan, const SampleErrors& errors, const SlabCosts& costs);

    struct Found {
        Costs costs;
        bool visible = false;
        void take(const Found& other) { costs.take(other.costs), visible = visible || other.visible; }
    };
    /// Of all cells; of those in a box, or of blocks that hold them.
    const Found& all() const { return levels_.back().block.front(); }
    Found in(const CellBox& box) const;
    /// The cells that the plan renders.
    const CellBox& cells() const { return cells_; }
    /// The steepest that a cell can be: CellValues::edges.
    double steepest() const { return steepest_; }
    /// Of a cell, and where slabs have two ends of all cells within a step of it.
    CellValues values(std::int64_t x, std::int64_t y, std::int64_t z) const;
    /// Whether a ray's last sample may lie there.
    bool at_a_face(std::int64_t x, std::int64_t y, std::int64_t z) const;

  private:
    struct Level {
        std::array<std::int64_t, 3> blocks{};
        std::vector<Found> block;
        std::size_t index(std::int64_t x, std::int64_t y, std::int64_t z) const {
            return static_cast<std::size_t>((z * blocks[1] + y) * blocks[0] + x);
        }
    };
    using Place = std::array<std::int64_t, 3>;
    CellValues of_cell(const Place& at) const;
    std::vector<CellValues> plane(std::int64_t z) const;
    void build_lowest(const SlabCosts& costs);
    void build_above();

    const Volume& volume_;
    CellBox cells_;
    Place
        within_a_step_{};  // cells from a slab's front to its back, at most; none where a slab has one input
    std::array<std::array<double, 2>, 3> inside_{};  // farther from the faces than a ray's last slab reaches
    int lowest_bits_ = 0;                            // cells along a side of a block, as a power of two
    double steepest_ = 0;
    std::vector<Level> levels_;
};

}  // namespace squint
