// A calculator in formats: the arithmetic of `squint number`, and an oracle for other implementations.
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

/// One operation, its operands and its result.
struct Calculation {
    Spec spec;                           // of the result
    std::string operation;               // add, sub, mul, madd, lerp; "" for a conversion
    std::vector<std::int64_t> operands;  // raw, each in its own format
    std::vector<Format> operand_formats;
    std::vector<bool> operand_overflow;  // whether the format's limits changed the operand as it was read
    Exact exact;                         // the result before it is quantised
    bool sticky = false;                 // the true result exceeds `exact` by less than one last bit
    std::int64_t raw = 0;
    bool inexact = false;   // whether rounding changed it
    bool overflow = false;  // whether the format's limits changed it
};

/// Evaluates one operation, given as words:
///
///     RESULT NUMBER              u1.15 0.7                     a decimal, rounded once
///     RESULT OPERATION OPERAND.. u1.15 trn mul u1.15 0.7 0.7   exact on raw operands, quantised once
///
/// RESULT is a Spec.  OPERATION is add +, sub -, mul *, madd (a b + c) or lerp (a + w (b - a)).  An OPERAND
/// is a number after its Spec; without one it takes that of the operand before it, the first that of RESULT.
/// A number is decimal (at most 18 digits, rounded to its Spec), #raw or 0xraw.  Returns an empty string and
/// fills `out`; on bad input returns one line that says what was found and what is allowed.
std::string calculate(const std::vector<std::string>& words, Calculation& out);

/// All digits of the value: "0.0001220703125", "-3".
std::string decimal(const Exact& exact);
/// The bits of the two's complement in hexadecimal: "0x599a".
std::string hex(std::int64_t raw, const Format& format);
/// The bits of the two's complement with a binary point before the fraction: "0.101100110011010" is a sign,
/// integer and fraction bits.
std::string bits(std::int64_t raw, const Format& format);

/// The result minus the exact value; `last_bits` gives it in units of the result's last bit.
Exact error_of(const Calculation& calculation);
double last_bits(const Calculation& calculation);

}  // namespace squint
