// How narrow lanes find the remainder of a wide quotient where no multiply-add rounds once: what lanes do, and what
// intervals note for them.
#pragma once

namespace squint {

/// Whether a quotient of so many bits is multiplied by both halves of the denominator, of 27 and 26 bits; else the
/// denominator by both halves of the quotient.
constexpr bool splits_denominator(int width) {
    return width <= 26;
}
/// The bits that a double needs for that, beside the denominator's.
constexpr int bits_beside_denominator(int width) {
    return splits_denominator(width) ? 1 : width / 2 + 2;
}

}  // namespace squint
