#include "pipeline/classification/tables/pi2d_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/classification/tables/pi2d_kernel.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::preintegration {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::ScalableTag<double>;
using V = hn::Vec<Tag>;
constexpr Tag kTag;

V constant(double value) {
    return hn::Set(kTag, value);
}

/// a + b c, rounded twice on every target.
V plus_product(V a, V b, V c) {
    return hn::Add(a, hn::Mul(b, c));
}

/// The value of the polynomial with these coefficients, lowest first.
template <class... Higher>
V polynomial(V x, double lowest, Higher... higher) {
    if constexpr (sizeof...(higher) == 0)
        return constant(lowest);
    else
        return plus_product(constant(lowest), x, polynomial(x, higher...));
}

/// e^x for x <= 0 within 1e-12: 2^n times a polynomial on [-ln 2 / 2, ln 2 / 2]; e^-700 below that.
V decay(V x) {
    const V round =
        constant(6755399441055744.0);  // 1.5 * 2^52: adding it leaves the nearest integer in the low bits
    x = hn::Max(x, constant(-700));
    const V shifted = plus_product(round, x, constant(1.4426950408889634));
    const V n = hn::Sub(shifted, round);
    const V high = hn::Sub(x, hn::Mul(n, constant(0.693147180369123816490)));
    const V r = hn::Sub(high, hn::Mul(n, constant(1.90821492927058770002e-10)));
    const V p = polynomial(r, 1, 1, 1.0 / 2, 1.0 / 6, 1.0 / 24, 1.0 / 120, 1.0 / 720, 1.0 / 5040, 1.0 / 40320,
                           1.0 / 362880, 1.0 / 3628800);
    const hn::RebindToUnsigned<Tag> bits;
    return hn::BitCast(kTag, hn::Add(hn::BitCast(bits, p), hn::ShiftLeft<52>(hn::BitCast(bits, shifted))));
}

// The mean transparency of a stretch whose depth per length is a and b at its ends, with x = (a + b) / 2 and
// y = (b - a) / 2, is
//   M(x, y) = int_0^1 exp(-x u + y u (1 - u)) du = e^(-x/2) Q(x^2, y),   Q = sum_jk q_jk x^(2j) y^k,
//   q_jk = 2^-(2j+2k+1) / ((2j)! (j+1/2) (j+3/2) ... (j+k+1/2))
// (substitute v = u - 1/2, then expand cosh and exp).
// Seen from the other side, y changes sign.
constexpr double q(int j, int k) {
    double value = 0.5;
    for (int i = 0; i < j + k; ++i) value /= 4;
    for (int i = 1; i <= 2 * j; ++i) value /= i;
    for (int i = 0; i <= k; ++i) value /= j + 0.5 + i;
    return value;
}

struct Means {
    V half;      // e^(-x/2)
    V up, down;  // M from either side
};

/// a, b <= 1: terms up to 2j + k = 8; the largest one left out is below 1e-11.
struct UpToOne {
    static Means means(V a, V b) {
        const V x = hn::Mul(constant(0.5), hn::Add(a, b)), y = hn::Mul(constant(0.5), hn::Sub(b, a));
        const V xx = hn::Mul(x, x), yy = hn::Mul(y, y);
        const V half = decay(hn::Mul(constant(-0.5), x));
        const V q0 = polynomial(xx, q(0, 0), q(1, 0), q(2, 0), q(3, 0), q(4, 0));
        const V q1 = polynomial(xx, q(0, 1), q(1, 1), q(2, 1), q(3, 1));
        const V q2 = polynomial(xx, q(0, 2), q(1, 2), q(2, 2), q(3, 2));
        const V q3 = polynomial(xx, q(0, 3), q(1, 3), q(2, 3));
        const V q4 = polynomial(xx, q(0, 4), q(1, 4), q(2, 4));
        const V q5 = polynomial(xx, q(0, 5), q(1, 5));
        const V q6 = polynomial(xx, q(0, 6), q(1, 6));
        const V even_tail = plus_product(q4, yy, plus_product(q6, yy, constant(q(0, 8))));
        const V even = plus_product(q0, yy, plus_product(q2, yy, even_tail));
        const V odd_tail = plus_product(q3, yy, plus_product(q5, yy, constant(q(0, 7))));
        const V odd = hn::Mul(y, plus_product(q1, yy, odd_tail));
        return {half, hn::Mul(half, hn::Add(even, odd)), hn::Mul(half, hn::Sub(even, odd))};
    }
};

