#include "core/portable_math.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <vector>

namespace {

using squint::portable::cos;
using squint::portable::exp;
using squint::portable::expm1;
using squint::portable::log;
using squint::portable::log1p;
using squint::portable::pow;
using squint::portable::sin;
using squint::portable::tan;

constexpr double kPromised = 0x1p-50;  // the relative error that portable_math.h states
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Doubles whose bits come from a generator that the standard fixes, not from a distribution, which it leaves
/// open.
class Draws {
  public:
    double uniform(double low, double high) {
        return low + (high - low) * (static_cast<double>(next_() >> 11) * 0x1p-53);
    }
    double over_binades(int low, int high) {  // positive, every binade of [2^low, 2^high) alike
        const auto exponent =
            static_cast<std::uint64_t>(low + 1023) + next_() % static_cast<std::uint64_t>(high - low);
        return std::bit_cast<double>(exponent << 52 | next_() >> 12);
    }

  private:
    std::mt19937_64 next_{20260};
};

double relative_error(double value, long double exact) {
    return exact == 0 ? std::fabs(value) : static_cast<double>(std::fabs((value - exact) / exact));
}

struct Worst {
    double error = 0, at = 0;
    void operator()(double x, double value, long double exact) {
        const double e = relative_error(value, exact);
        if (!(e <= error)) error = e, at = x;
    }
};

TEST(PortableMath, ExpAndExpm1StayWithinTheirStatedError) {
    Draws draw;
    Worst exp_error, expm1_error;
    for (int i = 0; i < 200000; ++i) {
        const double x = draw.uniform(-700, 700), small = draw.over_binades(-60, 2) * (i % 2 ? 1 : -1);
        exp_error(x, exp(x), std::exp(static_cast<long double>(x)));
        exp_error(small, exp(small), std::exp(static_cast<long double>(small)));
        expm1_error(x, expm1(x), std::expm1(static_cast<long double>(x)));
        expm1_error(small, expm1(small), std::expm1(static_cast<long double>(small)));
    }
    EXPECT_LE(exp_error.error, kPromised) << exp_error.at;
    EXPECT_LE(expm1_error.error, kPromised) << expm1_error.at;
}

TEST(PortableMath, LogAndLog1pStayWithinTheirStatedError) {
    Draws draw;
    Worst log_error, log1p_error;
    for (int i = 0; i < 200000; ++i) {
        const double x = draw.over_binades(-1070, 1023), near_one = draw.uniform(0.4, 2.1);
        log_error(x, log(x), std::log(static_cast<long double>(x)));
        log_error(near_one, log(near_one), std::log(static_cast<long double>(near_one)));
        const double small = draw.over_binades(-60, 60), negative = -draw.over_binades(-60, 0);
        log1p_error(small, log1p(small), std::log1p(static_cast<long double>(small)));
        log1p_error(negative, log1p(negative), std::log1p(static_cast<long double>(negative)));
    }
    EXPECT_LE(log_error.error, kPromised) << log_error.at;
    EXPECT_LE(log1p_error.error, kPromised) << log1p_error.at;
}

TEST(PortableMath, PowStaysWithinItsStatedErrorAlsoWhereTheExponentMagnifiesTheLogarithm) {
    Draws draw;
    Worst error;
    for (int i = 0; i < 200000; ++i) {
        const double base = draw.over_binades(-40, 40), unit = draw.uniform(0.5, 1.5);
        const double exponent = draw.uniform(-16, 16), large = draw.uniform(-600, 600);
        error(base, pow(base, exponent),
              std::pow(static_cast<long double>(base), static_cast<long double>(exponent)));
        error(unit, pow(unit, large),
              std::pow(static_cast<long double>(unit), static_cast<long double>(large)));
    }
    EXPECT_LE(error.error, kPromised) << error.at;
}

TEST(PortableMath, SinCosAndTanStayWithinTheirStatedErrorAlsoBesideTheirZeros) {
    Draws draw;
    Worst sin_error, cos_error, tan_error;
    const auto try_at = [&](double x) {
        const auto exact = static_cast<long double>(x);
        sin_error(x, sin(x), std::sin(exact));
        cos_error(x, cos(x), std::cos(exact));
        tan_error(x, tan(x), std::tan(exact));
    };
    for (int i = 0; i < 100000; ++i) {
        try_at(draw.uniform(-10, 10));
        try_at(draw.uniform(-1e6, 1e6));
        try_at(draw.over_binades(-60, 0));
        try_at(static_cast<double>(i * 1.5707963267948966192L));  // the double nearest a multiple of pi/2
    }
    EXPECT_LE(sin_error.error, kPromised) << sin_error.at;
    EXPECT_LE(cos_error.error, kPromised) << cos_error.at;
    EXPECT_LE(tan_error.error, kPromised) << tan_error.at;
}

TEST(PortableMath, ExactValuesAreExact) {
    EXPECT_EQ(exp(0), 1);
    EXPECT_EQ(expm1(0), 0);
    EXPECT_EQ(log(1), 0);
    EXPECT_EQ(log1p(0), 0);
    EXPECT_EQ(pow(2, 10), 1024);
    EXPECT_EQ(pow(4, 0.5), 2);
    EXPECT_EQ(pow(2, -1074), 0x1p-1074);
    EXPECT_EQ(pow(0, 0), 1);
    EXPECT_EQ(pow(0, 2), 0);
    EXPECT_EQ(pow(0, -2), kInfinity);
    EXPECT_EQ(pow(1, kInfinity), 1);
    EXPECT_EQ(sin(0), 0);
    EXPECT_EQ(cos(0), 1);
    EXPECT_EQ(tan(0), 0);
}

TEST(PortableMath, BeyondTheRangeThereIsZeroOrInfinityAndOutsideTheDomainNotANumber) {
    EXPECT_EQ(exp(1000), kInfinity);
    EXPECT_EQ(exp(-1000), 0);
    EXPECT_EQ(exp(kInfinity), kInfinity);
    EXPECT_EQ(exp(-kInfinity), 0);
    EXPECT_EQ(expm1(1000), kInfinity);
    EXPECT_EQ(expm1(-1000), -1);
    EXPECT_EQ(log(0), -kInfinity);
    EXPECT_EQ(log(kInfinity), kInfinity);
    EXPECT_EQ(log1p(-1), -kInfinity);
    EXPECT_EQ(pow(10, 400), kInfinity);
    EXPECT_EQ(pow(10, -400), 0);
    EXPECT_EQ(pow(0.1, 1e300), 0);
    EXPECT_EQ(pow(1.5, 1e300), kInfinity);
    EXPECT_EQ(pow(2, 1e-320), 1);
    EXPECT_TRUE(std::isnan(log(-1)));
    EXPECT_TRUE(std::isnan(log1p(-2)));
    EXPECT_TRUE(std::isnan(pow(-1, 0.5)));
    EXPECT_TRUE(std::isnan(sin(kInfinity)));
    for (const auto f : {exp, expm1, log, log1p, sin, cos, tan}) EXPECT_TRUE(std::isnan(f(std::nan(""))));
}

/// FNV-1a over the bits of 100,000 values.
std::uint64_t fingerprint(const std::function<double(Draws&)>& next) {
    Draws draw;
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (int i = 0; i < 100000; ++i) {
        auto bits = std::bit_cast<std::uint64_t>(next(draw));
        for (int byte = 0; byte < 8; ++byte, bits >>= 8) hash = (hash ^ (bits & 255)) * 0x100000001b3u;
    }
    return hash;
}

// Whatever the vectors' length, and whatever stands beside a number: zeros, tiny, deep and huge ones among
// the usual.
TEST(PortableMath, ManyAtOnceHaveTheBitsOfEachAlone) {
    Draws draw;
    std::vector<double> x{0.0, -0.0, 1e-300, -0x1p-54, -0x1p-53, -1.0, 1.0, -40, 40, -40.5, 41, 800, -800};
    for (int i = 0; i < 20000; ++i) x.push_back(draw.uniform(-1, i % 97 ? 0 : 1));
    for (int i = 0; i < 20000; ++i) x.push_back(draw.uniform(i % 97 ? -40 : -800, i % 89 ? 0 : 800));
    for (int i = 0; i < 1000; ++i) x.push_back(-draw.over_binades(-60, 0));
    x.insert(x.end(), {-kInfinity, kInfinity, std::nan("")});
    std::vector<double> exponentials(x.size()), logarithms(x.size());
    squint::portable::expm1_each(x, exponentials), squint::portable::log1p_each(x, logarithms);
    for (std::size_t i = 0; i < x.size(); ++i) {
        const auto bits = [](double value) {
            return std::isnan(value) ? 0 : std::bit_cast<std::uint64_t>(value);
        };
        ASSERT_EQ(bits(exponentials[i]), bits(expm1(x[i]))) << x[i];
        ASSERT_EQ(bits(logarithms[i]), bits(log1p(x[i]))) << x[i];
    }
}

// A compiler or CPU that differs in the last bit of one value in 100,000 changes these.
TEST(PortableMath, EveryMachineGetsTheseBits) {
    EXPECT_EQ(fingerprint([](Draws& draw) { return exp(draw.uniform(-745, 709)); }), 0x58c1ff18ed112f21u);
    EXPECT_EQ(fingerprint([](Draws& draw) { return expm1(draw.uniform(-5, 5)); }), 0xe204c16c27e591du);
    EXPECT_EQ(fingerprint([](Draws& draw) { return log(draw.over_binades(-60, 60)); }), 0x3ea9d394b2205b4au);
    EXPECT_EQ(fingerprint([](Draws& draw) { return log1p(draw.uniform(-1, 1)); }), 0x891960abe9eb94d8u);
    EXPECT_EQ(fingerprint([](Draws& draw) {
                  const double base = draw.uniform(0, 2);
                  return pow(base, draw.uniform(-64, 64));
              }),
              0x172ae99353a7d6au);
    EXPECT_EQ(fingerprint([](Draws& draw) { return sin(draw.uniform(-1000, 1000)); }), 0x455c6a75b7fc468bu);
    EXPECT_EQ(fingerprint([](Draws& draw) { return cos(draw.uniform(-1000, 1000)); }), 0x3191410811c7726bu);
    EXPECT_EQ(fingerprint([](Draws& draw) { return tan(draw.uniform(-1000, 1000)); }), 0x29c0d3f06f6d698du);
}

}  // namespace
