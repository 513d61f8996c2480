// The word of the fast path: as many samples side by side as a vector register holds.  Compiled once per
// SIMD target (Highway's foreach_target).  In floating point it uses only + - * / and sqrt, which IEEE 754
// rounds exactly, and corrects every quotient and root in integers: it has the model's bits on every CPU.
// This file has words and their arithmetic; kernels also include lane_tables-inl.h and
// lane_quotients-inl.h.
//
//   Lanes<int32_t>   products and sums of 32 bits
//   Lanes<int64_t>   factors of 32 bits, products and sums of 64
#if defined(SQUINT_FIXEDPOINT_WORDS_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_FIXEDPOINT_WORDS_LANES_INL_H
#undef SQUINT_FIXEDPOINT_WORDS_LANES_INL_H
#else
#define SQUINT_FIXEDPOINT_WORDS_LANES_INL_H
#endif

#include "fixedpoint/unrolled-inl.h"
#include "fixedpoint/words.h"

#include <hwy/highway.h>

#include <algorithm>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// K: what the kernel is compiled to assume about every Rescale that the word meets (fixedpoint/quantise.h).
template <class T, KnownRescales K = KnownRescales::nothing>
struct Lanes {
    using Element = T;
    using D = hn::ScalableTag<T>;
    using V = hn::Vec<D>;
    static constexpr KnownRescales kKnown = K;
    V v;
    static constexpr std::size_t count() { return HWY_LANES(T); }
};
template <class T>
struct LaneMask {
    using M = hn::Mask<hn::ScalableTag<T>>;
    M m;
};

