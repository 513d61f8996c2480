// X1's sums in vectors: the bits they have an entry at a time, on every SIMD target of this machine.
#include "pipeline/classification/tables/light_sums.h"

#include "pipeline/classification/tables/prefix_tables.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

namespace squint {
namespace {

/// Entries of any size from fog to walls, some of them empty.
std::vector<Entry> drawn(int count) {
    std::mt19937_64 random(count);
    std::uniform_real_distribution<double> any(0, 1);
    std::vector<Entry> entries;
    for (int i = 0; i < count; ++i) {
        const double red = any(random), green = any(random), blue = any(random);
        const double extinction = any(random) < 0.2 ? 0 : std::exp2(30 * any(random) - 20);
        entries.push_back({{red, green, blue}, any(random), extinction, false});
    }
    return entries;
}
void on_every_target(const std::function<void()>& check) {
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        SCOPED_TRACE(hwy::TargetName(target));
        check();
    }
    hwy::SetSupportedTargetsForTest(0);
}

TEST(LightSums, AreThoseOfAnEntryAtATimeOnEveryTarget) {
    on_every_target([] {
        for (const int count : {2, 3, 17, 4096}) {
            const std::vector<Entry> entries = drawn(count);
            std::vector<double> sums(3 * entries.size() + 1);
            write_light_sums(entries, 0.3, sums.data());
            Vec3 sum{0, 0, 0};
            double largest = 0;
            for (std::size_t i = 0; i < entries.size(); ++i)
                for (int c = 0; c < 3; ++c) {
                    if (i > 0) {
                        const Entry &a = entries[i - 1], &b = entries[i];
                        sum[c] +=
                            preintegration::colored_depth(a.color[c], a.extinction, b.color[c], b.extinction);
                        largest = std::max(largest, std::abs(b.color[c] - a.color[c]));
                    }
                    ASSERT_EQ(sums[3 * i + static_cast<std::size_t>(c)], sum[c] * 0.3) << count << ' ' << i;
                }
            EXPECT_EQ(largest_swing(entries), largest);
        }
    });
}

TEST(LightSums, StandBesideTheDepthsRowByRow) {
    on_every_target([] {
        for (const int rows : {2, 5, 1000})
            for (const int stride : {1, 2}) {
                std::mt19937 random(7);
                std::vector<std::int32_t> depth(static_cast<std::size_t>(rows * stride)),
                    light(static_cast<std::size_t>(rows * 3)), joined(static_cast<std::size_t>(rows * 4));
                for (auto* words : {&depth, &light})
                    for (std::int32_t& word : *words) word = static_cast<std::int32_t>(random() >> 2);
                const std::int32_t most = join_rows(depth.data(), stride, light.data(), rows, joined.data());
                std::int32_t largest = 0;
                for (int i = 0; i < rows; ++i)
                    for (int c = 0; c < 4; ++c) {
                        const auto word = [&](int row) {
                            return c == 0 ? depth[static_cast<std::size_t>(row * stride)]
                                          : light[static_cast<std::size_t>(3 * row + c - 1)];
                        };
                        ASSERT_EQ(joined[static_cast<std::size_t>(4 * i + c)], word(i));
                        if (i > 0) largest = std::max(largest, word(i) - word(i - 1));
                    }
                EXPECT_EQ(most, largest);
            }
    });
}

}  // namespace
}  // namespace squint
