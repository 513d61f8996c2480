// What the tests of light in a slab hand to the stages, in either of two words.
#pragma once

#include "fixedpoint/words/real.h"

#include <cmath>
#include <concepts>
#include <cstdint>

namespace squint::test {

/// A number in last bits as W has it: the nearest integer, or in doubles the number itself.
template <class W>
W word_of(double value) {
    if constexpr (std::same_as<W, std::int64_t>)
        return static_cast<W>(std::floor(value + 0.5));
    else
        return W{value};
}

}  // namespace squint::test
