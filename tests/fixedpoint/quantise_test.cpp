// quantise() is SystemC's arithmetic: held against a second implementation by exact division, over every
// small format, mode, shift and value.  (systemc/sc_fix_test.cpp holds both against SystemC itself.)
#include "fixedpoint/quantise.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

namespace squint {
namespace {

constexpr std::array kRoundings{Rounding::trn, Rounding::trn_zero, Rounding::rnd, Rounding::rnd_conv};
constexpr std::array kOverflows{Overflow::sat, Overflow::wrap};

Int128 floor_of(Int128 numerator, Int128 denominator) {
    const Int128 q = numerator / denominator;
    return q * denominator > numerator ? q - 1 : q;
}

/// The definition: x 2^-from as a fraction, rounded by division, then limited by comparison or remainder.
Int128 by_division(Int128 x, int from, const Spec& spec) {
    const int shift = from - spec.format.fraction_bits;
    const Int128 n = x * (shift < 0 ? Int128{1} << -shift : 1), d = shift > 0 ? Int128{1} << shift : 1;
    const Int128 below = floor_of(n, d), rest = n - below * d;
    Int128 rounded = below;
    if (spec.rounding == Rounding::trn_zero) rounded = n / d;
    if (spec.rounding == Rounding::rnd) rounded = floor_of(2 * n + d, 2 * d);
    if (spec.rounding == Rounding::rnd_conv && (2 * rest > d || (2 * rest == d && below % 2 != 0)))
        rounded = below + 1;
    const Int128 low = spec.format.smallest(), high = spec.format.largest();
    if (spec.overflow == Overflow::sat) return std::min(std::max(rounded, low), high);
    const Int128 modulus = high - low + 1;
    return rounded - floor_of(rounded - low, modulus) * modulus;
}

template <class F>
void for_each_spec(int most_bits, F&& f) {
    for (int bits = 1; bits <= most_bits; ++bits)
        for (int fraction = 0; fraction <= bits; ++fraction)
            for (const bool is_signed : {false, true})
                for (const Rounding rounding : kRoundings)
                    for (const Overflow overflow : kOverflows)
                        f(Spec{{bits - fraction, fraction, is_signed}, rounding, overflow});
}

TEST(Quantise, EqualsExactDivisionForEverySmallFormatModeShiftAndValue) {
    std::int64_t wrong = 0;
    for_each_spec(6, [&](const Spec& spec) {
        for (int shift = -3; shift <= 5; ++shift) {
            const int from = spec.format.fraction_bits + shift;
            if (from < 0) continue;
            const Rescale to(from, spec);
            // Twice the format's range to either side, so that it overflows by more than once around.
            const std::int64_t reach = std::int64_t{1} << (spec.format.width() + 1 + std::max(shift, 0));
            for (std::int64_t x = -reach; x <= reach; ++x) {
                const Int128 expected = by_division(x, from, spec);
                if (quantise(x, to) == expected && quantise(Int128{x}, to) == expected) continue;
                if (++wrong <= 5)
                    ADD_FAILURE() << x << " with " << from << " fraction bits to " << to_string(spec) << ": "
                                  << quantise(x, to) << ", not " << static_cast<std::int64_t>(expected);
            }
        }
    });
    EXPECT_EQ(wrong, 0);
}

TEST(Quantise, EqualsExactDivisionForWideFormats) {
    std::mt19937_64 random(1);
    for (int i = 0; i < 400'000; ++i) {
        Spec spec;
        spec.format = {static_cast<int>(random() % 25), static_cast<int>(random() % 25), random() % 2 == 0};
        if (spec.format.integer_bits + spec.format.fraction_bits == 0) continue;
        spec.rounding = kRoundings[random() % 4], spec.overflow = kOverflows[random() % 2];
        const int from = static_cast<int>(random() % 49);
        // 62 bits less what a format gains, so that 64-bit words are allowed.
        const int gained = std::max(spec.format.fraction_bits - from, 0);
        const std::int64_t x = static_cast<std::int64_t>(random()) >> (1 + gained + random() % 30);
        const Rescale to(from, spec);
        const Int128 expected = by_division(x, from, spec);
        ASSERT_EQ(quantise(x, to), static_cast<std::int64_t>(expected))
            << x << " with " << from << " fraction bits to " << to_string(spec) << ", draw " << i;
        ASSERT_TRUE(quantise(Int128{x}, to) == expected)
            << x << " from " << from << " to " << to_string(spec);
    }
}

TEST(Quantise, LeavesWhatFitsAndNeedsNoRoundingAlone) {
    for_each_spec(6, [](const Spec& spec) {
        const Rescale to(spec.format.fraction_bits, spec);
        for (std::int64_t raw = spec.format.smallest(); raw <= spec.format.largest(); ++raw)
            ASSERT_EQ(quantise(raw, to), raw) << to_string(spec);
    });
}

TEST(Quantise, OneTimesOneIsOne) {
    for (int fraction = 0; fraction <= 24; ++fraction)
        for (const Rounding rounding : kRoundings) {
            const Spec spec{{1, fraction, false}, rounding, Overflow::sat};
            const std::int64_t one = spec.format.one();
            EXPECT_EQ(quantise(one * one, Rescale(2 * fraction, spec)), one) << to_string(spec);
        }
}

// ------------------------------------------------------------------------------------ from doubles

/// x 2^F is exact in a double (a power of two, upwards), and so are its integer part and its fraction.
/// From 2^62 on, and so for infinities, wrapping formats saturate too.
double by_parts(double x, const Spec& spec) {
    double whole = 0;
    const double scaled = std::ldexp(x, spec.format.fraction_bits);
    if (std::abs(scaled) >= 0x1p62)
        return static_cast<double>(x < 0 ? spec.format.smallest() : spec.format.largest());
    const double part = std::modf(scaled, &whole);
    const bool odd = std::fmod(whole, 2) != 0;
    switch (spec.rounding) {
        case Rounding::trn:
            whole -= part < 0;
            break;
        case Rounding::trn_zero:
            break;
        case Rounding::rnd:
            whole += part >= 0.5, whole -= part < -0.5;
            break;
        case Rounding::rnd_conv:
            whole += part > 0.5 || (part == 0.5 && odd), whole -= part < -0.5 || (part == -0.5 && odd);
            break;
    }
    const auto low = static_cast<double>(spec.format.smallest()),
               high = static_cast<double>(spec.format.largest());
    if (spec.overflow == Overflow::sat) return std::min(std::max(whole, low), high);
    const double modulus = high - low + 1;
    double rest = std::fmod(whole, modulus);
    if (rest < low) rest += modulus;
    return rest > high ? rest - modulus : rest;
}

void expect_by_parts(double x, const Spec& spec) {
    ASSERT_EQ(static_cast<double>(quantise_real(x, spec)), by_parts(x, spec) + 0.0)
        << std::hexfloat << x << " to " << to_string(spec);
}

TEST(QuantiseReal, IsExactAroundEveryHalfOfEverySmallFormat) {
    for_each_spec(5, [](const Spec& spec) {
        const double unit = std::ldexp(1.0, -spec.format.fraction_bits);
        for (std::int64_t halves = 4 * spec.format.smallest() - 4; halves <= 4 * spec.format.largest() + 4;
             ++halves) {
            const double x = static_cast<double>(halves) * unit / 2;
            for (const double near : {x, std::nextafter(x, -1e9), std::nextafter(x, 1e9)})
                expect_by_parts(near, spec);
        }
    });
}

TEST(QuantiseReal, IsExactForDoublesOfEverySize) {
    std::mt19937_64 random(2);
    for (int i = 0; i < 200'000; ++i) {
        Spec spec;
        spec.format = {static_cast<int>(random() % 25), static_cast<int>(random() % 25), random() % 2 == 0};
        if (spec.format.integer_bits + spec.format.fraction_bits == 0) continue;
        spec.rounding = kRoundings[random() % 4], spec.overflow = kOverflows[random() % 2];
        const double sign = random() % 2 ? 1 : -1;
        const double mantissa = 1 + static_cast<double>(random() >> 12) * 0x1p-52;
        const int exponent = static_cast<int>(random() % 130) - 70;
        expect_by_parts(sign * std::ldexp(mantissa, exponent), spec);
    }
}

TEST(QuantiseReal, JustBelowAHalfIsNotAHalf) {
    // floor(x + 1/2) in doubles gives 1.
    const double below = std::nextafter(0.5, 0.0);
    for (const Rounding rounding : kRoundings)
        EXPECT_EQ(quantise_real(below, {{4, 0, false}, rounding, Overflow::sat}), 0);
    EXPECT_EQ(std::floor(below + 0.5), 1);
    EXPECT_EQ(quantise_real(0.5, {{4, 0, false}, Rounding::rnd, Overflow::sat}), 1);
    EXPECT_EQ(quantise_real(0.5, {{4, 0, false}, Rounding::rnd_conv, Overflow::sat}), 0);
    EXPECT_EQ(quantise_real(1.5, {{4, 0, false}, Rounding::rnd_conv, Overflow::sat}), 2);
    EXPECT_EQ(quantise_real(std::ldexp(below, -15), {{1, 15, false}, Rounding::rnd, Overflow::sat}), 0);
}

TEST(QuantiseReal, NumbersBelowTheLastBitRoundByTheirSign) {
    for (const double tiny : {std::numeric_limits<double>::denorm_min(), 1e-310, 0x1p-80, 0x1p-60}) {
        for (const Rounding rounding : kRoundings) {
            const Spec spec{{1, 15, true}, rounding, Overflow::sat};
            EXPECT_EQ(quantise_real(tiny, spec), 0) << tiny;
            EXPECT_EQ(quantise_real(-tiny, spec), rounding == Rounding::trn ? -1 : 0) << tiny;
        }
    }
    EXPECT_EQ(quantise_real(-0.0, {{1, 15, true}, Rounding::trn, Overflow::sat}), 0);
}

TEST(QuantiseReal, InfinitySaturatesAndWhatIsNoNumberIsZero) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const Rounding rounding : kRoundings)
        for (const bool is_signed : {false, true}) {
            const Spec spec{{1, 15, is_signed}, rounding, Overflow::sat};
            EXPECT_EQ(quantise_real(kInfinity, spec), spec.format.largest());
            EXPECT_EQ(quantise_real(-kInfinity, spec), spec.format.smallest());
            EXPECT_EQ(quantise_real(1e300, spec), spec.format.largest());
            EXPECT_EQ(quantise_real(-1e300, spec), spec.format.smallest());
            EXPECT_EQ(quantise_real(std::numeric_limits<double>::quiet_NaN(), spec), 0);
        }
}

TEST(QuantiseReal, GivesEveryRawNumberBack) {
    for_each_spec(6, [](const Spec& spec) {
        for (std::int64_t raw = spec.format.smallest(); raw <= spec.format.largest(); ++raw)
            ASSERT_EQ(quantise_real(to_real(raw, spec.format), spec), raw) << to_string(spec);
    });
}

}  // namespace
}  // namespace squint
