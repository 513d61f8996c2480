// Shared by shading models: N.L, powers, and the sums of lights that matter reflects.  Compiled once per SIMD
// target.
#if defined(SQUINT_PIPELINE_STAGES_SHADING_LIGHTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_SHADING_LIGHTS_INL_H
#undef SQUINT_PIPELINE_STAGES_SHADING_LIGHTS_INL_H
#else
#define SQUINT_PIPELINE_STAGES_SHADING_LIGHTS_INL_H
#endif

#include "core/portable_math.h"
#include "fixedpoint/unrolled-inl.h"
#include "pipeline/stages/location-inl.h"
#include "pipeline/stages/shading.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// The result of a model: matter of colour c shines with c * diffuse + specular.
template <class W>
struct Reflection {
    std::array<W, 3> diffuse, specular;
    bool white = false;  // the first of three holds for all
};

/// N.V of two unit vectors: an exact sum of three products, quantised once; the caller clamps it to [0, 1].
template <class W>
HWY_INLINE W dot(const std::array<W, 3>& a, const std::array<W, 3>& b, const Rescale& to) {
    return quantise(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], to);
}

/// Knittel's parabola in the angle, which is a cone in the cosine: max(0, 1 - slope (1 - x)).
template <class W>
HWY_INLINE W cone_of(const ShadingStage& s, W x) {
    const W zero = constant<W>(0), one = constant<W>(std::int64_t{1} << s.power_fraction);
    return max(one - quantise((one - x) * constant<W>(s.parabola_slope), s.to_fall), zero);
}

/// x^p for x in [0, 1].
template <class W>
HWY_INLINE W power(const ShadingStage& s, W x) {
    x = quantise(x, s.to_power_input);
    if (s.power == PowerRule::squaring) {  // exponents 2^n: n squarings (Squeeze, section 4.2.2)
        for (int i = 0; i < s.squarings; ++i)
            x = within(quantise(x * x, s.to_power), 0, std::int64_t{1} << s.power_fraction);
        return x;
    }
    if (s.power == PowerRule::parabola) return cone_of(s, x);
    const int fraction = s.power_fraction - s.power_table_bits;  // a table, linear between rows
    const W row = min(floor_shift(x, fraction), constant<W>((std::int64_t{1} << s.power_table_bits) - 1));
    const W rest = within(x - shift_left(row, fraction), 0, std::int64_t{1} << fraction);
    return quantise(
        blend(gather(s.power_table, row, 0), gather(s.power_table, row + constant<W>(1), 0), rest, fraction),
        s.to_power_lerp);
}

/// Without rounding the power itself replaces a table.
inline Real<double> power(const ShadingStage& s, Real<double> x) {
    if (s.power != PowerRule::table || s.power_table.active) return power<Real<double>>(s, x);
    const double one = power_of_two<double>(s.power_fraction);
    const double base = quantise(x, s.to_power_input).v / one;
    return quantise_raw(Real<double>{portable::pow(base, s.exponent) * one}, s.to_power_lerp);
}

/// The direction to a light.
template <class W>
HWY_INLINE std::array<W, 3> light_vector(const ShadingStage& s, std::size_t l) {
    std::array<W, 3> light;
    for (std::size_t a = 0; a < 3; ++a)
        light[a] =
            stage_constant<W>(s.light[l][a], s.light_exact[l][a], s.light_fraction, s.active, Wire::light);
    return light;
}
/// The half vector H between a light and the eye.
template <class W>
HWY_INLINE std::array<W, 3> half_vector(const ShadingStage& s, const RayWords<W>& ray, std::size_t l) {
    if (s.half_per_ray) return ray.half[l];
    std::array<W, 3> half;
    for (std::size_t a = 0; a < 3; ++a)
        half[a] =
            stage_constant<W>(s.half[l][a], s.half_exact[l][a], s.light_fraction, s.active, Wire::light);
    return half;
}

/// N.H in [0, 1]; |N.H| where both sides are lit.
template <class W>
HWY_INLINE W towards_half(const ShadingStage& s, const RayWords<W>& ray, const std::array<W, 3>& normal,
                          std::size_t l) {
    const W facing = dot(normal, half_vector(s, ray, l), s.to_dot);
    return clamp(s.two_sided ? absolute(facing) : facing, constant<W>(0),
                 constant<W>(std::int64_t{1} << s.dot_fraction));
}

/// ka + kd sum max(0, N.L), and ks sum of `highlight(l, light, facing)` over the lights.
template <class W, class Highlight>
HWY_INLINE Reflection<W> lights_that_add_up(const ShadingStage& s, const std::array<W, 3>& normal,
                                            W confidence, const Highlight& highlight) {
    const W zero = constant<W>(0), one_dot = constant<W>(std::int64_t{1} << s.dot_fraction);
    const std::size_t channels = s.white ? 1 : 3;
    Reflection<W> sum{{zero, zero, zero}, {zero, zero, zero}, s.white};
    for (std::size_t l = 0; l < static_cast<std::size_t>(s.lights); ++l) {
        const std::array<W, 3> light = light_vector<W>(s, l);
        const W facing = dot(normal, light, s.to_dot);
        const W shine = highlight(l, light, facing);
        const W lit = clamp(s.two_sided ? absolute(facing) : facing, zero, one_dot);
        for (std::size_t c = 0; c < channels; ++c) {
            const W tint = stage_constant<W>(s.color[l][c], s.color_exact[l][c], s.material_fraction,
                                             s.active, Wire::material);
            sum.diffuse[c] = sum.diffuse[c] + lit * tint;
            sum.specular[c] = sum.specular[c] + shine * tint;
        }
    }
    const W one = constant<W>(std::int64_t{1} << s.intensity_fraction);
    const W ka = stage_constant<W>(s.ka, s.material[0], s.material_fraction, s.active, Wire::material);
    const W kd = stage_constant<W>(s.kd, s.material[1], s.material_fraction, s.active, Wire::material);
    const W ks = stage_constant<W>(s.ks, s.material[2], s.material_fraction, s.active, Wire::material);
    for (std::size_t c = 0; c < channels; ++c) {
        W diffuse = clamp(quantise(sum.diffuse[c], s.to_diffuse_sum), zero, one),
          specular = clamp(quantise(sum.specular[c], s.to_specular_sum), zero, one);
        if (s.fades) {
            diffuse = quantise(diffuse * confidence, s.to_faded);
            specular = quantise(specular * confidence, s.to_faded);
        }
        sum.diffuse[c] =
            clamp(quantise(shift_left(ka, s.intensity_fraction) + kd * diffuse, s.to_diffuse), zero, one);
        sum.specular[c] = clamp(quantise(ks * specular, s.to_specular), zero, one);
    }
    return sum;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
