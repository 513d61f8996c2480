#include "pipeline/machines/lanes/near_walls.h"

#include "core/parallel.h"
#include "pipeline/kept.h"
#include "pipeline/stages/faces.h"

#include <algorithm>

namespace squint::lanes {
namespace {

// The bits of the block whose first cell is at (x, y, z).
template <class T>
void mark_block(const Volume& volume, const WallStage& walls, const Index3& first, std::uint32_t* bits) {
    const Index3& n = volume.dims;
    const T* data = static_cast<const T*>(volume.data.get());
    constexpr int kVoxels = kBlock + 1;
    T voxel[kVoxels][kVoxels][kVoxels];
    for (int z = 0; z < kVoxels; ++z)
        for (int y = 0; y < kVoxels; ++y) {
            const T* row = data + n.x * (voxel_at(first.y + y, n.y) + n.y * voxel_at(first.z + z, n.z));
            for (int x = 0; x < kVoxels; ++x) voxel[z][y][x] = row[voxel_at(first.x + x, n.x)];
        }
    for (int z = 0, cell = 0; z < kBlock; ++z)
        for (int y = 0; y < kBlock; ++y)
            for (int x = 0; x < kBlock; ++x, ++cell) {
                T least = voxel[z][y][x], greatest = least;
                for (int i = 1; i < 8; ++i) {
                    const T corner = voxel[z + (i >> 2)][y + (i >> 1 & 1)][x + (i & 1)];
                    least = std::min(least, corner), greatest = std::max(greatest, corner);
                }
                if (walls.between(least, greatest)) bits[cell / 32] |= 1U << cell % 32;
            }
}

// Of four cells along an axis, the twos in whose reach each one is: those from the one before the first on.
constexpr int kReach[kBlock][2] = {{0, 1}, {1, 2}, {1, 2}, {2, 3}};
// The twos in reach of any of four cells along x, bit i of `cells` cell i, the two before the first in bit 0.
constexpr std::uint32_t in_reach(std::uint32_t cells) {
    std::uint32_t twos = 0;
    for (int x = 0; x < kBlock; ++x)
        if (cells >> x & 1) twos |= 1U << kReach[x][0] | 1U << kReach[x][1];
    return twos;
}

// Fills `about` from `bits`, a layer of it at a time.
void mark_about(NearWalls& near) {
    const Index3& n = near.box.blocks;
    const std::int64_t row_words = NearWalls::words_a_row(near.box);
    near.about.assign(static_cast<std::size_t>(NearWalls::words_about(near.box)), 0);
    const auto mark_row = [&](std::int64_t row, std::int64_t first, std::uint32_t twos) {
        for (int i = 0; i < 4; ++i)
            if (const std::int64_t x = first + i; twos >> i & 1 && x >= 0 && x < 2 * n.x)
                near.about[static_cast<std::size_t>(row * row_words + x / 32)] |= 1U << x % 32;
    };
    // Of the sixteen cells of a block's layer.
    const auto mark_layer = [&](std::int64_t layer, std::int64_t x, std::int64_t y, std::uint32_t cells) {
        for (int line = 0; line < kBlock; ++line)
            if (const std::uint32_t twos = in_reach(cells >> kBlock * line & 15); twos != 0)
                for (const int reach : kReach[line])
                    if (const std::int64_t two = 2 * y - 1 + reach; two >= 0 && two < 2 * n.y)
                        mark_row(layer * 2 * n.y + two, 2 * x - 1, twos);
    };
    in_parallel(2 * n.z, [&](std::int64_t layer) {
        const std::int64_t last = std::min(2 * layer + 2, kBlock * n.z - 1);
        for (std::int64_t z = std::max(2 * layer - 1, std::int64_t{0}); z <= last; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x) {
                    const std::int64_t block = ((z >> kBlockBits) * n.y + y) * n.x + x;
                    const std::int64_t cells = z % kBlock * kBlock * kBlock;
                    const std::uint32_t word =
                        near.bits[static_cast<std::size_t>(block * NearWalls::kWords + cells / 32)];
                    if (word != 0) mark_layer(layer, x, y, word >> cells % 32 & 0xFFFF);
                }
    });
}

NearWalls find_walls(const Volume& volume, const BlockBox& box, const WallStage& walls) {
    const std::shared_ptr<const BlockRanges> ranges = block_ranges(volume, box);
    NearWalls near{box, {}, {}};
    near.bits.assign(static_cast<std::size_t>(box.count()) * NearWalls::kWords, 0);
    const Index3 &n = box.blocks, &known = ranges->box.blocks;
    const auto mark = [&]<class T>(const BlockRanges::Of<T>& of) {
        in_parallel(n.z, [&](std::int64_t z) {
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x) {
                    const Index3 block = box.low + Index3(x, y, z), there = block - ranges->box.low;
                    const auto in_ranges =
                        static_cast<std::size_t>((there.z * known.y + there.y) * known.x + there.x);
                    if (!walls.between(of.smallest[in_ranges], of.largest[in_ranges])) continue;
                    const Index3 first(block.x * kBlock, block.y * kBlock, block.z * kBlock);
                    mark_block<T>(volume, walls, first,
                                  near.bits.data() + ((z * n.y + y) * n.x + x) * NearWalls::kWords);
                }
        });
    };
    std::visit(mark, ranges->of);
    mark_about(near);
    return near;
}

struct Keyed {
    WallStage walls;
    NearWalls near;
};

}  // namespace

std::shared_ptr<const NearWalls> near_walls(const Volume& volume, const BlockBox& box,
                                            const WallStage& walls) {
    static KeptPerVolume<Keyed> kept;
    const std::shared_ptr<Keyed> found = kept.find_or_make(
        volume,
        [&] {
            return std::make_shared<Keyed>(Keyed{walls, find_walls(volume, box, walls)});
        },
        [&](const Keyed& k) { return k.walls == walls && k.near.box.holds(box); });
    return {found, &found->near};
}

}  // namespace squint::lanes
