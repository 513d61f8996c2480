// The word of the fast path: as many samples side by side as a vector register holds.  All vector types and
// target code live here; compiled once per SIMD target (Highway's foreach_target).  Only + - * / sqrt that
// IEEE 754 rounds exactly are used in floating point, and every quotient and root is corrected in integers:
// the same bits as the model's on every CPU.
//
//   Lanes<int32_t>   products and sums of 32 bits
//   Lanes<int64_t>   factors of 32 bits, products and sums of 64
#if defined(SQUINT_FIXEDPOINT_LANES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_FIXEDPOINT_LANES_H
#undef SQUINT_FIXEDPOINT_LANES_H
#else
#define SQUINT_FIXEDPOINT_LANES_H
#endif

#include "fixedpoint/cell_table.h"
#include "fixedpoint/words.h"

#include <hwy/highway.h>

#include <algorithm>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class T>
struct Lanes {
    using D = hn::ScalableTag<T>;
    using V = hn::Vec<D>;
    V v;
    static constexpr std::size_t count() { return HWY_LANES(T); }
};
template <class T>
struct LaneMask {
    using M = hn::Mask<hn::ScalableTag<T>>;
    M m;
};

/// words.h's constant, compiled for the target.
template <class W>
HWY_INLINE W constant(std::int64_t value) {
    return make_word(WordTag<W>{}, value);
}
template <class T>
HWY_INLINE Lanes<T> make_word(WordTag<Lanes<T>>, std::int64_t value) {
    return {hn::Set(hn::ScalableTag<T>(), static_cast<T>(value))};
}
template <class T>
HWY_INLINE Lanes<T> operator+(Lanes<T> a, Lanes<T> b) {
    return {hn::Add(a.v, b.v)};
}
template <class T>
HWY_INLINE Lanes<T> operator-(Lanes<T> a, Lanes<T> b) {
    return {hn::Sub(a.v, b.v)};
}
HWY_INLINE Lanes<std::int32_t> operator*(Lanes<std::int32_t> a, Lanes<std::int32_t> b) {
    return {hn::Mul(a.v, b.v)};
}
/// Factors of 32 bits each, sign included.
HWY_INLINE Lanes<std::int64_t> operator*(Lanes<std::int64_t> a, Lanes<std::int64_t> b) {
    const hn::ScalableTag<std::int32_t> d32;
    return {hn::MulEven(hn::BitCast(d32, a.v), hn::BitCast(d32, b.v))};
}
template <class T>
HWY_INLINE LaneMask<T> operator==(Lanes<T> a, Lanes<T> b) {
    return {hn::Eq(a.v, b.v)};
}
template <class T>
HWY_INLINE LaneMask<T> operator<(Lanes<T> a, Lanes<T> b) {
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
template <class T>
HWY_INLINE Lanes<T> select(LaneMask<T> c, Lanes<T> yes, Lanes<T> no) {
    return {hn::IfThenElse(c.m, yes.v, no.v)};
}
template <class T>
HWY_INLINE Lanes<T> min(Lanes<T> a, Lanes<T> b) {
    return {hn::Min(a.v, b.v)};
}
template <class T>
HWY_INLINE Lanes<T> max(Lanes<T> a, Lanes<T> b) {
    return {hn::Max(a.v, b.v)};
}
template <class T>
HWY_INLINE Lanes<T> clamp(Lanes<T> x, Lanes<T> low, Lanes<T> high) {
    return min(max(x, low), high);
}
template <class T>
HWY_INLINE Lanes<T> absolute(Lanes<T> x) {
    return {hn::Max(x.v, hn::Sub(hn::Zero(hn::ScalableTag<T>()), x.v))};
}
template <class T>
HWY_INLINE Lanes<T> shift_left(Lanes<T> x, int bits) {
    return {hn::ShiftLeftSame(x.v, bits)};
}
template <class T>
HWY_INLINE Lanes<T> floor_shift(Lanes<T> x, int bits) {
    return {hn::ShiftRightSame(x.v, bits)};
}
template <class T>
HWY_INLINE Lanes<T> blend(Lanes<T> v0, Lanes<T> v1, Lanes<T> weight, int weight_bits) {
    return shift_left(v0, weight_bits) + weight * (v1 - v0);
}
template <class T>
HWY_INLINE Lanes<T> affine(Lanes<T> p, Lanes<T> k, Lanes<T> v, std::int64_t, std::int64_t) {
    return p + k * v;
}
template <class T>
HWY_INLINE Lanes<T> within(Lanes<T> x, std::int64_t, std::int64_t) {
    return x;
}

/// A format's limit as lanes can hold it: one beyond them is never met, for results fit the lanes.
template <class T>
HWY_INLINE Lanes<T> limit_in_lanes(std::int64_t limit) {
    return make_word(WordTag<Lanes<T>>{}, std::clamp<std::int64_t>(limit, std::numeric_limits<T>::min(),
                                                                   std::numeric_limits<T>::max()));
}

/// quantise.h's formula, all rounding and overflow modes in one: the constants say which.
template <class T>
HWY_INLINE Lanes<T> quantise(Lanes<T> x, const Rescale& to) {
    const hn::ScalableTag<T> d;
    if (to.shift <= 0) {
        x = shift_left(x, -to.shift);
    } else if (to.shift >= static_cast<int>(8 * sizeof(T))) {
        // Truncation alone: the sign is left.  A bias as wide would have asked for wider lanes.
        x = floor_shift(x, static_cast<int>(8 * sizeof(T)) - 1);
    } else {
        auto sum = hn::Add(x.v, hn::Set(d, static_cast<T>(to.bias)));
        if (to.to_even) sum = hn::Add(sum, hn::And(hn::ShiftRightSame(x.v, to.shift), hn::Set(d, T{1})));
        if (to.to_zero)
            sum = hn::Add(
                sum, hn::IfThenElseZero(hn::Lt(x.v, hn::Zero(d)), hn::Set(d, static_cast<T>(to.to_zero))));
        x.v = hn::ShiftRightSame(sum, to.shift);
    }
    if (!to.limits) return x;
    if (!to.wraps) return clamp(x, limit_in_lanes<T>(to.lowest), limit_in_lanes<T>(to.highest));
    const int unused = static_cast<int>(8 * sizeof(T)) - to.width;
    if (unused <= 0) return x;
    if (to.is_signed) return floor_shift(shift_left(x, unused), unused);
    return {hn::And(x.v, hn::Set(d, static_cast<T>((std::int64_t{1} << to.width) - 1)))};
}

// ------------------------------------------------------------------------------------------------ tables

HWY_INLINE Lanes<std::int32_t> gather(const Table& table, Lanes<std::int32_t> row, int column) {
    const hn::ScalableTag<std::int32_t> d;
    const auto index = hn::Add(hn::Mul(row.v, hn::Set(d, table.columns())), hn::Set(d, column));
    return {hn::GatherIndex(d, table.narrow(), index)};
}
HWY_INLINE Lanes<std::int64_t> gather(const Table& table, Lanes<std::int64_t> row, int column) {
    const hn::ScalableTag<std::int64_t> d;
    const Lanes<std::int64_t> index = row * make_word(WordTag<Lanes<std::int64_t>>{}, table.columns()) +
                                      make_word(WordTag<Lanes<std::int64_t>>{}, column);
    return {hn::GatherIndex(d, table.words().data(), index.v)};
}

template <class T>
HWY_INLINE std::array<Lanes<T>, 2> gather_pair(const Table& table, Lanes<T> row, int column) {
    if constexpr (sizeof(T) == 4)
        if (const std::int32_t* packed = table.packed()) {
            const hn::ScalableTag<T> d;
            const auto index =
                hn::Add(hn::Mul(row.v, hn::Set(d, table.columns() / 2)), hn::Set(d, column / 2));
            const auto both = hn::GatherIndex(d, packed, index);
            const hn::RebindToUnsigned<decltype(d)> du;
            return {Lanes<T>{hn::And(both, hn::Set(d, 0xffff))},
                    Lanes<T>{hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(du, both)))}};
        }
    return {gather(table, row, column), gather(table, row, column + 1)};
}

