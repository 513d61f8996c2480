// Quotients, roots and wide numbers of lanes.  Floating point gives an estimate, integers correct it: the
// model's bits on every CPU.
#if defined(SQUINT_FIXEDPOINT_WORDS_LANE_QUOTIENTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_FIXEDPOINT_WORDS_LANE_QUOTIENTS_INL_H
#undef SQUINT_FIXEDPOINT_WORDS_LANE_QUOTIENTS_INL_H
#else
#define SQUINT_FIXEDPOINT_WORDS_LANE_QUOTIENTS_INL_H
#endif

#include "fixedpoint/quotients-inl.h"
#include "fixedpoint/split_quotient.h"
#include "fixedpoint/words/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

namespace lanes_detail {
template <class T>
using FloatOf = std::conditional_t<sizeof(T) == 4, float, double>;
template <class T, KnownRescales K>
HWY_INLINE auto to_floats(Lanes<T, K> x) {
    return hn::ConvertTo(hn::ScalableTag<FloatOf<T>>(), x.v);
}
}  // namespace lanes_detail

/// The number of bits of x >= 0.  It is the exponent of x as a float; every bit below a set one is cleared
/// first, so that rounding cannot carry into the next power.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> bit_length(Lanes<T, K> x) {
    const hn::ScalableTag<T> d;
    constexpr int kMantissa = sizeof(T) == 4 ? 23 : 52;
    constexpr int kBias = sizeof(T) == 4 ? 126 : 1022;
    const Lanes<T, K> leading{hn::AndNot(hn::ShiftRight<1>(x.v), x.v)};
    const auto exponent = hn::ShiftRight<kMantissa>(hn::BitCast(d, lanes_detail::to_floats(leading)));
    return {
        hn::IfThenZeroElse(hn::Eq(x.v, hn::Zero(d)), hn::Sub(exponent, hn::Set(d, static_cast<T>(kBias))))};
}
/// floor(x 2^bits) for bits of either sign; x >= 0.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> shift_by(Lanes<T, K> x, Lanes<T, K> bits) {
    using U = std::make_unsigned_t<T>;
    const hn::ScalableTag<U> du;
    const hn::ScalableTag<T> d;
    const auto zero = hn::Zero(d);
    const auto left = hn::BitCast(du, hn::Max(bits.v, zero)),
               right = hn::BitCast(du, hn::Max(hn::Sub(zero, bits.v), zero));
    return {hn::BitCast(d, hn::Shr(hn::Shl(hn::BitCast(du, x.v), left), right))};
}
/// words.h says why the root in double precision has the right floor.
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> vector_length(const std::array<Lanes<std::int64_t, K>, 3>& v, int guard) {
    const hn::ScalableTag<std::int64_t> d;
    const auto squares = shift_left(v[0] * v[0] + v[1] * v[1] + v[2] * v[2], 2 * guard);
    return {hn::ConvertTo(d, hn::Sqrt(lanes_detail::to_floats(squares)))};
}
/// guard <= 8: the sum of squares fills 32 unsigned bits, and the root 24.  The root in floats is off by at
/// most 1.1; the sum minus its square fits 32 bits again, and decides the floor.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> vector_length(const std::array<Lanes<std::int32_t, K>, 3>& v, int guard) {
    const hn::ScalableTag<std::int32_t> d;
    const hn::ScalableTag<float> df;
    const auto one = hn::Set(d, 1), zero = hn::Zero(d);
    const Lanes<std::int32_t, K> squares = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    const auto as_signed = hn::ConvertTo(df, squares.v);
    const auto sum =
        hn::Add(as_signed, hn::IfThenElseZero(hn::Lt(as_signed, hn::Zero(df)), hn::Set(df, 0x1p32F)));
    const auto root = hn::Mul(hn::Sqrt(sum), hn::Set(df, power_of_two<float>(guard)));
    const Lanes<std::int32_t, K> estimate{hn::ConvertTo(d, root)};
    const auto rest = (shift_left(squares, 2 * guard) - estimate * estimate).v;
    const auto twice = hn::Add(estimate.v, estimate.v);
    auto length = estimate.v;
    length = hn::IfThenElse(hn::Lt(rest, zero), hn::Sub(length, one), length);
    length = hn::IfThenElse(hn::Lt(rest, hn::Min(zero, hn::Sub(one, twice))), hn::Sub(length, one), length);
    return {hn::IfThenElse(hn::Gt(rest, twice), hn::Add(length, one), length)};
}

