// A volume: unsigned integer scalars on a regular grid, at right angles in world space.  Knows no bits of the
// pipeline.
#pragma once

#include "core/vector.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace squint {

enum class ScalarType : std::uint8_t { u8, u16 };  // how scalars lie in memory

/// Voxels [first, end), counted as they lie in memory.
struct VoxelRun {
    std::int64_t first = 0, end = 0;
};

inline const std::array<Vec3, 3> kNoTurn{Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};

/// Scalars are levels: a level is the stored value minus the smallest value that the type or a declared
/// window allows (docs/conventions.md#scalars-and-transfer-function).  A volume is immutable and cheap to
/// copy: copies share its voxels, which lie in memory or are mapped from a file.
struct Volume {
    Index3 dims{0, 0, 0};   // voxels along x, y, z; x runs fastest
    Vec3 spacing{1, 1, 1};  // world units between voxel centres
    Vec3 origin{0, 0, 0};   // the first voxel's centre, in grid space
    /// The grid's x, y and z as unit vectors in world space; kNoTurn where they lie along the world's axes.  Grid
    /// space has these axes and the world's unit and origin.
    std::array<Vec3, 3> turn = kNoTurn;
    ScalarType type = ScalarType::u8;
    /// dims.x * dims.y * dims.z scalars of `type`, little-endian; 64 bytes after them can be read.
    std::shared_ptr<const void> data;
    bool mapped = false;          // whether they lie in a mapped file, which the system reads and drops
    std::vector<VoxelRun> zeros;  // known to be 0 unread: holes of a sparse file; ascending, disjoint
    std::uint32_t smallest = 0;   // least and greatest scalar in the data
    std::uint32_t largest = 0;
    int scalar_bits = 8;     // I: integer bits that hold every scalar of the declared range
    double value_scale = 1;  // value in the file = value_scale * scalar + value_offset (HU where declared)
    double value_offset = 0;
    std::string name;          // for messages: a path or a procedural name
    std::string space;         // its world axes, where the file names them: "left-posterior-superior"
    std::string modality;      // where DICOM states it: "CT", "MR"
    std::string content_hash;  // of dims, type and voxels: names the data, wherever the file lies

    std::int64_t voxels() const { return dims.x * dims.y * dims.z; }
    std::size_t scalar_bytes() const { return type == ScalarType::u8 ? 1 : 2; }
    std::uint32_t largest_representable() const { return (1u << scalar_bits) - 1; }

    std::uint32_t at(std::int64_t x, std::int64_t y, std::int64_t z) const {
        const std::int64_t index = (z * dims.y + y) * dims.x + x;
        return type == ScalarType::u8 ? static_cast<const std::uint8_t*>(data.get())[index]
                                      : static_cast<const std::uint16_t*>(data.get())[index];
    }
    /// Whether voxels [first, end) are known to be 0 without reading them.
    bool known_zero(std::int64_t first, std::int64_t end) const {
        const auto after =
            std::upper_bound(zeros.begin(), zeros.end(), first,
                             [](std::int64_t voxel, const VoxelRun& run) { return voxel < run.first; });
        return after != zeros.begin() && end <= (after - 1)->end;
    }
    /// The box that is rendered, in grid space: from the first to the last voxel centre.  An axis of one voxel is
    /// one spacing thick, half to each side of its centre, and the field is constant along it.
    Vec3 box_low() const { return grid_from_voxel(Vec3(0) - half_of_thin_axes()); }
    Vec3 box_high() const { return grid_from_voxel(Vec3(dims - Index3(1)) + half_of_thin_axes()); }
    bool is_thin(int axis) const { return dims[axis] == 1; }

    double smallest_spacing() const { return std::min(spacing.x, std::min(spacing.y, spacing.z)); }

    double value_at(double scalar) const { return value_scale * scalar + value_offset; }  // file's units

    Vec3 voxel_from_grid(const Vec3& p) const { return (p - origin) / spacing; }
    Vec3 grid_from_voxel(const Vec3& p) const { return origin + p * spacing; }
    Vec3 voxel_from_world(const Vec3& p) const { return voxel_from_grid(grid_from_world(p)); }
    Vec3 world_from_voxel(const Vec3& p) const { return world_from_grid(grid_from_voxel(p)); }

    bool turned() const { return turn != kNoTurn; }
    /// A position or a direction; unchanged bits for a volume that is not turned.
    Vec3 world_from_grid(const Vec3& v) const {
        return turned() ? turn[0] * v.x + turn[1] * v.y + turn[2] * v.z : v;
    }
    Vec3 grid_from_world(const Vec3& v) const {
        return turned() ? Vec3(turn[0].dot(v), turn[1].dot(v), turn[2].dot(v)) : v;
    }

  private:
    Vec3 half_of_thin_axes() const {
        return {is_thin(0) ? 0.5 : 0.0, is_thin(1) ? 0.5 : 0.0, is_thin(2) ? 0.5 : 0.0};
    }
};

}  // namespace squint
