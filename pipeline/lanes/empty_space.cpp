#include "pipeline/lanes/empty_space.h"

#include "pipeline/lanes/kept.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace squint::lanes {
namespace {

template <class T>
void measure_slab(const Volume& volume, BlockRanges& ranges, std::int64_t bz) {
    const T* data = static_cast<const T*>(volume.data.get());
    const Index3 n = volume.dims;
    // The voxels of a row, folded onto its blocks; a block's last voxel is its neighbour's first.
    const auto z0 = bz * kBlock, z1 = std::min(z0 + kBlock, n.z - 1);
    for (std::int64_t by = 0; by < ranges.blocks.y; ++by) {
        const auto y0 = by * kBlock, y1 = std::min(y0 + kBlock, n.y - 1);
        for (std::int64_t z = z0; z <= z1; ++z)
            for (std::int64_t y = y0; y <= y1; ++y) {
                const T* row = data + (z * n.y + y) * n.x;
                for (std::int64_t bx = 0; bx < ranges.blocks.x; ++bx) {
                    const auto x0 = bx * kBlock, x1 = std::min(x0 + kBlock, n.x - 1);
                    T low = row[x0], high = row[x0];
                    for (std::int64_t x = x0 + 1; x <= x1; ++x)
                        low = std::min(low, row[x]), high = std::max(high, row[x]);
                    const auto at = static_cast<std::size_t>(ranges.index(bx, by, bz));
                    ranges.smallest[at] = std::min<std::uint16_t>(ranges.smallest[at], low);
                    ranges.largest[at] = std::max<std::uint16_t>(ranges.largest[at], high);
                }
            }
    }
}

// Chebyshev distance to the nearest zero: one more than the nearest of a block's 26 neighbours has, 13 of
// them on the way forth and 13 on the way back.
void spread(std::vector<std::uint8_t>& distance, const Index3& blocks) {
    const auto nx = static_cast<std::size_t>(blocks.x);
    std::vector<std::uint8_t> nearest(nx +
                                      2);  // of the rows already passed, with a block more on either side
    const auto pass = [&](bool forth) {
        const std::int64_t before = forth ? -1 : 1;
        const auto at = [&](std::int64_t i, std::int64_t count) { return forth ? i : count - 1 - i; };
        for (std::int64_t k = 0; k < blocks.z; ++k)
            for (std::int64_t j = 0; j < blocks.y; ++j) {
                const std::int64_t z = at(k, blocks.z), y = at(j, blocks.y);
                const auto row = [&](std::int64_t dy, std::int64_t dz) -> std::uint8_t* {
                    const bool inside = y + dy >= 0 && y + dy < blocks.y && z + dz >= 0 && z + dz < blocks.z;
                    return inside ? distance.data() + ((z + dz) * blocks.y + y + dy) * blocks.x : nullptr;
                };
                std::fill(nearest.begin(), nearest.end(), std::uint8_t{254});
                for (const std::uint8_t* passed :
                     {row(before, 0), row(-1, before), row(0, before), row(1, before)})
                    for (std::size_t x = 0; passed && x < nx; ++x)
                        nearest[x + 1] = std::min(nearest[x + 1], passed[x]);
                std::uint8_t* here = row(0, 0);
                for (std::size_t x = 0; x < nx; ++x) {
                    const std::uint8_t around =
                        std::min(nearest[x], std::min(nearest[x + 1], nearest[x + 2]));
                    here[x] = std::min(here[x], static_cast<std::uint8_t>(around + 1));
                }
                int last = 254;
                for (std::size_t i = 0; i < nx; ++i) {
                    std::uint8_t& d = here[forth ? i : nx - 1 - i];
                    last = std::min<int>(d, last + 1);
                    d = static_cast<std::uint8_t>(last);
                }
            }
    };
    pass(true), pass(false);
}

// Each block's range with its 26 neighbours': axis by axis.
void widen(BlockRanges& ranges) {
    const Index3 n = ranges.blocks;
    const auto pass = [&](std::int64_t stride, std::int64_t count) {
        const BlockRanges old = ranges;
        tbb::parallel_for(std::int64_t{0}, n.z, [&](std::int64_t z) {
            for (std::int64_t i = z * n.x * n.y; i < (z + 1) * n.x * n.y; ++i) {
                const std::int64_t place = i / stride % count;
                const auto at = static_cast<std::size_t>(i);
                for (const std::int64_t step : {std::int64_t{-1}, std::int64_t{1}}) {
                    if (place + step < 0 || place + step >= count) continue;
                    const auto other = static_cast<std::size_t>(i + step * stride);
                    ranges.smallest[at] = std::min(ranges.smallest[at], old.smallest[other]);
                    ranges.largest[at] = std::max(ranges.largest[at], old.largest[other]);
                }
            }
        });
    };
    pass(1, n.x), pass(n.x, n.y), pass(n.x * n.y, n.z);
}

}  // namespace

