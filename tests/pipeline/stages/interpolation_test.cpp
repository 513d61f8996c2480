// Stage 2's hard cases: what a lerp must keep exactly, and how far three of them are from the exact value.
#include "pipeline/stages/interpolation-inl.h"

#include "fixedpoint/words.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;
using Word = std::int64_t;

constexpr Rounding kRoundings[] = {Rounding::trn, Rounding::trn_zero, Rounding::rnd, Rounding::rnd_conv};

Spec unsigned_spec(int integer_bits, int fraction_bits, Rounding rounding) {
    return {{integer_bits, fraction_bits, false}, rounding, Overflow::sat};
}

/// Voxels of I bits, weights of w bits, every level I.F.
InterpolationStage stage_of(int integer_bits, int weight_bits, int fraction_bits, Rounding rounding) {
    const Spec spec = unsigned_spec(integer_bits, fraction_bits, rounding);
    InterpolationStage s;
    s.weight_bits = weight_bits, s.sample_fraction = fraction_bits;
    s.to_x = Rescale(weight_bits, spec);
    s.to_y = s.to_sample = Rescale(fraction_bits + weight_bits, spec);
    return s;
}

/// One lerp between words of F fraction bits.
Word lerp_of(Word v0, Word v1, Word w, int weight_bits, int fraction_bits, Rounding rounding) {
    const Spec spec{{20, fraction_bits, true}, rounding, Overflow::sat};
    return lerp(v0, v1, w, weight_bits, Rescale(fraction_bits + weight_bits, spec));
}

// C2.1
TEST(Interpolation, EqualCornersReturnThemselvesForEveryWeight) {
    std::mt19937_64 random(1);
    for (const Rounding rounding : kRoundings) {
        const InterpolationStage s = stage_of(12, 12, 12, rounding);
        for (const Word v : {0, 1, 7, 2048, 4094, 4095})
            for (int i = 0; i < 4000; ++i) {
                Cell<Word> cell;
                cell.corner.fill(v);
                const auto weight = [&] { return static_cast<Word>(random() % 4097); };
                ASSERT_EQ(interpolate(s, cell, std::array<Word, 3>{weight(), weight(), weight()}), v << 12);
            }
    }
}

// C2.2
TEST(Interpolation, AWeightOfZeroOrOneReturnsACorner) {
    for (const Rounding rounding : kRoundings) {
        const InterpolationStage s = stage_of(8, 6, 4, rounding);
        const Cell<Word> cell{{3, 250, 17, 90, 255, 0, 128, 64}};
        for (std::size_t i = 0; i < 8; ++i) {
            const std::array<Word, 3> weight{i & 1 ? 64 : 0, i & 2 ? 64 : 0, i & 4 ? 64 : 0};
            EXPECT_EQ(interpolate(s, cell, weight), cell.corner[i] << 4);
        }
    }
}

// C2.3
TEST(Interpolation, BetweenZeroAndOneTheSampleIsTheWeight) {
    const InterpolationStage s = stage_of(12, 12, 12, Rounding::trn);
    const Cell<Word> ramp{{0, 1, 0, 1, 0, 1, 0, 1}};
    for (Word k = 0; k <= 4096; ++k) ASSERT_EQ(interpolate(s, ramp, std::array<Word, 3>{k, 1234, 4000}), k);
}

// C2.4: every pair of 6-bit words and every weight of 6 bits.
TEST(Interpolation, IsMonotonicInTheWeightAndStaysBetweenItsEnds) {
    for (const Rounding rounding : kRoundings)
        for (Word v0 = -32; v0 < 32; ++v0)
            for (Word v1 = v0; v1 < 32; ++v1) {
                Word before = v0;
                for (Word w = 0; w <= 64; ++w) {
                    const Word up = lerp_of(v0, v1, w, 6, 2, rounding);
                    ASSERT_LE(before, up) << v0 << ' ' << v1 << ' ' << w;
                    ASSERT_LE(up, v1);
                    before = up;
                }
            }
}

TEST(Interpolation, StaysWithinTheCellsRange) {
    std::mt19937_64 random(2);
    for (int i = 0; i < 100'000; ++i) {
        const InterpolationStage s = stage_of(8, 5, static_cast<int>(random() % 9), kRoundings[random() % 4]);
        Cell<Word> cell;
        for (Word& v : cell.corner) v = static_cast<Word>(random() % 256);
        const auto weight = [&] { return static_cast<Word>(random() % 33); };
        const Word sample = interpolate(s, cell, std::array<Word, 3>{weight(), weight(), weight()});
        const auto [least, most] = std::minmax_element(cell.corner.begin(), cell.corner.end());
        ASSERT_GE(sample, *least << s.sample_fraction);
        ASSERT_LE(sample, *most << s.sample_fraction);
    }
}

