// What the parts of a certificate share: who pays for what an operation takes.
#pragma once

#include "fixedpoint/words/bounded.h"
#include "scene/wires.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <utility>

namespace squint {

constexpr int index_of(Wire wire) {
    return static_cast<int>(wire);
}
inline double in_double(Int128 x) {
    return static_cast<double>(x);
}
/// What quantising to a wire may take, in units of its last bit: nothing where it drops no bits.
inline double unit_of(const Rescale& to) {
    return to.shift > 0 ? rounding_of(1e-300, to.rounding) : 0;
}
/// Adds `known` to `shares`: as much as `usual` says of each, and what is more to the last.
inline void add_local(Shares& shares, double known, std::initializer_list<std::pair<int, double>> usual) {
    if (known == 0) return;
    double left = known;
    int last = Shares::kElsewhere;
    for (const auto& [who, error] : usual) shares[last = who] += error, left -= error;
    if (left > 0) shares[last] += left;
}

/// The number between eight corners, in integers: a whole one has 2^bits units.
class BetweenCorners {
  public:
    /// Of weights of `weight_bits` fraction bits; those above 34 are dropped.
    BetweenCorners(const std::array<std::int64_t, 8>& corner, const std::array<Bounded, 3>& weight,
                   int weight_bits) {
        const int dropped = std::max(weight_bits - 34, 0), bits = weight_bits - dropped;
        std::array<Int128, 8> at{};
        std::int64_t most = 0;
        for (std::size_t i = 0; i < 8; ++i) {
            at[i] = corner[i];
            most = std::max(most, corner[i] < 0 ? -corner[i] : corner[i]);
        }
        for (std::size_t axis = 0, n = 4; axis < 3; ++axis, n /= 2)
            for (std::size_t i = 0; i < n; ++i)
                at[i] = (at[2 * i] << bits) + (weight[axis].v >> dropped) * (at[2 * i + 1] - at[2 * i]);
        value_ = at[0], bits_ = 3 * bits;
        slack_ = dropped > 0 ? std::ldexp(static_cast<double>(most), 3 - bits) : 0;
    }
    double value() const { return std::ldexp(in_double(value_), -bits_); }
    /// How far a word with `fraction` fraction bits is from it, in the word's last bits.
    double from(Int128 word, int fraction) const {
        const int more = bits_ - fraction;
        const Int128 off = more >= 0 ? value_ - (word << more) : (value_ << -more) - word;
        return std::ldexp(in_double(absolute(off)), -std::max(more, 0)) + std::ldexp(slack_, fraction);
    }

  private:
    Int128 value_ = 0;
    int bits_ = 0;
    double slack_ = 0;
};

}  // namespace squint
