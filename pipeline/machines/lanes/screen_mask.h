// Which packets of a picture look at anything: the others are filled, not cast.
#pragma once

#include "pipeline/machines/lanes/empty_space.h"
#include "pipeline/machines/lanes/packet.h"
#include "pipeline/plan/plan.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace squint::lanes {

/// A mark for every 4x4 pixels of a picture, from its corner on, whose rays may meet a visible block.
class ScreenMask {
  public:
    /// Every packet is marked.
    ScreenMask() = default;
    /// Nothing is marked yet.
    ScreenMask(int width, int height);

    /// Pixels [left, right) x [top, bottom), both ends held inside the picture; from many threads at once.
    void mark(double left, double top, double right, double bottom);
    /// Whether any of the 4x4 pixels from (left, top) is marked, wherever they start: they lie in as many as four
    /// of the mask's own packets.
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

/// The packets of a plan's picture whose rays run through a block in which anything can be seen, and some
/// about them.  Every block that bounds the visible ones marks its rectangle on the screen: a ray that meets
/// one inside meets one of those on its way out.
ScreenMask visible_packets(const Plan& plan, const EmptySpace& empty);

}  // namespace squint::lanes