/// Cells of 16-bit words are two 32-bit words, or one of 64 bits, with the first channel lowest.
HWY_INLINE std::array<Lanes<std::int32_t>, 4> gather_cell(const CellTable& table, Lanes<std::int32_t> row,
                                                          Lanes<std::int32_t> column) {
    const hn::ScalableTag<std::int32_t> d;
    using L = Lanes<std::int32_t>;
    const auto cell = hn::Add(hn::Mul(row.v, hn::Set(d, table.size())), column.v);
    if (table.is_narrow()) {
        const auto* words = reinterpret_cast<const std::int32_t*>(table.narrow_words());
        const auto low = hn::GatherIndex(d, words, hn::Add(cell, cell));
        const auto high = hn::GatherIndex(d, words, hn::Add(hn::Add(cell, cell), hn::Set(d, 1)));
        const auto mask = hn::Set(d, 0xffff);
        const hn::RebindToUnsigned<decltype(d)> du;
        const auto upper = [&](auto v) { return hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(du, v))); };
        return {L{hn::And(low, mask)}, L{upper(low)}, L{hn::And(high, mask)}, L{upper(high)}};
    }
    const auto* words = reinterpret_cast<const std::int32_t*>(table.wide_words());
    const auto first = hn::ShiftLeft<2>(cell);
    const auto at = [&](int c) { return L{hn::GatherIndex(d, words, hn::Add(first, hn::Set(d, c)))}; };
    return {at(0), at(1), at(2), at(3)};
}
HWY_INLINE std::array<Lanes<std::int64_t>, 4> gather_cell(const CellTable& table, Lanes<std::int64_t> row,
                                                          Lanes<std::int64_t> column) {
    const hn::ScalableTag<std::int64_t> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    using L = Lanes<std::int64_t>;
    const auto cell = (row * make_word(WordTag<L>{}, table.size()) + column).v;
    if (table.is_narrow()) {
        const auto all = hn::BitCast(
            du, hn::GatherIndex(d, reinterpret_cast<const std::int64_t*>(table.narrow_words()), cell));
        const auto mask = hn::Set(du, 0xffff);
        const auto part = [&](auto v) { return L{hn::BitCast(d, hn::And(v, mask))}; };
        return {part(all), part(hn::ShiftRight<16>(all)), part(hn::ShiftRight<32>(all)),
                part(hn::ShiftRight<48>(all))};
    }
    const auto* words = reinterpret_cast<const std::int64_t*>(table.wide_words());
    const auto first = hn::ShiftLeft<1>(cell);
    const auto low = hn::BitCast(du, hn::GatherIndex(d, words, first));
    const auto high = hn::BitCast(du, hn::GatherIndex(d, words, hn::Add(first, hn::Set(d, 1))));
    const auto mask = hn::Set(du, 0xffffffff);
    const auto part = [&](auto v) { return L{hn::BitCast(d, hn::And(v, mask))}; };
    return {part(low), part(hn::ShiftRight<32>(low)), part(high), part(hn::ShiftRight<32>(high))};
}

