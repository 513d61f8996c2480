// The one place where bits are lost: quantises an exact integer with `from` fraction bits to a wire's format.
// It rounds first and limits second, as SystemC does.
#pragma once

#include "fixedpoint/format.h"

#include <algorithm>
#include <concepts>
#include <cstdint>

namespace squint {

struct WireStatistics;  // audit.h

using Int128 = __int128;

/// A Spec applied to numbers with `from` fraction bits, as constants computed once per picture:
///
///     q = (x + bias + odd(x >> shift) * to_even + negative(x) * to_zero) >> shift,   then clamp or wrap
struct Rescale {
    int shift = 0;             // fraction bits dropped; if negative, zero bits appended
    std::int64_t bias = 0;     // half a unit of the result, minus one raw bit for rnd_conv
    std::int64_t to_even = 0;  // 1 for rnd_conv
    std::int64_t to_zero = 0;  // (1 << shift) - 1 for trn_zero
    std::int64_t lowest = 0;   // the format's limits, as raw numbers
    std::int64_t highest = 0;
    int width = 0;  // of the format in bits, for wrapping
    bool is_signed = false;
    bool wraps = false;
    bool limits = true;    // false: proven never to be met, and lanes leave them out
    bool active = true;    // Real alone: whether it rounds and limits, or passes values through
    bool divides = false;  // whether it belongs to a quotient, which rounds by its own remainder
    int wire = -1;         // the wire's index, for audits and traces; -1: none
    WireStatistics* statistics = nullptr;  // Audited alone: where it counts
    Rounding rounding = Rounding::trn;

    constexpr Rescale() = default;
    constexpr Rescale(int from_fraction_bits, const Spec& spec, int wire_index = -1)
        : shift(from_fraction_bits - spec.format.fraction_bits),
          lowest(spec.format.smallest()),
          highest(spec.format.largest()),
          width(spec.format.width()),
          is_signed(spec.format.is_signed),
          wraps(spec.overflow == Overflow::wrap),
          wire(wire_index),
          rounding(spec.rounding) {
        if (shift <= 0) return;
        const std::int64_t half = shift < 63 ? std::int64_t{1} << (shift - 1) : 0;
        if (rounding == Rounding::rnd) bias = half;
        if (rounding == Rounding::rnd_conv) bias = half - 1, to_even = 1;
        if (rounding == Rounding::trn_zero) to_zero = 2 * half - 1;
    }
};

/// What a kernel is compiled to assume about every Rescale that it meets.  Each value but the last assumes
/// all that the one before it does.
enum class KnownRescales {
    nothing,
    halves_to_even,  // shift >= 0; trn, rnd or rnd_conv; limits saturate
    halves_up,       // as above, without rnd_conv and without limits
    // Outside this order, and set only where the plan has proven it: rnd_conv without limits, and every
    // product has two factors from 0 to 1 with 15 fraction bits and keeps 15.
    unit_products,
};
inline bool holds(KnownRescales known, const Rescale& to, int lane_bits) {
    // A wire that carries nothing, or one that is not quantised by quantise().
    if (to.width == 0 || to.divides || known == KnownRescales::nothing) return true;
    if (to.shift < 0 || to.shift >= lane_bits || to.to_zero != 0) return false;
    return known == KnownRescales::halves_up ? to.to_even == 0 && !to.limits : !(to.limits && to.wraps);
}

template <class W>
concept Integer = std::same_as<W, std::int64_t> || std::same_as<W, Int128>;

/// Rounds without limiting.
template <Integer W>
constexpr W round_off(W x, const Rescale& to) {
    if (to.shift <= 0) return x * (W{1} << -to.shift);
    return (x + to.bias + ((x >> to.shift) & to.to_even) + (x < 0 ? to.to_zero : 0)) >> to.shift;
}

/// Limits without rounding: saturates, or keeps the lowest `width` bits.
template <Integer W>
constexpr W limit(W x, const Rescale& to) {
    if (!to.wraps) return x < to.lowest ? W{to.lowest} : x > to.highest ? W{to.highest} : x;
    const W modulus = W{1} << to.width;
    const W low_bits = x & (modulus - 1);
    return to.is_signed && low_bits >= modulus / 2 ? low_bits - modulus : low_bits;
}

/// Quantises an exact integer once.  Returns a raw number of the wire's format.
template <Integer W>
[[nodiscard]] constexpr W quantise(W x, const Rescale& to) {
    return limit(round_off(x, to), to);
}

/// Quantises a real number and returns it raw.  Works on the bits of the double, so that it has not the known
/// error of `floor(x 2^F + 1/2)` just below a half.  NaN gives 0; infinities and values outside the format
/// saturate.
std::int64_t quantise_real(double x, const Spec& spec);
/// The same for many numbers: `one` is 2^F, and `to` is built with F fraction bits and the Spec.
inline std::int64_t quantise_real(double x, double one, const Rescale& to) {
    // Scaling by a power of two is exact, and so are a double's whole part and the rest above it: no sum can
    // round up just below a half.
    const double scaled = x * one;
    if (!(scaled > -0x1p62 && scaled < 0x1p62)) return x < 0 ? to.lowest : x > 0 ? to.highest : 0;
    // The usual case, for tables and rays.  Adding 1.5 2^52 leaves no fraction bits: the sum is the nearest
    // integer, halves to even.
    if (to.rounding == Rounding::rnd_conv && scaled > -0x1p51 && scaled < 0x1p51)
        return limit(static_cast<std::int64_t>((scaled + 0x1.8p52) - 0x1.8p52), to);
    auto raw = static_cast<std::int64_t>(scaled);
    raw -= static_cast<double>(raw) > scaled;  // the floor
    const double rest = scaled - static_cast<double>(raw);
    if (to.rounding == Rounding::rnd) raw += rest >= 0.5;
    if (to.rounding == Rounding::rnd_conv) raw += rest > 0.5 || (rest == 0.5 && (raw & 1));
    if (to.rounding == Rounding::trn_zero) raw += rest > 0 && raw < 0;
    return limit(raw, to);
}

/// The real value of a raw number.
constexpr double to_real(std::int64_t raw, const Format& format) {
    return static_cast<double>(raw) / static_cast<double>(format.one());
}

}  // namespace squint
