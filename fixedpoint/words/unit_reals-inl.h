// Numbers from 0 to 1 of up to 26 fraction bits as doubles: lanes for compositing in wide words.  A product of two
// is exact in 53 bits, and rounded to a whole number by the addition of another.  Compiled once per SIMD target.
#if defined(SQUINT_FIXEDPOINT_WORDS_UNIT_REALS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_FIXEDPOINT_WORDS_UNIT_REALS_INL_H
#undef SQUINT_FIXEDPOINT_WORDS_UNIT_REALS_INL_H
#else
#define SQUINT_FIXEDPOINT_WORDS_UNIT_REALS_INL_H
#endif

#include "fixedpoint/words/lane_quotients-inl.h"

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// As many as there are 32-bit lanes, in their order: the lower half and the upper one.
struct UnitReals {
    using D = hn::ScalableTag<double>;
    using V = hn::Vec<D>;
    static constexpr int kMostBits = 26;
    V low, high;
    static constexpr std::size_t count() { return HWY_LANES(std::int32_t); }
};
struct UnitRealMask {
    hn::Mask<UnitReals::D> low, high;
};

HWY_INLINE UnitReals make_word(WordTag<UnitReals>, std::int64_t value) {
    const auto all = hn::Set(UnitReals::D(), static_cast<double>(value));
    return {all, all};
}
HWY_INLINE UnitReals operator+(UnitReals a, UnitReals b) {
    return {hn::Add(a.low, b.low), hn::Add(a.high, b.high)};
}
HWY_INLINE UnitReals operator-(UnitReals a, UnitReals b) {
    return {hn::Sub(a.low, b.low), hn::Sub(a.high, b.high)};
}
HWY_INLINE UnitRealMask operator<(UnitReals a, UnitReals b) {
    return {hn::Lt(a.low, b.low), hn::Lt(a.high, b.high)};
}
HWY_INLINE UnitRealMask operator&(UnitRealMask a, UnitRealMask b) {
    return {hn::And(a.low, b.low), hn::And(a.high, b.high)};
}
HWY_INLINE UnitRealMask operator!(UnitRealMask a) {
    return {hn::Not(a.low), hn::Not(a.high)};
}
HWY_INLINE bool any(UnitRealMask a) {
    return !hn::AllFalse(UnitReals::D(), hn::Or(a.low, a.high));
}
/// x where c, else 0.
HWY_INLINE UnitReals only(UnitRealMask c, UnitReals x) {
    return {hn::IfThenElseZero(c.low, x.low), hn::IfThenElseZero(c.high, x.high)};
}
HWY_INLINE UnitReals shift_left(UnitReals x, int bits) {
    if (bits == 0) return x;
    const auto factor = hn::Set(UnitReals::D(), power_of_two<double>(bits));
    return {hn::Mul(x.low, factor), hn::Mul(x.high, factor)};
}
/// Sums pass on; only products lose bits.
HWY_INLINE UnitReals quantise(UnitReals x, const Rescale& to) {
    assert(to.shift == 0 && !to.limits);
    (void)to;
    return x;
}
/// Halves to even: a sum with 1.5 2^52 has no bits below one.
HWY_INLINE UnitReals quantised_product(UnitReals a, UnitReals b, const Rescale& to) {
    assert(to.shift >= 0 && to.to_even == (to.shift > 0) && !to.limits);
    const UnitReals::D d;
    const auto whole = hn::Set(d, 0x1.8p52), factor = hn::Set(d, power_of_two<double>(-to.shift));
    const auto product = [&](UnitReals::V x, UnitReals::V y)
                             HWY_ATTR { return hn::Sub(hn::MulAdd(x, hn::Mul(y, factor), whole), whole); };
    return {product(a.low, b.low), product(a.high, b.high)};
}

/// Words of 32-bit lanes, and back.
template <class L>
HWY_INLINE UnitReals unit_reals(L x) {
    const auto wide = widen(x);
    return {wide.low, wide.high};
}
template <class L>
HWY_INLINE std::array<L, 1> words_of(UnitReals x) {
    return {lanes_detail::narrow(WideLanes<L::kKnown>{x.low, x.high})};
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