// C2.5: v0 + w (v1 - v0) from either end.  Floor and half-up give the same bits where nothing is lost but the
// last rounding; half to even and towards zero look at the sum itself, which is the same number either way.
TEST(Interpolation, AMirroredLerpIsTheSameNumber) {
    for (const Rounding rounding : kRoundings)
        for (Word v0 = -32; v0 < 32; ++v0)
            for (Word v1 = -32; v1 < 32; ++v1)
                for (Word w = 0; w <= 64; ++w)
                    ASSERT_EQ(lerp_of(v0, v1, w, 6, 0, rounding), lerp_of(v1, v0, 64 - w, 6, 0, rounding));
}

/// The exact trilinear value, in units of 2^-(F + 3 w): the truth without any rounding.
Int128 exact_value(const Cell<Word>& cell, const std::array<Word, 3>& weight, int weight_bits) {
    Int128 sum = 0;
    for (int i = 0; i < 8; ++i) {
        Int128 share = cell.corner[static_cast<std::size_t>(i)];
        for (int axis = 0; axis < 3; ++axis) {
            const Word w = weight[static_cast<std::size_t>(axis)];
            share *= i >> axis & 1 ? w : (Word{1} << weight_bits) - w;
        }
        sum += share;
    }
    return sum;
}

double worst_error(int weight_bits, int fraction_bits, Rounding rounding) {
    const InterpolationStage s = stage_of(8, weight_bits, fraction_bits, rounding);
    std::mt19937_64 random(3);
    double worst = 0;
    for (int i = 0; i < 400'000; ++i) {
        Cell<Word> cell;
        for (Word& v : cell.corner) v = static_cast<Word>(random() % 256);
        std::array<Word, 3> weight;
        for (Word& w : weight) w = static_cast<Word>(random() % ((std::uint64_t{1} << weight_bits) + 1));
        const Int128 exact = exact_value(cell, weight, weight_bits);
        const Int128 found = Int128{interpolate(s, cell, weight)} << (3 * weight_bits);
        const double error =
            std::ldexp(static_cast<double>(found - (exact << fraction_bits)), -3 * weight_bits);
        worst = std::max(worst, std::abs(error));
    }
    return worst;
}

// C2.6: each rounding costs one last bit truncating, half rounding, and later lerps average what is there.
TEST(Interpolation, TheErrorIsOneOrAHalfLastBitForEachRounding) {
    // First level exact (F >= w): two levels round.
    EXPECT_LT(worst_error(6, 6, Rounding::trn), 2);
    EXPECT_LE(worst_error(6, 6, Rounding::rnd), 1);
    EXPECT_LE(worst_error(6, 6, Rounding::rnd_conv), 1);
    // Coarser samples: all three do.
    EXPECT_LT(worst_error(6, 2, Rounding::trn), 3);
    EXPECT_LE(worst_error(6, 2, Rounding::rnd), 1.5);
    EXPECT_LE(worst_error(6, 2, Rounding::rnd_conv), 1.5);
    // The bounds are nearly met: they are not slack.
    EXPECT_GT(worst_error(6, 6, Rounding::trn), 1.7);
    EXPECT_GT(worst_error(6, 6, Rounding::rnd), 0.85);
}

// C2.7
TEST(Interpolation, TheMiddleOfACheckerboardIsHalfWay) {
    for (const Rounding rounding : kRoundings) {
        const InterpolationStage s = stage_of(12, 12, 12, rounding);
        const Cell<Word> board{{0, 4095, 4095, 0, 4095, 0, 0, 4095}};
        EXPECT_EQ(interpolate(s, board, std::array<Word, 3>{2048, 2048, 2048}), 4095 * 2048);
    }
}

// C2.8
TEST(Interpolation, ARampIsItsOwnCoordinate) {
    const InterpolationStage s = stage_of(12, 12, 12, Rounding::trn);
    for (Word cell_index = 0; cell_index < 4095; cell_index += 97) {
        const Word v0 = cell_index, v1 = cell_index + 1;
        const Cell<Word> ramp{{v0, v1, v0, v1, v0, v1, v0, v1}};
        for (Word w = 0; w <= 4096; w += 7)
            ASSERT_EQ(interpolate(s, ramp, std::array<Word, 3>{w, 100, 3999}), (cell_index << 12) + w);
    }
}

