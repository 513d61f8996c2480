// The scalar words a stage's arithmetic can run in.  A stage is written once over W and uses only what is
// here:
//
//   + - *   shift_left  floor_shift  min max absolute  == <  select  any  constant<W>  gather  bit_length
//   vector_length quantise  quotient(s)  blend  affine  within
//
// Integer<W>   the model: 64 bits, or 128 where a product needs them
// Audited      the model, counting what every wire carried
// Real<T>      no rounding: raw units in floating point; shifts are exact multiplications
// Range        intervals: what a stage's exact results can reach, and so how wide a word it needs
//              (pipeline/plan/ranges.cpp)
// Lanes        many samples side by side: words/lanes-inl.h
//
// Wide<W>      beside W, for the few numbers that need more bits than all others: at the end of this file
#pragma once

#include "fixedpoint/audit.h"
#include "fixedpoint/quantise.h"
#include "fixedpoint/table.h"

#include <array>
#include <bit>
#include <cassert>
#include <cmath>

namespace squint {

template <class W>
struct WordTag {};

/// The word that holds an integer.
template <class W>
constexpr W constant(std::int64_t value) {
    return make_word(WordTag<W>{}, value);
}

/// Says that a constant stands on a wire, by its index, or a table's word (-1: none): for words that list wires.
template <class W>
constexpr void note_wire(WordTag<W>, int) {}

// ---------------------------------------------------------------------------------------- integers

template <Integer W>
constexpr W make_word(WordTag<W>, std::int64_t value) {
    return value;
}
template <Integer W>
constexpr W shift_left(W x, int bits) {
    return x * (W{1} << bits);
}
template <Integer W>
constexpr W floor_shift(W x, int bits) {
    return x >> bits;
}
template <Integer W>
constexpr W min(W a, W b) {
    return b < a ? b : a;
}
template <Integer W>
constexpr W max(W a, W b) {
    return a < b ? b : a;
}
template <Integer W>
constexpr W absolute(W x) {
    return x < 0 ? -x : x;
}
template <Integer W>
constexpr W select(bool condition, W yes, W no) {
    return condition ? yes : no;
}
constexpr bool any(bool condition) {
    return condition;
}
template <Integer W>
constexpr std::int64_t to_index(W x) {
    return static_cast<std::int64_t>(x);
}
template <Integer W>
constexpr double to_double(W x) {
    return static_cast<double>(x);
}
template <Integer W>
W gather(const Table& table, W row, int column) {
    return table.word(static_cast<std::int64_t>(row), column);
}

/// v0 + w (v1 - v0) with a weight of `weight_bits` fraction bits, exact: lies between v0 and v1, shifted.
template <Integer W>
constexpr W blend(W v0, W v1, W weight, int weight_bits) {
    return shift_left(v0, weight_bits) + weight * (v1 - v0);
}
/// p + k v, known by its meaning to lie in [low, high].
template <Integer W>
constexpr W affine(W p, W k, W v, std::int64_t, std::int64_t) {
    return p + k * v;
}
/// x, known by its meaning to lie in [low, high].
template <Integer W>
constexpr W within(W x, std::int64_t, std::int64_t) {
    return x;
}

/// Bits of |x|: 0 for 0.  x >= 0.
constexpr std::int64_t bit_length(std::int64_t x) {
    return std::bit_width(static_cast<std::uint64_t>(x));
}
constexpr Int128 bit_length(Int128 x) {
    const auto high = static_cast<std::uint64_t>(static_cast<unsigned __int128>(x) >> 64);
    return high ? 64 + std::bit_width(high) : std::bit_width(static_cast<std::uint64_t>(x));
}
/// x 2^bits for bits of either sign; bits below the last are dropped (floor).
template <Integer W>
constexpr W shift_by(W x, W bits) {
    return bits >= 0 ? shift_left(x, static_cast<int>(bits)) : floor_shift(x, static_cast<int>(-bits));
}
/// floor(|v| 2^guard) of a vector whose components are at least 0 and below 2^15; guard <= 10.
template <Integer W>
W vector_length(const std::array<W, 3>& v, int guard) {
    // The double nearest to the root of an integer below 2^52 has the right floor: the root of a non-square
    // is at least 2^-27 away from an integer, far more than half a unit in a double's last place there.
    const W squares = shift_left(v[0] * v[0] + v[1] * v[1] + v[2] * v[2], 2 * guard);
    return static_cast<std::int64_t>(std::sqrt(static_cast<double>(static_cast<std::int64_t>(squares))));
}

/// numerator / denominator, exact, then quantised once.  numerator >= 0, denominator > 0.  `to` is built with
/// (numerator's - denominator's) fraction bits, which must not exceed the wire's own.
template <Integer W>
constexpr W quotient(W numerator, W denominator, const Rescale& to) {
    assert(to.shift <= 0);
    const W scaled = shift_left(numerator, -to.shift);
    W q = scaled / denominator;
    const W twice_rest = 2 * (scaled - q * denominator);
    if (to.rounding == Rounding::rnd && twice_rest >= denominator) q += 1;
    if (to.rounding == Rounding::rnd_conv &&
        (twice_rest > denominator || (twice_rest == denominator && (q & 1))))
        q += 1;
    return limit(q, to);
}

// ----------------------------------------------------------------------------------------- audited

/// The model's 128-bit word that counts what arrives on each wire.
struct Audited {
    Int128 v = 0;
    friend constexpr Audited operator+(Audited a, Audited b) { return {a.v + b.v}; }
    friend constexpr Audited operator-(Audited a, Audited b) { return {a.v - b.v}; }
    friend constexpr Audited operator*(Audited a, Audited b) { return {a.v * b.v}; }
    friend constexpr bool operator==(Audited a, Audited b) { return a.v == b.v; }
    friend constexpr bool operator<(Audited a, Audited b) { return a.v < b.v; }
};
constexpr Audited make_word(WordTag<Audited>, std::int64_t value) {
    return {value};
}
constexpr Audited shift_left(Audited x, int bits) {
    return {shift_left(x.v, bits)};
}
constexpr Audited floor_shift(Audited x, int bits) {
    return {x.v >> bits};
}
constexpr Audited min(Audited a, Audited b) {
    return b < a ? b : a;
}
constexpr Audited max(Audited a, Audited b) {
    return a < b ? b : a;
}
constexpr Audited absolute(Audited x) {
    return {absolute(x.v)};
}
constexpr Audited select(bool c, Audited yes, Audited no) {
    return c ? yes : no;
}
constexpr double to_double(Audited x) {
    return static_cast<double>(x.v);
}
constexpr std::int64_t to_index(Audited x) {
    return static_cast<std::int64_t>(x.v);
}
inline Audited gather(const Table& t, Audited row, int column) {
    return {gather(t, row.v, column)};
}
constexpr Audited blend(Audited a, Audited b, Audited w, int bits) {
    return {blend(a.v, b.v, w.v, bits)};
}
constexpr Audited affine(Audited p, Audited k, Audited v, std::int64_t, std::int64_t) {
    return {p.v + k.v * v.v};
}
constexpr Audited within(Audited x, std::int64_t, std::int64_t) {
    return x;
}
constexpr Audited bit_length(Audited x) {
    return {bit_length(x.v)};
}
constexpr Audited shift_by(Audited x, Audited bits) {
    return {shift_by(x.v, bits.v)};
}
inline Audited vector_length(const std::array<Audited, 3>& v, int guard) {
    return {vector_length(std::array<Int128, 3>{v[0].v, v[1].v, v[2].v}, guard)};
}

inline Audited record(Int128 rounded, bool inexact, double exact, const Rescale& to) {
    const Int128 raw = limit(rounded, to);
    if (WireStatistics* s = to.statistics) {
        const auto value = static_cast<std::int64_t>(raw);
        ++s->count;
        s->inexact += inexact;
        s->underflowed += inexact && rounded == 0;
        if (raw != rounded) ++(to.wraps ? s->wrapped : s->saturated);
        s->smallest = std::min(s->smallest, value);
        s->largest = std::max(s->largest, value);
        ++s->magnitude[static_cast<std::size_t>(bit_length(absolute(value)))];
        if (s->trace) s->trace->push_back({to.wire, exact, value});
    }
    return {raw};
}
inline Audited quantise(Audited x, const Rescale& to) {
    const Int128 rounded = round_off(x.v, to);
    return record(rounded, to.shift > 0 && (rounded << to.shift) != x.v,
                  std::ldexp(static_cast<double>(x.v), -to.shift), to);
}
inline Audited quotient(Audited numerator, Audited denominator, const Rescale& to) {
    Rescale unlimited = to;
    unlimited.wraps = false, unlimited.lowest = std::numeric_limits<std::int64_t>::min(),
    unlimited.highest = std::numeric_limits<std::int64_t>::max();
    const Int128 q = quotient(numerator.v, denominator.v, unlimited);
    const Int128 scaled = shift_left(numerator.v, -to.shift);
    return record(q, q * denominator.v != scaled,
                  static_cast<double>(scaled) / static_cast<double>(denominator.v), to);
}

// -------------------------------------------------------------------------------------------- real

/// A real number in raw units (value * 2^F of its wire): no rounding but where a wire's Rescale is active,
/// which is how one stage alone is put into fixed point.
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
/// Real<T> and lanes of floats.
template <class W>
concept RealWord = requires {
    typename W::IsReal;
};
/// 2^bits, |bits| < 1000.
template <class T>
constexpr T power_of_two(int bits) {
    return bits >= 0 ? (bits < 63 ? static_cast<T>(std::uint64_t{1} << bits)
                                  : power_of_two<T>(bits - 62) * power_of_two<T>(62))
                     : 1 / power_of_two<T>(-bits);
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
/// 2^x of whole numbers, -127 < x < 128.
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
/// Of whole numbers.
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
/// For traces: a wire's value without its rounding.
template <class T>
Real<T> traced(Real<T> value, const Rescale& to) {
    if (to.statistics && to.statistics->trace) {
        const double nearest = std::floor(static_cast<double>(value.v) + 0.5);
        to.statistics->trace->push_back(
            {to.wire, static_cast<double>(value.v), static_cast<std::int64_t>(nearest)});
    }
    return value;
}
template <class T>
Real<T> quantise(Real<T> x, const Rescale& to) {
    const T scaled = x.v * power_of_two<T>(-to.shift);
    if (!to.active) return traced(Real<T>{scaled}, to);
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
template <class T>
Real<T> quotient(Real<T> numerator, Real<T> denominator, const Rescale& to) {
    Rescale raw = to;
    raw.shift = 0;
    return quantise(Real<T>{numerator.v * power_of_two<T>(-to.shift) / denominator.v}, raw);
}

// ------------------------------------------------------------------------------------------- range

/// How wide a stage's numbers get.
struct WordNeeds {
    int wide_bits = 0;     // the widest number of a Wide<W>, sign included
    int operand_bits = 0;  // the widest factor of a multiplication, sign included
    int result_bits = 0;   // the widest exact result, sign included
    int lane_bits = 0;     // the same where numbers may wrap on the way to a result that fits: lanes do
    void merge(const WordNeeds& other) {
        operand_bits = std::max(operand_bits, other.operand_bits);
        result_bits = std::max(result_bits, other.result_bits);
        lane_bits = std::max(lane_bits, other.lane_bits);
        wide_bits = std::max(wide_bits, other.wide_bits);
    }
};

/// Every value an expression can take: lowest and highest.  Operations note their widths in `needs`.
struct Range {
    Int128 low = 0, high = 0;
    static thread_local WordNeeds needs;
    static thread_local std::uint64_t limited;  // bit w: wire w can saturate or wrap
    static thread_local std::uint64_t used;     // bit w: something passes wire w, or is read from its table
};
inline void note_wire(WordTag<Range>, int wire) {
    if (wire >= 0) Range::used |= std::uint64_t{1} << wire;
}
/// A comparison of ranges: both answers are looked at.
struct Perhaps {
    friend constexpr Perhaps operator&(Perhaps, Perhaps) { return {}; }
    friend constexpr Perhaps operator|(Perhaps, Perhaps) { return {}; }
    friend constexpr Perhaps operator!(Perhaps) { return {}; }
};
constexpr bool any(Perhaps) {
    return true;
}
int signed_bits(Range x);
Range noted(Range result);
Range operator+(Range a, Range b);
Range operator-(Range a, Range b);
Range operator*(Range a, Range b);
constexpr Perhaps operator==(Range, Range) {
    return {};
}
constexpr Perhaps operator<(Range, Range) {
    return {};
}
constexpr Range make_word(WordTag<Range>, std::int64_t value) {
    return {value, value};
}
Range shift_left(Range x, int bits);
Range floor_shift(Range x, int bits);
Range min(Range a, Range b);
Range max(Range a, Range b);
Range absolute(Range x);
Range select(Perhaps, Range yes, Range no);
Range gather(const Table& table, Range row, int column);
Range blend(Range v0, Range v1, Range weight, int weight_bits);
Range affine(Range p, Range k, Range v, std::int64_t low, std::int64_t high);
Range within(Range x, std::int64_t low, std::int64_t high);
Range bit_length(Range x);
Range shift_by(Range x, Range bits);
Range vector_length(const std::array<Range, 3>& v, int guard);
Range quantise(Range x, const Rescale& to);
Range quotient(Range numerator, Range denominator, const Rescale& to);

// ------------------------------------------------------------------------------------ wide numbers

/// A few numbers of a stage may need more bits than all others: differences of sums, which a quotient makes
/// small again.  A Wide<W> holds them next to W: it is W itself where W is wide enough for anything; lanes of
/// 32 bits take doubles, exact up to 53 bits.
///
///   widen  wide_sum  wide_product  -  shift_left  absolute  max  quotient
template <class W>
struct WideOf {
    using Type = W;
};
template <class W>
using Wide = typename WideOf<W>::Type;
template <class W>
constexpr W widen(W x) {
    return x;
}
/// high 2^bits + low.
template <class W>
constexpr W wide_sum(W high, int bits, W low) {
    return shift_left(high, bits) + low;
}
template <class W>
constexpr W wide_product(W a, W b) {
    return a * b;
}
struct WideRange {
    Range range;
};
template <>
struct WideOf<Range> {
    using Type = WideRange;
};
/// Whether any of the numbers side by side is above zero.
template <class N>
constexpr bool any_positive(const N& x) {
    return any(constant<N>(0) < x);
}
constexpr bool any_positive(const WideRange&) {
    return true;
}
WideRange widen(Range x);
WideRange wide_sum(Range high, int bits, Range low);
WideRange wide_product(Range a, Range b);
WideRange operator-(WideRange a, WideRange b);
WideRange shift_left(WideRange x, int bits);
WideRange absolute(WideRange x);
WideRange max(WideRange a, WideRange b);
Range quotient(WideRange numerator, WideRange denominator, const Rescale& to);

/// Between rows `row` and `row + 1` of a table of four columns: red, green, blue, alpha.
template <class W>
std::array<W, 4> lerp_rows(const Table& table, W row, W weight, int weight_bits, const Rescale& to_color,
                           const Rescale& to_alpha) {
    std::array<W, 4> between;
    for (int c = 0; c < 4; ++c)
        between[static_cast<std::size_t>(c)] = quantise(
            blend(gather(table, row, c), gather(table, row + constant<W>(1), c), weight, weight_bits),
            c < 3 ? to_color : to_alpha);
    return between;
}

/// Quotients by one denominator.
template <class W>
constexpr std::array<W, 3> quotients(const std::array<W, 3>& numerators, W denominator, const Rescale& to) {
    return {quotient(numerators[0], denominator, to), quotient(numerators[1], denominator, to),
            quotient(numerators[2], denominator, to)};
}

/// a b, exact, then quantised once.
template <class W>
constexpr W quantised_product(W a, W b, const Rescale& to) {
    return quantise(a * b, to);
}

template <class W>
constexpr W clamp(W x, W low, W high) {
    return min(max(x, low), high);
}

}  // namespace squint
