// A lerp between two rows of a table whose blend is wider than a lane, though the rows' rise is not.
#pragma once

#include "fixedpoint/quantise.h"

namespace squint {

/// Whether lanes of 32 bits split v0 + w (v1 - v0), of numbers from 0 on that `to` can hold once rounded: with
/// v0 = h 2^c + l, c the bits by which `to` is coarser than v0,
///
///     floor((v0 2^b + w (v1 - v0) + bias) 2^-shift) = h + floor((l 2^b + w (v1 - v0) + bias) 2^-shift),  shift = c + b.
///
/// Halves to even ask for the whole result's last bit.  b: the weight's fraction bits.  Where the product is too wide,
/// too, the rise is split once more, half-way through the bits that are lost.
inline bool splits_lerp(const Rescale& to, int weight_bits) {
    const int coarser = to.shift - weight_bits;
    return to.to_even == 0 && coarser >= 0 && to.shift >= 2 && to.shift < 31 &&
           to.highest >= std::int64_t{1} << (31 - to.shift);
}

}  // namespace squint
