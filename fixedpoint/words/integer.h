// The words of the model: 64 bits, or 128 where a product needs them.
#pragma once

#include "fixedpoint/quantise.h"
#include "fixedpoint/table.h"

#include <array>
#include <bit>
#include <cassert>
#include <cmath>

namespace squint {

template <class W>
struct WordTag {};

/// An integer as a word.
template <class W>
constexpr W constant(std::int64_t value) {
    return make_word(WordTag<W>{}, value);
}

/// Tells words that list wires that a constant stands on wire `int`, or a table's word does (-1: none).
template <class W>
constexpr void note_wire(WordTag<W>, int) {}

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

/// v0 + w (v1 - v0), exact, for a weight of `weight_bits` fraction bits: v0 and v1 shifted, or between them.
template <Integer W>
constexpr W blend(W v0, W v1, W weight, int weight_bits) {
    return shift_left(v0, weight_bits) + weight * (v1 - v0);
}
/// p + k v.  The caller promises that it lies in [low, high].
template <Integer W>
constexpr W affine(W p, W k, W v, std::int64_t, std::int64_t) {
    return p + k * v;
}
/// x.  The caller promises that it lies in [low, high].
template <Integer W>
constexpr W within(W x, std::int64_t, std::int64_t) {
    return x;
}

/// The number of bits of x >= 0; 0 for 0.
constexpr std::int64_t bit_length(std::int64_t x) {
    return std::bit_width(static_cast<std::uint64_t>(x));
}
constexpr Int128 bit_length(Int128 x) {
    const auto high = static_cast<std::uint64_t>(static_cast<unsigned __int128>(x) >> 64);
    return high ? 64 + std::bit_width(high) : std::bit_width(static_cast<std::uint64_t>(x));
}
/// x 2^bits for bits of either sign; a right shift drops bits (floor).
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

/// numerator / denominator, computed exactly and quantised once; numerator >= 0, denominator > 0.  `to` is
/// built with (numerator's - denominator's) fraction bits, which must not exceed the wire's own.
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

}  // namespace squint
