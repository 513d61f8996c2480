// Fixed-point formats, roundings and overflow rules: plain values, chosen at run time.
//
//   u1.15   i . fffffffffffffff      16 bits, 1.0 is raw 1 << 15
//   s1.12   s i . ffffffffffff       14 bits: the sign bit is extra
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace squint {

/// I integer bits, F fraction bits, and one more bit when signed.  I is 0 to 24, F 0 to 29, I + F >= 1.
struct Format {
    int integer_bits = 1;
    int fraction_bits = 15;
    bool is_signed = false;

    constexpr int width() const { return integer_bits + fraction_bits + (is_signed ? 1 : 0); }
    constexpr std::int64_t largest() const { return (std::int64_t{1} << (integer_bits + fraction_bits)) - 1; }
    constexpr std::int64_t smallest() const {
        return is_signed ? -(std::int64_t{1} << (integer_bits + fraction_bits)) : 0;
    }
    constexpr std::int64_t one() const { return std::int64_t{1} << fraction_bits; }
    constexpr bool operator==(const Format&) const = default;
};

inline constexpr int kMostIntegerBits = 24, kMostFractionBits = 29;
/// Presets and tables choose no more fraction bits than these by themselves: more would not show.
inline constexpr int kMostChosenFractionBits = 24;

/// What happens to the bits below the last one: SystemC's SC_TRN, SC_TRN_ZERO, SC_RND and SC_RND_CONV.
enum class Rounding : std::uint8_t {
    trn,       // towards minus infinity: the bits are dropped
    trn_zero,  // towards zero
    rnd,       // to nearest, halves towards plus infinity
    rnd_conv,  // to nearest, halves to even
};

/// What happens to values outside the format: SystemC's SC_SAT and SC_WRAP.
enum class Overflow : std::uint8_t { sat, wrap };

/// All that a wire does to a number that arrives on it: it rounds first and limits second.
struct Spec {
    Format format;
    Rounding rounding = Rounding::rnd_conv;
    Overflow overflow = Overflow::sat;
    constexpr bool operator==(const Spec&) const = default;
};

std::string to_string(const Format& format);  // "u1.15"
std::string to_string(Rounding rounding);     // "rnd_conv"
std::string to_string(Overflow overflow);     // "sat"
std::string to_string(const Spec& spec);      // "u1.15 rnd_conv sat"

/// Parsers.  Each returns an empty string and fills `out`, or returns one line that says what is wrong.
std::string parse_format(std::string_view text, Format& out);
std::string parse_rounding(std::string_view text, Rounding& out);
std::string parse_overflow(std::string_view text, Overflow& out);
/// "u1.15", "u1.15 trn", "u1.15 rnd wrap": a part that is left out keeps its value in `out`.
std::string parse_spec(std::string_view text, Spec& out);

}  // namespace squint
