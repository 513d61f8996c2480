#include "fixedpoint/table.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace {

using namespace squint;

std::vector<double> values_of(int rows, int columns, double largest) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> any(-largest / 8, largest);
    std::vector<double> values(static_cast<std::size_t>(rows * columns));
    for (double& value : values) value = any(random);
    for (std::size_t i = 0; i < values.size(); i += 3)
        values[i] = std::ldexp(std::floor(values[i] * 64) + 0.5, -6);
    values[1] = 1e300, values[2] = -1e300, values[3] = std::nan("");
    values[4] = std::numeric_limits<double>::infinity();
    return values;
}

// Halves, what lies outside the format, and what is no number among them.
TEST(Table, FillsManyWordsAsItSetsThemOneByOne) {
    for (const Rounding rounding : {Rounding::rnd_conv, Rounding::trn, Rounding::rnd, Rounding::trn_zero})
        for (const Overflow overflow : {Overflow::sat, Overflow::wrap})
            for (const int fraction : {5, 15, 20, 24})
                for (const bool keeps_exact : {true, false}) {
                    const std::array<Spec, 3> specs{Spec{{1, fraction, false}, rounding, overflow},
                                                    Spec{{4, 5, true}, rounding, overflow},
                                                    Spec{{2, fraction + 1, false}, rounding, overflow}};
                    const std::vector<double> values = values_of(101, 3, 2.5);
                    Table many(101, 3, keeps_exact), one(101, 3);
                    many.fill(values, specs);
                    for (int i = 0; i < 101; ++i)
                        for (int c = 0; c < 3; ++c)
                            one.set(i, c, values[one.index(i, c)], specs[static_cast<std::size_t>(c)]);
                    EXPECT_EQ(many.has_exact(), keeps_exact);
                    for (int i = 0; i < 101; ++i)
                        for (int c = 0; c < 3; ++c) {
                            ASSERT_EQ(many.word(i, c), one.word(i, c)) << values[one.index(i, c)];
                            if (keeps_exact && !std::isnan(one.exact(i, c))) {
                                ASSERT_EQ(many.exact(i, c), one.exact(i, c));
                            }
                        }
                }
}

// A format of 32 unsigned bits is narrow as long as its words are.
TEST(Table, TakesSixtyFourBitsOnlyWhereAWordNeedsThem) {
    const Spec spec{{12, 20, false}, Rounding::rnd_conv, Overflow::sat};
    for (const double last : {2047.0, 2048.0}) {
        Table many(3, 1, false), one(3, 1);
        many.fill(std::vector<double>{0, 1000.25, last}, std::array{spec});
        one.set(0, 0, 0, spec), one.set(1, 0, 1000.25, spec), one.set(2, 0, last, spec);
        for (const Table& table : {many, one}) {
            EXPECT_EQ(table.narrow() != nullptr, last < 2048);
            EXPECT_EQ(table.wide() == nullptr, last < 2048);
            EXPECT_EQ(table.word(1, 0), 1000.25 * (1 << 20));
            EXPECT_EQ(table.word(2, 0), static_cast<std::int64_t>(last) << 20);
        }
    }
}

TEST(Table, RowsStandBesideTheNextWhereTheirWordsHaveSixteenBits) {
    const Spec spec{{1, 16, false}, Rounding::rnd_conv, Overflow::sat};
    for (const double top : {65535.0 / 65536, 1.0}) {
        Table table(7, 4, false);
        std::vector<double> values(28);
        for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(i * 2000) / 65536;
        values[20] = top;
        table.fill(values, std::array{spec, spec, spec, spec});
        table.pair_rows();
        ASSERT_EQ(table.paired() != nullptr, top < 1);
        for (int i = 0; table.paired() && i < 7; ++i)
            for (int c = 0; c < 4; ++c)
                EXPECT_EQ(static_cast<std::uint32_t>(table.paired()[table.index(i, c)]) ^ 0x80008000u,
                          table.word(i, c) | table.word(i < 6 ? i + 1 : i, c) << 16);
    }
}

}  // namespace
