#include "pipeline/machines/lanes/empty_space.h"

#include "core/parallel.h"
#include "pipeline/kept.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

namespace squint::lanes {
namespace {

// The ranges of the blocks along x at y, z of the box.
template <class T>
void measure_row(const Volume& volume, const BlockBox& box, BlockRanges::Of<T>& ranges, std::int64_t y,
                 std::int64_t z) {
    const T* data = static_cast<const T*>(volume.data.get());
    const Index3 n = volume.dims, &low = box.low, &blocks = box.blocks;
    T* smallest = ranges.smallest.data() + (z * blocks.y + y) * blocks.x;
    T* largest = ranges.largest.data() + (z * blocks.y + y) * blocks.x;
    // Fold the voxels of each line onto its blocks; a block's last voxel is its neighbour's first.
    const auto first = [](std::int64_t block) { return block * kBlock; };
    const auto last = [](std::int64_t block, std::int64_t voxels) {
        return std::min((block + 1) * kBlock, voxels - 1);
    };
    const std::int64_t from = first(low.x), end = last(low.x + blocks.x - 1, n.x) + 1;
    bool zeros = false;  // of lines that are known to be zero
    for (std::int64_t k = first(low.z + z); k <= last(low.z + z, n.z); ++k)
        for (std::int64_t j = first(low.y + y); j <= last(low.y + y, n.y); ++j) {
            const std::int64_t line = (k * n.y + j) * n.x;
            if (volume.known_zero(line + from, line + end)) {
                zeros = true;
                continue;
            }
            const T* row = data + line;
            for (std::int64_t x = 0; x < blocks.x; ++x) {
                const auto x0 = first(low.x + x), x1 = last(low.x + x, n.x);
                T least = row[x0], greatest = row[x0];
                for (std::int64_t i = x0 + 1; i <= x1; ++i)
                    least = std::min(least, row[i]), greatest = std::max(greatest, row[i]);
                smallest[x] = std::min(smallest[x], least);
                largest[x] = std::max(largest[x], greatest);
            }
        }
    if (zeros) std::fill_n(smallest, blocks.x, T{0});
}

// The Chebyshev distance to the nearest zero is one more than the least among 26 neighbours: 13 of them are
// visited on the way forth and 13 on the way back.
void spread(std::vector<std::uint8_t>& distance, const Index3& n) {
    const auto nx = static_cast<std::size_t>(n.x);
    // The rows already passed, with a place more on either side.
    std::vector<std::uint8_t> rows_passed(nx + 2);
    std::uint8_t* const nearest = rows_passed.data();
    // By value: for all that a compiler knows, a byte that is stored may be one of theirs.
    const auto pass = [&, nx, nearest](bool forth) {
        const std::int64_t before = forth ? -1 : 1;
        const auto at = [&](std::int64_t i, std::int64_t count) { return forth ? i : count - 1 - i; };
        for (std::int64_t k = 0; k < n.z; ++k)
            for (std::int64_t j = 0; j < n.y; ++j) {
                const std::int64_t z = at(k, n.z), y = at(j, n.y);
                const auto row = [&](std::int64_t dy, std::int64_t dz) -> std::uint8_t* {
                    const bool inside = y + dy >= 0 && y + dy < n.y && z + dz >= 0 && z + dz < n.z;
                    return inside ? distance.data() + ((z + dz) * n.y + y + dy) * n.x : nullptr;
                };
                std::fill_n(nearest, nx + 2, std::uint8_t{254});
                for (const std::uint8_t* passed :
                     {row(before, 0), row(-1, before), row(0, before), row(1, before)})
                    for (std::size_t x = 0; passed && x < nx; ++x)
                        nearest[x + 1] = std::min(nearest[x + 1], passed[x]);
                std::uint8_t* const here = row(0, 0);
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

// So many blocks stand between a corner and the nearest that can be seen as there are steps from the corner to
// one of that block's own.
void find_clear(EmptySpace& space) {
    const Index3 blocks = space.box.blocks, n = blocks + Index3(1);
    const auto count = static_cast<std::size_t>(n.x * n.y * n.z), nx = static_cast<std::size_t>(blocks.x);
    space.corners = n;
    space.clear.reserve(count + 3);  // lanes read four bytes at any of them
    space.clear.resize(count);
    in_parallel(n.z, [&](std::int64_t z) {
        // Of the blocks about a row of corners, one more on either side; so far their bits are 0 or 1.
        std::vector<std::uint8_t> about(nx + 2);
        std::uint8_t* const seen = about.data();
        for (std::int64_t y = 0; y < n.y; ++y) {
            std::fill_n(seen, nx + 2, std::uint8_t{0});
            for (const std::int64_t k : {z - 1, z})
                for (const std::int64_t j : {y - 1, y}) {
                    if (k < 0 || k >= blocks.z || j < 0 || j >= blocks.y) continue;
                    const std::uint8_t* row = space.spans.data() + (k * blocks.y + j) * blocks.x;
                    for (std::size_t x = 0; x < nx; ++x) seen[x + 1] |= row[x];
                }
            std::uint8_t* here = space.clear.data() + (z * n.y + y) * n.x;
            for (std::size_t x = 0; x <= nx; ++x)
                here[x] = static_cast<std::uint8_t>((seen[x] | seen[x + 1]) - 1);
        }
    });
    spread(space.clear, n);
}

// Of each block's bits, from the first.
void find_spans(EmptySpace& space) {
    const Index3 n = space.box.blocks;
    const auto nx = static_cast<std::size_t>(n.x);
    const auto slice = [&](std::int64_t z) {
        // Two bits of a block of a row: whether it, and whether it or the next, can be seen.
        const auto see = [&](std::int64_t y, std::int64_t k, std::vector<std::uint8_t>& row) {
            std::fill(row.begin(), row.end(), std::uint8_t{0});
            if (y >= n.y || k >= n.z) return;
            const std::uint8_t* spans = space.spans.data() + (k * n.y + y) * n.x;
            for (std::size_t x = 0; x < nx; ++x) row[x] = static_cast<std::uint8_t>(3 * (spans[x] & 1));
            for (std::size_t x = 0; x + 1 < nx; ++x)
                row[x] = static_cast<std::uint8_t>(row[x] | (row[x + 1] & 2));
        };
        std::vector<std::uint8_t> here(nx), above(nx), next_here(nx), next_above(nx);
        see(0, z, above), see(0, z + 1, next_above);
        for (std::int64_t y = 0; y < n.y; ++y) {
            here.swap(above), next_here.swap(next_above);
            see(y + 1, z, above), see(y + 1, z + 1, next_above);
            std::uint8_t* spans = space.spans.data() + (z * n.y + y) * n.x;
            for (std::size_t x = 0; x < nx; ++x) {
                const int along_y = here[x] | above[x], along_z = here[x] | next_here[x];
                spans[x] = static_cast<std::uint8_t>(here[x] | along_y << 2 | along_z << 4 |
                                                     (along_y | along_z | next_above[x]) << 6);
            }
        }
    };
    // A slice reads the next, which none may write meanwhile.
    for (const std::int64_t odd : {std::int64_t{0}, std::int64_t{1}})
        in_parallel((n.z - odd + 1) / 2, [&](std::int64_t pair) { slice(2 * pair + odd); });
}

template <class T>
BlockRanges::Of<T> measure_all(const Volume& volume, const BlockBox& box) {
    const auto count = static_cast<std::size_t>(box.count());
    BlockRanges::Of<T> ranges;
    ranges.smallest.assign(count, std::numeric_limits<T>::max()), ranges.largest.assign(count, 0);
    in_parallel(box.blocks.z, [&](std::int64_t z) {
        for (std::int64_t y = 0; y < box.blocks.y; ++y) measure_row<T>(volume, box, ranges, y, z);
    });
    return ranges;
}

std::shared_ptr<BlockRanges> measure(const Volume& volume, const BlockBox& box) {
    auto ranges = std::make_shared<BlockRanges>();
    ranges->box = box;
    if (volume.type == ScalarType::u8)
        ranges->of = measure_all<std::uint8_t>(volume, box);
    else
        ranges->of = measure_all<std::uint16_t>(volume, box);
    return ranges;
}

/// Which ranges of scalars hold something to be seen.
class SeenRanges {
  public:
    SeenRanges(const Entries& entries, std::uint16_t greatest, int entry_reach)
        : before_from_(greatest + 1U), before_to_(greatest + 1U) {
        // visible_before[i]: how many entries below i can be seen.
        std::vector<int> visible_before(static_cast<std::size_t>(entries.size()) + 1, 0);
        for (std::size_t i = 0; i < entries.entry.size(); ++i)
            visible_before[i + 1] = visible_before[i] + entries.entry[i].is_visible();
        // A sample's rounding may reach the next entry: one more on either side.
        const int last = entries.size() - 1, more = 1 + entry_reach;
        const auto entry_at = [&](double place) {
            return static_cast<std::size_t>(std::clamp<double>(place, 0, last));
        };
        for (std::size_t scalar = 0; scalar <= greatest; ++scalar) {
            const double entry = entries.coordinate(static_cast<double>(scalar));
            before_from_[scalar] = visible_before[entry_at(std::floor(entry) - more)];
            before_to_[scalar] = visible_before[entry_at(std::ceil(entry) + more) + 1];
        }
    }
    bool operator()(std::size_t smallest, std::size_t largest) const {
        return before_to_[largest] > before_from_[smallest];
    }

  private:
    std::vector<int> before_from_, before_to_;  // visible entries that a range from or to a scalar may reach
};

// What `choose` leaves of each block of slice z and all up to `reach` blocks away, axis by axis.
template <class T, class Choose>
std::vector<T> widened(const std::vector<T>& blocks, const Index3& n, std::int64_t z, std::int64_t reach,
                       Choose&& choose) {
    // Of `count` runs of so many blocks, those about one of them.
    const auto join = [&](const T* runs, std::int64_t run, std::int64_t count, std::int64_t at, T* joined) {
        const std::int64_t first = std::max(at - reach, std::int64_t{0}),
                           last = std::min(at + reach, count - 1);
        std::copy_n(runs + first * run, run, joined);
        for (std::int64_t i = first + 1; i <= last; ++i)
            for (std::int64_t k = 0; k < run; ++k) joined[k] = choose(joined[k], runs[i * run + k]);
    };
    std::vector<T> slice(static_cast<std::size_t>(n.x * n.y)), along_z(slice.size()),
        row(static_cast<std::size_t>(n.x));
    join(blocks.data(), n.x * n.y, n.z, z, along_z.data());
    for (std::int64_t y = 0; y < n.y; ++y) {
        join(along_z.data(), n.x, n.y, y, row.data());
        for (std::int64_t x = 0; x < n.x; ++x) join(row.data(), 1, n.x, x, slice.data() + y * n.x + x);
    }
    return slice;
}

// Bit 0 of EmptySpace::spans.
template <class T>
void find_visible(const BlockRanges::Of<T>& ranges, const SeenRanges& can_be_seen, int reach, bool from_zero,
                  EmptySpace& space) {
    const Index3 n = space.box.blocks;
    const auto count = static_cast<std::size_t>(space.box.count());
    space.spans.reserve(count + 3);  // lanes read four bytes at any of them
    space.spans.resize(count);
    std::atomic<std::int64_t> visible{0};
    in_parallel(n.z, [&](std::int64_t z) {
        const std::int64_t blocks = n.x * n.y;
        const T* smallest = ranges.smallest.data() + z * blocks;
        const T* largest = ranges.largest.data() + z * blocks;
        std::vector<T> least, most;
        if (reach > 0) {
            least = widened(ranges.smallest, n, z, reach, [](T a, T b) { return std::min(a, b); });
            most = widened(ranges.largest, n, z, reach, [](T a, T b) { return std::max(a, b); });
            smallest = least.data(), largest = most.data();
        }
        std::uint8_t* spans = space.spans.data() + z * blocks;
        std::int64_t here = 0;
        for (std::int64_t i = 0; i < blocks; ++i) {
            spans[i] = can_be_seen(from_zero ? T{0} : smallest[i], largest[i]);
            here += spans[i];
        }
        visible += here;
    });
    space.visible_blocks = visible;
}

/// Which blocks of half a side can be seen: a byte each, x fastest.
template <class T>
std::vector<std::uint8_t> seen_in_halves(const Volume& volume, const SeenRanges& can_be_seen,
                                         const EmptySpace& space) {
    constexpr std::int64_t kHalf = kBlock / 2;
    const T* data = static_cast<const T*>(volume.data.get());
    const Index3 &n = volume.dims, &low = space.box.low, &blocks = space.box.blocks;
    std::vector<std::uint8_t> seen(static_cast<std::size_t>(8 * space.box.count()));
    const auto look = [&](const Index3& block) {
        // The voxels along x of each line, folded onto two halves; the middle one is in both.
        std::int64_t at[3][kBlock + 1];
        for (int a = 0; a < 3; ++a)
            for (std::int64_t i = 0; i <= kBlock; ++i)
                at[a][i] = std::min((low[a] + block[a]) * kBlock + i, n[a] - 1);
        T least[2][2][2], most[2][2][2];
        std::fill_n(&least[0][0][0], 8, std::numeric_limits<T>::max()), std::fill_n(&most[0][0][0], 8, T{0});
        for (std::int64_t k = 0; k <= kBlock; ++k)
            for (std::int64_t j = 0; j <= kBlock; ++j) {
                const T* line = data + (at[2][k] * n.y + at[1][j]) * n.x;
                T from[2], to[2];
                for (int x = 0; x < 2; ++x) {
                    const T a = line[at[0][kHalf * x]], b = line[at[0][kHalf * x + 1]],
                            c = line[at[0][kHalf * x + 2]];
                    from[x] = std::min(a, std::min(b, c)), to[x] = std::max(a, std::max(b, c));
                }
                for (int z = k > kHalf; z <= (k >= kHalf); ++z)
                    for (int y = j > kHalf; y <= (j >= kHalf); ++y)
                        for (int x = 0; x < 2; ++x) {
                            least[z][y][x] = std::min(least[z][y][x], from[x]);
                            most[z][y][x] = std::max(most[z][y][x], to[x]);
                        }
            }
        for (int z = 0; z < 2; ++z)
            for (int y = 0; y < 2; ++y)
                for (int x = 0; x < 2; ++x)
                    seen[static_cast<std::size_t>(
                        ((2 * block.z + z) * 2 * blocks.y + 2 * block.y + y) * 2 * blocks.x + 2 * block.x +
                        x)] = can_be_seen(least[z][y][x], most[z][y][x]);
    };
    in_parallel(blocks.z, [&](std::int64_t z) {
        for (std::int64_t y = 0; y < blocks.y; ++y)
            for (std::int64_t x = 0; x < blocks.x; ++x)
                if (space.visible(low.x + x, low.y + y, low.z + z)) look(Index3(x, y, z));
    });
    return seen;
}

}  // namespace

bool BlockBox::holds(const BlockBox& other) const {
    for (int a = 0; a < 3; ++a)
        if (other.low[a] < low[a] || other.low[a] + other.blocks[a] > low[a] + blocks[a]) return false;
    return true;
}

BlockBox all_blocks_of(const Volume& volume) {
    const auto cells = [](std::int64_t n) {
        return std::max<std::int64_t>((n - 1 + kBlock - 1) / kBlock, 1);
    };
    return {Index3(0), Index3(cells(volume.dims.x), cells(volume.dims.y), cells(volume.dims.z))};
}

std::shared_ptr<const BlockRanges> block_ranges(const Volume& volume, const BlockBox& box) {
    static KeptPerVolume<BlockRanges> kept;
    return kept.find(
        volume, [&] { return measure(volume, box); },
        [&](const BlockRanges& ranges) { return ranges.box.holds(box); });
}

EmptySpace find_empty_space(const BlockRanges& ranges, const Entries& entries, int reach, int entry_reach,
                            bool from_zero) {
    EmptySpace space;
    space.box = ranges.box;
    std::visit(
        [&](const auto& of) {
            const auto greatest = *std::max_element(of.largest.begin(), of.largest.end());
            find_visible(of, SeenRanges(entries, greatest, entry_reach), reach, from_zero, space);
        },
        ranges.of);
    find_clear(space);
    find_spans(space);
    return space;
}

void look_again(const Volume& volume, const Entries& entries, EmptySpace& space) {
    // Few enough that a new transfer function does not wait for them, and that caches hold their bits.
    constexpr std::int64_t kMostVisible = 1 << 16;
    if (space.visible_blocks > kMostVisible || space.box.count() > EmptySpace::kMostInHalves) return;
    const SeenRanges can_be_seen(entries, static_cast<std::uint16_t>(volume.largest), 0);
    std::vector<std::uint8_t> seen = volume.type == ScalarType::u8
                                         ? seen_in_halves<std::uint8_t>(volume, can_be_seen, space)
                                         : seen_in_halves<std::uint16_t>(volume, can_be_seen, space);
    // Each with the next, axis by axis; a block past the end of a line is the next line's, and does no harm.
    const Index3& n = space.box.blocks;
    for (const std::int64_t stride : {std::int64_t{1}, 2 * n.x, 4 * n.x * n.y})
        for (std::size_t i = 0, next = static_cast<std::size_t>(stride); next < seen.size(); ++i, ++next)
            seen[i] |= seen[next];
    space.fine.assign((seen.size() + 31) / 32, 0);
    for (std::size_t i = 0; i < seen.size(); ++i)
        space.fine[i / 32] |= static_cast<std::uint32_t>(seen[i]) << i % 32;
}

}  // namespace squint::lanes
