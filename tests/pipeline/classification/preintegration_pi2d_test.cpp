// The two-dimensional table: the O(n^2) build against the definition.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pipeline/classification/tables/exact_slab.h"
#include "pipeline/classification/tables/pi2d_table.h"
#include "tests/pipeline/classification/preintegration_cases.h"

namespace squint::preintegration {
namespace {

using cases::constant;
using cases::grey;
using cases::make_opaque;

double largest_difference(const RealPreIntegrated2D& a, const RealPreIntegrated2D& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.cell.size(); ++i) {
        if (!(std::abs(a.cell[i] - b.cell[i]) <= largest)) largest = std::abs(a.cell[i] - b.cell[i]);
    }
    return largest;
}

Entries walls(int size) {
    Entries entries = cases::noise(size, 0.01, 3, 21);
    for (const int i : {0, 5, 6, 7, 40, size - 1}) make_opaque(entries, i, grey(i % 2));
    return entries;
}

// The polynomials' remainders (2e-9 of a stretch's colour step at the depth 1/16, and only 16 * 30 such
// stretches can be seen, with falling remainders) and the rounding of 4096 additions stay below this.
constexpr double kBuildError = 1e-8;

TEST(PreIntegrated2D, FastBuildEqualsTheDefinition) {
    const int n = 48;
    for (const Entries& entries : {cases::ramp(n), cases::noise(n, 1e-3, 2, 22), cases::noise(n, 2, 20, 23),
                                   constant(n, 0, 1), constant(n, 1.0 / 32768, 1), walls(n)}) {
        for (const double length : {0.25, 2.0})
            EXPECT_LE(
                largest_difference(build_pi2d(entries, n, length), build_pi2d_direct(entries, n, length)),
                kBuildError);
    }
}

TEST(PreIntegrated2D, FastBuildEqualsTheDefinitionForTablesOfAnotherSizeThanTheEntries) {
    for (const Entries& entries : {cases::noise(43, 1e-3, 20, 24), walls(43), walls(46)}) {
        for (const int size : {16, 31, 60})
            EXPECT_LE(largest_difference(build_pi2d(entries, size, 1), build_pi2d_direct(entries, size, 1)),
                      kBuildError)
                << size;
    }
}

TEST(PreIntegrated2D, FastBuildHoldsForASpikeAThousandDeep) {
    const Entries entries = cases::entries_of(64, [](int i) {
        return cases::Matter{i == 30 ? 1000 : 0.02, grey(i % 2)};
    });
    EXPECT_LE(largest_difference(build_pi2d(entries, 64, 2), build_pi2d_direct(entries, 64, 2)), kBuildError);
}

TEST(PreIntegrated2D, FastBuildOfFourThousandEntriesEqualsTheDefinitionInDrawnCells) {
    const int n = 4096;
    Entries entries = cases::noise(n, 1e-3, 2, 25);
    make_opaque(entries, 1234, grey(1));
    // Not the whole table, which takes half a gigabyte in doubles: a few diagonals.
    for_each_diagonal_group(entries, n, 2,
                            [&](int first, int, Pi2dDiagonal& diagonal, std::vector<std::byte>&) {
                                if (first % (64 * kDiagonalsPerGroup) != 8) return;
                                diagonal.solve(first);
                                for (int f = 0; f < n - first; f += 499) {
                                    const SlabValue up = exact_slab(entries, f, f + first, 2),
                                                    down = exact_slab(entries, f + first, f, 2);
                                    for (int k = 0; k < 3; ++k) {
                                        EXPECT_NEAR(diagonal.up(k)[f], up.color[k], kBuildError);
                                        EXPECT_NEAR(diagonal.down(k)[f], down.color[k], kBuildError);
                                    }
                                    EXPECT_NEAR(diagonal.up(3)[f], up.alpha, kBuildError);
                                    EXPECT_NEAR(diagonal.down(3)[f], down.alpha, kBuildError);
                                }
                            });
}

TEST(PreIntegrated2D, WordsAreTheRoundedDoubles) {
    const Entries entries = walls(64);
    const RealPreIntegrated2D table = build_pi2d(entries, 64, 1);
    std::vector<std::uint16_t> words(table.cell.size(), 12345);
    build_pi2d_words<std::uint16_t>(entries, 64, 1, words, EncodeU16{15});
    for (std::size_t i = 0; i < words.size(); ++i)
        ASSERT_EQ(words[i], std::nearbyint(table.cell[i] * 32768)) << i;
}

TEST(PreIntegrated2D, ColorStaysBetweenZeroAndAlpha) {
    for (const Entries& entries : {walls(64), cases::noise(64, 2, 20, 26)}) {
        for (const RealPreIntegrated2D& table :
             {build_pi2d(entries, 64, 2), build_pi2d_without_self_attenuation(entries, 64, 2)}) {
            for (std::size_t i = 0; i < table.cell.size(); ++i) {
                ASSERT_GE(table.cell[i], 0);
                ASSERT_LE(table.cell[i], table.cell[i | 3]);
                ASSERT_LE(table.cell[i | 3], 1);
            }
        }
    }
}

TEST(PreIntegrated2D, WithoutSelfAttenuationEqualsTheExactTableWhereMatterIsThin) {
    // C without attenuation exceeds C by at most x alpha <= x^2, x = 2e-4.
    const Entries entries = constant(32, 1e-4, 0.5);
    EXPECT_LE(
        largest_difference(build_pi2d_without_self_attenuation(entries, 32, 2), build_pi2d(entries, 32, 2)),
        4e-8);
}

TEST(PreIntegrated2D, LookupReturnsTheCellsAtNodesAndTheirMeanBetween) {
    const Entries entries = cases::noise(64, 0.1, 2, 27);
    RealPreIntegrated2D table = build_pi2d(entries, 64, 1);
    const SlabValue exact = exact_slab(entries, 20, 31, 1);
    EXPECT_NEAR(table.slab(20, 31, 1).color.y, exact.color.y, kBuildError);
    const double mean = (table.slab(20, 31, 1).alpha + table.slab(20, 32, 1).alpha) / 2;
    EXPECT_NEAR(table.slab(20, 31.5, 1).alpha, mean, 1e-15);
    table.lookup = Lookup::nearest;
    EXPECT_EQ(table.slab(20.4, 30.6, 1).alpha, table.slab(20, 31, 1).alpha);
}

TEST(PreIntegrated2D, AnotherLengthIsExactInAlpha) {
    const Entries entries = cases::noise(64, 0.1, 2, 28);
    const RealPreIntegrated2D table = build_pi2d(entries, 64, 1);
    for (const double length : {0.25, 0.9, 1.5})
        EXPECT_NEAR(table.slab(10, 41, length).alpha, exact_slab(entries, 10, 41, length).alpha, kBuildError)
            << length;
}

}  // namespace
}  // namespace squint::preintegration
