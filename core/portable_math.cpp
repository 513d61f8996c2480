// Range reduction and Taylor series in double; pow carries its logarithm in two doubles.
// Nothing here may be contracted to a fused multiply-add: the build says -ffp-contract=off.
#include "core/portable_math.h"
#include "core/portable_math_series.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace squint::portable {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// pi/2 in four parts: the first three have 33 bits, so that k times each is exact for |k| < 2^20.
constexpr double kHalfPi1 = 0x1.921fb54400000p+0;
constexpr double kHalfPi2 = 0x1.0b4611a600000p-34;
constexpr double kHalfPi3 = 0x1.3198a2e000000p-69;
constexpr double kHalfPi4 = 0x1.b839a252049c1p-104;

/// Nearest integer, ties away from zero; |x| < 2^31.
int nearest(double x) {
    return static_cast<int>(x < 0 ? x - 0.5 : x + 0.5);
}

/// 2^k for -1022 <= k <= 1023.
double power_of_two(int k) {
    return std::bit_cast<double>(static_cast<std::uint64_t>(k + 1023) << 52);
}

/// x 2^k, with one rounding where the result is subnormal.
double scale(double x, int k) {
    if (k > 1023) return x * power_of_two(1023) * power_of_two(k - 1023);
    if (k < -1022) return x * power_of_two(k + 200) * power_of_two(-200);
    return x * power_of_two(k);
}

/// A value as an unevaluated sum of two doubles, |low| <= ulp(high) / 2: about 106 bits (Dekker 1971).
struct Double2 {
    double high = 0, low = 0;
};

/// Exactly a + b, for |a| >= |b|.
Double2 quick_sum(double a, double b) {
    const double sum = a + b;
    return {sum, b - (sum - a)};
}

/// Exactly a + b (Knuth).
Double2 sum(double a, double b) {
    const double high = a + b;
    const double b_part = high - a;
    return {high, (a - (high - b_part)) + (b - b_part)};
}

/// Exactly a b, by halves of 26 bits (Dekker); |a|, |b| < 2^990.
Double2 product(double a, double b) {
    constexpr double kSplit = 0x1p27 + 1;
    const double a_scaled = kSplit * a, b_scaled = kSplit * b;
    const double a1 = a_scaled - (a_scaled - a), a2 = a - a1;
    const double b1 = b_scaled - (b_scaled - b), b2 = b - b1;
    const double high = a * b;
    return {high, ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2};
}

Double2 operator+(Double2 a, Double2 b) {
    const Double2 s = sum(a.high, b.high);
    return quick_sum(s.high, s.low + (a.low + b.low));
}

Double2 operator*(Double2 a, Double2 b) {
    const Double2 p = product(a.high, b.high);
    return quick_sum(p.high, p.low + (a.high * b.low + a.low * b.high));
}

Double2 operator/(Double2 a, Double2 b) {
    const double quotient = a.high / b.high;
    const Double2 back = product(quotient, b.high);
    const double rest = ((a.high - back.high) - back.low) + a.low - quotient * b.low;
    return quick_sum(quotient, rest / b.high);
}

/// x = k ln 2 + r, |r| <= 0.35.
struct ExpReduction {
    int k;
    double r;
};
ExpReduction reduce_exp(double x) {
    const int k = nearest(x * (1 / kLn2High));
    return {k, (x - k * kLn2High) - k * kLn2Low};
}

/// sum of coefficient[n] x^n: even and odd powers side by side, so that their multiplies overlap.
template <std::size_t N>
double polynomial(const std::array<double, N>& coefficient, double x) {
    static_assert(N % 2 == 0);
    const double square = x * x;
    double even = coefficient[N - 2], odd = coefficient[N - 1];
    for (std::size_t n = N - 2; n > 0; n -= 2) {
        even = even * square + coefficient[n - 2];
        odd = odd * square + coefficient[n - 1];
    }
    return even + x * odd;
}

/// e^r - 1 for |r| <= 0.35.  The first term left out is r^15 / 15!, below 2^-60 of r.
double expm1_near_zero(double r) {
    return r + r * r * (0.5 + r * polynomial(kFactorials, r));
}

/// x = 2^k m with m in [sqrt(1/2), sqrt(2)), for positive finite x.
struct LogReduction {
    int k;
    double m;
};
LogReduction reduce_log(double x) {
    int k = 0;
    if (x < std::numeric_limits<double>::min()) x *= 0x1p54, k = -54;
    const auto bits = std::bit_cast<std::uint64_t>(x);
    k += static_cast<int>(bits >> 52) - 1023;
    double m = std::bit_cast<double>((bits & 0x000fffffffffffffu) | 0x3ff0000000000000u);
    if (m >= 0x1.6a09e667f3bcdp+0) m *= 0.5, ++k;
    return {k, m};
}

