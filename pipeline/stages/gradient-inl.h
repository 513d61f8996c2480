// The maths of gradient.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_GRADIENT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_GRADIENT_INL_H
#undef SQUINT_PIPELINE_STAGES_GRADIENT_INL_H
#else
#define SQUINT_PIPELINE_STAGES_GRADIENT_INL_H
#endif

#include "pipeline/stages/gradient.h"

#include "pipeline/stages/interpolation-inl.h"
#include "pipeline/stages/location-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// Twice the central difference along an axis at one voxel of the neighbourhood: v(+1) - v(-1).
template <class N>
HWY_INLINE auto central_difference(const N& n, int x, int y, int z, int axis) {
    const int dx = axis == 0, dy = axis == 1, dz = axis == 2;
    return n.at(x + dx, y + dy, z + dz) - n.at(x - dx, y - dy, z - dz);
}

/// 32 times the Sobel gradient along an axis at one voxel: (-1 0 1) along it, (1 2 1) twice across it.
template <class W, class N>
HWY_INLINE W sobel_difference(const N& n, int x, int y, int z, int axis) {
    W sum = constant<W>(0);
    for (int a = -1; a <= 1; ++a)
        for (int b = -1; b <= 1; ++b) {
            const int px = axis == 0 ? x : x + a;
            const int py = axis == 1 ? y : y + (axis == 0 ? a : b);
            const int pz = axis == 2 ? z : z + b;
            const int weight = (a == 0 ? 1 : 0) + (b == 0 ? 1 : 0);  // log2 of 1, 2, 4
            sum = sum + shift_left(central_difference(n, px, py, pz, axis), weight);
        }
    return sum;
}

/// Interpolates along x between the differences at two neighbours, in row (y, z) of the cell.
template <class W, class N>
HWY_INLINE W lerped_difference(const GradientStage& s, const N& n, int y, int z, int axis, W weight) {
    const auto at = [&](int x) {
        return s.rule == GradientRule::sobel ? sobel_difference<W>(n, x, y, z, axis)
                                             : central_difference(n, x, y, z, axis);
    };
    return lerp(at(1), at(2), weight, s.weight_bits, s.to_first);
}

/// The 4x4x4 voxels around a cell, with the cell's corners in the middle; x fastest.  Clamped at the volume's
/// faces.
template <class W>
struct Neighbourhood {
    std::array<W, 64> voxel;
    const W& at(int x, int y, int z) const { return voxel[static_cast<std::size_t>((z * 4 + y) * 4 + x)]; }
    /// lerped_difference, or what gives the same from the way voxels are kept.
    W along_x(const GradientStage& s, int y, int z, int axis, W weight) const {
        return lerped_difference(s, *this, y, z, axis, weight);
    }
};

/// Interpolates the differences at the cell's eight voxels like a sample.  N: a Neighbourhood, however its voxels
/// are kept.
template <class W, class N>
HWY_INLINE W interpolated_difference(const GradientStage& s, const N& n, const std::array<W, 3>& weight,
                                     int axis) {
    const auto along_x = [&](int y, int z) SQUINT_WRITTEN_OUT { return n.along_x(s, y, z, axis, weight[0]); };
    const W z0 = lerp(along_x(1, 1), along_x(2, 1), weight[1], s.weight_bits, s.to_second);
    const W z1 = lerp(along_x(1, 2), along_x(2, 2), weight[1], s.weight_bits, s.to_second);
    return lerp(z0, z1, weight[2], s.weight_bits, s.to_gradient);
}

/// The exact derivative of the trilinear cell along an axis: the differences of its four edges, interpolated
/// across.
template <class W, class N>
HWY_INLINE W analytic_difference(const GradientStage& s, const N& n, const std::array<W, 3>& weight,
                                 int axis) {
    const auto corner = [&](int along, int a, int b) {
        const int x = axis == 0 ? along : a, y = axis == 1 ? along : (axis == 0 ? a : b),
                  z = axis == 2 ? along : b;
        return n.at(1 + x, 1 + y, 1 + z);
    };
    const auto edge = [&](int a, int b) { return corner(1, a, b) - corner(0, a, b); };
    const std::size_t first = axis == 0 ? 1 : 0, second = axis == 2 ? 1 : 2;
    const int bits = s.weight_bits;
    const W b0 = lerp(edge(0, 0), edge(1, 0), weight[first], bits, s.to_first);
    const W b1 = lerp(edge(0, 1), edge(1, 1), weight[first], bits, s.to_first);
    return lerp(b0, b1, weight[second], bits, s.to_gradient);
}

