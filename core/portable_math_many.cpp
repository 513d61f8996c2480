// expm1 and log1p of many numbers: the operations of portable_math.cpp, in their order, on vectors.  A
// vector's operation on doubles rounds like a single one, so the bits are the same on every target.
#include "core/portable_math.h"
#include "core/portable_math_series.h"

#include <cassert>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/portable_math_many.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::portable {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::ScalableTag<double>;
using V = hn::Vec<Tag>;
constexpr Tag kTag;
constexpr hn::RebindToUnsigned<Tag> kBits;

V constant(double value) {
    return hn::Set(kTag, value);
}
V plus_product(V a, V b, V c) {  // rounds twice on every target
    return hn::Add(a, hn::Mul(b, c));
}

template <std::size_t N>
V polynomial(const std::array<double, N>& coefficient, V x) {
    const V square = hn::Mul(x, x);
    V even = constant(coefficient[N - 2]), odd = constant(coefficient[N - 1]);
    for (std::size_t n = N - 2; n > 0; n -= 2) {
        even = plus_product(constant(coefficient[n - 2]), even, square);
        odd = plus_product(constant(coefficient[n - 1]), odd, square);
    }
    return plus_product(even, x, odd);
}

/// For |x| <= 40.
struct Expm1 {
    static auto in_domain(V x) { return hn::Le(hn::Abs(x), constant(40)); }
    static double of_one(double x) { return expm1(x); }
    static V of(V x) {
        const V turns = hn::Mul(x, constant(1 / kLn2High));
        const V k = hn::Trunc(hn::IfThenElse(hn::Lt(turns, constant(0)), hn::Sub(turns, constant(0.5)),
                                             hn::Add(turns, constant(0.5))));
        const V r = hn::Sub(hn::Sub(x, hn::Mul(k, constant(kLn2High))), hn::Mul(k, constant(kLn2Low)));
        const V p =
            plus_product(r, hn::Mul(r, r), hn::Add(constant(0.5), hn::Mul(r, polynomial(kFactorials, r))));
        // 2^k: the lowest bits of the sum are k + 1023.
        const V sum = hn::Add(k, constant(0x1.8p52 + 1023));
        const V power = hn::BitCast(kTag, hn::ShiftLeft<52>(hn::BitCast(kBits, sum)));
        const V result = hn::Add(hn::Mul(power, p), hn::Sub(power, constant(1)));
        return hn::IfThenElse(hn::Lt(hn::Abs(x), constant(0x1p-54)), x, result);
    }
};

/// For -1 < x < 1.
struct Log1p {
    static auto in_domain(V x) { return hn::Lt(hn::Abs(x), constant(1)); }
    static double of_one(double x) { return log1p(x); }
    static V of(V x) {
        const V u = hn::Add(constant(1), x), lost = hn::Sub(x, hn::Sub(u, constant(1)));
        // u = 2^k m.  The exponent becomes a number in the lowest bits of 2^52.
        const auto bits = hn::BitCast(kBits, u);
        const auto exponent = hn::Or(hn::ShiftRight<52>(bits), hn::Set(kBits, 0x4330000000000000u));
        V k = hn::Sub(hn::BitCast(kTag, exponent), constant(0x1p52 + 1023));
        V m = hn::BitCast(kTag, hn::Or(hn::And(bits, hn::Set(kBits, 0x000fffffffffffffu)),
                                       hn::Set(kBits, 0x3ff0000000000000u)));
        const auto large = hn::Ge(m, constant(0x1.6a09e667f3bcdp+0));
        m = hn::IfThenElse(large, hn::Mul(m, constant(0.5)), m);
        k = hn::IfThenElse(large, hn::Add(k, constant(1)), k);
        const V f = hn::Sub(m, constant(1));
        const V s = hn::Div(f, hn::Add(constant(2), f));
        const V half = hn::Mul(hn::Mul(constant(0.5), f), f), z = hn::Mul(s, s);
        const V tail =
            hn::Mul(s, hn::Add(half, hn::Mul(hn::Mul(constant(2), z), polynomial(kAtanhFrom1, z))));
        const V low = hn::Sub(half, hn::Add(tail, hn::Mul(k, constant(kLn2Low))));
        const V log = hn::Sub(hn::Mul(k, constant(kLn2High)), hn::Sub(low, f));
        return hn::Add(log, hn::Div(lost, u));
    }
};

template <class Function>
void of_many(const double* x, std::size_t count, double* result) {
    const std::size_t lanes = hn::Lanes(kTag);
    std::size_t i = 0;
    for (; i + lanes <= count; i += lanes) {
        const V here = hn::LoadU(kTag, x + i);
        if (!hn::AllTrue(kTag, Function::in_domain(here)))
            for (std::size_t j = i; j < i + lanes; ++j) result[j] = Function::of_one(x[j]);
        else
            hn::StoreU(Function::of(here), kTag, result + i);
    }
    for (; i < count; ++i) result[i] = Function::of_one(x[i]);
}

void ManyExpm1(const double* x, std::size_t count, double* result) {
    of_many<Expm1>(x, count, result);
}
void ManyLog1p(const double* x, std::size_t count, double* result) {
    of_many<Log1p>(x, count, result);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace squint::portable
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::portable {

HWY_EXPORT(ManyExpm1);
HWY_EXPORT(ManyLog1p);

void expm1_each(std::span<const double> x, std::span<double> result) {
    assert(x.size() == result.size());
    HWY_DYNAMIC_DISPATCH(ManyExpm1)(x.data(), x.size(), result.data());
}
void log1p_each(std::span<const double> x, std::span<double> result) {
    assert(x.size() == result.size());
    HWY_DYNAMIC_DISPATCH(ManyLog1p)(x.data(), x.size(), result.data());
}

}  // namespace squint::portable
#endif
