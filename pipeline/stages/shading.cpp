#include "pipeline/stages/shading.h"

#include "core/error.h"
#include "core/portable_math.h"
#include "pipeline/stages/inputs.h"
#include "pipeline/stages/presets.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace squint {
namespace {

GoochTones build_gooch(const StageInputs& in) {
    GoochTones g;
    const ShadingSettings& settings = in.scene.shading;
    const Spec material = in.specs[Wire::material];
    g.cool_to_light = settings.cool_side == CoolSide::light;
    g.share_exact = {settings.kd * settings.cool_share, settings.kd * settings.warm_share};
    for (std::size_t side = 0; side < 2; ++side) {
        g.share[side] = quantise_real(g.share_exact[side], material);
        for (int channel = 0; channel < 3; ++channel) {
            const auto c = static_cast<std::size_t>(channel);
            g.tone_exact[c][side] = side == 0 ? settings.cool[channel] : settings.warm[channel];
            g.tone[c][side] = quantise_real(g.tone_exact[c][side], material);
        }
    }
    g.to_faded = rescale(in, fraction(in, Wire::dot) + fraction(in, Wire::confidence), Wire::dot);
    g.to_side = rescale(in, fraction(in, Wire::dot) + 1, Wire::intensity);
    return g;
}

KeptLength build_kept_length(const StageInputs& in) {
    KeptLength k;
    k.wanted = in.inside == InsideRule::nlpi;
    const ShadingSettings& settings = in.scene.shading;
    k.held = k.wanted && settings.ka + settings.kd + settings.ks <= 1;
    const Spec arc{{2, KeptLength::kArcBits, false}, Rounding::rnd_conv, Overflow::sat};
    k.row_bits = std::min(KeptLength::kRowBits, fraction(in, Wire::dot));
    if (k.wanted) {
        const int rows = 1 << k.row_bits;
        k.arc = Table(rows + 1, 1);
        for (int i = 0; i <= rows; ++i)
            k.arc.set(i, 0, 2 * std::sqrt(2 / (1 + std::ldexp(i, -k.row_bits))) - 1, arc);
    }
    k.arc.wire = wire_index(Wire::dot);
    k.to_turn = rescale(in, 2 * fraction(in, Wire::normal), Wire::dot);
    k.to_arc =
        Rescale(KeptLength::kArcBits + fraction(in, Wire::dot) - k.row_bits, arc, wire_index(Wire::dot));
    Spec between = in.specs[Wire::intensity];
    between.overflow = Overflow::sat;
    k.to_between =
        Rescale(fraction(in, Wire::intensity) + KeptLength::kArcBits, between, wire_index(Wire::intensity));
    k.to_between.divides = true;
    return k;
}

}  // namespace

std::vector<WireFormats> shading_wires(const PresetInputs& in) {
    constexpr Rounding trn = Rounding::trn;
    const int sharp = highlight_bits(in);
    const Spec squeeze = unsigned_spec(1, 15, trn), eight_bit = unsigned_spec(1, 8, trn),
               wide = unsigned_spec(1, 20, kToEven), standard = unsigned_spec(1, 14, kToEven),
               signed_wide = signed_spec(1, held(20 + sharp), kToEven);
    return {{Wire::light, signed_spec(1, 14 + sharp, kToEven), signed_spec(1, 15, trn),
             signed_spec(1, 8, trn), signed_wide},
            {Wire::dot, signed_spec(1, 15 + sharp, kToEven), signed_spec(1, 15, trn), signed_spec(1, 8, trn),
             signed_wide},
            {Wire::power, unsigned_spec(1, 15 + sharp, kToEven), unsigned_spec(1, 16, trn), eight_bit,
             unsigned_spec(1, held(20 + sharp), kToEven)},
            {Wire::material, standard, squeeze, eight_bit, wide},
            {Wire::intensity, standard, squeeze, eight_bit, wide},
            {Wire::lit_color, unsigned_spec(1, accumulating_bits(in), kToEven), squeeze, eight_bit,
             unsigned_spec(1, wide_accumulating_bits(in), kToEven)}};
}

