// Which packets of a picture can see anything: the others are filled, not cast.
#pragma once

#include "pipeline/machines/lanes/empty_space.h"
#include "pipeline/machines/lanes/packet.h"
#include "pipeline/plan/plan.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace squint::lanes {

/// A mark for each 4x4 pixels of a picture, from its corner on, whose rays may meet a visible block.
class ScreenMask {
  public:
    /// Marks every packet.
    ScreenMask() = default;
    /// Marks nothing.
    ScreenMask(int width, int height);

    /// Marks pixels [left, right) x [top, bottom), clamped to the picture; many threads may call it at once.
    void mark(double left, double top, double right, double bottom);
    /// Whether any of the 4x4 pixels from (left, top) on is marked, wherever they start: they overlap up to
    /// four of the mask's packets.
    bool holds(int left, int top) const {
        if (marks_.empty()) return true;
        const auto packet = [](int pixel, std::size_t packets) {
            return std::min(static_cast<std::size_t>(pixel / kSide), packets - 1);
        };
        const std::size_t x0 = packet(left, columns_), x1 = packet(left + kSide - 1, columns_),
                          y0 = packet(top, rows_), y1 = packet(top + kSide - 1, rows_);
        return marks_[y0 * columns_ + x0] || marks_[y0 * columns_ + x1] || marks_[y1 * columns_ + x0] ||
               marks_[y1 * columns_ + x1];
    }

  private:
    std::size_t columns_ = 0, rows_ = 0;
    std::vector<std::uint8_t> marks_;
};

/// The visible blocks with a neighbour that cannot be seen or lies beyond the box.  They depend on no camera: found
/// once a transfer function.
struct VisibleSurface {
    struct Block {
        std::uint32_t x;  // from the box's corner on, as y
        std::uint32_t y : 26,
            open : 6;  // bit 2 a: the neighbour before it along axis a is such a one; 2 a + 1: behind
    };
    BlockBox box;
    std::vector<std::vector<Block>> layers;  // along z

    explicit VisibleSurface(const EmptySpace& empty);
    std::int64_t bytes() const;
};

/// The packets of a plan's picture whose rays run through a visible block, and some around them.  Blocks of the
/// surface mark their rectangle on the screen, those alone that a ray may enter from where nothing can be seen:
/// behind them it meets others of which it passed one.
ScreenMask visible_packets(const Plan& plan, const VisibleSurface& surface);

}  // namespace squint::lanes
