// Exaggerated gradients of the fast path: place by place, in the model's words, from sums that neighbours share.
#pragma once

#include "pipeline/machines/lanes/packet.h"
#include "pipeline/plan/plan.h"
#include "pipeline/stages/gradient-inl.h"

#include <array>
#include <cstdint>
#include <vector>

namespace squint::lanes {

/// Sums over the 5^3 voxels about a volume's voxels, in bricks of 8^3 sums: made where one is asked for, and kept until
/// another takes its place.  Not for two threads at once.
class BoxSums {
  public:
    explicit BoxSums(const Volume& volume) : volume_(volume) {}
    /// Those of the neighbourhood of a cell, as FromVolume::box_sums has them.
    HWY_NAMESPACE::Neighbourhood<std::int64_t> box_sums(const std::array<std::int64_t, 3>& cell);

  private:
    static constexpr int kBits = 3, kSide = 1 << kBits;  // of a brick
    static constexpr int kAcross = 8, kDeep = 4;         // bricks that are kept side by side: x and y, z
    using Brick = std::array<std::int32_t, std::size_t{kSide} * kSide * kSide>;

    const Brick& brick_at(const Index3& brick);
    template <class T>
    void add_up(const Index3& brick, Brick& sums) const;

    const Volume& volume_;
    std::vector<std::int64_t> kept_;  // which brick, -1: none; empty until one is asked for
    std::vector<Brick> bricks_;
};

/// Replaces the raw gradients at the first `count` packed places by their exaggerated ones.
void exaggerate(const Plan& plan, int count, BoxSums& sums, LitSamples& places);

}  // namespace squint::lanes
