#include "fixedpoint/quantise.h"

#include <cmath>

namespace squint {

std::int64_t quantise_real(double x, const Spec& spec) {
    const Rescale limits(spec.format.fraction_bits, spec);  // nothing to round: its limits alone
    if (std::isnan(x)) return 0;
    // x = mantissa * 2^exponent with a 53-bit integer mantissa: then rounding is an integer matter.
    int exponent = 0;
    const double fraction = std::frexp(x, &exponent);
    if (!std::isfinite(x) || exponent > 80) return x < 0 ? limits.lowest : limits.highest;
    const Int128 mantissa = static_cast<std::int64_t>(std::ldexp(fraction, 53));
    const int from = 53 - exponent;  // fraction bits of the mantissa
    const int excess = from - spec.format.fraction_bits;
    Int128 raw = 0;
    if (excess <= 0) {
        raw = mantissa * (Int128{1} << std::min(-excess, 60));
    } else {
        // Far below the last bit only the sign and "not zero" matter: 62 bits hold both.
        const int shift = std::min(excess, 62);
        const Int128 sticky = excess > 62 ? (mantissa > 0 ? 1 : mantissa < 0 ? -1 : 0) : mantissa;
        raw = round_off(sticky, Rescale(shift, Spec{.format = {24, 0, true}, .rounding = spec.rounding}));
    }
    return static_cast<std::int64_t>(limit(raw, limits));
}

}  // namespace squint
