// Empty space: distances against their definition.
#include "pipeline/machines/lanes/empty_space.h"

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
    ranges.smallest.assign(count, 0), ranges.largest.assign(count, 0);
    Drawn drawn;
    for (int i = between(0, 4); i > 0; --i) {
        const Index3 at(between(0, static_cast<int>(n.x) - 1), between(0, static_cast<int>(n.y) - 1),
                        between(0, static_cast<int>(n.z) - 1));
        ranges.largest[static_cast<std::size_t>((at.z * n.y + at.y) * n.x + at.x)] = 200;
        drawn.visible.push_back(at + low);
    }
    Entries entries;  // nothing is seen below 100
    entries.entry.resize(256);
    for (std::size_t i = 100; i < 256; ++i) entries.entry[i].extinction = 1;
    drawn.space = find_empty_space(ranges, entries, 0);
    return drawn;
}
std::int64_t apart(const Index3& a, const Index3& b) {
    return std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
}

TEST(EmptySpace, ABlocksDistanceIsThatOfTheNearestVisibleOne) {
    std::mt19937 random(1);
    for (int round = 0; round < 200; ++round) {
        const Drawn drawn = draw(random);
        const Index3 low = drawn.space.box.low, end = low + drawn.space.box.blocks;
        for (auto z = low.z; z < end.z; ++z)
            for (auto y = low.y; y < end.y; ++y)
                for (auto x = low.x; x < end.x; ++x) {
                    std::int64_t nearest = 200;
                    for (const Index3& v : drawn.visible) nearest = std::min(nearest, apart(v, {x, y, z}));
                    if (nearest == 200)
                        ASSERT_GE(drawn.space.at(x, y, z), 200);
                    else
                        ASSERT_EQ(drawn.space.at(x, y, z), nearest);
                }
    }
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
                        ASSERT_GE(clear, 200);
                    else
                        ASSERT_EQ(clear, nearest);
                }
    }
}

}  // namespace
}  // namespace squint::lanes
