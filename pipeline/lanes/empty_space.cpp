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

// Distance to the nearest zero along x, then y, then z: separable for the Chebyshev distance only as a
// dilation, so each pass takes min over the line of max(|offset|, distance so far).
void spread(std::vector<std::uint8_t>& distance, const Index3& blocks) {
    const auto pass = [&](std::int64_t count, std::int64_t stride, std::int64_t lines, auto&& start) {
        tbb::parallel_for(std::int64_t{0}, lines, [&](std::int64_t line) {
            std::vector<std::uint8_t> in(static_cast<std::size_t>(count));
            std::uint8_t* base = distance.data() + start(line);
            for (std::int64_t i = 0; i < count; ++i) in[static_cast<std::size_t>(i)] = base[i * stride];
            for (std::int64_t i = 0; i < count; ++i) {
                int best = in[static_cast<std::size_t>(i)];
                for (std::int64_t j = 1; j < best; ++j) {
                    const auto left = i - j, right = i + j;
                    if (left >= 0)
                        best = std::min(best, std::max(static_cast<int>(j),
                                                       static_cast<int>(in[static_cast<std::size_t>(left)])));
                    if (right < count)
                        best =
                            std::min(best, std::max(static_cast<int>(j),
                                                    static_cast<int>(in[static_cast<std::size_t>(right)])));
                }
                base[i * stride] = static_cast<std::uint8_t>(best);
            }
        });
    };
    const auto nx = blocks.x, ny = blocks.y, nz = blocks.z;
    pass(nx, 1, ny * nz, [=](std::int64_t line) { return line * nx; });
    pass(ny, nx, nx * nz, [=](std::int64_t line) { return line / nx * nx * ny + line % nx; });
    pass(nz, nx * ny, nx * ny, [=](std::int64_t line) { return line; });
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

EmptySpace find_empty_space(const BlockRanges& ranges, const Entries& entries, bool between_samples,
                            int entry_reach) {
    // visible_before[i]: entries below i in which anything can be seen.
    std::vector<int> visible_before(static_cast<std::size_t>(entries.size()) + 1, 0);
    for (std::size_t i = 0; i < entries.entry.size(); ++i)
        visible_before[i + 1] =
            visible_before[i] + (entries.entry[i].extinction > 0 || entries.entry[i].opaque);
    const int last = entries.size() - 1;
    const auto any_between = [&](double low, double high) {
        // A sample's rounding may reach the next entry: one more on either side.
        const int more = 1 + entry_reach;
        const int first = std::clamp(static_cast<int>(std::floor(entries.coordinate(low))) - more, 0, last);
        const int beyond = std::clamp(static_cast<int>(std::ceil(entries.coordinate(high))) + more, 0, last);
        return visible_before[static_cast<std::size_t>(beyond) + 1] >
               visible_before[static_cast<std::size_t>(first)];
    };
    EmptySpace space;
    const Index3 n = space.blocks = ranges.blocks;
    space.distance.reserve(ranges.smallest.size() + 3);  // lanes read four bytes at any of them
    space.distance.assign(ranges.smallest.size(), 255);
    const int reach = between_samples ? 1 : 0;
    std::atomic<std::int64_t> visible{0};
    tbb::parallel_for(std::int64_t{0}, n.z, [&](std::int64_t z) {
        std::int64_t here = 0;
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                std::uint16_t low = 0xffff, high = 0;
                for (auto dz = std::max<std::int64_t>(z - reach, 0); dz <= std::min(z + reach, n.z - 1); ++dz)
                    for (auto dy = std::max<std::int64_t>(y - reach, 0); dy <= std::min(y + reach, n.y - 1);
                         ++dy)
                        for (auto dx = std::max<std::int64_t>(x - reach, 0);
                             dx <= std::min(x + reach, n.x - 1); ++dx) {
                            const auto at = static_cast<std::size_t>(ranges.index(dx, dy, dz));
                            low = std::min(low, ranges.smallest[at]),
                            high = std::max(high, ranges.largest[at]);
                        }
                if (any_between(low, high))
                    space.distance[static_cast<std::size_t>(ranges.index(x, y, z))] = 0, ++here;
            }
        visible += here;
    });
    space.visible_blocks = visible;
    spread(space.distance, n);
    return space;
}

}  // namespace squint::lanes