/// ln x to about 2^-66 relative: ln m = 2 s (1 + z/3 + z^2/5 + ...) with s = (m - 1) / (m + 1), z = s^2.
Double2 log_twice(double x) {
    const auto [k, m] = reduce_log(x);
    constexpr Double2 kThird{0x1.5555555555555p-2, 0x1.5555555555555p-56};
    const Double2 s = Double2{m - 1, 0} / sum(m, 1);
    const Double2 z = s * s;
    const Double2 series = Double2{1, 0} + z * (kThird + product(z.high, polynomial(kAtanhFrom2, z.high)));
    const Double2 log_m = Double2{2 * s.high, 2 * s.low} * series;
    return (Double2{k * kLn2High, 0} + product(k, kLn2Low)) + log_m;
}

/// x = quarter pi/2 + r + low, |r| <= 0.79, quarter modulo 4.
struct Turn {
    int quarter;
    double r, low;
};
Turn reduce_turn(double x) {
    const int k = nearest(x * (1 / kHalfPi1));
    const Double2 first = sum(x - k * kHalfPi1, -(k * kHalfPi2));
    const Double2 second = sum(first.high, -(k * kHalfPi3));
    const Double2 r = sum(second.high, (first.low + second.low) - k * kHalfPi4);
    return {k & 3, r.high, r.low};
}

/// sin(r + low): Taylor series to r^19.  The first term left out is r^21 / 21!, below 2^-70 of r.
double sin_near_zero(double r, double low) {
    const double z = r * r;
    double series = 0;
    for (int n = 18; n >= 4; n -= 2)
        series = (series + 1) * -z / (n * (n + 1));  // -z/(4 5) + z^2/(4 5 6 7) - ...
    return r + (low * (1 - 0.5 * z) - r * z * ((1 + series) / 6));
}

/// cos(r + low): Taylor series to r^20.
double cos_near_zero(double r, double low) {
    const double z = r * r;
    double series = 0;
    for (int n = 19; n >= 3; n -= 2)
        series = (series + 1) * -z / (n * (n + 1));  // -z/(3 4) + z^2/(3 4 5 6) - ...
    const double half = 0.5 * z;
    const double top = 1 - half;
    return top + (((1 - top) - half) - (half * series + r * low));
}

bool turns(double x) {
    return std::fabs(x) < 1e6;
}

}  // namespace

double exp(double x) {
    if (x != x) return x;
    if (x > 709.79) return kInfinity;
    if (x < -745.14) return 0;
    const auto [k, r] = reduce_exp(x);
    return scale(1 + expm1_near_zero(r), k);
}

double expm1(double x) {
    if (x != x || std::fabs(x) < 0x1p-54) return x;
    if (x > 709.79) return kInfinity;
    if (x < -40) return -1;
    const auto [k, r] = reduce_exp(x);
    const double p = expm1_near_zero(r);
    if (k == 0) return p;
    if (k > 60) return scale(1 + p, k);
    return power_of_two(k) * p + (power_of_two(k) - 1);
}

double log(double x) {
    if (x != x || x < 0) return kNaN;
    if (x == 0) return -kInfinity;
    if (x == kInfinity) return x;
    const auto [k, m] = reduce_log(x);
    const double f = m - 1;
    const double s = f / (2 + f);
    const double half = 0.5 * f * f;
    // 2 atanh(s) = f - f^2/2 + s (f^2/2 + 2 (z/3 + z^2/5 + ...)): the large terms are exact or nearly so.
    const double z = s * s;
    const double tail = s * (half + 2 * z * polynomial(kAtanhFrom1, z));
    return k * kLn2High - ((half - (tail + k * kLn2Low)) - f);
}

double log1p(double x) {
    if (x != x || x < -1) return kNaN;
    if (x == -1) return -kInfinity;
    if (x == kInfinity) return x;
    const double u = 1 + x;
    const double lost = x < 1 ? x - (u - 1) : 1 - (u - x);  // 1 + x = u + lost, exactly
    return log(u) + lost / u;
}

double pow(double base, double exponent) {
    if (exponent == 0 || base == 1) return 1;
    if (base != base || exponent != exponent || base < 0) return kNaN;
    if (base == 0 || base == kInfinity) return (base == 0) == (exponent > 0) ? 0 : kInfinity;
    const Double2 l = log_twice(base);
    if (!(std::fabs(l.high * exponent) < 800)) return (l.high > 0) == (exponent > 0) ? kInfinity : 0;
    if (std::fabs(exponent) < 0x1p-900) return 1;
    const Double2 x = l * Double2{exponent, 0};
    const double power = exp(x.high);
    return power == kInfinity ? power : power + power * x.low;
}

double sin(double x) {
    if (!turns(x)) return kNaN;
    const auto [quarter, r, low] = reduce_turn(x);
    const double value = quarter & 1 ? cos_near_zero(r, low) : sin_near_zero(r, low);
    return quarter & 2 ? -value : value;
}

double cos(double x) {
    if (!turns(x)) return kNaN;
    const auto [quarter, r, low] = reduce_turn(x);
    const double value = quarter & 1 ? sin_near_zero(r, low) : cos_near_zero(r, low);
    return quarter == 1 || quarter == 2 ? -value : value;
}

double tan(double x) {
    if (!turns(x)) return kNaN;
    const auto [quarter, r, low] = reduce_turn(x);
    const double s = sin_near_zero(r, low), c = cos_near_zero(r, low);
    return quarter & 1 ? -(c / s) : s / c;
}

}  // namespace squint::portable
