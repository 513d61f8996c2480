// The integer words' own algorithms against their definitions, and intervals against the integers they bound.
#include "fixedpoint/words.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

namespace squint {
namespace {

TEST(Words, VectorLengthIsTheFloorOfTheLength) {
    std::mt19937_64 random(3);
    for (int i = 0; i < 600'000; ++i) {
        std::array<std::int64_t, 3> v;
        for (std::int64_t& x : v) x = static_cast<std::int64_t>(random() % 32768) >> random() % 15;
        if (i % 3 == 0) v[2] = 0;  // a plane holds vectors of whole lengths
        if (i % 12 == 0) v[1] = 0;
        const int guard = static_cast<int>(random() % 11);
        const std::int64_t squares = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) << 2 * guard;
        const std::int64_t root = vector_length(v, guard);
        ASSERT_LE(root * root, squares);
        ASSERT_GT((root + 1) * (root + 1), squares) << v[0] << ' ' << v[1] << ' ' << v[2] << ' ' << guard;
        ASSERT_TRUE((vector_length(std::array<Int128, 3>{v[0], v[1], v[2]}, guard) == root));
    }
}

TEST(Words, BitLengthIsTheLeastPowerOfTwoAbove) {
    EXPECT_EQ(bit_length(std::int64_t{0}), 0);
    for (int b = 1; b < 63; ++b) {
        const std::int64_t power = std::int64_t{1} << b;
        EXPECT_EQ(bit_length(power - 1), b);
        EXPECT_EQ(bit_length(power), b + 1);
    }
    for (int b = 1; b < 126; ++b) {
        const Int128 power = Int128{1} << b;
        EXPECT_TRUE(bit_length(power - 1) == b && bit_length(power) == b + 1) << b;
    }
}

TEST(Words, QuotientIsTheExactFractionRoundedOnce) {
    std::mt19937_64 random(4);
    for (int i = 0; i < 300'000; ++i) {
        const int gained = static_cast<int>(random() % 16);
        const Spec spec{{static_cast<int>(random() % 8) + 1, static_cast<int>(random() % 16), false},
                        static_cast<Rounding>(random() % 4),
                        random() % 2 ? Overflow::wrap : Overflow::sat};
        const Rescale to(spec.format.fraction_bits - gained, spec);
        // Small denominators make ties and exact results common.
        const auto n = static_cast<std::int64_t>(random() >> (34 + random() % 28));
        const auto d = 1 + static_cast<std::int64_t>(random() >> (34 + random() % 29));
        const Int128 scaled = Int128{n} << gained, floor = scaled / d, rest = scaled % d;
        Int128 expected = floor;
        if (spec.rounding == Rounding::rnd) expected += 2 * rest >= d;
        if (spec.rounding == Rounding::rnd_conv)
            expected += 2 * rest > d || (2 * rest == d && floor % 2 == 1);
        const Int128 size = Int128{spec.format.largest()} + 1;
        expected = spec.overflow == Overflow::wrap ? expected % size : std::min(expected, size - 1);
        ASSERT_EQ(quotient(n, d, to), static_cast<std::int64_t>(expected)) << n << " / " << d;
        ASSERT_TRUE(quotient(Int128{n}, Int128{d}, to) == expected) << n << " / " << d;
    }
}

TEST(Audited, CountsRoundedUnderflownSaturatedAndWrappedValues) {
    // From four fraction bits to u2.0: 0, 1/4 -> 0, 3/4 -> 1, 2, 5 -> 3, -1/4 -> 0, -3/4 -> -1 -> 0.
    for (const Overflow overflow : {Overflow::sat, Overflow::wrap}) {
        WireStatistics counted;
        Rescale to(4, {{2, 0, false}, Rounding::rnd, overflow});
        to.statistics = &counted;
        for (const int x : {0, 4, 12, 32, 80, -4, -12}) quantise(Audited{x}, to);
        EXPECT_EQ(counted.count, 7);
        EXPECT_EQ(counted.inexact, 4);
        EXPECT_EQ(counted.underflowed, 2) << "1/4 and -1/4; -3/4 became zero by a limit, not in rounding";
        EXPECT_EQ(counted.saturated, overflow == Overflow::sat ? 2 : 0);
        EXPECT_EQ(counted.wrapped, overflow == Overflow::wrap ? 2 : 0);
        WireStatistics twice = counted;
        twice.merge(counted);
        EXPECT_EQ(twice.underflowed, 4);
    }
    // 1 / 5 to the nearest whole is not zero, and becomes it; 0 / 5 is.
    WireStatistics counted;
    Rescale to(0, {{2, 0, false}, Rounding::rnd, Overflow::sat});
    to.statistics = &counted;
    quotient(Audited{1}, Audited{5}, to);
    quotient(Audited{0}, Audited{5}, to);
    EXPECT_EQ(counted.underflowed, 1);
}

TEST(Words, ShiftByIsMultiplicationByAPowerOfTwoRoundedDown) {
    for (std::int64_t x = 0; x < 300; ++x)
        for (std::int64_t bits = -12; bits <= 12; ++bits)
            EXPECT_EQ(shift_by(x, bits), static_cast<std::int64_t>(std::floor(
                                             std::ldexp(static_cast<double>(x), static_cast<int>(bits)))));
}

TEST(Words, BlendLiesBetweenItsEndsAndIsExact) {
    for (std::int64_t v0 = -9; v0 <= 9; ++v0)
        for (std::int64_t v1 = -9; v1 <= 9; ++v1)
            for (std::int64_t w = 0; w <= 16; ++w) {
                const std::int64_t between = blend(v0, v1, w, 4);
                EXPECT_EQ(between, (16 - w) * v0 + w * v1);
                EXPECT_GE(between, 16 * std::min(v0, v1));
                EXPECT_LE(between, 16 * std::max(v0, v1));
            }
}

// ------------------------------------------------------------------------------------------------ Range

bool holds(Range range, Int128 x) {
    return range.low <= x && x <= range.high;
}

TEST(Range, HoldsEveryResultOfEveryOperation) {
    std::mt19937_64 random(5);
    const auto draw = [&](std::int64_t low, std::int64_t high) {
        return low + static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(high - low + 1));
    };
    for (int i = 0; i < 60'000; ++i) {
        const std::int64_t a0 = draw(-999, 999), a1 = draw(a0, 999), b0 = draw(-999, 999), b1 = draw(b0, 999);
        const Range a{a0, a1}, b{b0, b1};
        const Spec spec{{static_cast<int>(draw(0, 8)), static_cast<int>(draw(1, 8)), draw(0, 1) == 1},
                        static_cast<Rounding>(draw(0, 3)),
                        static_cast<Overflow>(draw(0, 1))};
        const Rescale to(static_cast<int>(draw(0, 14)), spec);
        const int bits = static_cast<int>(draw(0, 9));
        const Range w{0, std::int64_t{1} << bits};
        for (int j = 0; j < 4; ++j) {
            const std::int64_t x = draw(a0, a1), y = draw(b0, b1), weight = draw(0, std::int64_t{1} << bits);
            ASSERT_TRUE(holds(a + b, x + y));
            ASSERT_TRUE(holds(a - b, x - y));
            ASSERT_TRUE(holds(a * b, x * y));
            ASSERT_TRUE(holds(min(a, b), min(x, y)) && holds(max(a, b), max(x, y)));
            ASSERT_TRUE(holds(absolute(a), absolute(x))) << a0 << ' ' << a1;
            ASSERT_TRUE(holds(select(Perhaps{}, a, b), j % 2 ? x : y));
            ASSERT_TRUE(holds(shift_left(a, bits), shift_left(x, bits)));
            ASSERT_TRUE(holds(floor_shift(a, bits), floor_shift(x, bits)));
            ASSERT_TRUE(holds(blend(a, b, w, bits), blend(x, y, weight, bits)));
            ASSERT_TRUE(holds(quantise(a, to), quantise(x, to))) << x << " to " << to_string(spec);
            const Range p{std::abs(a0), std::abs(a0) + 9}, q{std::abs(b0) + 1, std::abs(b0) + 20};
            const std::int64_t n = draw(std::abs(a0), std::abs(a0) + 9),
                               d = draw(std::abs(b0) + 1, std::abs(b0) + 20);
            const Rescale up(spec.format.fraction_bits - bits, spec);
            ASSERT_TRUE(holds(quotient(p, q, up), quotient(n, d, up)))
                << n << " / " << d << " to " << to_string(spec);
            const auto part = [](std::int64_t whole) { return whole & 0x7fff; };
            const std::array<std::int64_t, 3> vector{part(n), part(d), part(n + d)};
            const std::array<Range, 3> vectors{Range{0, vector[0] + 3}, Range{0, vector[1]},
                                               Range{0, 0x7fff}};
            ASSERT_TRUE(holds(vector_length(vectors, bits % 11), vector_length(vector, bits % 11)));
            ASSERT_TRUE(holds(bit_length(p), bit_length(n)));
            ASSERT_TRUE(holds(shift_by(p, Range{-bits, bits}), shift_by(n, draw(-bits, bits))));
        }
    }
}

TEST(Range, NotesTheWidestFactorAndTheWidestResult) {
    Range::needs = {};
    const Range product = Range{0, 4095} * Range{-4096, 4095};
    EXPECT_EQ(Range::needs.operand_bits, 13);
    EXPECT_EQ(Range::needs.result_bits, 25);
    EXPECT_EQ(signed_bits(product), 25);
    EXPECT_EQ(signed_bits(Range{-1, 0}), 1);
    EXPECT_EQ(signed_bits(Range{0, 32767}), 16);
    EXPECT_EQ(signed_bits(Range{-32768, 32767}), 16);
    EXPECT_EQ(signed_bits(Range{0, 32768}), 17);
}

}  // namespace
}  // namespace squint
