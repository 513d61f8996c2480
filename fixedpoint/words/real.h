// Numbers without rounding: raw units in floating point, where a shift is an exact multiplication.
#pragma once

#include "fixedpoint/audit.h"
#include "fixedpoint/words/word.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace squint {

/// A real number in raw units (value * 2^F of its wire).  It rounds only where a wire's Rescale is active: so
/// one stage alone is put into fixed point.
template <class T>
struct Real {
    using IsReal = void;
    T v = 0;
    static constexpr Real from(double raw) { return {static_cast<T>(raw)}; }
    friend constexpr Real operator+(Real a, Real b) { return {a.v + b.v}; }
    friend constexpr Real operator-(Real a, Real b) { return {a.v - b.v}; }
    friend constexpr Real operator*(Real a, Real b) { return {a.v * b.v}; }
    friend constexpr Real operator/(Real a, Real b) { return {a.v / b.v}; }
    friend constexpr bool operator==(Real a, Real b) { return a.v == b.v; }
    friend constexpr bool operator<(Real a, Real b) { return a.v < b.v; }
};
/// 2^bits, |bits| < 1000, by its exponent: a division would cost as much as all else that a wire does.
template <class T>
constexpr T power_of_two(int bits) {
    constexpr int kBias = 1023, kMantissaBits = 52;  // of a double
    return static_cast<T>(std::bit_cast<double>(static_cast<std::uint64_t>(kBias + bits) << kMantissaBits));
}
template <class T>
constexpr Real<T> make_word(WordTag<Real<T>>, std::int64_t value) {
    return {static_cast<T>(value)};
}
template <class T>
constexpr Real<T> shift_left(Real<T> x, int bits) {
    return {x.v * power_of_two<T>(bits)};
}
template <class T>
Real<T> floor_shift(Real<T> x, int bits) {
    return {std::floor(x.v * power_of_two<T>(-bits))};
}
template <class T>
constexpr Real<T> min(Real<T> a, Real<T> b) {
    return b < a ? b : a;
}
template <class T>
constexpr Real<T> max(Real<T> a, Real<T> b) {
    return a < b ? b : a;
}
template <class T>
Real<T> absolute(Real<T> x) {
    return {std::abs(x.v)};
}
template <class T>
Real<T> square_root(Real<T> x) {
    return {std::sqrt(x.v)};
}
/// 2^x of an integer, -127 < x < 128.
template <class T>
Real<T> whole_power_of_two(Real<T> x) {
    return {power_of_two<T>(static_cast<int>(x.v))};
}
template <class T>
constexpr Real<T> select(bool c, Real<T> yes, Real<T> no) {
    return c ? yes : no;
}
template <class T>
constexpr std::int64_t to_index(Real<T> x) {
    return static_cast<std::int64_t>(x.v);
}
template <class T>
constexpr double to_double(Real<T> x) {
    return static_cast<double>(x.v);
}
template <class T>
Real<T> gather(const Table& t, Real<T> row, int column) {
    const auto at = static_cast<std::int64_t>(row.v);
    return {static_cast<T>(t.active ? static_cast<double>(t.word(at, column)) : t.exact(at, column))};
}
template <class T>
constexpr Real<T> blend(Real<T> a, Real<T> b, Real<T> w, int bits) {
    return {a.v * power_of_two<T>(bits) + w.v * (b.v - a.v)};
}
template <class T>
constexpr Real<T> affine(Real<T> p, Real<T> k, Real<T> v, std::int64_t, std::int64_t) {
    return {p.v + k.v * v.v};
}
template <class T>
constexpr Real<T> within(Real<T> x, std::int64_t, std::int64_t) {
    return x;
}
/// The number of bits of an integer; 0 for 0.
template <class T>
Real<T> bit_length(Real<T> x) {
    int bits = 0;
    if (x.v > 0) std::frexp(x.v, &bits);
    return {static_cast<T>(bits)};
}
template <class T>
Real<T> shift_by(Real<T> x, Real<T> bits) {
    return {std::floor(x.v * power_of_two<T>(static_cast<int>(bits.v)))};
}
/// For traces: records a wire's value without rounding it.
template <class T>
Real<T> traced(Real<T> value, const Rescale& to) {
    if (to.statistics->trace) {
        const double nearest = std::floor(static_cast<double>(value.v) + 0.5);
        to.statistics->trace->push_back(
            {to.wire, static_cast<double>(value.v), static_cast<std::int64_t>(nearest)});
    }
    return value;
}
// Where a wire's Rescale is active.
template <class T>
Real<T> rounded_raw(T scaled, const Rescale& to) {
    // Exact for |scaled| < 2^52: the fraction of a double is a double.
    const T below = std::floor(scaled), rest = scaled - below;
    T rounded = below;
    if (to.rounding == Rounding::rnd && rest >= T(0.5)) rounded += 1;
    if (to.rounding == Rounding::rnd_conv &&
        (rest > T(0.5) || (rest == T(0.5) && std::fmod(below, T(2)) != 0)))
        rounded += 1;
    if (to.rounding == Rounding::trn_zero && rest > 0 && below < 0) rounded += 1;
    if (!to.wraps)
        return {std::min(std::max(rounded, static_cast<T>(to.lowest)), static_cast<T>(to.highest))};
    return {static_cast<T>(limit(static_cast<Int128>(rounded), to))};
}
/// quantise of what has the wire's fraction bits already: to.shift is not asked.
template <class T>
Real<T> quantise_raw(Real<T> raw, const Rescale& to) {
    if (to.active) return rounded_raw(raw.v, to);
    return to.statistics ? traced(raw, to) : raw;
}
template <class T>
Real<T> quantise(Real<T> x, const Rescale& to) {
    return quantise_raw(Real<T>{x.v * power_of_two<T>(-to.shift)}, to);
}
template <class T>
Real<T> quotient(Real<T> numerator, Real<T> denominator, const Rescale& to) {
    return quantise_raw(Real<T>{numerator.v * power_of_two<T>(-to.shift) / denominator.v}, to);
}

static_assert(Word<Real<double>> && Word<Real<float>> && RealWord<Real<double>>);

}  // namespace squint