/// For the spline of Catmull and Rom through four values in a row, at a place t between the middle two: weights of
/// their three differences for its slope, and of the values themselves.  Each sums to one exactly, and the weights at
/// 1 - t are those at t from the other end.
template <class W>
HWY_INLINE std::array<W, 3> spline_slope_weights(const GradientStage& s, W t) {
    const W one = constant<W>(std::int64_t{1} << s.weight_bits);
    // (1 - t)(1 - 3t) / 2 and t (3t - 2) / 2, with 3F + 1 fraction bits
    const auto weight = [&](W near, W far) {
        return quantise(shift_left(far * (far - near - near), s.weight_bits), s.to_spline);
    };
    const W rest = one - t, first = weight(t, rest), last = weight(rest, t);
    return {first, constant<W>(std::int64_t{1} << s.spline_fraction) - (first + last), last};
}
template <class W>
HWY_INLINE std::array<W, 4> spline_weights(const GradientStage& s, W t) {
    const W one = constant<W>(std::int64_t{1} << s.weight_bits), rest = one - t;
    const W whole = constant<W>(std::int64_t{1} << s.spline_fraction);
    // -t (1 - t)^2 / 2 and (1 - t)(1 + (1 - t)(1 + 3t)) / 2, with 3F + 1 fraction bits
    const auto outer = [&](W near, W far) {
        return quantise(constant<W>(0) - near * (far * far), s.to_spline);
    };
    const auto inner = [&](W near, W far) {
        return quantise(far * (shift_left(one, s.weight_bits) + far * (one + constant<W>(3) * near)),
                        s.to_spline);
    };
    std::array<W, 4> w{outer(t, rest), inner(t, rest), inner(rest, t), outer(rest, t)};
    // What roundings leave goes to the nearer.
    const W left = whole - (w[0] + w[1] + w[2] + w[3]), zero = constant<W>(0);
    const auto nearer = t < rest;
    w[1] = w[1] + select(nearer, left, zero), w[2] = w[2] + select(nearer, zero, left);
    return w;
}

/// The slope along an axis of the spline through the 4x4x4 voxels around a cell: along that axis first, then across.
template <class W, class N>
HWY_INLINE W spline_difference(const GradientStage& s, const N& n, const std::array<W, 3>& weight, int axis) {
    const auto a = static_cast<std::size_t>(axis), b = (a + 1) % 3, c = (a + 2) % 3;
    const std::array<W, 3> along = spline_slope_weights(s, weight[a]);
    const std::array<W, 4> across = spline_weights(s, weight[b]), beyond = spline_weights(s, weight[c]);
    const auto slope = [&](int j, int k) SQUINT_WRITTEN_OUT {
        const auto voxel = [&](int i) SQUINT_WRITTEN_OUT {
            std::array<int, 3> at{};
            at[a] = i, at[b] = j, at[c] = k;
            return n.at(at[0], at[1], at[2]);
        };
        const W v0 = voxel(0), v1 = voxel(1), v2 = voxel(2), v3 = voxel(3);
        return quantise(along[0] * (v1 - v0) + along[1] * (v2 - v1) + along[2] * (v3 - v2), s.to_first);
    };
    const auto sum = [&](const std::array<W, 4>& w, auto&& at, const Rescale& to) SQUINT_WRITTEN_OUT {
        return quantise(w[0] * at(0) + w[1] * at(1) + w[2] * at(2) + w[3] * at(3), to);
    };
    return sum(
        beyond,
        [&](int k) SQUINT_WRITTEN_OUT {
            return sum(
                across, [&](int j) SQUINT_WRITTEN_OUT { return slope(j, k); }, s.to_second);
        },
        s.to_gradient);
}

/// A component of the gradient from the voxels around a cell, by the stage's rule.
template <class W, class N>
HWY_INLINE W voxel_difference(const GradientStage& s, const N& n, const std::array<W, 3>& weight, int axis) {
    if (s.rule == GradientRule::cubic_spline) return spline_difference(s, n, weight, axis);
    return s.rule == GradientRule::analytic ? analytic_difference(s, n, weight, axis)
                                            : interpolated_difference(s, n, weight, axis);
}

/// Half the difference of the samples one voxel to either side along an axis (Squeeze, section 4.3).
template <class W>
HWY_INLINE W sample_difference(const GradientStage& s, W ahead, W behind) {
    return quantise(ahead - behind, s.to_gradient);
}

/// A component in levels per smallest spacing.
template <class W>
HWY_INLINE W to_world(const GradientStage& s, W component, int axis) {
    if (s.isotropic) return component;
    const auto a = static_cast<std::size_t>(axis);
    return quantise(component * stage_constant<W>(s.spacing[a], s.spacing_exact[a], s.spacing_fraction,
                                                  s.active, Wire::spacing),
                    s.to_scaled);
}

/// A gradient's magnitudes, scaled so that the largest has kNormalBits bits (floors), and floor(sqrt(sum of squares)
/// 2^kNormalGuard), at least one.
template <class W>
struct ScaledGradient {
    std::array<W, 3> size;
    W length;
};
template <class W>
HWY_INLINE ScaledGradient<W> scaled_gradient(const std::array<W, 3>& gradient) {
    ScaledGradient<W> scaled;
    std::array<W, 3>& size = scaled.size;
    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT { size[a] = absolute(gradient[a]); });
    const W largest = max(max(size[0], size[1]), size[2]);
    const W shift = constant<W>(kNormalBits) - bit_length(largest);
    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
        size[a] = within(shift_by(size[a], shift), 0, (std::int64_t{1} << kNormalBits) - 1);
    });
    scaled.length = max(vector_length(size, kNormalGuard), constant<W>(1));
    return scaled;
}

