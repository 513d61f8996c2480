// Short loops unrolled by hand, because compilers leave an array in memory if they unroll its loop late.  By
// hand, the array stays in registers.
#if defined(SQUINT_FIXEDPOINT_UNROLLED_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_FIXEDPOINT_UNROLLED_INL_H
#undef SQUINT_FIXEDPOINT_UNROLLED_INL_H
#else
#define SQUINT_FIXEDPOINT_UNROLLED_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// Calls f(0), f(1) and f(2): for axes and colour channels.  f should be SQUINT_WRITTEN_OUT.
template <class F>
HWY_INLINE void for_three(F&& f) {
    f(std::size_t{0}), f(std::size_t{1}), f(std::size_t{2});
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#ifndef SQUINT_WRITTEN_OUT
#define SQUINT_WRITTEN_OUT __attribute__((always_inline))
#endif
#endif
