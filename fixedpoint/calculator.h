// A calculator in formats: what `squint number` does, and an oracle for other implementations.
#pragma once

#include "fixedpoint/quantise.h"

#include <string>
#include <vector>

namespace squint {

/// An exact number: value / 2^fraction_bits.
struct Exact {
    Int128 value = 0;
    int fraction_bits = 0;
};

/// One operation and what became of it.
struct Calculation {
    Spec spec;                           // of the result
    std::string operation;               // "" for a conversion, add, sub, mul, madd, lerp
    std::vector<std::int64_t> operands;  // raw, each in its own format
    std::vector<Format> operand_formats;
    std::vector<bool> operand_overflow;  // the format's limits changed the operand as it was read
    Exact exact;                         // what would stand there without an end of bits
    bool sticky = false;                 // the exact value lies above `exact`, by less than its last bit
    std::int64_t raw = 0;
    bool inexact = false;   // rounding changed it
    bool overflow = false;  // the format's limits changed it
};

/// Words of one operation:
///
///     RESULT NUMBER              u1.15 0.7                     a decimal, rounded once
///     RESULT OPERATION OPERAND.. u1.15 trn mul u1.15 0.7 0.7   exact on raw operands, quantised once
///
/// RESULT is a Spec; OPERATION add + sub - mul * madd (a b + c) lerp (a + w (b - a)); an OPERAND is a number
/// after its Spec, which may be left out where it is the one before (the first: RESULT's).  A number is
/// decimal (at most 18 digits, rounded to its Spec), #raw or 0xraw.  Returns an empty string and fills `out`,
/// or one line: what was found, what is allowed.
std::string calculate(const std::vector<std::string>& words, Calculation& out);

/// Every digit: "0.0001220703125", "-3".
std::string decimal(const Exact& exact);
/// "0x599a", the bits of two's complement.
std::string hex(std::int64_t raw, const Format& format);
/// "0.101100110011010": sign, integer and fraction bits of two's complement, with a point before the
/// fraction.
std::string bits(std::int64_t raw, const Format& format);

/// Result less exact value; `last_bits` counts it in units of the result's last bit.
Exact error_of(const Calculation& calculation);
double last_bits(const Calculation& calculation);

}  // namespace squint
