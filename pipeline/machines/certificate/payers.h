// What the parts of a certificate share: who pays for what an operation takes.
#pragma once

#include "fixedpoint/words/bounded.h"
#include "scene/wires.h"

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

}  // namespace squint
