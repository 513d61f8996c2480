// Numbers from 0 to 1 of 15 fraction bits, 16 bits each: lanes for compositing where a plan has proven that
// nothing else occurs.
#if defined(SQUINT_FIXEDPOINT_WORDS_UNIT_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_FIXEDPOINT_WORDS_UNIT_LANES_INL_H
#undef SQUINT_FIXEDPOINT_WORDS_UNIT_LANES_INL_H
#else
#define SQUINT_FIXEDPOINT_WORDS_UNIT_LANES_INL_H
#endif

#include "fixedpoint/unrolled-inl.h"
#include "fixedpoint/words/lanes-inl.h"

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

// x86's rounding multiplication takes -1 by -1 to -1, others saturate.
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_SSE4
inline constexpr bool kHasUnitLanes = true;

/// Raw x stands as -x, for -2^15 fits 16 bits and 2^15 does not.  Sixteen at most, in an order of their own: that
/// of narrow_words().
struct UnitLanes {
    using D = hn::CappedTag<std::int16_t, 16>;
    hn::Vec<D> v;
    static constexpr std::size_t count() {
        return HWY_LANES(std::int16_t) < 16 ? HWY_LANES(std::int16_t) : 16;
    }
};
struct UnitMask {
    hn::Mask<UnitLanes::D> m;
};

HWY_INLINE UnitLanes make_word(WordTag<UnitLanes>, std::int64_t value) {
    return {hn::Set(UnitLanes::D(), static_cast<std::int16_t>(-value))};
}
HWY_INLINE UnitLanes operator+(UnitLanes a, UnitLanes b) {
    return {hn::Add(a.v, b.v)};
}
HWY_INLINE UnitLanes operator-(UnitLanes a, UnitLanes b) {
    return {hn::Sub(a.v, b.v)};
}
HWY_INLINE UnitMask operator<(UnitLanes a, UnitLanes b) {
    return {hn::Lt(b.v, a.v)};
}
HWY_INLINE UnitMask operator&(UnitMask a, UnitMask b) {
    return {hn::And(a.m, b.m)};
}
HWY_INLINE UnitMask operator!(UnitMask a) {
    return {hn::Not(a.m)};
}
HWY_INLINE bool any(UnitMask a) {
    return !hn::AllFalse(UnitLanes::D(), a.m);
}
/// x where c, else 0.
HWY_INLINE UnitLanes only(UnitMask c, UnitLanes x) {
    return {hn::IfThenElseZero(c.m, x.v)};
}
HWY_INLINE UnitLanes shift_left(UnitLanes x, int bits) {
    return {shift_left_same(x.v, bits)};
}
/// Sums pass on; only products lose bits.
HWY_INLINE UnitLanes quantise(UnitLanes x, const Rescale& to) {
    assert(to.shift == 0 && !to.limits);
    (void)to;
    return x;
}
/// Halves to even.  Rounded up, 1 comes out as -2^15; an odd product of an exact half loses its last bit.
HWY_INLINE UnitLanes quantised_product(UnitLanes a, UnitLanes b, const Rescale& to) {
    assert(to.shift == 15 && to.to_even == 1 && !to.limits);
    (void)to;
    const UnitLanes::D d;
    const auto up = hn::MulFixedPoint15(a.v, b.v);
    // Of the product's low 16 bits: 15 that are dropped, a half, below an even number.
    const auto half = hn::VecFromMask(d, hn::Eq(hn::Mul(a.v, b.v), hn::Set(d, 0x4000)));
    return {hn::Sub(hn::Zero(d), hn::Add(up, half))};
}

/// Vectors of L that hold as many words as UnitLanes.
template <class L>
inline constexpr std::size_t kPartsOfUnits = UnitLanes::count() / L::count();
template <class L>
using UnitParts = std::array<L, kPartsOfUnits<L>>;

/// Calls f(i) for each part, written out: see unrolled-inl.h.
template <class L, class F>
HWY_INLINE void for_parts(F&& f) {
    static_assert(kPartsOfUnits<L> <= 2);
    f(std::size_t{0});
    if constexpr (kPartsOfUnits<L> == 2) f(std::size_t{1});
}

