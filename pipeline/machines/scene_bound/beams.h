// Bounds the error of all rays of a beam: lines through a range of places, in a range of directions.
//
// A beam meets the blocks of cells in their order.  Sample by sample, from its far end, the greatest cost of what its
// rays can meet there goes through the recursion of slab_costs.h.  The rays of a beam share no grid of samples: sample j
// of one of them lies anywhere between j and j + 1 steps from the beam's middle plane.
#pragma once

#include "pipeline/machines/scene_bound/cost_blocks.h"
#include "pipeline/plan/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

namespace squint {

/// Lines that run along `axis`, towards higher voxels or lower ones.  In voxels.
struct Beam {
    struct Range {
        double low = 0, high = 0;
        double width() const { return high - low; }
    };
    std::size_t axis = 0;
    bool backwards = false;
    std::array<Range, 2>
        place;  // in the box's middle plane across the axis; along the two other axes, in order
    std::array<Range, 2> slope;  // voxels a voxel along the axis, -1 to 1
};

/// What a visible slab costs in compositing, whatever T: roundings of C, w and T.
struct CompositingCosts {
    double each = 0;   // of 1.0
    double most = 1;   // what slabs come to at T = 1: as much as matter shines
    double clear = 0;  // T alone: counts with what lies behind
    Shares shares;     // of `each`
};

/// The most that slabs behind a place can add to a pixel's error.
struct Behind {
    double slabs = 0;        // at T = 1
    double compositing = 0;  // whatever T
    double sum() const { return slabs + compositing; }
};

class Beams {
  public:
    Beams(const Plan& plan, const SampleErrors& errors, const CostBlocks& blocks,
          const CompositingCosts& compositing);

    /// Of all rays through the volume: six beams.
    std::vector<Beam> all() const;
    /// Two halves, across its widest side.
    std::array<Beam, 2> halves(const Beam& beam) const;
    /// Of all rays of a beam; none where it misses what is rendered.
    std::optional<Behind> bound(const Beam& beam) const;

    /// Calls take(box, samples, surely) for the cells of `samples` samples in a row, from the far end; surely: the
    /// rays of the beam have them all, and none is a ray's last.
    template <class Take>
    void walk(const Beam& beam, Take&& take) const;
    /// What one more sample adds.
    void step(Behind& behind, const CostBlocks::Found& found, bool surely) const;

  private:
    const CostBlocks& blocks_;
    CompositingCosts compositing_;
    Vec3 spacing_;
    double step_world_ = 1, off_ = 0, earlier_ = 0;
    bool clipped_ = false;            // a ray may end inside the box
    std::array<Beam::Range, 3> box_;  // voxels
};

template <class Take>
void Beams::walk(const Beam& beam, Take&& take) const {
    const std::array<std::size_t, 3> axes{beam.axis, (beam.axis + 1) % 3, (beam.axis + 2) % 3};
    const auto spacing = [&](std::size_t axis) { return spacing_[static_cast<int>(axis)]; };
    // Voxels along the axis in a step.
    double least = spacing(beam.axis) * spacing(beam.axis), most = least;
    for (std::size_t i = 0; i < 2; ++i) {
        const Beam::Range& s = beam.slope[i];
        const double near = s.low > 0 ? s.low : s.high < 0 ? -s.high : 0, far = std::max(-s.low, s.high);
        const double unit = spacing(axes[i + 1]) * spacing(axes[i + 1]);
        least += near * near * unit, most += far * far * unit;
    }
    const double short_step = step_world_ / std::sqrt(most) * (1 - 0x1p-40),
                 long_step = step_world_ / std::sqrt(least) * (1 + 0x1p-40);
    const Beam::Range& along = box_[beam.axis];
    const double middle = (along.low + along.high) / 2, half = along.width() / 2 + off_;
    const double widest = std::max({beam.place[0].width(), beam.place[1].width(),
                                    beam.slope[0].width() * half, beam.slope[1].width() * half});
    const auto group = std::max<std::int64_t>(static_cast<std::int64_t>(widest / 8 / long_step), 1);
    // Sample j lies j to j + 1 steps from the middle, of either length.
    const auto ends = static_cast<std::int64_t>(std::ceil(half / short_step)) + 1;
    for (std::int64_t j = ends; j >= -ends; j -= group) {
        const auto from = static_cast<double>(j - group + 1), to = static_cast<double>(j + 1);
        double low = std::min(from * short_step, from * long_step) - earlier_ * long_step,
               high = std::max(to * short_step, to * long_step);
        if (low > half || high < -half) continue;
        if (beam.backwards) std::swap(low, high), low = -low, high = -high;
        CellBox cells;
        bool empty = false, surely = true;
        for (std::size_t i = 0; i < 3; ++i) {
            double a = low, b = high;
            if (i > 0) {
                const Beam::Range &s = beam.slope[i - 1], &p = beam.place[i - 1];
                a = p.low +
                    std::min(std::min(low * s.low, low * s.high), std::min(high * s.low, high * s.high));
                b = p.high +
                    std::max(std::max(low * s.low, low * s.high), std::max(high * s.low, high * s.high));
            } else {
                a += middle, b += middle;
            }
            const Beam::Range& box = box_[axes[i]];
            const double margin = step_world_ / spacing(axes[i]);  // a step along the axis at most
            a -= off_, b += off_;
            empty = empty || b < box.low - off_ || a > box.high + off_;
            surely = surely && a - margin > box.low && b + margin < box.high;
            const auto cell = [&](double place) {
                return std::clamp(static_cast<std::int64_t>(std::floor(place)),
                                  blocks_.cells().first[axes[i]], blocks_.cells().last[axes[i]]);
            };
            cells.first[axes[i]] = cell(a), cells.last[axes[i]] = cell(b);
        }
        if (!empty) take(cells, group, surely);
    }
}

}  // namespace squint