/// The lowest 32 or 64 bits of a product of any factors.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> low_product(Lanes<std::int32_t, K> a, Lanes<std::int32_t, K> b) {
    return a * b;
}
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> low_product(Lanes<std::int64_t, K> a, Lanes<std::int64_t, K> b) {
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

namespace lanes_detail {
/// Corrects an estimate of scaled / denominator, an integer off by at most one, by its exact remainder.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> corrected(Lanes<T, K> q, Lanes<T, K> scaled, Lanes<T, K> denominator,
                                 const Rescale& to) {
    const hn::ScalableTag<T> d;
    const auto one = hn::Set(d, T{1}), zero = hn::Zero(d);
    const auto rest = (scaled - low_product(q, denominator)).v, below = denominator.v;
    auto down = hn::Lt(rest, zero), up = hn::Not(hn::Lt(rest, below));
    if (to.rounding == Rounding::rnd || to.rounding == Rounding::rnd_conv) {
        // Halves go up (rnd), or to the even neighbour (rnd_conv).
        const auto twice = hn::Add(rest, rest), odd = hn::And(q.v, one);
        const bool to_even = to.rounding == Rounding::rnd_conv;
        up = hn::Gt(hn::Add(twice, to_even ? odd : one), below);
        down = hn::Gt(hn::Sub(to_even ? odd : zero, twice), below);
    }
    q.v = hn::IfThenElse(up, hn::Add(q.v, one), q.v);
    return {hn::IfThenElse(down, hn::Sub(q.v, one), q.v)};
}
/// The integer nearest to x; |x| <= 2^22 (floats) or 2^51.  Adding 1.5 times the power of two whose last bit
/// is one leaves it in the lowest bits of the sum.
template <class T, class V>
HWY_INLINE auto nearest_whole(V x) {
    const hn::ScalableTag<T> d;
    const auto whole = hn::Set(hn::DFromV<V>(), FloatOf<T>(sizeof(T) == 4 ? 0x1.8p23 : 0x1.8p52));
    return hn::Sub(hn::BitCast(d, hn::Add(x, whole)), hn::BitCast(d, whole));
}
// A multiply-add rounds once.
inline constexpr bool kRoundsOnce = HWY_NATIVE_FMA != 0;
/// scaled / denominator as whole doubles, from the denominator's inverse.  An estimate, off by an eighth at most where
/// results have 48 bits, is corrected by its exact remainder.  Without multiply-adds that round once, its products
/// have at most 53 bits (split_quotient.h; range.cpp notes it).
template <class V>
HWY_INLINE V whole_quotient(V scaled, V below, V inverse, const Rescale& to) {
    const hn::ScalableTag<double> d;
    const auto one = hn::Set(d, 1.0), zero = hn::Zero(d);
    const bool halves_up = to.rounding == Rounding::rnd, halves_to_even = to.rounding == Rounding::rnd_conv;
    const auto estimate = hn::Mul(scaled, inverse);
    // Halves up: lowered by a quarter, it is never rounded too high.
    auto q = halves_up        ? hn::Floor(hn::Add(estimate, hn::Set(d, 0.25)))
             : halves_to_even ? hn::Round(estimate)
                              : hn::Trunc(estimate);
    auto rest = zero;
    if constexpr (kRoundsOnce) {
        rest = hn::NegMulAdd(q, below, scaled);
    } else if (splits_denominator(to.width)) {
        const hn::ScalableTag<std::int64_t> bits;
        const auto high =
            hn::BitCast(d, hn::And(hn::BitCast(bits, below), hn::Set(bits, -(std::int64_t{1} << 26))));
        rest = hn::Sub(hn::Sub(scaled, hn::Mul(q, high)), hn::Mul(q, hn::Sub(below, high)));
    } else {
        const auto coarse = hn::Mul(hn::Trunc(hn::Mul(q, hn::Set(d, power_of_two<double>(-to.width / 2)))),
                                    hn::Set(d, power_of_two<double>(to.width / 2)));
        rest = hn::Sub(hn::Sub(scaled, hn::Mul(coarse, below)), hn::Mul(hn::Sub(q, coarse), below));
    }
    if (halves_up) return hn::Add(q, hn::IfThenElseZero(hn::Ge(rest, hn::Mul(below, hn::Set(d, 0.5))), one));
    if (!halves_to_even) {
        q = hn::Sub(q, hn::IfThenElseZero(hn::Lt(rest, zero), one));
        return hn::Add(q, hn::IfThenElseZero(hn::Ge(rest, below), one));
    }
    const auto twice = hn::Add(rest, rest);
    // The usual case: in no lane is the remainder as large as half the denominator.
    if (hn::AllTrue(d, hn::Lt(hn::Abs(twice), below))) return q;
    const auto halved = hn::Mul(q, hn::Set(d, 0.5));
    const auto odd = hn::Ne(halved, hn::Trunc(halved));
    const auto down = hn::Or(hn::Lt(twice, hn::Neg(below)), hn::And(hn::Eq(twice, hn::Neg(below)), odd));
    const auto up = hn::Or(hn::Gt(twice, below), hn::And(hn::Eq(twice, below), odd));
    q = hn::Sub(q, hn::IfThenElseZero(down, one));
    return hn::Add(q, hn::IfThenElseZero(up, one));
}
/// Quotients in 64-bit lanes of numbers below 2^52, which doubles hold.
template <KnownRescales K, std::size_t N>
HWY_INLINE std::array<Lanes<std::int64_t, K>, N> quotients_of_doubles(
    const std::array<Lanes<std::int64_t, K>, N>& numerators, Lanes<std::int64_t, K> denominator,
    const Rescale& to) {
    const hn::ScalableTag<double> df;
    const hn::ScalableTag<std::int64_t> d;
    const auto unit = hn::Set(df, 0x1p52), whole = hn::Set(df, 0x1.8p52);
    const auto real = [&](auto x) HWY_ATTR {
        return hn::Sub(hn::BitCast(df, hn::Or(x.v, hn::BitCast(d, unit))), unit);
    };
    const auto factor = hn::Set(df, power_of_two<double>(-to.shift)),
               low = hn::Set(df, static_cast<double>(to.lowest)),
               high = hn::Set(df, static_cast<double>(to.highest));
    const auto below = real(denominator), inverse = hn::Div(hn::Set(df, 1.0), below);
    std::array<Lanes<std::int64_t, K>, N> results;
    for (std::size_t i = 0; i < N; ++i) {
        const auto q = whole_quotient(hn::Mul(real(numerators[i]), factor), below, inverse, to);
        const auto sum = hn::Add(hn::Min(hn::Max(q, low), high), whole);
        results[i] = {hn::Sub(hn::BitCast(d, sum), hn::BitCast(d, whole))};
    }
    return results;
}
template <class T, KnownRescales K, std::size_t N>
HWY_INLINE std::array<Lanes<T, K>, N> quotients(const std::array<Lanes<T, K>, N>& numerators,
                                                Lanes<T, K> denominator, const Rescale& to) {
    using F = lanes_detail::FloatOf<T>;
    if constexpr (kRoundsOnce && sizeof(T) == 8) {
        const hn::ScalableTag<T> d;
        auto all = denominator.v;
        for (const auto& x : numerators) all = hn::Or(all, x.v);
        if (hn::AllTrue(d, hn::Eq(hn::ShiftRight<52>(all), hn::Zero(d))))
            return quotients_of_doubles(numerators, denominator, to);
    }
    const hn::ScalableTag<F> df;
    const bool to_nearest = to.rounding == Rounding::rnd || to.rounding == Rounding::rnd_conv;
    const auto factor = hn::Set(df, static_cast<F>(power_of_two<double>(-to.shift)));
    const auto inverse = hn::Div(factor, lanes_detail::to_floats(denominator));
    const auto beyond = hn::Set(df, static_cast<F>(to.highest + 1));
    std::array<Lanes<T, K>, N> results;
    for (std::size_t i = 0; i < N; ++i) {
        const auto ratio = hn::Min(hn::Mul(lanes_detail::to_floats(numerators[i]), inverse), beyond);
        const Lanes<T, K> estimate{
            nearest_whole<T>(to_nearest ? ratio : hn::Sub(ratio, hn::Set(df, F{0.5})))};
        const Lanes<T, K> q =
            lanes_detail::corrected(estimate, shift_left(numerators[i], -to.shift), denominator, to);
        results[i] = clamp(q, limit_in_lanes<T, K>(to.lowest), limit_in_lanes<T, K>(to.highest));
    }
    return results;
}
}  // namespace lanes_detail

