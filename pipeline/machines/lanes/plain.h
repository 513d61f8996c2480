// Kernels of the default's formats are compiled apart: a stage's copy is taken as plain, so that the compiler
// leaves out what the plan has proven not to happen, and asks nothing in every vector.
#pragma once

#include "fixedpoint/quantise.h"

#include <hwy/base.h>

namespace squint::lanes {

inline bool drops_bits(const Rescale& to) {
    return to.shift > 0 && !to.limits;
}
inline bool does_nothing(const Rescale& to) {
    return to.shift == 0 && !to.limits;
}
/// Says so to the compiler.
HWY_INLINE void take_as_dropping_bits(Rescale& to) {
    to.limits = false;
    if (to.shift <= 0) __builtin_unreachable();
}
HWY_INLINE void take_as_doing_nothing(Rescale& to) {
    to.limits = false, to.shift = 0;
}

}  // namespace squint::lanes
