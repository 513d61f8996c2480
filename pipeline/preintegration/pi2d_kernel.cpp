#include "pipeline/preintegration/pi2d_kernel.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/preintegration/pi2d_kernel.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::preintegration {
namespace HWY_NAMESPACE {
namespace {

/// e^x for x <= 0 within 1e-12: 2^n times a polynomial on [-ln 2 / 2, ln 2 / 2]; e^-700 below that.
inline double decay(double x) {
    constexpr double kRound =
        6755399441055744.0;  // 1.5 * 2^52: adding it leaves the nearest integer in the low bits
    x = x < -700 ? -700 : x;
    const double shifted = x * 1.4426950408889634 + kRound;
    const double n = shifted - kRound;
    const double r = (x - n * 0.693147180369123816490) - n * 1.90821492927058770002e-10;
    double p = 1.0 / 3628800;
    p = p * r + 1.0 / 362880;
    p = p * r + 1.0 / 40320;
    p = p * r + 1.0 / 5040;
    p = p * r + 1.0 / 720;
    p = p * r + 1.0 / 120;
    p = p * r + 1.0 / 24;
    p = p * r + 1.0 / 6;
    p = p * r + 0.5;
    p = p * r + 1;
    p = p * r + 1;
    return std::bit_cast<double>(std::bit_cast<std::uint64_t>(p) +
                                 (std::bit_cast<std::uint64_t>(shifted) << 52));
}

// The mean transparency of a stretch of depths a and b per length at its ends, x = (a + b) / 2, y = (b - a) /
// 2, is
//   M(x, y) = int_0^1 exp(-x u + y u (1 - u)) du = e^(-x/2) Q(x^2, y),   Q = sum_jk q_jk x^(2j) y^k,
//   q_jk = 2^-(2j+2k+1) / ((2j)! (j+1/2) (j+3/2) ... (j+k+1/2))          (v = u - 1/2, cosh and exp by their
//   series).
// From the other side y changes sign.
constexpr double q(int j, int k) {
    double value = 0.5;
    for (int i = 0; i < j + k; ++i) value /= 4;
    for (int i = 1; i <= 2 * j; ++i) value /= i;
    for (int i = 0; i <= k; ++i) value /= j + 0.5 + i;
    return value;
}

struct Means {
    double half;      // e^(-x/2)
    double up, down;  // M from either side
};

/// a, b <= 1: terms up to 2j + k = 8; the largest one left out is below 1e-11.
inline Means means_up_to_one(double a, double b) {
    const double x = (a + b) / 2, y = (b - a) / 2, xx = x * x, yy = y * y;
    const double half = decay(-x / 2);
    const double q0 = q(0, 0) + xx * (q(1, 0) + xx * (q(2, 0) + xx * (q(3, 0) + xx * q(4, 0))));
    const double q1 = q(0, 1) + xx * (q(1, 1) + xx * (q(2, 1) + xx * q(3, 1)));
    const double q2 = q(0, 2) + xx * (q(1, 2) + xx * (q(2, 2) + xx * q(3, 2)));
    const double q3 = q(0, 3) + xx * (q(1, 3) + xx * q(2, 3));
    const double q4 = q(0, 4) + xx * (q(1, 4) + xx * q(2, 4));
    const double q5 = q(0, 5) + xx * q(1, 5);
    const double q6 = q(0, 6) + xx * q(1, 6);
    const double even = q0 + yy * (q2 + yy * (q4 + yy * (q6 + yy * q(0, 8))));
    const double odd = y * (q1 + yy * (q3 + yy * (q5 + yy * q(0, 7))));
    return {half, half * (even + odd), half * (even - odd)};
}

/// a, b <= 1/16, where nearly all diagonals of a large table are: the largest term left out is 2e-9 (x^2
/// y^2).
inline Means means_up_to_a_sixteenth(double a, double b) {
    const double x = (a + b) / 2, y = (b - a) / 2, xx = x * x, yy = y * y;
    const double z = -x / 2;
    const double half = 1 + z * (1 + z * (0.5 + z * (1.0 / 6 + z * (1.0 / 24 + z * (1.0 / 120)))));
    const double even = 1 + xx * (q(1, 0) + xx * q(2, 0)) + yy * q(0, 2);
    const double odd = y * (q(0, 1) + xx * q(1, 1) + yy * q(0, 3));
    return {half, half * (even + odd), half * (even - odd)};
}

/// Any depth, by pieces of depth <= 1; what lies behind a depth of 40 is dropped.
Means means_of_any_depth(double a, double b) {
    const int pieces = std::max(1, static_cast<int>(std::ceil(std::max(a, b))));
    const double h = 1.0 / pieces;
    const auto one_way = [&](double from, double to) {
        double sum = 0;
        for (int piece = 0; piece < pieces; ++piece) {
            const double u = piece * h;
            const double before = u * (from + u * (to - from) / 2);
            if (before > 40) break;
            const double a0 = (from + u * (to - from)) * h, a1 = (from + (u + h) * (to - from)) * h;
            sum += h * decay(-before) * means_up_to_one(a0, a1).up;
        }
        return sum;
    };
    return {decay(-(a + b) / 4), one_way(a, b), one_way(b, a)};
}

template <class MeansOf>
inline void store(const Stretches& s, int i, double rate, const MeansOf& means_of) {
    const double path = rate * s.width[i];
    const Means m = means_of(path * s.extinction[i], path * s.extinction[i + 1]);
    const double e = m.half * m.half;
    s.transparency[i] = e;
    for (int k = 0; k < 3; ++k) {
        s.up[k][i] = s.color[k][i] * (1 - m.up) + s.color[k][i + 1] * (m.up - e);
        s.down[k][i] = s.color[k][i + 1] * (1 - m.down) + s.color[k][i] * (m.down - e);
    }
}

template <class MeansOf>
void all_stretches(const Stretches& s, double rate, const MeansOf& means_of) {
    const int count = s.count;
    const double* HWY_RESTRICT width = s.width;
    const double* HWY_RESTRICT tau = s.extinction;
    const double *HWY_RESTRICT c0 = s.color[0], *HWY_RESTRICT c1 = s.color[1], *HWY_RESTRICT c2 = s.color[2];
    double* HWY_RESTRICT transparency = s.transparency;
    double *HWY_RESTRICT up0 = s.up[0], *HWY_RESTRICT up1 = s.up[1], *HWY_RESTRICT up2 = s.up[2];
    double *HWY_RESTRICT down0 = s.down[0], *HWY_RESTRICT down1 = s.down[1], *HWY_RESTRICT down2 = s.down[2];
    for (int i = 0; i < count; ++i) {
        const double path = rate * width[i];
        const Means m = means_of(path * tau[i], path * tau[i + 1]);
        const double e = m.half * m.half;
        const double far_up = 1 - m.up, near_up = m.up - e, far_down = 1 - m.down, near_down = m.down - e;
        transparency[i] = e;
        up0[i] = c0[i] * far_up + c0[i + 1] * near_up;
        up1[i] = c1[i] * far_up + c1[i + 1] * near_up;
        up2[i] = c2[i] * far_up + c2[i + 1] * near_up;
        down0[i] = c0[i + 1] * far_down + c0[i] * near_down;
        down1[i] = c1[i + 1] * far_down + c1[i] * near_down;
        down2[i] = c2[i + 1] * far_down + c2[i] * near_down;
    }
}

void SolveStretches(const Stretches& s, double rate, double deepest) {
    if (rate * deepest <= 1.0 / 16) {
        all_stretches(s, rate, [](double a, double b) { return means_up_to_a_sixteenth(a, b); });
        return;
    }
    all_stretches(s, rate, [](double a, double b) { return means_up_to_one(a, b); });
    if (rate * deepest <= 1) return;
    for (int i = 0; i < s.count; ++i)
        if (rate * s.width[i] * std::max(s.extinction[i], s.extinction[i + 1]) > 1)
            store(s, i, rate, means_of_any_depth);
}

void SlabOpacities(const double* HWY_RESTRICT depth, int m, int count, double rate,
                   double* HWY_RESTRICT transparency, double* HWY_RESTRICT opacity) {
    for (int f = 0; f < count; ++f) {
        const double t = decay(-rate * (depth[f + m] - depth[f]));
        transparency[f] = t;
        opacity[f] = 1 - t;
    }
}

void SubtractDropped(const double* HWY_RESTRICT add, const double* HWY_RESTRICT transparency,
                     const double* HWY_RESTRICT drop, int count, double* HWY_RESTRICT out) {
    for (int f = 0; f < count; ++f) out[f] = add[f] - transparency[f] * drop[f];
}

void EncodeU16(const double* HWY_RESTRICT values, int count, int fraction_bits,
               unsigned short* HWY_RESTRICT words) {
    constexpr double kRound = 6755399441055744.0;
    const double scale = static_cast<double>(1 << fraction_bits);
    for (int i = 0; i < count; ++i) {
        double scaled = values[i] * scale;
        scaled = scaled < 0 ? 0 : scaled;
        scaled = scaled > 65535 ? 65535 : scaled;
        words[i] = static_cast<unsigned short>(static_cast<int>((scaled + kRound) - kRound));
    }
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

}  // namespace squint::preintegration
#endif
