// The calculator against arithmetic in doubles, which is exact for these small numbers.
#include "fixedpoint/calculator.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace squint {
namespace {

Calculation calculated(const std::string& words) {
    Calculation c;
    EXPECT_EQ(calculate({words}, c), "") << words;
    return c;
}
std::string refusal(const std::string& words) {
    Calculation c;
    return calculate({words}, c);
}

/// Rounding in units of the last bit, by its definition.
double rounded(double x, Rounding rounding) {
    const double below = std::floor(x), rest = x - below;
    switch (rounding) {
        case Rounding::trn:
            return below;
        case Rounding::trn_zero:
            return std::trunc(x);
        case Rounding::rnd:
            return rest >= 0.5 ? below + 1 : below;
        default:
            return rest > 0.5 || (rest == 0.5 && std::fmod(below, 2) != 0) ? below + 1 : below;
    }
}

TEST(Calculator, ProductsAndSumsOfSmallFormatsAreExactThenRoundedOnce) {
    const Format operand{1, 2, true};
    for (const Rounding rounding : {Rounding::trn, Rounding::trn_zero, Rounding::rnd, Rounding::rnd_conv})
        for (std::int64_t a = operand.smallest(); a <= operand.largest(); ++a)
            for (std::int64_t b = operand.smallest(); b <= operand.largest(); ++b)
                for (const char* operation : {"add", "sub", "mul"}) {
                    const Calculation c = calculated(
                        fmt::format("s4.1 {} {} s1.2 #{} #{}", to_string(rounding), operation, a, b));
                    const double x = static_cast<double>(a) / 4, y = static_cast<double>(b) / 4;
                    const double exact = *operation == 'a' ? x + y : *operation == 's' ? x - y : x * y;
                    const auto raw = static_cast<double>(c.raw);
                    EXPECT_EQ(raw, rounded(2 * exact, rounding)) << operation << a << ' ' << b;
                    EXPECT_EQ(c.inexact, raw != 2 * exact);
                    EXPECT_FALSE(c.overflow);
                    EXPECT_EQ(last_bits(c), raw - 2 * exact);
                }
}

TEST(Calculator, MultiplyAddAndLerpRoundOnce) {
    for (int a = 0; a < 16; ++a)
        for (int b = 0; b < 16; ++b)
            for (int w = 0; w <= 8; ++w) {
                const double x = a / 4.0, y = b / 4.0, t = w / 8.0;
                EXPECT_EQ(calculated(fmt::format("u4.2 lerp u2.2 #{} #{} u1.3 #{}", a, b, w)).raw,
                          rounded(4 * (x + t * (y - x)), Rounding::rnd_conv));
                EXPECT_EQ(calculated(fmt::format("u6.1 trn madd u2.2 #{} #{} u1.3 #{}", a, b, w)).raw,
                          std::floor(2 * (x * y + t)));
            }
}

TEST(Calculator, OverflowSaturatesOrWrapsAndIsFlagged) {
    EXPECT_EQ(calculated("u4.4 add 15.5 0.75").raw, 255);
    EXPECT_TRUE(calculated("u4.4 add 15.5 0.75").overflow);
    EXPECT_FALSE(calculated("u4.4 add 15.5 0.75").inexact);
    EXPECT_EQ(calculated("u4.4 wrap add 15.5 0.75").raw, 4);
    EXPECT_EQ(calculated("s1.3 wrap 1.5").raw, 12);
    EXPECT_EQ(calculated("s1.3 wrap 2").raw, -16);
    EXPECT_EQ(calculated("u1.3 -1").raw, 0);
    EXPECT_EQ(calculated("s24.24 1e17").raw, Format({24, 24, true}).largest());
}

TEST(Calculator, DecimalsAreNotReadThroughDoubles) {
    // 0.5 of the last bit of u1.24 less 10^-18: to nearest it is nothing, but the double nearest to it is
    // half a bit.
    EXPECT_EQ(calculated("u1.24 rnd 0.000000029802322387").raw, 0);
    EXPECT_EQ(calculated("u1.24 rnd 0.000000029802322388").raw, 1);
    // Halves to even, exactly.
    EXPECT_EQ(calculated("u1.1 0.25").raw, 0);
    EXPECT_EQ(calculated("u1.1 0.75").raw, 2);
    EXPECT_EQ(calculated("s1.1 -0.25").raw, 0);
    EXPECT_EQ(calculated("s1.1 rnd -0.25").raw, 0);
    EXPECT_EQ(calculated("s1.1 trn -0.000000000000000001").raw, -1);
    EXPECT_EQ(calculated("s1.1 trn_zero -0.4").raw, 0);
    EXPECT_EQ(calculated("u4.4 1.5e1").raw, 240);
    EXPECT_EQ(calculated("u4.4 125E-2").raw, 20);
}

TEST(Calculator, RawOperandsInDecimalAndHexadecimal) {
    EXPECT_EQ(calculated("s1.6 0xff").raw, -1);
    EXPECT_EQ(calculated("s1.6 0x7f").raw, 127);
    EXPECT_EQ(calculated("s1.6 #-128").raw, -128);
    EXPECT_EQ(refusal("u1.6 #128"), "'#128' is no raw number of u1.6: 0 to 127 are");
    EXPECT_NE(refusal("u1.6 0x80"), "");
}

TEST(Calculator, OperandsKeepTheFormatBeforeThem) {
    const Calculation c = calculated("u1.15 trn mul u1.4 trn 0.7 u0.8 0.7");
    EXPECT_EQ(c.operands, (std::vector<std::int64_t>{11, 179}));
    EXPECT_EQ(c.operand_formats[1], (Format{0, 8, false}));
    EXPECT_EQ(calculated("u1.15 mul u1.4 1 1").operand_formats[1], (Format{1, 4, false}));
    EXPECT_EQ(calculated("u1.15 mul 1 1").operand_formats[0], (Format{1, 15, false}));
    EXPECT_EQ(calculated("u1.15 * 1 1").raw, 1 << 15);
}

TEST(Calculator, TheWidestFormatsDoNotOverflowTheExactNumber) {
    EXPECT_EQ(calculated("s24.24 mul s24.24 #281474976710655 #281474976710655").raw,
              (std::int64_t{1} << 48) - 1);
    EXPECT_EQ(calculated("s24.24 wrap mul s24.24 #281474976710655 u1.24 1").raw, (std::int64_t{1} << 48) - 1);
    // a + w (b - a) at w = 1 is b, whatever the width.
    EXPECT_EQ(calculated("s24.24 lerp s24.24 #-281474976710656 #281474976710655 u1.24 1").raw,
              (std::int64_t{1} << 48) - 1);
    EXPECT_EQ(calculated("s24.24 lerp u24.0 1 u0.24 0.5 u1.24 1").raw, std::int64_t{1} << 23);
}

TEST(Calculator, WritesNumbersInFull) {
    EXPECT_EQ(decimal({-3, 2}), "-0.75");
    EXPECT_EQ(decimal({1, 24}), "0.000000059604644775390625");
    EXPECT_EQ(decimal({5, 0}), "5");
    EXPECT_EQ(bits(-1, {1, 2, true}), "11.11");
    EXPECT_EQ(bits(5, {4, 0, false}), "0101");
    EXPECT_EQ(hex(-1, {1, 2, true}), "0xf");
    EXPECT_EQ(hex(1, {4, 9, false}), "0x0001");
}

TEST(Calculator, MistakesAreOneLine) {
    for (const char* words :
         {"", "u1.15", "x1.15 1", "u1.15 foo 1", "u1.15 mul 1", "u1.15 mul 1 2 3", "u1.15 1 2", "u1.15 0.7.1",
          "u1.15 1e", "u1.15 1e99", "u1.15 #", "u1.15 0x", "u1.15 # 1", "u1.15 1234567890123456789",
          "u1.15 mul u1.15", "u1.15 nan", "u1.15 -", "u1.15 99e18"}) {
        const std::string wrong = refusal(words);
        EXPECT_NE(wrong, "") << words;
        EXPECT_EQ(wrong.find('\n'), std::string::npos);
    }
}

}  // namespace
}  // namespace squint