namespace {
std::shared_ptr<BlockRanges> measure(const Volume& volume) {
    auto ranges = std::make_shared<BlockRanges>();
    const auto cells = [](std::int64_t n) {
        return std::max<std::int64_t>((n - 1 + kBlock - 1) / kBlock, 1);
    };
    ranges->blocks = Index3(cells(volume.dims.x), cells(volume.dims.y), cells(volume.dims.z));
    const auto count = static_cast<std::size_t>(ranges->blocks.x * ranges->blocks.y * ranges->blocks.z);
    ranges->smallest.assign(count, 0xffff), ranges->largest.assign(count, 0);
    tbb::parallel_for(std::int64_t{0}, ranges->blocks.z, [&](std::int64_t bz) {
        if (volume.type == ScalarType::u8)
            measure_slab<std::uint8_t>(volume, *ranges, bz);
        else
            measure_slab<std::uint16_t>(volume, *ranges, bz);
    });
    return ranges;
}
}  // namespace

std::shared_ptr<const BlockRanges> block_ranges(const Volume& volume) {
    static KeptPerVolume<BlockRanges> kept;
    return kept.find(
        volume, [&] { return measure(volume); }, [](const BlockRanges&) { return true; });
}

EmptySpace find_empty_space(const BlockRanges& ranges, const Entries& entries, int reach, int entry_reach) {
    // visible_before[i]: entries below i in which anything can be seen.
    std::vector<int> visible_before(static_cast<std::size_t>(entries.size()) + 1, 0);
    for (std::size_t i = 0; i < entries.entry.size(); ++i)
        visible_before[i + 1] =
            visible_before[i] + (entries.entry[i].extinction > 0 || entries.entry[i].opaque);
    // A sample's rounding may reach the next entry: one more on either side.
    const int last = entries.size() - 1, more = 1 + entry_reach;
    const auto entry_at = [&](double place) {
        return static_cast<std::size_t>(std::clamp<double>(place, 0, last));
    };
    std::uint16_t greatest = 0;
    for (const std::uint16_t scalar : ranges.largest) greatest = std::max(greatest, scalar);
    std::vector<int> before_from(greatest + 1U),
        before_to(greatest + 1U);  // visible entries below a scalar's
    for (std::size_t scalar = 0; scalar <= greatest; ++scalar) {
        const double entry = entries.coordinate(static_cast<double>(scalar));
        before_from[scalar] = visible_before[entry_at(std::floor(entry) - more)];
        before_to[scalar] = visible_before[entry_at(std::ceil(entry) + more) + 1];
    }

    BlockRanges widened;
    if (reach > 0) widened = ranges;
    for (int i = 0; i < reach; ++i) widen(widened);
    const BlockRanges& seen = reach > 0 ? widened : ranges;
    EmptySpace space;
    const Index3 n = space.blocks = ranges.blocks;
    space.distance.reserve(ranges.smallest.size() + 3);  // lanes read four bytes at any of them
    space.distance.assign(ranges.smallest.size(), 255);
    std::atomic<std::int64_t> visible{0};
    tbb::parallel_for(std::int64_t{0}, n.z, [&](std::int64_t z) {
        std::int64_t here = 0;
        for (std::int64_t i = z * n.x * n.y; i < (z + 1) * n.x * n.y; ++i) {
            const auto at = static_cast<std::size_t>(i);
            if (before_to[seen.largest[at]] > before_from[seen.smallest[at]]) space.distance[at] = 0, ++here;
        }
        visible += here;
    });
    space.visible_blocks = visible;
    spread(space.distance, n);
    return space;
}

}  // namespace squint::lanes
