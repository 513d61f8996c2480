// Voxels about a cell from a function of their place, and the raw gradient there.
#pragma once

#include "pipeline/stages/gradient-inl.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace squint {

/// value(x, y, z) on the 4x4x4 voxels about a cell whose lower corner is the origin.
template <class F>
HWY_NAMESPACE::Neighbourhood<std::int64_t> neighbourhood_of(F&& value) {
    HWY_NAMESPACE::Neighbourhood<std::int64_t> n;
    for (int i = 0; i < 64; ++i)
        n.voxel[static_cast<std::size_t>(i)] = value((i & 3) - 1, (i >> 2 & 3) - 1, (i >> 4) - 1);
    return n;
}

inline std::array<std::int64_t, 3> gradient_of(const GradientStage& s,
                                               const HWY_NAMESPACE::Neighbourhood<std::int64_t>& n,
                                               const std::array<std::int64_t, 3>& weight) {
    std::array<std::int64_t, 3> gradient;
    for (int axis = 0; axis < 3; ++axis)
        gradient[static_cast<std::size_t>(axis)] = HWY_NAMESPACE::voxel_difference(s, n, weight, axis);
    return gradient;
}

}  // namespace squint