/// quotient() of words.h.  In 32-bit lanes results have at most 22 bits and denominators are below 2^29 (the
/// plan checks it): four roundings of floats then err by at most one.  Saturating wires only.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> quotient(Lanes<T, K> numerator, Lanes<T, K> denominator, const Rescale& to) {
    return lanes_detail::quotients(std::array{numerator}, denominator, to)[0];
}
template <class T, KnownRescales K>
HWY_INLINE std::array<Lanes<T, K>, 3> quotients(const std::array<Lanes<T, K>, 3>& numerators,
                                                Lanes<T, K> denominator, const Rescale& to) {
    return lanes_detail::quotients(numerators, denominator, to);
}

template <KnownRescales K>
inline constexpr bool kInvertsOnce<Lanes<std::int64_t, K>> = true;

// ------------------------------------------------------------------------------------ wide numbers

/// Wide<W> of 32-bit lanes: doubles, for the lower half of the lanes and for the upper one.
template <KnownRescales K>
struct WideLanes {
    using InvertsOnce = void;
    using V = hn::Vec<hn::ScalableTag<double>>;
    V low, high;
};
}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
namespace squint {
template <KnownRescales K>
struct WideOf<HWY_NAMESPACE::Lanes<std::int32_t, K>> {
    using Type = HWY_NAMESPACE::WideLanes<K>;
};
}  // namespace squint
HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

