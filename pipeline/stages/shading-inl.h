// The maths of shading.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_SHADING_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_SHADING_INL_H
#undef SQUINT_PIPELINE_STAGES_SHADING_INL_H
#else
#define SQUINT_PIPELINE_STAGES_SHADING_INL_H
#endif

#include "pipeline/stages/shading.h"

#include "pipeline/stages/location-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// N.V of two unit vectors: exact sum of three products, quantised once; clamped to [0, 1] by the caller.
template <class W>
HWY_INLINE W dot(const std::array<W, 3>& a, const std::array<W, 3>& b, const Rescale& to) {
    return quantise(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], to);
}

/// x^p for x in [0, 1].
template <class W>
HWY_INLINE W power(const ShadingStage& s, W x) {
    x = quantise(x, s.to_power_input);
    const W zero = constant<W>(0), one = constant<W>(std::int64_t{1} << s.power_fraction);
    if (s.power == PowerRule::squaring) {  // exponents 2^n: n squarings (Squeeze, section 4.2.2)
        for (int i = 0; i < s.squarings; ++i)
            x = within(quantise(x * x, s.to_power), 0, std::int64_t{1} << s.power_fraction);
        return x;
    }
    if (s.power ==
        PowerRule::parabola)  // Knittel's, a parabola in the angle: max(0, 1 - (p + 1) / 2 (1 - x))
        return max(one - quantise((one - x) * constant<W>(s.parabola_slope), s.to_fall), zero);
    const int fraction = s.power_fraction - s.power_table_bits;  // a table, linear between its rows
    const W row = min(floor_shift(x, fraction), constant<W>((std::int64_t{1} << s.power_table_bits) - 1));
    const W rest = within(x - shift_left(row, fraction), 0, std::int64_t{1} << fraction);
    return quantise(
        blend(gather(s.power_table, row, 0), gather(s.power_table, row + constant<W>(1), 0), rest, fraction),
        s.to_power_lerp);
}

/// Lights a slab: `color`, straight or premultiplied, comes back lit.  A zero normal gets ambient light only.
template <class W>
HWY_INLINE void shade(const ShadingStage& s, const RayWords<W>& ray, const std::array<W, 3>& normal, W alpha,
                      std::array<W, 3>& color) {
    const W zero = constant<W>(0), one_dot = constant<W>(std::int64_t{1} << s.dot_fraction);
    const std::size_t channels = s.white ? 1 : 3;
    std::array<W, 3> diffuse{zero, zero, zero}, specular{zero, zero, zero};
    for (std::size_t l = 0; l < static_cast<std::size_t>(s.lights); ++l) {
        std::array<W, 3> light, half;
        for (std::size_t a = 0; a < 3; ++a) {
            light[a] = stage_constant<W>(s.light[l][a], s.light_exact[l][a], s.light_fraction, s.active,
                                         Wire::light);
            half[a] = s.half_per_ray ? ray.half[l][a]
                                     : stage_constant<W>(s.half[l][a], s.half_exact[l][a], s.light_fraction,
                                                         s.active, Wire::light);
        }
        W facing = dot(normal, light, s.to_dot);
        W highlight;
        if (s.model == ShadingModel::phong) {  // R.V = 2 (N.L)(N.V) - L.V
            const W towards_eye = dot(normal, ray.view, s.to_dot);
            const W light_view = dot(light, ray.view, s.to_light_view);
            highlight = quantise(shift_left(facing * towards_eye, 1) - shift_left(light_view, s.dot_fraction),
                                 s.to_reflected);
            // No reflection where no light falls; R is the same for both sides of a surface.
            highlight = select(s.two_sided ? facing == zero : !(zero < facing), zero, highlight);
        } else {
            highlight = dot(normal, half, s.to_dot);
        }
        if (s.two_sided) {
            facing = absolute(facing);
            if (s.model != ShadingModel::phong) highlight = absolute(highlight);
        }
        facing = clamp(facing, zero, one_dot);
        highlight = power(s, clamp(highlight, zero, one_dot));
        for (std::size_t c = 0; c < channels; ++c) {
            const W tint = stage_constant<W>(s.color[l][c], s.color_exact[l][c], s.material_fraction,
                                             s.active, Wire::material);
            diffuse[c] = diffuse[c] + facing * tint;
            specular[c] = specular[c] + highlight * tint;
        }
    }
    const W one = constant<W>(std::int64_t{1} << s.intensity_fraction);
    const W ka = stage_constant<W>(s.ka, s.material[0], s.material_fraction, s.active, Wire::material);
    const W kd = stage_constant<W>(s.kd, s.material[1], s.material_fraction, s.active, Wire::material);
    const W ks = stage_constant<W>(s.ks, s.material[2], s.material_fraction, s.active, Wire::material);
    for (std::size_t c = 0; c < channels; ++c) {
        const W sum = clamp(quantise(diffuse[c], s.to_diffuse_sum), zero, one);
        diffuse[c] =
            clamp(quantise(shift_left(ka, s.intensity_fraction) + kd * sum, s.to_diffuse), zero, one);
        specular[c] = clamp(quantise(specular[c], s.to_specular_sum), zero, one);
        specular[c] = clamp(quantise(ks * specular[c], s.to_specular), zero, one);
    }
    const W opacity = s.premultiplied ? alpha : constant<W>(std::int64_t{1} << s.color_fraction);
    for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t from = s.white ? 0 : c;
        color[c] = quantise(color[c] * diffuse[from] + opacity * specular[from], s.to_lit);
    }
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
