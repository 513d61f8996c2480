// A volume: unsigned integer scalars on a regular grid with right angles in world space.  Knows no bits of the
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

/// Scalars are levels: stored value minus the smallest the type or a declared window allows
/// (docs/conventions.md#scalars-and-transfer-function). A volume is immutable and cheap to copy; its voxels are shared, in memory or mapped from a
/// file.
struct Volume {
    Index3 dims{0, 0, 0};   // voxels along x, y, z; x runs fastest
    Vec3 spacing{1, 1, 1};  // world units between voxel centres
    Vec3 origin{0, 0, 0};   // position of the first voxel's centre
    /// Unit vectors along x, y and z of the grid in world space; positions and directions in the grid's own space
    /// are world ones turned by their inverse.  Of every file whose axes lie along the world's: no turn at all.
    std::array<Vec3, 3> turn = kNoTurn;
    ScalarType type = ScalarType::u8;
    /// dims.x * dims.y * dims.z scalars of `type`, little-endian; 64 more bytes can be read.
    std::shared_ptr<const void> data;
    bool mapped = false;          // they lie in a mapped file, which the system reads and forgets as it likes
    std::vector<VoxelRun> zeros;  // known to be 0 unread: what a sparse file never wrote; in order, apart
    std::uint32_t smallest = 0;   // least and greatest scalar in the data
    std::uint32_t largest = 0;
    int scalar_bits = 8;     // I: integer bits that hold every scalar of the declared range
    double value_scale = 1;  // file's value = value_scale * scalar + value_offset (HU where declared)
    double value_offset = 0;
    std::string name;          // for messages: a path or a procedural name
    std::string space;         // its world axes where the file states them: "left-posterior-superior"
    std::string modality;      // what DICOM states: "CT", "MR"; otherwise empty
    std::string content_hash;  // of dims, type and voxels: names the data wherever it lies

    std::int64_t voxels() const { return dims.x * dims.y * dims.z; }
    std::size_t scalar_bytes() const { return type == ScalarType::u8 ? 1 : 2; }
    std::uint32_t largest_representable() const { return (1u << scalar_bits) - 1; }

    std::uint32_t at(std::int64_t x, std::int64_t y, std::int64_t z) const {
        const std::int64_t index = (z * dims.y + y) * dims.x + x;
        return type == ScalarType::u8 ? static_cast<const std::uint8_t*>(data.get())[index]
                                      : static_cast<const std::uint16_t*>(data.get())[index];
    }
    /// Whether voxels [first, end) are known to be 0 without a look at them.
    bool known_zero(std::int64_t first, std::int64_t end) const {
        const auto after =
            std::upper_bound(zeros.begin(), zeros.end(), first,
                             [](std::int64_t voxel, const VoxelRun& run) { return voxel < run.first; });
        return after != zeros.begin() && end <= (after - 1)->end;
    }
    /// The box that is rendered: from the first to the last voxel centre.  An axis of one voxel is one spacing
    /// thick, half to each side of its centre, and the field is constant along it.
    Vec3 box_low() const { return world_from_voxel(Vec3(0) - half_of_thin_axes()); }
    Vec3 box_high() const { return world_from_voxel(Vec3(dims - Index3(1)) + half_of_thin_axes()); }
    bool is_thin(int axis) const { return dims[axis] == 1; }

    double smallest_spacing() const { return std::min(spacing.x, std::min(spacing.y, spacing.z)); }

    double value_at(double scalar) const { return value_scale * scalar + value_offset; }  // file's units

    bool turned() const { return turn != kNoTurn; }
    /// A vector of the grid's own space in world space, and back.
    Vec3 world_from_grid(const Vec3& v) const { return turn[0] * v.x + turn[1] * v.y + turn[2] * v.z; }
    Vec3 grid_from_world(const Vec3& v) const { return Vec3(turn[0].dot(v), turn[1].dot(v), turn[2].dot(v)); }

    // "World" is the grid's own space here; the two differ for a turned volume alone.
    Vec3 voxel_from_world(const Vec3& p) const { return (p - origin) / spacing; }
    Vec3 world_from_voxel(const Vec3& p) const { return origin + p * spacing; }

  private:
    Vec3 half_of_thin_axes() const {
        return {is_thin(0) ? 0.5 : 0.0, is_thin(1) ? 0.5 : 0.0, is_thin(2) ? 0.5 : 0.0};
    }
};

}  // namespace squint
