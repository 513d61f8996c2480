// What stands at and beyond a volume's faces: its outermost voxels go on.
#pragma once

#include "core/volume.h"

#include <algorithm>
#include <cstdint>

namespace squint {

/// The voxel that stands at place i along an axis of n voxels.
constexpr std::int64_t voxel_at(std::int64_t i, std::int64_t n) {
    return std::clamp<std::int64_t>(i, 0, n - 1);
}

/// Offsets in voxels from a cell's lower corner to its four pairs of corners along x, y fastest.  Along an axis
/// of one voxel both corners are that voxel.
struct PairOffsets {
    std::int64_t pair[4];
    explicit PairOffsets(const Index3& n) {
        const std::int64_t y = voxel_at(1, n.y) * n.x, z = voxel_at(1, n.z) * n.x * n.y;
        pair[0] = 0, pair[1] = y, pair[2] = z, pair[3] = y + z;
    }
};

}  // namespace squint
