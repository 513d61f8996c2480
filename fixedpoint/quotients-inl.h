// Quotients in any word, for any wire; compiled once per SIMD target.
#if defined(SQUINT_FIXEDPOINT_QUOTIENTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_FIXEDPOINT_QUOTIENTS_INL_H
#undef SQUINT_FIXEDPOINT_QUOTIENTS_INL_H
#else
#define SQUINT_FIXEDPOINT_QUOTIENTS_INL_H
#endif

#include "fixedpoint/words.h"

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// A quotient for any wire: where the wire has fewer fraction bits than the exact quotient, the denominator
/// is shifted.
template <class N>
HWY_INLINE auto divide(const N& numerator, const N& denominator, const Rescale& to) {
    Rescale whole = to;
    whole.shift = std::min(to.shift, 0);
    return quotient(numerator, to.shift > 0 ? N(shift_left(denominator, to.shift)) : denominator, whole);
}

/// Words that invert a denominator once for several quotients.
template <class N>
inline constexpr bool kInvertsOnce = requires {
    typename N::InvertsOnce;
};
/// Three quotients by one denominator.
template <class N>
HWY_INLINE auto divide_three(const std::array<N, 3>& numerator, const N& denominator, const Rescale& to) {
    if constexpr (kInvertsOnce<N>) {
        Rescale whole = to;
        whole.shift = std::min(to.shift, 0);
        return quotients(numerator, to.shift > 0 ? shift_left(denominator, to.shift) : denominator, whole);
    } else {
        return std::array{divide(numerator[0], denominator, to), divide(numerator[1], denominator, to),
                          divide(numerator[2], denominator, to)};
    }
}

/// A divisor: x >= 0, or its last bit where it is zero.  Without rounding every x above zero stays as it is.
/// N: the word or its Wide.
template <class W, class N>
HWY_INLINE N divisor(const N& x) {
    if constexpr (RealWord<W>)
        return select(constant<W>(0) < x, x, constant<W>(1));
    else if constexpr (std::is_same_v<N, W>)
        return max(x, constant<W>(1));
    else
        return max(x, widen(constant<W>(1)));
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