/// constant() of words.h, compiled for the target.
template <class W>
HWY_INLINE W constant(std::int64_t value) {
    return make_word(WordTag<W>{}, value);
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> make_word(WordTag<Lanes<T, K>>, std::int64_t value) {
    return {hn::Set(hn::ScalableTag<T>(), static_cast<T>(value))};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> operator+(Lanes<T, K> a, Lanes<T, K> b) {
    return {hn::Add(a.v, b.v)};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> operator-(Lanes<T, K> a, Lanes<T, K> b) {
    return {hn::Sub(a.v, b.v)};
}
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> operator*(Lanes<std::int32_t, K> a, Lanes<std::int32_t, K> b) {
    return {hn::Mul(a.v, b.v)};
}
/// Both factors must fit 32 bits, sign included.
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> operator*(Lanes<std::int64_t, K> a, Lanes<std::int64_t, K> b) {
    const hn::ScalableTag<std::int32_t> d32;
    return {hn::MulEven(hn::BitCast(d32, a.v), hn::BitCast(d32, b.v))};
}
template <class T, KnownRescales K>
HWY_INLINE LaneMask<T> operator==(Lanes<T, K> a, Lanes<T, K> b) {
    return {hn::Eq(a.v, b.v)};
}
template <class T, KnownRescales K>
HWY_INLINE LaneMask<T> operator<(Lanes<T, K> a, Lanes<T, K> b) {
    return {hn::Lt(a.v, b.v)};
}
template <class T>
HWY_INLINE LaneMask<T> operator&(LaneMask<T> a, LaneMask<T> b) {
    return {hn::And(a.m, b.m)};
}
template <class T>
HWY_INLINE LaneMask<T> operator|(LaneMask<T> a, LaneMask<T> b) {
    return {hn::Or(a.m, b.m)};
}
template <class T>
HWY_INLINE LaneMask<T> operator!(LaneMask<T> a) {
    return {hn::Not(a.m)};
}
template <class T>
HWY_INLINE bool any(LaneMask<T> a) {
    return !hn::AllFalse(hn::ScalableTag<T>(), a.m);
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> select(LaneMask<T> c, Lanes<T, K> yes, Lanes<T, K> no) {
    return {hn::IfThenElse(c.m, yes.v, no.v)};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> min(Lanes<T, K> a, Lanes<T, K> b) {
    return {hn::Min(a.v, b.v)};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> max(Lanes<T, K> a, Lanes<T, K> b) {
    return {hn::Max(a.v, b.v)};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> clamp(Lanes<T, K> x, Lanes<T, K> low, Lanes<T, K> high) {
    return min(max(x, low), high);
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> absolute(Lanes<T, K> x) {
    if constexpr (sizeof(T) == 4) return {hn::Abs(x.v)};
    return {hn::Max(x.v, hn::Sub(hn::Zero(hn::ScalableTag<T>()), x.v))};
}
/// Shifts all lanes by one count.  Where x86 can shift by a vector of counts, that is one instruction; a
/// shift by a single count is two.
template <class V>
HWY_INLINE V shift_left_same(V v, int bits) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
    using T = hn::TFromV<V>;
    return hn::Shl(v, hn::Set(hn::DFromV<V>(), static_cast<T>(bits)));
#else
    return hn::ShiftLeftSame(v, bits);
#endif
}
template <class V>
HWY_INLINE V shift_right_same(V v, int bits) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
    using T = hn::TFromV<V>;
    if constexpr (sizeof(T) == 4 || HWY_TARGET <= HWY_AVX3)
        return hn::Shr(v, hn::Set(hn::DFromV<V>(), static_cast<T>(bits)));
#endif
    return hn::ShiftRightSame(v, bits);
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> shift_left(Lanes<T, K> x, int bits) {
    return {shift_left_same(x.v, bits)};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> floor_shift(Lanes<T, K> x, int bits) {
    return {shift_right_same(x.v, bits)};
}
/// The lowest bits: x - floor(x 2^-bits) 2^bits.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> fraction_bits(Lanes<T, K> x, int bits) {
    return {hn::And(x.v, hn::Set(hn::ScalableTag<T>(), static_cast<T>((T{1} << bits) - 1)))};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> blend(Lanes<T, K> v0, Lanes<T, K> v1, Lanes<T, K> weight, int weight_bits) {
    return shift_left(v0, weight_bits) + weight * (v1 - v0);
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> affine(Lanes<T, K> p, Lanes<T, K> k, Lanes<T, K> v, std::int64_t, std::int64_t) {
    return p + k * v;
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> within(Lanes<T, K> x, std::int64_t, std::int64_t) {
    return x;
}

/// A format's limit, cut to what a lane holds.  A limit outside is never met, for results fit the lanes.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> limit_in_lanes(std::int64_t limit) {
    // Returns a value: a reference to one of three keeps compilers from moving it out of loops.
    constexpr std::int64_t kLow = std::numeric_limits<T>::min(), kHigh = std::numeric_limits<T>::max();
    return make_word(WordTag<Lanes<T, K>>{}, limit < kLow ? kLow : limit > kHigh ? kHigh : limit);
}

/// The formula of quantise.h.  What K does not assume is read from `to`, for every vector.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> quantise(Lanes<T, K> x, const Rescale& to) {
    const hn::ScalableTag<T> d;
    const auto biased = [&] { return hn::Add(x.v, hn::Set(d, static_cast<T>(to.bias))); };
    if constexpr (K == KnownRescales::halves_up) return {shift_right_same(biased(), to.shift)};
    if constexpr (K == KnownRescales::halves_to_even || K == KnownRescales::unit_products) {
        if (to.shift > 0) {
#if HWY_TARGET <= HWY_AVX3
            // Rounds halves up, then clears the last bit of what was a half: saves an instruction with masks.
            const auto sum = hn::Add(x.v, hn::Set(d, static_cast<T>(to.bias + to.to_even)));
            const auto rest = hn::Set(d, static_cast<T>((T{1} << to.shift) - 1));
            const auto half = hn::Eq(hn::And(sum, rest), hn::Zero(d));
            const auto up = shift_right_same(sum, to.shift);
            x.v = hn::IfThenElse(half, hn::AndNot(hn::Set(d, static_cast<T>(to.to_even)), up), up);
#else
            x.v = shift_right_same(hn::Add(biased(), hn::And(shift_right_same(x.v, to.shift),
                                                             hn::Set(d, static_cast<T>(to.to_even)))),
                                   to.shift);
#endif
        }
        return to.limits ? clamp(x, limit_in_lanes<T, K>(to.lowest), limit_in_lanes<T, K>(to.highest)) : x;
    }
    if (to.shift <= 0) {
        x = shift_left(x, -to.shift);
    } else if (to.shift >= static_cast<int>(8 * sizeof(T))) {
        // Only trn comes here, and leaves the sign; a bias as wide would have asked for wider lanes.
        x = floor_shift(x, static_cast<int>(8 * sizeof(T)) - 1);
    } else {
        auto sum = biased();
        if (to.to_even) sum = hn::Add(sum, hn::And(shift_right_same(x.v, to.shift), hn::Set(d, T{1})));
        if (to.to_zero)
            sum = hn::Add(
                sum, hn::IfThenElseZero(hn::Lt(x.v, hn::Zero(d)), hn::Set(d, static_cast<T>(to.to_zero))));
        x.v = shift_right_same(sum, to.shift);
    }
    if (!to.limits) return x;
    if (!to.wraps) return clamp(x, limit_in_lanes<T, K>(to.lowest), limit_in_lanes<T, K>(to.highest));
    const int unused = static_cast<int>(8 * sizeof(T)) - to.width;
    if (unused <= 0) return x;
    if (to.is_signed) return floor_shift(shift_left(x, unused), unused);
    return {hn::And(x.v, hn::Set(d, static_cast<T>((std::int64_t{1} << to.width) - 1)))};
}

/// quantised_product() of words.h.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> quantised_product(Lanes<T, K> a, Lanes<T, K> b, const Rescale& to) {
    return quantise(a * b, to);
}
/// For factors from 0 to 1, in 16 bits.  Both are negated first, because -1 exists there and 1 does not.
template <KnownRescales K>
requires(K == KnownRescales::unit_products) HWY_INLINE Lanes<std::int32_t, K> quantised_product(
    Lanes<std::int32_t, K> a, Lanes<std::int32_t, K> b, const Rescale& to) {
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR
    (void)to;
    const hn::ScalableTag<std::int32_t> d;
    const hn::ScalableTag<std::int16_t> d16;
    const auto narrow = [&](auto v) HWY_ATTR { return hn::BitCast(d16, v); };
    const auto below = [&](auto v) HWY_ATTR { return hn::Sub(hn::Zero(d16), narrow(v)); };
    // Rounds halves up.  A result of 1 comes out as -2^15, with a zero upper half: it is 1 as 32 bits.
    const auto up = hn::BitCast(d, hn::MulFixedPoint15(below(a.v), below(b.v)));
    // Clears the last bit of what was a half.
    const auto lost = hn::And(hn::BitCast(d, hn::Mul(narrow(a.v), narrow(b.v))), hn::Set(d, 0x7fff));
    const auto half = hn::Eq(lost, hn::Set(d, 0x4000));
    return {hn::IfThenElse(half, hn::AndNot(hn::Set(d, 1), up), up)};
#else
    return quantise(a * b, to);
#endif
}

// ------------------------------------------------------------------------------------------ memory
// Words between stages, which lie in buffers

/// Wires pass between stages in buffers of 32-bit words, whatever the width of a stage's lanes.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> load(WordTag<Lanes<std::int32_t, K>>, const std::int32_t* from) {
    return {hn::LoadU(hn::ScalableTag<std::int32_t>(), from)};
}
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> load(WordTag<Lanes<std::int64_t, K>>, const std::int32_t* from) {
    const hn::ScalableTag<std::int64_t> d;
    const hn::Rebind<std::int32_t, decltype(d)> narrow;
    return {hn::PromoteTo(d, hn::LoadU(narrow, from))};
}
template <KnownRescales K>
HWY_INLINE void store(Lanes<std::int32_t, K> x, std::int32_t* to) {
    hn::StoreU(x.v, hn::ScalableTag<std::int32_t>(), to);
}
template <KnownRescales K>
HWY_INLINE void store(Lanes<std::int64_t, K> x, std::int32_t* to) {
    const hn::ScalableTag<std::int64_t> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    const hn::Rebind<std::int32_t, decltype(d)> narrow;
    const hn::Rebind<std::uint32_t, decltype(d)> low;
    hn::StoreU(hn::BitCast(narrow, hn::TruncateTo(low, hn::BitCast(du, x.v))), narrow, to);
}
template <class L>
HWY_INLINE L load(const std::int32_t* from) {
    return load(WordTag<L>{}, from);
}
/// Loads integers, which lie in the buffers as integers for every word.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> load_whole(WordTag<Lanes<T, K>> tag, const std::int32_t* from) {
    return load(tag, from);
}
template <class T, KnownRescales K>
HWY_INLINE void store_whole(Lanes<T, K> x, std::int32_t* to) {
    store(x, to);
}
template <class L>
HWY_INLINE L load_whole(const std::int32_t* from) {
    return load_whole(WordTag<L>{}, from);
}
/// The lower or the upper 16 bits of 32-bit words in a buffer: one of two voxels.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> half_of(Lanes<T, K> both, bool upper) {
    return {hn::And(upper ? hn::ShiftRight<16>(both.v) : both.v, hn::Set(hn::ScalableTag<T>(), T{0xffff}))};
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