// C2.9
TEST(Interpolation, TheWidestProductPassesThirtyTwoBitsAndDoesNotWrap) {
    const Rescale to(24, unsigned_spec(12, 12, Rounding::trn));
    const Word top = Word{4095} << 12, one = 1 << 12;
    EXPECT_EQ(lerp(top, Word{0}, one - 1, 12, to), 4095);
    EXPECT_EQ(lerp(Word{0}, top, one - 1, 12, to), top - 4095);
    Range::needs = {};
    static_cast<void>(Range{0, one} * (Range{0, top} - Range{0, top}));
    EXPECT_EQ(Range::needs.result_bits, 37);  // 2^12 (2^24 - 2^12) and a sign; as formats, 13 + 25 = 38
}

TEST(Interpolation, NearestTakesTheCloserCornerAndTheUpperHalfWay) {
    InterpolationStage s = stage_of(8, 4, 3, Rounding::trn);
    s.nearest = true;
    const Cell<Word> cell{{10, 20, 30, 40, 50, 60, 70, 80}};
    EXPECT_EQ(interpolate(s, cell, std::array<Word, 3>{7, 7, 7}), 10 << 3);
    EXPECT_EQ(interpolate(s, cell, std::array<Word, 3>{8, 7, 7}), 20 << 3);
    EXPECT_EQ(interpolate(s, cell, std::array<Word, 3>{7, 8, 7}), 30 << 3);
    EXPECT_EQ(interpolate(s, cell, std::array<Word, 3>{16, 16, 16}), 80 << 3);
}

TEST(Interpolation, IntervalsHoldEveryCellsSample) {
    std::mt19937_64 random(4);
    for (int i = 0; i < 20'000; ++i) {
        InterpolationStage s = stage_of(8, 1 + static_cast<int>(random() % 8),
                                        static_cast<int>(random() % 10), kRoundings[random() % 4]);
        s.nearest = random() % 8 == 0;
        const Word low = static_cast<Word>(random() % 256), high = low + static_cast<Word>(random() % 256);
        Cell<Word> cell;
        Cell<Range> cells;
        cells.corner.fill(Range{low, high});
        std::array<Word, 3> weight;
        for (Word& v : cell.corner)
            v = low + static_cast<Word>(random() % static_cast<std::uint64_t>(high - low + 1));
        for (Word& w : weight) w = static_cast<Word>(random() % ((std::uint64_t{1} << s.weight_bits) + 1));
        const Range one{0, Word{1} << s.weight_bits};
        const Range all = interpolate(s, cells, std::array<Range, 3>{one, one, one});
        const Word sample = interpolate(s, cell, weight);
        ASSERT_TRUE(all.low <= sample && sample <= all.high);
    }
}

// Squeeze, equation 13, cut: a last bit is lost wherever a product is not whole.
TEST(Interpolation, TwoCutProductsOfEqualEndsLoseALastBitUnlessTheyAreWhole) {
    const Spec spec = unsigned_spec(12, 0, Rounding::trn);
    const Rescale to(12, spec), to_sum(0, spec);
    for (const Word v : {Word{1}, Word{7}, Word{2048}, Word{4095}})
        for (Word weight = 0; weight <= 4096; ++weight)
            ASSERT_EQ(lerp_of_two_products(v, v, weight, 12, to, to_sum),
                      v - (v * weight % 4096 != 0 ? 1 : 0))
                << v << ' ' << weight;
}

TEST(Interpolation, TwoProductsAreOneWhereNothingIsRounded) {
    const Spec spec = unsigned_spec(8, 12, Rounding::trn);
    const Rescale to(12, spec), to_sum(12, spec);
    std::mt19937_64 random(3);
    for (int i = 0; i < 20000; ++i) {
        const auto v0 = static_cast<Word>(random() % 256), v1 = static_cast<Word>(random() % 256),
                   weight = static_cast<Word>(random() % 4097);
        ASSERT_EQ(lerp_of_two_products(v0, v1, weight, 12, to, to_sum), lerp(v0, v1, weight, 12, to));
    }
}

}  // namespace
}  // namespace squint
