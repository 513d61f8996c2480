#include "pipeline/machines/lanes/exaggerated.h"

#include "pipeline/slab-inl.h"

namespace squint::lanes {

using namespace HWY_NAMESPACE;

template <class T>
void BoxSums::add_up(const Index3& brick, Brick& sums) const {
    constexpr int kReach = kBoxSide / 2, kRead = kSide + 2 * kReach;  // voxels a side that are read
    const Index3 &n = volume_.dims, first = brick * kSide - Index3(kReach);
    const T* voxels = static_cast<const T*>(volume_.data.get());
    std::int64_t column[kRead];
    for (int x = 0; x < kRead; ++x) column[x] = voxel_at(first.x + x, n.x);
    // Axis by axis; a sum is the one before it, a voxel further on.
    const auto slide = [](const auto& at, auto&& to) {
        std::int32_t sum = 0;
        for (int i = 0; i < kRead; ++i) {
            sum += at(i);
            if (i < kBoxSide - 1) continue;
            to(i - kBoxSide + 1) = sum;
            sum -= at(i - kBoxSide + 1);
        }
    };
    std::int32_t along_x[kRead][kRead][kSide], along_xy[kRead][kSide][kSide];
    for (int z = 0; z < kRead; ++z) {
        for (int y = 0; y < kRead; ++y) {
            const T* row = voxels + n.x * (voxel_at(first.y + y, n.y) + n.y * voxel_at(first.z + z, n.z));
            slide([&](int i) { return std::int32_t{row[column[i]]}; },
                  [&](int i) -> std::int32_t& { return along_x[z][y][i]; });
        }
        for (int x = 0; x < kSide; ++x)
            slide([&](int i) { return along_x[z][i][x]; },
                  [&](int i) -> std::int32_t& { return along_xy[z][i][x]; });
    }
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x)
            slide([&](int i) { return along_xy[i][y][x]; },
                  [&](int i) -> std::int32_t& {
                      return sums[static_cast<std::size_t>((i * kSide + y) * kSide + x)];
                  });
}

const BoxSums::Brick& BoxSums::brick_at(const Index3& brick) {
    constexpr std::size_t kBricks = std::size_t{kAcross} * kAcross * kDeep;
    if (kept_.empty()) kept_.assign(kBricks, -1), bricks_.resize(kBricks);
    const auto slot = static_cast<std::size_t>(((brick.z % kDeep) * kAcross + brick.y % kAcross) * kAcross +
                                               brick.x % kAcross);
    const Index3& n = volume_.dims;
    const std::int64_t number = (brick.z * n.y + brick.y) * n.x + brick.x;
    if (kept_[slot] != number) {
        kept_[slot] = number;
        if (volume_.type == ScalarType::u8)
            add_up<std::uint8_t>(brick, bricks_[slot]);
        else
            add_up<std::uint16_t>(brick, bricks_[slot]);
    }
    return bricks_[slot];
}

Neighbourhood<std::int64_t> BoxSums::box_sums(const std::array<std::int64_t, 3>& cell) {
    // Of four voxels in a row the first ones lie in one brick and the others in the next.
    std::array<std::array<std::int64_t, 4>, 3> place;
    std::array<std::array<bool, 4>, 3> is_next;
    Index3 first;
    for (int a = 0; a < 3; ++a)
        for (std::size_t i = 0; i < 4; ++i) {
            const auto axis = static_cast<std::size_t>(a);
            const std::int64_t at = voxel_at(cell[axis] - 1 + static_cast<std::int64_t>(i), volume_.dims[a]);
            if (i == 0) first[a] = at >> kBits;
            place[axis][i] = at % kSide, is_next[axis][i] = at >> kBits != first[a];
        }
    std::array<const Brick*, 8> bricks{};
    for (std::size_t i = 0; i < 8; ++i) {
        const bool x = i & 1, y = i >> 1 & 1, z = i >> 2;
        if ((x && !is_next[0][3]) || (y && !is_next[1][3]) || (z && !is_next[2][3])) continue;
        bricks[i] = &brick_at(first + Index3(x, y, z));
    }
    Neighbourhood<std::int64_t> sums;
    std::size_t to = 0;
    for (std::size_t z = 0; z < 4; ++z)
        for (std::size_t y = 0; y < 4; ++y) {
            const std::size_t beside = (is_next[2][z] ? 4U : 0U) + (is_next[1][y] ? 2U : 0U);
            const auto row = static_cast<std::size_t>((place[2][z] * kSide + place[1][y]) * kSide);
            for (std::size_t x = 0; x < 4; ++x)
                sums.voxel[to++] =
                    (*bricks[beside + (is_next[0][x] ? 1U : 0U)])[row +
                                                                  static_cast<std::size_t>(place[0][x])];
        }
    return sums;
}

void exaggerate(const Plan& plan, int count, BoxSums& sums, LitSamples& places) {
    using Vector = std::array<std::int64_t, 3>;
    const auto at = [](const Batch(&from)[3], int i) {
        return Vector{from[0].v[i], from[1].v[i], from[2].v[i]};
    };
    for (int i = 0; i < count; ++i) {
        const Vector gradient = exaggerated_gradient(plan, sums, at(places.cell, i), at(places.weight, i),
                                                     at(places.gradient, i));
        for (std::size_t a = 0; a < 3; ++a) places.gradient[a].v[i] = static_cast<Word>(gradient[a]);
    }
}

}  // namespace squint::lanes