// ------------------------------------------------------------------------------------------------ quotients
// and roots

namespace lanes_detail {
template <class T>
using FloatOf = std::conditional_t<sizeof(T) == 4, float, double>;
template <class T>
HWY_INLINE auto to_floats(Lanes<T> x) {
    return hn::ConvertTo(hn::ScalableTag<FloatOf<T>>(), x.v);
}
}  // namespace lanes_detail

/// Bits of x >= 0: the exponent of x with every bit below a set one cleared, which no rounding carries into
/// the next power.
template <class T>
HWY_INLINE Lanes<T> bit_length(Lanes<T> x) {
    const hn::ScalableTag<T> d;
    constexpr int kMantissa = sizeof(T) == 4 ? 23 : 52;
    constexpr int kBias = sizeof(T) == 4 ? 126 : 1022;
    const Lanes<T> leading{hn::AndNot(hn::ShiftRight<1>(x.v), x.v)};
    const auto exponent = hn::ShiftRight<kMantissa>(hn::BitCast(d, lanes_detail::to_floats(leading)));
    return {
        hn::IfThenZeroElse(hn::Eq(x.v, hn::Zero(d)), hn::Sub(exponent, hn::Set(d, static_cast<T>(kBias))))};
}
/// x 2^bits, floor; x >= 0.
template <class T>
HWY_INLINE Lanes<T> shift_by(Lanes<T> x, Lanes<T> bits) {
    using U = std::make_unsigned_t<T>;
    const hn::ScalableTag<U> du;
    const hn::ScalableTag<T> d;
    const auto zero = hn::Zero(d);
    const auto left = hn::BitCast(du, hn::Max(bits.v, zero)),
               right = hn::BitCast(du, hn::Max(hn::Sub(zero, bits.v), zero));
    return {hn::BitCast(d, hn::Shr(hn::Shl(hn::BitCast(du, x.v), left), right))};
}
/// floor(sqrt(x)), 0 <= x < 2^52: see words.h.  64-bit lanes only; 32-bit ones would need more than a float's
/// 24 bits.
HWY_INLINE Lanes<std::int64_t> square_root(Lanes<std::int64_t> x) {
    const hn::ScalableTag<std::int64_t> d;
    return {hn::ConvertTo(d, hn::Sqrt(lanes_detail::to_floats(x)))};
}
/// Never run: the plan gives square roots 64-bit lanes.
HWY_INLINE Lanes<std::int32_t> square_root(Lanes<std::int32_t> x) {
    return x;
}

