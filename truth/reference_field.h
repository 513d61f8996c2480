// The trilinear field along a ray, for the reference: a cubic polynomial of the distance inside one cell.
// Plain doubles; shares nothing with the stages.
#pragma once

#include "core/camera.h"
#include "core/volume.h"
#include "scene/scene.h"

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace squint::reference {

/// A polynomial c[0] + c[1] r + c[2] r^2 + c[3] r^3.
struct Cubic {
    std::array<double, 4> c{};
    double at(double r) const { return c[0] + r * (c[1] + r * (c[2] + r * c[3])); }
    double slope(double r) const { return c[1] + r * (2 * c[2] + r * (3 * c[3])); }
    /// The same polynomial in q, for r = from + width q.
    Cubic stretched(double from, double width) const;
};

/// Where the slope of p changes sign in (0, 1), in ascending order; at most two places.
struct Turns {
    int count = 0;
    std::array<double, 2> at{};
};
Turns turns_of(const Cubic& p);

/// The passage of a ray through one cell, with r from 0 to 1.
struct Passage {
    Index3 cell{0, 0, 0};
    Vec3 from{0, 0, 0}, to{0, 0, 0};  // in the cell, each component in [0, 1]
    double first = 0, length = 0;     // world units along the ray
};

/// The values at a cell's corners, x fastest.
using Corners = std::array<double, 8>;

/// The trilinear interpolant of `corners` along a passage.
Cubic along(const Corners& corners, const Passage& passage);

/// The part of a passage where one voxel is nearest.
struct NearestPart {
    Passage passage;
    double scalar = 0;
};
/// Cuts a passage where the nearest voxel changes: half-way between voxels, which belongs to the upper one.
struct NearestParts {
    int count = 0;
    std::array<NearestPart, 4> part{};
};
NearestParts nearest_along(const Corners& corners, const Passage& passage);

/// The scalars at the corners of a cell; an axis of one voxel repeats it.
Corners corners_of(const Volume& volume, const Index3& cell);

/// The gradient along a passage, in levels per smallest voxel spacing, in grid space.  The rules of
/// docs/conventions.md but cubic_spline are all trilinear in the cell: differences of samples one voxel apart, clamped to the
/// box, are interpolated differences of voxels.
std::array<Cubic, 3> gradient_along(const Volume& volume, GradientRule rule, const Passage& passage);
/// The same of the volume's means over 5^3 voxels, by central differences.
std::array<Cubic, 3> mean_gradient_along(const Volume& volume, const Passage& passage);

/// The gradient of the spline of Catmull and Rom through the 4x4x4 voxels around a cell: no trilinear field.
class SplineGradient {
  public:
    SplineGradient() = default;
    SplineGradient(const Volume& volume, const Passage& passage);
    /// At distance r of the passage.
    Vec3 at(double r) const;

  private:
    Passage passage_;
    Vec3 per_spacing_{1, 1, 1};
    std::array<double, 64> voxel_{};  // x fastest
};

/// Blocks of 4 x 4 x 4 cells, and whether a ray must look into each.
class Blocks {
  public:
    /// `visible(least, greatest)` tells whether scalars of that range can be seen.
    Blocks(const Volume& volume, const std::function<bool(double, double)>& visible);
    static constexpr int kShift = 2;
    bool visible(const Index3& cell) const {
        return visible_[static_cast<std::size_t>(
                   ((cell.z >> kShift) * count_.y + (cell.y >> kShift)) * count_.x + (cell.x >> kShift))] !=
               0;
    }

  private:
    Index3 count_{0, 0, 0};
    std::vector<std::uint8_t> visible_;
};

/// The cells of a ray, front to back.
class CellWalk {
  public:
    /// `inside`: distances between which the ray is in the box.  Without blocks (null) all cells are visited.
    CellWalk(const Volume& volume, const Ray& ray, const Interval& inside, const Blocks* blocks);
    /// Moves to the next cell; false after the last.
    bool next(Passage& passage);

  private:
    void aim(int axis);
    void leave_block();
    void step_over(int axis);

    const Blocks* blocks_;
    Vec3 origin_, rate_;  // voxels, voxels per world unit
    Index3 cell_{0, 0, 0}, last_cell_{0, 0, 0};
    Vec3 local_{0, 0, 0};  // in the cell
    std::array<double, 3> crossing_{};
    double here_, end_;
};

}  // namespace squint::reference