ShadingStage build_shading(const StageInputs& in) {
    if (in.lit)
        for (const Wire wire : {Wire::light, Wire::dot}) require_signed(in, wire);
    ShadingStage s;
    const ShadingSettings& settings = in.scene.shading;
    s.model = settings.model, s.power = settings.power, s.two_sided = settings.two_sided;
    s.premultiplied = in.premultiplied;
    s.color_fraction = s.premultiplied ? fraction(in, Wire::slab_color) : fraction(in, Wire::slab_ratio);
    if (s.premultiplied) s.finer_than_alpha = s.color_fraction - fraction(in, Wire::slab_alpha);
    s.light_fraction = fraction(in, Wire::light), s.normal_fraction = fraction(in, Wire::normal);
    s.dot_fraction = fraction(in, Wire::dot), s.power_fraction = fraction(in, Wire::power);
    s.intensity_fraction = fraction(in, Wire::intensity), s.material_fraction = fraction(in, Wire::material);
    s.light_spec = in.specs[Wire::light];
    s.lights = static_cast<int>(in.scene.lights.size());
    s.half_per_ray = in.camera.projection == Projection::perspective;
    const Spec material = in.specs[Wire::material];
    for (std::size_t l = 0; l < in.scene.lights.size(); ++l) {
        const Light& light = in.scene.lights[l];
        const Vec3 towards =
            light.headlight ? -in.camera.view : in.volume.grid_from_world(light.direction.normalized());
        const Vec3 half = (towards - in.camera.view).normalized();
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            s.light_exact[l][a] = towards[axis], s.half_exact[l][a] = half[axis],
            s.color_exact[l][a] = light.color[axis];
            s.light[l][a] = quantise_real(towards[axis], s.light_spec);
            s.half[l][a] = quantise_real(half[axis], s.light_spec);
            s.color[l][a] = quantise_real(light.color[axis], material);
        }
        s.white = s.white && light.color == Vec3(1, 1, 1);
    }
    s.material = {settings.ka, settings.kd, settings.ks};
    s.ka = quantise_real(settings.ka, material), s.kd = quantise_real(settings.kd, material),
    s.ks = quantise_real(settings.ks, material);
    s.exponent = settings.exponent;
    s.squarings = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(settings.exponent))) - 1;
    const bool is_cone = settings.model == ShadingModel::cone;
    if (!is_cone && settings.power == PowerRule::squaring &&
        settings.exponent != std::ldexp(1.0, s.squarings))
        throw InputError(
            fmt::format("shading.exponent: {} is not a power of two, which shading.power = \"squaring\" "
                        "needs; use {} or power = \"table\"",
                        settings.exponent, std::ldexp(1.0, s.squarings)));
    // (p + 1) / 2: an integer p needs one fraction bit; others get what 31 bits leave, at most 20.
    const int slope_bits = settings.exponent == std::floor(settings.exponent)
                               ? 1
                               : std::min(21, 32 - bits_for(settings.exponent + 2));
    const double slope =
        is_cone && settings.cone_slope == ConeSlope::paper ? settings.exponent : (settings.exponent + 1) / 2;
    s.parabola_slope = static_cast<std::int64_t>(std::floor(std::ldexp(slope, slope_bits) + 0.5));
    s.power_table_bits = std::min(10, s.power_fraction);
    if (settings.power == PowerRule::table) {
        // 1024 rows, linear between them: the error is p^2 / 8 / 2^20 for exponent p.
        const int rows = 1 << s.power_table_bits;
        s.power_table = Table(rows + 1, 1);
        for (int i = 0; i <= rows; ++i)
            s.power_table.set(i, 0, portable::pow(std::ldexp(i, -s.power_table_bits), settings.exponent),
                              in.specs[Wire::power]);
    }
    s.power_table.wire = wire_index(Wire::power);
    s.fades = in.lit && settings.gradient_floor > 0;
    s.to_faded = rescale(in, s.intensity_fraction + fraction(in, Wire::confidence), Wire::intensity);
    s.gooch = build_gooch(in);
    s.kept = build_kept_length(in);
    s.to_light = rescale(in, s.light_fraction, Wire::light);
    s.to_dot = rescale(in, s.normal_fraction + s.light_fraction, Wire::dot);
    s.to_light_view = rescale(in, 2 * s.light_fraction, Wire::dot);
    s.to_reflected = rescale(in, 2 * s.dot_fraction, Wire::dot);
    s.to_power_input = rescale(in, s.dot_fraction, Wire::power);
    s.to_power = rescale(in, 2 * s.power_fraction, Wire::power);
    s.to_power_lerp = rescale(in, 2 * s.power_fraction - s.power_table_bits, Wire::power);
    s.to_fall = rescale(in, s.power_fraction + slope_bits, Wire::power);
    s.to_diffuse_sum = rescale(in, s.dot_fraction + s.material_fraction, Wire::intensity);
    s.to_specular_sum = rescale(in, s.power_fraction + s.material_fraction, Wire::intensity);
    s.to_diffuse = s.to_specular = rescale(in, s.material_fraction + s.intensity_fraction, Wire::intensity);
    s.to_lit = rescale(in, s.color_fraction + s.intensity_fraction, Wire::lit_color);
    return s;
}

}  // namespace squint