/// The lowest bits of a product, whatever its factors: all 32 or 64 of them.
HWY_INLINE Lanes<std::int32_t> low_product(Lanes<std::int32_t> a, Lanes<std::int32_t> b) {
    return a * b;
}
HWY_INLINE Lanes<std::int64_t> low_product(Lanes<std::int64_t> a, Lanes<std::int64_t> b) {
    const hn::ScalableTag<std::int64_t> d;
    const hn::ScalableTag<std::uint64_t> du;
    const hn::ScalableTag<std::uint32_t> d32;
    const auto x = hn::BitCast(du, a.v), y = hn::BitCast(du, b.v);
    const auto product = [&](auto p, auto q) {
        return hn::MulEven(hn::BitCast(d32, p), hn::BitCast(d32, q));
    };
    const auto cross = hn::Add(product(hn::ShiftRight<32>(x), y), product(x, hn::ShiftRight<32>(y)));
    return {hn::BitCast(d, hn::Add(product(x, y), hn::ShiftLeft<32>(cross)))};
}

/// quantise.h's quotient.  A floating-point estimate of the floor, off by one at most, is corrected by the
/// exact rest. 32-bit lanes: results of at most 22 bits, denominators below 2^29 (pipeline/plan.cpp checks).
/// Saturating wires only.
template <class T>
HWY_INLINE Lanes<T> quotient(Lanes<T> numerator, Lanes<T> denominator, const Rescale& to) {
    using F = lanes_detail::FloatOf<T>;
    const hn::ScalableTag<T> d;
    const hn::ScalableTag<F> df;
    const auto one = hn::Set(d, T{1}), zero = hn::Zero(d);
    const Lanes<T> scaled = shift_left(numerator, -to.shift);
    const auto factor = hn::Set(df, static_cast<F>(power_of_two<double>(-to.shift)));
    const auto ratio =
        hn::Div(hn::Mul(lanes_detail::to_floats(numerator), factor), lanes_detail::to_floats(denominator));
    const auto beyond = hn::Set(df, static_cast<F>(to.highest + 1));
    Lanes<T> q{hn::ConvertTo(d, hn::Min(ratio, beyond))};
    Lanes<T> rest = scaled - low_product(q, denominator);
    const auto below = hn::Lt(rest.v, zero);
    q.v = hn::Sub(q.v, hn::IfThenElseZero(below, one));
    rest.v = hn::Add(rest.v, hn::IfThenElseZero(below, denominator.v));
    const auto above = hn::Not(hn::Lt(rest.v, denominator.v));
    q.v = hn::Add(q.v, hn::IfThenElseZero(above, one));
    rest.v = hn::Sub(rest.v, hn::IfThenElseZero(above, denominator.v));
    const auto twice = hn::Add(rest.v, rest.v);
    if (to.rounding == Rounding::rnd)
        q.v = hn::Add(q.v, hn::IfThenZeroElse(hn::Lt(twice, denominator.v), one));
    if (to.rounding == Rounding::rnd_conv) {
        const auto up = hn::Or(hn::Gt(twice, denominator.v),
                               hn::And(hn::Eq(twice, denominator.v), hn::Ne(hn::And(q.v, one), zero)));
        q.v = hn::Add(q.v, hn::IfThenElseZero(up, one));
    }
    return clamp(q, limit_in_lanes<T>(to.lowest), limit_in_lanes<T>(to.highest));
}

// ------------------------------------------------------------------------------------------------ memory:
// always 32-bit words

/// Wires pass between stages in buffers of 32-bit words, whatever the lanes a stage runs in.
HWY_INLINE Lanes<std::int32_t> load(WordTag<Lanes<std::int32_t>>, const std::int32_t* from) {
    return {hn::LoadU(hn::ScalableTag<std::int32_t>(), from)};
}
HWY_INLINE Lanes<std::int64_t> load(WordTag<Lanes<std::int64_t>>, const std::int32_t* from) {
    const hn::ScalableTag<std::int64_t> d;
    const hn::Rebind<std::int32_t, decltype(d)> narrow;
    return {hn::PromoteTo(d, hn::LoadU(narrow, from))};
}
HWY_INLINE void store(Lanes<std::int32_t> x, std::int32_t* to) {
    hn::StoreU(x.v, hn::ScalableTag<std::int32_t>(), to);
}
HWY_INLINE void store(Lanes<std::int64_t> x, std::int32_t* to) {
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

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