/// -g / |g| in s1.F, in integers: three exact quotients of a scaled gradient by its length.  Error: 2^-14 from
/// scaling, where the gradient has more bits, plus half a last bit of the wire.  A zero gradient gives a zero normal.
template <class W>
HWY_INLINE std::array<W, 3> normal_of(const GradientStage& s, const std::array<W, 3>& gradient,
                                      const ScaledGradient<W>& scaled) {
    const W zero = constant<W>(0);
    std::array<W, 3> normal;
    const std::array<W, 3> part = quotients(scaled.size, scaled.length, s.to_normal);
    for_three([&](std::size_t a)
                  SQUINT_WRITTEN_OUT { normal[a] = select(gradient[a] < zero, part[a], zero - part[a]); });
    return normal;
}
template <class W>
HWY_INLINE std::array<W, 3> normalise(const GradientStage& s, const std::array<W, 3>& gradient) {
    return normal_of(s, gradient, scaled_gradient(gradient));
}

/// min(1, |g| / g_0) in 1.F, in integers: exactly one where |g| >= g_0.  Relative error: 2^-13 where g_0 has
/// more than kNormalBits bits (no length of g_0 may come out below one), plus half a last bit.
template <class W>
HWY_INLINE W confidence(const GradientStage& s, const std::array<W, 3>& gradient) {
    std::array<W, 3> size;
    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
        const W enough = min(absolute(gradient[a]), constant<W>(s.floor_raw));
        size[a] =
            within(s.floor_bits < 0 ? floor_shift(enough, -s.floor_bits) : shift_left(enough, s.floor_bits),
                   0, (std::int64_t{1} << kNormalBits) - 1);
    });
    const W full = constant<W>(s.full_length);
    return quotient(min(vector_length(size, kNormalGuard), full), full, s.to_confidence);
}
template <RealWord W>
HWY_INLINE W confidence(const GradientStage& s, const std::array<W, 3>& g) {
    const W length = square_root(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    const W part = min(length / W::from(s.floor_exact), constant<W>(1));
    return quantise_raw(shift_left(part, s.confidence_fraction), s.to_confidence);
}

/// |g| with kNormalGuard fraction bits more, to a relative error of 2^-14.
template <class W>
HWY_INLINE W gradient_length(const std::array<W, 3>& gradient) {
    std::array<W, 3> size;
    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT { size[a] = absolute(gradient[a]); });
    const W shift = constant<W>(kNormalBits) - bit_length(max(max(size[0], size[1]), size[2]));
    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
        size[a] = within(shift_by(size[a], shift), 0, (std::int64_t{1} << kNormalBits) - 1);
    });
    return shift_by(vector_length(size, kNormalGuard), constant<W>(0) - shift);
}
template <RealWord W>
HWY_INLINE W gradient_length(const std::array<W, 3>& g) {
    return shift_left(square_root(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]), kNormalGuard);
}

/// Without rounding: the definition itself, but zero for what is no longer than a rounding.
template <RealWord W>
HWY_INLINE std::array<W, 3> normalise(const GradientStage& s, const std::array<W, 3>& g) {
    const W zero = constant<W>(0), shortest = W::from(s.vanishing);
    const W length = square_root(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    const W scale = W::from(-power_of_two<double>(s.normal_fraction)) / length;
    const auto component = [&](std::size_t a) SQUINT_WRITTEN_OUT {
        return select(shortest < length, quantise_raw(g[a] * scale, s.to_normal), zero);
    };
    return {component(0), component(1), component(2)};
}

/// A gradient as long as it is, along -(N + e (N - M)): N its own normal, M that of the sums about its place.
template <class W>
HWY_INLINE std::array<W, 3> exaggerated(const GradientStage& s, const GradientStage& boxes,
                                        const std::array<W, 3>& gradient, const std::array<W, 3>& of_boxes) {
    const Exaggeration& e = s.exaggerated;
    const W part = stage_constant<W>(e.raw, e.exact, e.fraction, e.active, Wire::exaggeration);
    const std::array<W, 3> normal = normalise(s, gradient), mean = normalise(boxes, of_boxes);
    std::array<W, 3> turned;
    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
        turned[a] = shift_left(normal[a], e.fraction) + part * (normal[a] - mean[a]);
    });
    const std::array<W, 3> against = normalise(s, turned);
    const W length = gradient_length(gradient);
    for_three([&](std::size_t a)
                  SQUINT_WRITTEN_OUT { turned[a] = quantise(length * against[a], e.to_length); });
    return turned;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
