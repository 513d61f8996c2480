// Empty space: ranges, what can be seen and distances against their definitions.
#include "pipeline/machines/lanes/blocks_met.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <random>

namespace squint::lanes {
namespace {

// Blocks of which a few are visible, at random.
struct Drawn {
    EmptySpace space;
    std::vector<Index3> visible;
};
Drawn draw(std::mt19937& random) {
    const auto between = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
    BlockRanges ranges;
    ranges.box = {Index3(between(0, 3), 0, between(0, 9)),
                  Index3(between(1, 9), between(1, 9), between(1, 9))};
    const Index3 &n = ranges.box.blocks, &low = ranges.box.low;
    const auto count = static_cast<std::size_t>(ranges.box.count());
    if (between(0, 1) == 1) ranges.of = BlockRanges::Of<std::uint16_t>();
    Drawn drawn;
    std::visit(
        [&](auto& of) {
            of.smallest.assign(count, 0), of.largest.assign(count, 0);
            for (int i = between(0, 4); i > 0; --i) {
                const Index3 at(between(0, static_cast<int>(n.x) - 1), between(0, static_cast<int>(n.y) - 1),
                                between(0, static_cast<int>(n.z) - 1));
                of.largest[static_cast<std::size_t>((at.z * n.y + at.y) * n.x + at.x)] = 200;
                drawn.visible.push_back(at + low);
            }
        },
        ranges.of);
    Entries entries;  // nothing is seen below 100
    entries.entry.resize(256);
    for (std::size_t i = 100; i < 256; ++i) entries.entry[i].extinction = 1;
    drawn.space = find_empty_space(ranges, entries, 0);
    return drawn;
}
std::int64_t apart(const Index3& a, const Index3& b) {
    return std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
}

TEST(EmptySpace, ABlockOfCellsMayBeMetWhereOneOfItsEightIsNear) {
    std::mt19937 random(4);
    for (int round = 0; round < 200; ++round) {
        const Drawn drawn = draw(random);
        const EmptySpace& space = drawn.space;
        const Index3 cells(7, 6, 11);
        const int near = std::uniform_int_distribution(0, 2)(random);
        for (std::int64_t block = 0; block < cells.x * cells.y * cells.z; ++block) {
            bool met = false, inside = false;
            for (int i = 0; i < 8; ++i) {
                const Index3 at(2 * (block % cells.x) + i % 2, 2 * (block / cells.x % cells.y) + i / 2 % 2,
                                2 * (block / (cells.x * cells.y)) + i / 4);
                if (!space.box.holds({at, Index3(1)})) continue;
                inside = true;
                for (const Index3& v : drawn.visible) met = met || apart(v, at) <= near;
            }
            ASSERT_EQ(may_be_met(space.box, &space, cells, block, near), met) << block;
            ASSERT_EQ(may_be_met(space.box, nullptr, cells, block, near), inside);
        }
    }
}

/// Voxels at random, of which most blocks hold a narrow range.
template <class T>
Volume noise(std::mt19937& random) {
    const auto between = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
    Volume volume;
    volume.dims = {between(2, 30), between(2, 30), between(2, 30)};
    volume.type = sizeof(T) == 1 ? ScalarType::u8 : ScalarType::u16;
    const auto voxels = std::make_shared<std::vector<T>>();
    for (std::int64_t z = 0; z < volume.dims.z; ++z)
        for (std::int64_t y = 0; y < volume.dims.y; ++y)
            for (std::int64_t x = 0; x < volume.dims.x; ++x)
                voxels->push_back(static_cast<T>(20 * (x / 9) + 30 * (y / 9) + 25 * (z / 9) + between(0, 5) +
                                                 (between(0, 400) == 0 ? 100 : 0)));
    volume.data = std::shared_ptr<const void>(voxels, voxels->data());
    return volume;
}

/// Ranges, and what is seen of them, against voxels and ranges looked at one by one.
template <class T>
void check_what_is_seen(std::mt19937& random) {
    const auto between = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
    const Volume volume = noise<T>(random);
    const T* voxels = static_cast<const T*>(volume.data.get());
    BlockBox box = all_blocks_of(volume);
    for (int a = 0; a < 3; ++a) {
        box.low[a] = between(0, static_cast<int>(box.blocks[a]) - 1);
        box.blocks[a] = between(1, static_cast<int>(box.blocks[a] - box.low[a]));
    }
    const Index3 n = volume.dims, blocks = box.blocks;
    const auto ranges = block_ranges(volume, box);
    const auto& of = std::get<BlockRanges::Of<T>>(ranges->of);
    ASSERT_EQ(of.smallest.size(), static_cast<std::size_t>(box.count()));
    const auto index = [&](const Index3& at) {
        return static_cast<std::size_t>((at.z * blocks.y + at.y) * blocks.x + at.x);
    };
    const auto for_all = [](const Index3& low, const Index3& high, auto&& f) {  // both ends
        for (auto z = low.z; z <= high.z; ++z)
            for (auto y = low.y; y <= high.y; ++y)
                for (auto x = low.x; x <= high.x; ++x) f(Index3(x, y, z));
    };
    for_all(Index3(0), blocks - Index3(1), [&](const Index3& at) {
        int least = 1 << 16, most = -1;
        Index3 first, last;
        for (int a = 0; a < 3; ++a)
            first[a] = (box.low[a] + at[a]) * kBlock, last[a] = std::min(first[a] + kBlock, n[a] - 1);
        for_all(first, last, [&](const Index3& v) {
            const int voxel = voxels[(v.z * n.y + v.y) * n.x + v.x];
            least = std::min(least, voxel), most = std::max(most, voxel);
        });
        ASSERT_EQ(of.smallest[index(at)], least);
        ASSERT_EQ(of.largest[index(at)], most);
    });
    Entries entries;
    entries.entry.resize(256);
    for (std::size_t i = 100; i < 110; ++i) entries.entry[i].extinction = 1;
    const int reach = between(0, 3), entry_reach = between(0, 2);
    const bool from_zero = between(0, 3) == 0;
    const EmptySpace space = find_empty_space(*ranges, entries, reach, entry_reach, from_zero);
    std::int64_t visible = 0;
    for_all(Index3(0), blocks - Index3(1), [&](const Index3& at) {
        int least = 1 << 16, most = -1;
        Index3 first, last;
        for (int a = 0; a < 3; ++a)
            first[a] = std::max<std::int64_t>(at[a] - reach, 0),
            last[a] = std::min(at[a] + reach, blocks[a] - 1);
        for_all(first, last, [&](const Index3& b) {
            least = std::min<int>(least, of.smallest[index(b)]),
            most = std::max<int>(most, of.largest[index(b)]);
        });
        if (from_zero) least = 0;
        const int more = 1 + entry_reach;  // one for a sample's rounding
        const bool seen = least - more < 110 && most + more >= 100;
        ASSERT_EQ(space.visible(box.low.x + at.x, box.low.y + at.y, box.low.z + at.z), seen);
        visible += seen;
    });
    EXPECT_EQ(space.visible_blocks, visible);
}

TEST(EmptySpace, ABlockIsSeenWithTheRangeOfThoseInReach) {
    std::mt19937 random(6);
    for (int round = 0; round < 100; ++round)
        check_what_is_seen<std::uint8_t>(random), check_what_is_seen<std::uint16_t>(random);
}

TEST(EmptySpace, ASpanIsSeenWhereOneOfItsBlocksIs) {
    std::mt19937 random(3);
    for (int round = 0; round < 200; ++round) {
        const Drawn drawn = draw(random);
        const Index3 low = drawn.space.box.low, n = drawn.space.box.blocks;
        std::size_t i = 0;
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x, ++i)
                    for (int span = 0; span < 8; ++span) {
                        const Index3 first = low + Index3(x, y, z);
                        const bool seen =
                            std::any_of(drawn.visible.begin(), drawn.visible.end(), [&](const Index3& v) {
                                const Index3 off = v - first;
                                return off.x >= 0 && off.x <= (span & 1) && off.y >= 0 &&
                                       off.y <= (span >> 1 & 1) && off.z >= 0 && off.z <= span >> 2;
                            });
                        ASSERT_EQ((drawn.space.spans[i] >> span & 1) != 0, seen);
                    }
    }
}

TEST(EmptySpace, ASecondLookFindsTheBlocksOfTwoCellsThatCanBeSeen) {
    std::mt19937 random(5);
    const auto between = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
    Entries entries;  // nothing is seen below 100
    entries.entry.resize(256);
    for (std::size_t i = 100; i < 256; ++i) entries.entry[i].extinction = 1;
    for (int round = 0; round < 60; ++round) {
        auto voxels = std::make_shared<std::vector<std::uint8_t>>();
        Volume volume;
        volume.dims = {between(2, 19), between(2, 19), between(2, 19)};
        volume.type = ScalarType::u8, volume.largest = 200;
        voxels->assign(static_cast<std::size_t>(volume.voxels()), 0);
        for (int i = between(0, 3); i > 0; --i)
            (*voxels)[static_cast<std::size_t>(between(0, static_cast<int>(volume.voxels()) - 1))] = 200;
        volume.data = std::shared_ptr<const void>(voxels, voxels->data());
        EmptySpace space = find_empty_space(*block_ranges(volume, all_blocks_of(volume)), entries, 0);
        look_again(volume, entries, space);
        const Index3 n = volume.dims, blocks = space.box.blocks + space.box.blocks;
        const auto bright = [&](const Index3& low, const Index3& high) {  // cells between, both ends
            for (auto z = low.z; z <= std::min(high.z + 1, n.z - 1); ++z)
                for (auto y = low.y; y <= std::min(high.y + 1, n.y - 1); ++y)
                    for (auto x = low.x; x <= std::min(high.x + 1, n.x - 1); ++x)
                        if ((*voxels)[static_cast<std::size_t>((z * n.y + y) * n.x + x)] > 0) return true;
            return false;
        };
        for (std::int64_t z = 0; z + 1 < blocks.z; ++z)
            for (std::int64_t y = 0; y + 1 < blocks.y; ++y)
                for (std::int64_t x = 0; x + 1 < blocks.x; ++x) {
                    const auto i = static_cast<std::size_t>((z * blocks.y + y) * blocks.x + x);
                    const Index3 low(2 * x, 2 * y, 2 * z);
                    ASSERT_EQ((space.fine[i / 32] >> i % 32 & 1) != 0, bright(low, low + Index3(3)));
                }
    }
}

TEST(EmptySpace, ACornerIsClearOfBlocksUpToTheNearestVisibleOne) {
    std::mt19937 random(2);
    for (int round = 0; round < 200; ++round) {
        const Drawn drawn = draw(random);
        const Index3 low = drawn.space.box.low, n = drawn.space.corners;
        ASSERT_EQ(n, drawn.space.box.blocks + Index3(1));
        for (std::int64_t z = 0; z < n.z; ++z)
            for (std::int64_t y = 0; y < n.y; ++y)
                for (std::int64_t x = 0; x < n.x; ++x) {
                    // So many blocks stand between the corner and the visible one's near face, along the
                    // axis where they are most.
                    std::int64_t nearest = 200;
                    for (const Index3& v : drawn.visible) {
                        const auto between = [](std::int64_t corner, std::int64_t block) {
                            return block >= corner ? block - corner : corner - block - 1;
                        };
                        nearest =
                            std::min(nearest, std::max({between(x + low.x, v.x), between(y + low.y, v.y),
                                                        between(z + low.z, v.z)}));
                    }
                    const int clear = drawn.space.clear[static_cast<std::size_t>((z * n.y + y) * n.x + x)];
                    if (nearest == 200)
                        ASSERT_EQ(clear, 255);
                    else
                        ASSERT_EQ(clear, nearest);
                }
    }
}

}  // namespace
}  // namespace squint::lanes