/// Words of 32 bits that fit 16, in the order of UnitLanes; and back.
template <class L>
HWY_INLINE hn::Vec<UnitLanes::D> narrow_words(const UnitParts<L>& x) {
    const UnitLanes::D d;
    if constexpr (kPartsOfUnits<L> == 1)
        return hn::DemoteTo(d, x[0].v);
    else
        return hn::ReorderDemote2To(d, x[0].v, x[1].v);
}
template <class L>
HWY_INLINE UnitParts<L> widen_words(hn::Vec<UnitLanes::D> x) {
    const hn::ScalableTag<typename L::Element> d;
    if constexpr (kPartsOfUnits<L> == 1) {
        return {L{hn::PromoteTo(d, x)}};
    } else {
        const UnitLanes::D d16;
        const auto part = [&](auto twice) { return L{hn::ShiftRight<16>(hn::BitCast(d, twice))}; };
        return {part(hn::InterleaveLower(d16, x, x)), part(hn::InterleaveUpper(d16, x, x))};
    }
}
template <class L>
HWY_INLINE UnitLanes units_of(const UnitParts<L>& x) {
    UnitParts<L> below;
    for_parts<L>([&](std::size_t i) SQUINT_WRITTEN_OUT { below[i] = constant<L>(0) - x[i]; });
    return {narrow_words<L>(below)};
}
template <class L>
HWY_INLINE UnitParts<L> words_of(UnitLanes x) {
    UnitParts<L> words = widen_words<L>(x.v);
    for_parts<L>([&](std::size_t i) SQUINT_WRITTEN_OUT { words[i] = constant<L>(0) - words[i]; });
    return words;
}

/// Where word i of block `block` (128 bits) of UnitLanes stands among L's words side by side.
template <class L>
constexpr int word_of_unit(int block, int i) {
    if (kPartsOfUnits<L> == 1 || i < 4) return (kPartsOfUnits<L> == 1 ? 8 : 4) * block + i;
    return static_cast<int>(L::count()) + 4 * block + i - 4;
}

/// lerp() of interpolation.h, halves up, between rows row[j] and row[j] + 1 of four numbers each, for word j of L;
/// `weight` is of 15 bits and below one.  Rows stand as UnitLanes do.  No number goes from 0 to 1 in one row, for
/// that difference does not fit 16 bits.
template <class L>
HWY_INLINE std::array<UnitLanes, 4> lerp_unit_rows(const std::int16_t* rows, const std::int32_t* row,
                                                   hn::Vec<UnitLanes::D> weight) {
    const UnitLanes::D d;
    const hn::Repartition<std::int32_t, UnitLanes::D> d32;
    const hn::Repartition<std::int64_t, UnitLanes::D> d64;
    const auto load = [&](int i) HWY_ATTR {  // words i of all blocks: their rows and the next ones
        const hn::Full128<std::int16_t> block;
        const auto of = [&](int b) HWY_ATTR {
            return hn::LoadU(block, rows + std::int64_t{4} * row[word_of_unit<L>(b, i)]);
        };
        if constexpr (UnitLanes::count() == 8)
            return of(0);
        else
            return hn::Combine(d, of(1), of(0));
    };
    const auto between = [&](int i,
                             auto weights) HWY_ATTR {  // words i and i + 1, side by side in each column
        const auto first = load(i), second = load(i + 1);
        const auto near = hn::InterleaveLower(d, first, second), far = hn::InterleaveUpper(d, first, second);
        const auto part = hn::MulFixedPoint15(hn::Sub(near, far), hn::BitCast(d, weights));
        return hn::BitCast(d32, hn::Sub(near, part));
    };
    const auto weights = hn::BitCast(d32, weight);
    const auto a = between(0, hn::Broadcast<0>(weights)), b = between(2, hn::Broadcast<1>(weights)),
               c = between(4, hn::Broadcast<2>(weights)), e = between(6, hn::Broadcast<3>(weights));
    const auto wide = [&](auto v) HWY_ATTR { return hn::BitCast(d64, v); };
    const auto ab = wide(hn::InterleaveLower(d32, a, b)), ce = wide(hn::InterleaveLower(d32, c, e)),
               ab_upper = wide(hn::InterleaveUpper(d32, a, b)),
               ce_upper = wide(hn::InterleaveUpper(d32, c, e));
    const auto unit = [&](auto v) HWY_ATTR { return UnitLanes{hn::BitCast(d, v)}; };
    return {unit(hn::InterleaveLower(d64, ab, ce)), unit(hn::InterleaveUpper(d64, ab, ce)),
            unit(hn::InterleaveLower(d64, ab_upper, ce_upper)),
            unit(hn::InterleaveUpper(d64, ab_upper, ce_upper))};
}
#else
inline constexpr bool kHasUnitLanes = false;
#endif

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