/// a, b <= 1/16, which covers nearly all diagonals of a large table: the largest term left out is 2e-9 (x^2
/// y^2).
struct UpToASixteenth {
    static Means means(V a, V b) {
        const V x = hn::Mul(constant(0.5), hn::Add(a, b)), y = hn::Mul(constant(0.5), hn::Sub(b, a));
        const V xx = hn::Mul(x, x), yy = hn::Mul(y, y);
        const V half = polynomial(hn::Mul(constant(-0.5), x), 1, 1, 1.0 / 2, 1.0 / 6, 1.0 / 24, 1.0 / 120);
        const V even = plus_product(polynomial(xx, 1, q(1, 0), q(2, 0)), yy, constant(q(0, 2)));
        const V odd = hn::Mul(y, plus_product(polynomial(xx, q(0, 1), q(1, 1)), yy, constant(q(0, 3))));
        return {half, hn::Mul(half, hn::Add(even, odd)), hn::Mul(half, hn::Sub(even, odd))};
    }
};

double first_lane(V v) {
    return hn::GetLane(v);
}

/// The mean transparency at any depth, by pieces of depth <= 1; beyond a depth of 40 nothing is added.
double mean_of_any_depth(double from, double to) {
    const int pieces = std::max(1, static_cast<int>(std::ceil(std::max(from, to))));
    const double h = 1.0 / pieces;
    double sum = 0;
    for (int piece = 0; piece < pieces; ++piece) {
        const double u = piece * h;
        const double before = u * (from + u * (to - from) / 2);
        if (before > 40) break;
        const double a = (from + u * (to - from)) * h, b = (from + (u + h) * (to - from)) * h;
        sum += h * first_lane(hn::Mul(decay(constant(-before)), UpToOne::means(constant(a), constant(b)).up));
    }
    return sum;
}

void solve_deep_stretch(const Stretches& s, int i, double rate) {
    const double path = rate * s.width[i], a = path * s.extinction[i], b = path * s.extinction[i + 1];
    const double e = first_lane(decay(constant(-(a + b) / 2)));
    const double up = mean_of_any_depth(a, b), down = mean_of_any_depth(b, a);
    s.transparency[i] = e;
    for (int k = 0; k < 3; ++k) {
        s.up[k][i] = s.color[k][i] * (1 - up) + s.color[k][i + 1] * (up - e);
        s.down[k][i] = s.color[k][i + 1] * (1 - down) + s.color[k][i] * (down - e);
    }
}

template <class Range>
void all_stretches(const Stretches& s, double rate) {
    for (int i = 0; i < s.count; i += static_cast<int>(hn::Lanes(kTag))) {
        const V path = hn::Mul(constant(rate), hn::LoadU(kTag, s.width + i));
        const Means m = Range::means(hn::Mul(path, hn::LoadU(kTag, s.extinction + i)),
                                     hn::Mul(path, hn::LoadU(kTag, s.extinction + i + 1)));
        const V e = hn::Mul(m.half, m.half);
        hn::StoreU(e, kTag, s.transparency + i);
        const V far_up = hn::Sub(constant(1), m.up), near_up = hn::Sub(m.up, e);
        const V far_down = hn::Sub(constant(1), m.down), near_down = hn::Sub(m.down, e);
        for (int k = 0; k < 3; ++k) {
            const V low = hn::LoadU(kTag, s.color[k] + i), high = hn::LoadU(kTag, s.color[k] + i + 1);
            hn::StoreU(plus_product(hn::Mul(low, far_up), high, near_up), kTag, s.up[k] + i);
            hn::StoreU(plus_product(hn::Mul(high, far_down), low, near_down), kTag, s.down[k] + i);
        }
    }
}

void SolveStretches(const Stretches& s, double rate, double deepest) {
    if (rate * deepest <= 1.0 / 16) return all_stretches<UpToASixteenth>(s, rate);
    all_stretches<UpToOne>(s, rate);
    if (rate * deepest <= 1) return;
    for (int i = 0; i < s.count; ++i) {
        const double path = rate * s.width[i];
        if (path * std::max(s.extinction[i], s.extinction[i + 1]) > 1) solve_deep_stretch(s, i, rate);
    }
}