namespace lanes_detail {
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> narrow(const WideLanes<K>& x) {
    const hn::ScalableTag<std::int32_t> d;
#if HWY_TARGET == HWY_SCALAR
    return {hn::DemoteTo(d, x.low)};  // saturates, like the DemoteTo of vectors
#else
    const hn::Half<decltype(d)> half;
    return {hn::Combine(d, hn::DemoteTo(half, x.high), hn::DemoteTo(half, x.low))};
#endif
}
template <KnownRescales K, class F>
HWY_INLINE WideLanes<K> by_halves(F&& f) {
#if HWY_TARGET == HWY_SCALAR
    const auto only = f([](const auto& x) { return x.low; });
    return {only, only};
#else
    return {f([](const auto& x) { return x.low; }), f([](const auto& x) { return x.high; })};
#endif
}
}  // namespace lanes_detail
/// For 64-bit lanes, Wide<W> is W.
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> widen(Lanes<std::int64_t, K> x) {
    return x;
}
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> wide_sum(Lanes<std::int64_t, K> high, int bits,
                                           Lanes<std::int64_t, K> low) {
    return shift_left(high, bits) + low;
}
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> wide_product(Lanes<std::int64_t, K> a, Lanes<std::int64_t, K> b) {
    return a * b;
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> widen(Lanes<std::int32_t, K> x) {
    const hn::ScalableTag<double> wide;
#if HWY_TARGET == HWY_SCALAR
    const auto only = hn::PromoteTo(wide, x.v);
    return {only, only};
#else
    const hn::Half<hn::ScalableTag<std::int32_t>> half;
    return {hn::PromoteTo(wide, hn::LowerHalf(half, x.v)), hn::PromoteTo(wide, hn::UpperHalf(half, x.v))};
#endif
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> operator+(const WideLanes<K>& a, const WideLanes<K>& b) {
    return {hn::Add(a.low, b.low), hn::Add(a.high, b.high)};
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> operator-(const WideLanes<K>& a, const WideLanes<K>& b) {
    return {hn::Sub(a.low, b.low), hn::Sub(a.high, b.high)};
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> shift_left(const WideLanes<K>& x, int bits) {
    const auto factor = hn::Set(hn::ScalableTag<double>(), power_of_two<double>(bits));
    return {hn::Mul(x.low, factor), hn::Mul(x.high, factor)};
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> wide_sum(Lanes<std::int32_t, K> high, int bits, Lanes<std::int32_t, K> low) {
    return shift_left(widen(high), bits) + widen(low);
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> wide_product(Lanes<std::int32_t, K> a, Lanes<std::int32_t, K> b) {
    const auto x = widen(a), y = widen(b);
    return {hn::Mul(x.low, y.low), hn::Mul(x.high, y.high)};
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> absolute(const WideLanes<K>& x) {
    return {hn::Abs(x.low), hn::Abs(x.high)};
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> max(const WideLanes<K>& a, const WideLanes<K>& b) {
    return {hn::Max(a.low, b.low), hn::Max(a.high, b.high)};
}
template <KnownRescales K>
HWY_INLINE bool any_positive(const WideLanes<K>& x) {
    const hn::ScalableTag<double> d;
    const auto most = hn::Max(x.low, x.high);
    return !hn::AllFalse(d, hn::Lt(hn::Zero(d), most));
}
template <KnownRescales K>
HWY_INLINE bool any_positive(Lanes<std::int64_t, K> x) {
    return any(constant<Lanes<std::int64_t, K>>(0) < x);
}
namespace lanes_detail {
/// Results beyond 32 bits saturate.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> quotient_by(const WideLanes<K>& numerator, const WideLanes<K>& denominator,
                                              const WideLanes<K>& inverse, const Rescale& to) {
    const auto factor = hn::Set(hn::ScalableTag<double>(), power_of_two<double>(-to.shift));
    const auto half = [&](auto part) SQUINT_WRITTEN_OUT {
        return whole_quotient(hn::Mul(part(numerator), factor), part(denominator), part(inverse), to);
    };
    const auto q = narrow(by_halves<K>(half));
    return clamp(q, limit_in_lanes<std::int32_t, K>(to.lowest), limit_in_lanes<std::int32_t, K>(to.highest));
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> inverse_of(const WideLanes<K>& x) {
    const auto one = hn::Set(hn::ScalableTag<double>(), 1.0);
    return {hn::Div(one, x.low), hn::Div(one, x.high)};
}
}  // namespace lanes_detail
/// quantised_wide_product of entries-inl.h.  Saturating wires only.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> quantised_wide_product(Lanes<std::int32_t, K> a, Lanes<std::int32_t, K> b,
                                                         const Rescale& to) {
    const hn::ScalableTag<double> d;
    const WideLanes<K> product = shift_left(wide_product(a, b), -to.shift);
    const auto half = [&](auto part) SQUINT_WRITTEN_OUT {
        const auto x = part(product);
        switch (to.rounding) {
            case Rounding::rnd:
                return hn::Floor(hn::Add(x, hn::Set(d, 0.5)));
            case Rounding::rnd_conv:
                return hn::Round(x);
            case Rounding::trn_zero:
                return hn::Trunc(x);
            default:
                return hn::Floor(x);
        }
    };
    const auto q = lanes_detail::narrow(lanes_detail::by_halves<K>(half));
    return clamp(q, limit_in_lanes<std::int32_t, K>(to.lowest), limit_in_lanes<std::int32_t, K>(to.highest));
}

template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> quotient(const WideLanes<K>& numerator, const WideLanes<K>& denominator,
                                           const Rescale& to) {
    return lanes_detail::quotient_by(numerator, denominator, lanes_detail::inverse_of(denominator), to);
}
template <KnownRescales K>
HWY_INLINE std::array<Lanes<std::int32_t, K>, 3> quotients(const std::array<WideLanes<K>, 3>& numerator,
                                                           const WideLanes<K>& denominator,
                                                           const Rescale& to) {
    const WideLanes<K> inverse = lanes_detail::inverse_of(denominator);
    return {lanes_detail::quotient_by(numerator[0], denominator, inverse, to),
            lanes_detail::quotient_by(numerator[1], denominator, inverse, to),
            lanes_detail::quotient_by(numerator[2], denominator, inverse, to)};
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
