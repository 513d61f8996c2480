#include "fixedpoint/quantise.h"

#include <cmath>

namespace squint {

std::int64_t quantise_real(double x, const Spec& spec) {
    if (std::isnan(x)) return 0;
    if (spec.rounding == Rounding::rnd_conv && spec.overflow == Overflow::sat) {
        // Tables are built of these.  Adding 1.5 2^52 leaves no fraction bits: the sum is the nearest
        // integer, halves to even.
        const double scaled = x * static_cast<double>(spec.format.one());
        if (std::abs(scaled) < 0x1p51) {
            const auto raw = static_cast<std::int64_t>((scaled + 0x1.8p52) - 0x1.8p52);
            return std::clamp(raw, spec.format.smallest(), spec.format.largest());
        }
    }
    const Rescale limits(spec.format.fraction_bits, spec);  // nothing to round: its limits alone
    // Scaling by a power of two is exact, and so are the floor of a double and what lies above it: no sum can
    // round up just below a half.
    const double scaled = x * static_cast<double>(spec.format.one());
    if (!(std::abs(scaled) < 0x1p62)) return x < 0 ? limits.lowest : limits.highest;
    std::int64_t raw = static_cast<std::int64_t>(scaled);  // towards zero; the floor without a call
    raw -= static_cast<double>(raw) > scaled;
    const double rest = scaled - static_cast<double>(raw);
    if (spec.rounding == Rounding::rnd) raw += rest >= 0.5;
    if (spec.rounding == Rounding::rnd_conv) raw += rest > 0.5 || (rest == 0.5 && (raw & 1));
    if (spec.rounding == Rounding::trn_zero) raw += rest > 0 && raw < 0;
    return limit(raw, limits);
}

}  // namespace squint
