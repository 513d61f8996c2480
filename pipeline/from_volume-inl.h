// Voxels for the composition (slab-inl.h), from the volume itself; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_FROM_VOLUME_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_FROM_VOLUME_INL_H
#undef SQUINT_PIPELINE_FROM_VOLUME_INL_H
#else
#define SQUINT_PIPELINE_FROM_VOLUME_INL_H
#endif

#include "core/volume.h"
#include "pipeline/stages/faces.h"
#include "pipeline/stages/gradient-inl.h"
#include "pipeline/stages/interpolation.h"
#include "pipeline/stages/walls.h"

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// The voxels of a volume.  Fetching is separate from arithmetic: stages receive voxels and index no volume.
struct FromVolume {
    const Volume& volume;

    template <class W>
    Cell<W> cell(const std::array<W, 3>& at) const {
        return {cube<W, 2>(at, 0)};
    }
    template <class W>
    Neighbourhood<W> neighbourhood(const std::array<W, 3>& at) const {
        return {cube<W, 4>(at, 1)};
    }
    /// Sums over the 5^3 voxels about each of a neighbourhood's, which stand for those beyond the volume, too.
    template <class W>
    Neighbourhood<W> box_sums(const std::array<W, 3>& at) const {
        constexpr int kReach = kBoxSide / 2, kSide = 4 + 2 * kReach;  // voxels a side that are read
        const Index3 p(to_index(at[0]), to_index(at[1]), to_index(at[2])), n = volume.dims;
        std::int64_t sum[kSide][kSide][kSide];
        for (int z = 0; z < kSide; ++z)
            for (int y = 0; y < kSide; ++y)
                for (int x = 0; x < kSide; ++x)
                    sum[z][y][x] =
                        volume.at(voxel_at(p.x - 1 - kReach + x, n.x), voxel_at(p.y - 1 - kReach + y, n.y),
                                  voxel_at(p.z - 1 - kReach + z, n.z));
        // Axis by axis, in place: place i of four takes those from first(i) on.
        const auto add = [&](int axis, auto&& line) {
            std::int64_t four[4];
            for (int i = 0; i < 4; ++i) {
                const auto first = voxel_at(p[axis] - 1 + i, n[axis]) - (p[axis] - 1);
                four[i] = 0;
                for (int d = 0; d < kBoxSide; ++d) four[i] += line(static_cast<int>(first) + d);
            }
            for (int i = 0; i < 4; ++i) line(i) = four[i];
        };
        for (int z = 0; z < kSide; ++z)
            for (int y = 0; y < kSide; ++y) add(0, [&](int i) -> std::int64_t& { return sum[z][y][i]; });
        for (int z = 0; z < kSide; ++z)
            for (int x = 0; x < 4; ++x) add(1, [&](int i) -> std::int64_t& { return sum[z][i][x]; });
        for (int y = 0; y < 4; ++y)
            for (int x = 0; x < 4; ++x) add(2, [&](int i) -> std::int64_t& { return sum[i][y][x]; });
        Neighbourhood<W> sums;
        for (int i = 0; i < 64; ++i)
            sums.voxel[static_cast<std::size_t>(i)] = constant<W>(sum[i >> 4][i >> 2 & 3][i & 3]);
        return sums;
    }
    /// One where a cell holds a wall, else zero.
    template <class W>
    W nears_wall(const WallStage& walls, const std::array<W, 3>& at) const {
        const Cell<std::int64_t> corners =
            cell(std::array<std::int64_t, 3>{to_index(at[0]), to_index(at[1]), to_index(at[2])});
        const auto [least, greatest] = std::minmax_element(corners.corner.begin(), corners.corner.end());
        return constant<W>(walls.between(*least, *greatest) ? 1 : 0);
    }

  private:
    // N^3 voxels, from `before` voxels below a cell on, x fastest.
    template <class W, std::int64_t N>
    std::array<W, N * N * N> cube(const std::array<W, 3>& at, std::int64_t before) const {
        std::array<std::array<std::int64_t, N>, 3> place;
        for (std::size_t a = 0; a < 3; ++a)
            for (std::int64_t i = 0; i < N; ++i)
                place[a][static_cast<std::size_t>(i)] =
                    voxel_at(to_index(at[a]) + i - before, volume.dims[static_cast<int>(a)]);
        std::array<W, N * N * N> voxels;
        std::size_t i = 0;
        for (const std::int64_t z : place[2])
            for (const std::int64_t y : place[1])
                for (const std::int64_t x : place[0]) voxels[i++] = constant<W>(volume.at(x, y, z));
        return voxels;
    }
};

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