void SlabOpacities(const double* depth, int m, int count, double rate, double* transparency,
                   double* opacity) {
    for (int f = 0; f < count; f += static_cast<int>(hn::Lanes(kTag))) {
        const V x =
            hn::Mul(constant(-rate), hn::Sub(hn::LoadU(kTag, depth + f + m), hn::LoadU(kTag, depth + f)));
        const V t = decay(x);
        hn::StoreU(t, kTag, transparency + f);
        hn::StoreU(hn::Sub(constant(1), t), kTag, opacity + f);
    }
}

void SubtractDropped(const double* add, const double* transparency, const double* drop, int count,
                     double* out) {
    for (int f = 0; f < count; f += static_cast<int>(hn::Lanes(kTag))) {
        const V dropped = hn::Mul(hn::LoadU(kTag, transparency + f), hn::LoadU(kTag, drop + f));
        hn::StoreU(hn::Sub(hn::LoadU(kTag, add + f), dropped), kTag, out + f);
    }
}

void EncodeU16(const double* HWY_RESTRICT values, int count, int fraction_bits,
               unsigned short* HWY_RESTRICT words) {
    constexpr double kRound = 6755399441055744.0;
    const double scale = static_cast<double>(1 << fraction_bits);
    const hn::Rebind<std::int32_t, Tag> whole;
    const hn::Rebind<std::uint16_t, Tag> word;
    int i = 0;
    for (; i + static_cast<int>(hn::Lanes(kTag)) <= count; i += static_cast<int>(hn::Lanes(kTag))) {
        const V scaled = hn::Mul(hn::LoadU(kTag, values + i), constant(scale));
        const V limited = hn::Min(hn::Max(scaled, constant(0)), constant(65535));
        const V rounded = hn::Sub(hn::Add(limited, constant(kRound)), constant(kRound));
        hn::StoreU(hn::DemoteTo(word, hn::DemoteTo(whole, rounded)), word, words + i);
    }
    for (; i < count; ++i) {
        double scaled = values[i] * scale;
        scaled = scaled < 0 ? 0 : scaled;
        scaled = scaled > 65535 ? 65535 : scaled;
        words[i] = static_cast<unsigned short>(static_cast<int>((scaled + kRound) - kRound));
    }
}

void Interleave4(const unsigned short* HWY_RESTRICT planes, std::size_t plane, std::size_t count,
                 unsigned short* HWY_RESTRICT cells) {
    const hn::ScalableTag<std::uint16_t> d;
    std::size_t i = 0;
    for (; i + hn::Lanes(d) <= count; i += hn::Lanes(d))
        hn::StoreInterleaved4(hn::LoadU(d, planes + i), hn::LoadU(d, planes + plane + i),
                              hn::LoadU(d, planes + 2 * plane + i), hn::LoadU(d, planes + 3 * plane + i), d,
                              cells + 4 * i);
    for (; i < count; ++i)
        for (std::size_t k = 0; k < 4; ++k) cells[4 * i + k] = planes[k * plane + i];
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace squint::preintegration
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::preintegration {

HWY_EXPORT(SolveStretches);
HWY_EXPORT(SlabOpacities);
HWY_EXPORT(SubtractDropped);
HWY_EXPORT(EncodeU16);
HWY_EXPORT(Interleave4);

void solve_stretches(const Stretches& stretches, double rate, double deepest) {
    HWY_DYNAMIC_DISPATCH(SolveStretches)(stretches, rate, deepest);
}

void slab_opacities(const double* depth, int m, int count, double rate, double* transparency,
                    double* opacity) {
    HWY_DYNAMIC_DISPATCH(SlabOpacities)(depth, m, count, rate, transparency, opacity);
}

void subtract_dropped(const double* add, const double* transparency, const double* drop, int count,
                      double* out) {
    HWY_DYNAMIC_DISPATCH(SubtractDropped)(add, transparency, drop, count, out);
}

void encode_u16(const double* values, int count, int fraction_bits, unsigned short* words) {
    HWY_DYNAMIC_DISPATCH(EncodeU16)(values, count, fraction_bits, words);
}

void interleave_4(const unsigned short* planes, std::size_t plane, std::size_t count, unsigned short* cells) {
    HWY_DYNAMIC_DISPATCH(Interleave4)(planes, plane, count, cells);
}

}  // namespace squint::preintegration
#endif
