// Costs of slabs by place: the greatest of every block of cells, in blocks of blocks.
#pragma once

#include "pipeline/machines/scene_bound/light_errors.h"
#include "pipeline/machines/scene_bound/slab_costs.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace squint {

/// Cells, from the first to the last, both included.
struct CellBox {
    std::array<std::int64_t, 3> first{}, last{};
};

/// Something of each block of cells, x fastest.
template <class T>
struct BlockGrid {
    std::array<std::int64_t, 3> blocks{};
    std::vector<T> block{};
    std::size_t index(std::int64_t x, std::int64_t y, std::int64_t z) const {
        return static_cast<std::size_t>((z * blocks[1] + y) * blocks[0] + x);
    }
    T& at(std::int64_t x, std::int64_t y, std::int64_t z) { return block[index(x, y, z)]; }
    const T& at(std::int64_t x, std::int64_t y, std::int64_t z) const { return block[index(x, y, z)]; }
};

class CostBlocks {
  public:
    /// Of the cells that the plan renders.  Uses the calling task arena.
    CostBlocks(const Plan& plan, const SampleErrors& errors, const LightErrors& light,
               const SlabCosts& costs);

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
    /// Of all cells: their values, and the steepest that any is.
    CellValues whole() const { return whole_; }
    /// Of each cell of a box, x fastest: where slabs have two ends of all cells within a step of it.
    std::vector<CellValues> values(const CellBox& box) const;
    /// Whether a ray's last sample may lie there.
    bool at_a_face(std::int64_t x, std::int64_t y, std::int64_t z) const;

  private:
    using Level = BlockGrid<Found>;
    using Place = std::array<std::int64_t, 3>;
    CellValues of_cell(const Place& at) const;
    /// With light, where anything near can cost anything.
    CellValues lit_cell(const Place& at) const;
    bool has_one_cell() const { return within_a_step_ == Place{}; }
    /// Cells along an axis that a slab with a rendered cell can meet.
    struct Span {
        std::int64_t first = 0, last = 0;
        std::int64_t size() const { return last - first + 1; }
    };
    Span met(std::size_t axis) const;
    void mark_lit();
    void build_lowest();
    void build_above();

    const Volume& volume_;
    const SlabCosts& costs_;
    CellBox cells_;
    Place
        within_a_step_{};  // cells from a slab's front to its back, at most; none where a slab has one input
    std::array<std::array<double, 2>, 3> inside_{};  // farther from the faces than a ray's last slab reaches
    CellValues whole_;
    std::optional<CellLights> lights_;
    static constexpr int kMarkBits = 3;     // cells along a side of a marked block, as a power of two
    std::optional<BlockGrid<char>> marks_;  // of slabs with two ends; none: all
    int lowest_bits_ = 0;                   // cells along a side of a block, as a power of two
    std::vector<Level> levels_;
};

}  // namespace squint
