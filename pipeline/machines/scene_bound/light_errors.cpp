#include "pipeline/machines/scene_bound/light_errors.h"

#include "core/portable_math.h"
#include "pipeline/machines/certificate/payers.h"
#include "pipeline/machines/certificate/stages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace squint {
namespace {

constexpr double kRoot3 = 1.7320508075688775;

/// The most that quantising to a wire takes: of what drops bits, and of a quotient or a set-up value.
double taken_by(const Plan& plan, const Rescale& to, Wire wire) {
    return unit_of(to) * last_bit(plan, wire);
}
double taken_by(const Plan& plan, Wire wire) {
    return rounding_of(1e-300, plan.specs[wire].rounding) * last_bit(plan, wire);
}

/// The sum of the lights' tints, of the channel where it is greatest.
double most_tint(const ShadingStage& s) {
    double most = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        double sum = 0;
        for (std::size_t l = 0; l < static_cast<std::size_t>(s.lights); ++l) sum += s.color_exact[l][c];
        most = std::max(most, sum);
    }
    return most;
}

double cone_slope(const ShadingStage& s) {
    return std::ldexp(static_cast<double>(s.parabola_slope), -s.to_fall.shift);
}
/// What matter of colour 1 shines at most, or 1.
double brightest_of(const ShadingStage& s) {
    const auto& [ka, kd, ks] = s.material;
    return std::max(std::min(ka + kd, 1.0) + std::min(ks, 1.0), 1.0);
}
/// The longest slope of |v| f(cos) over all v, for f the power.
double steepest_highlight(const ShadingStage& s) {
    if (s.power == PowerRule::parabola) return std::sqrt(std::max(2 * cone_slope(s) - 1, 1.0));
    const double p = s.exponent;
    return std::sqrt(p) * portable::pow(p / (p + 1), (p - 1) / 2) * (1 + 0x1p-40);
}

/// Of a word's unit normal, as a vector.
Shares of_normal(const Plan& plan) {
    const Format& gradient = plan.specs[Wire::gradient].format;
    // Of longer gradients the last bits are dropped.
    const bool drops = gradient.integer_bits + gradient.fraction_bits + 1 > kNormalBits;
    return Shares::one(
        index_of(Wire::normal),
        kRoot3 * (taken_by(plan, Wire::normal) + (drops ? std::ldexp(1.0, 1 - kNormalBits) : 0)) + 0x1p-20);
}
/// Of min(1, |g| / g_0) by a word's gradient.
Shares of_confidence(const Plan& plan) {
    const GradientStage& g = plan.gradient;
    const double dropped = g.floor_bits < 0 ? 3.001 * std::ldexp(1.0, 1 - kNormalBits) : 0x1p-20,
                 whole = std::abs(g.floor_exact - static_cast<double>(g.floor_raw)) / g.floor_exact;
    return Shares::one(index_of(Wire::confidence),
                       std::min(dropped + whole, 1.0) + taken_by(plan, Wire::confidence));
}
/// Of x^p, for an error of x in [0, 1].
Shares of_power(const Plan& plan, Shares x) {
    const ShadingStage& s = plan.shading;
    x[index_of(Wire::power)] += taken_by(plan, s.to_power_input, Wire::power);
    double steepest = s.exponent, words = 0;
    if (s.power == PowerRule::squaring) {
        // Each squaring doubles what came before.
        steepest = std::ldexp(1.0, s.squarings);
        words = (steepest - 1) * taken_by(plan, s.to_power, Wire::power);
    } else if (s.power == PowerRule::table) {
        const double bend = s.exponent * std::max(s.exponent - 1, 0.0) / 8;
        words = taken_by(plan, Wire::power) + taken_by(plan, s.to_power_lerp, Wire::power) +
                std::ldexp(bend, -2 * s.power_table_bits);
    } else {
        steepest = cone_slope(s), words = taken_by(plan, s.to_fall, Wire::power);
    }
    Shares power = x.scaled(steepest);
    power[index_of(Wire::power)] += words;
    const double all = power.sum();
    return all > 1 ? power.scaled(1 / all) : power;
}
double off(std::int64_t raw, double exact, int fraction) {
    return std::abs(std::ldexp(static_cast<double>(raw), -fraction) - exact);
}

/// A sum of lights, each off by `each`, up to where its strength, `strength` off by `strength_off`, counts.
Shares of_sum(const Plan& plan, const Shares& each, const Rescale& to_sum, const Rescale& to_strength,
              std::int64_t strength, double strength_exact) {
    const ShadingStage& s = plan.shading;
    Shares sum;
    for (std::size_t c = 0; c < 3; ++c) {
        Shares of_channel;
        for (std::size_t l = 0; l < static_cast<std::size_t>(s.lights); ++l) {
            of_channel.add(each, std::ldexp(static_cast<double>(s.color[l][c]), -s.material_fraction));
            of_channel[index_of(Wire::material)] +=
                off(s.color[l][c], s.color_exact[l][c], s.material_fraction);
        }
        sum = greatest(sum, of_channel);
    }
    sum[index_of(Wire::intensity)] +=
        taken_by(plan, to_sum, Wire::intensity) + taken_by(plan, s.to_faded, Wire::intensity);
    sum.add(of_confidence(plan), 1);
    sum = sum.scaled(std::ldexp(static_cast<double>(strength), -s.material_fraction));
    sum[index_of(Wire::material)] += off(strength, strength_exact, s.material_fraction);
    sum[index_of(Wire::intensity)] += taken_by(plan, to_strength, Wire::intensity);
    return sum;
}

}  // namespace

std::optional<std::string> what_light_is_not_bounded(const Plan& plan) {
    const ShadingSettings& shading = plan.scene.shading;
    const ShadingStage& s = plan.shading;
    if (!(shading.gradient_floor > 0))
        return "hopeless for a lit scene without shading.gradient_floor: in almost every block a gradient "
               "can "
               "vanish, "
               "and its normal be any; allowed: a shading.gradient_floor, shading.model none, or no lights "
               "(lights=[])";
    if (shading.model != ShadingModel::blinn_phong)
        return fmt::format("shading.model {} has no scene bound yet; allowed: blinn_phong, none",
                           name_of(shading.model));
    if (shading.gradient != GradientRule::central && shading.gradient != GradientRule::sobel)
        return fmt::format("shading.gradient {} has no scene bound yet; allowed: central, sobel",
                           name_of(shading.gradient));
    if (shading.exaggeration > 0)
        return fmt::format("shading.exaggeration {:g} has no scene bound yet; allowed: 0",
                           shading.exaggeration);
    if (plan.inside.rule != InsideRule::front && plan.inside.rule != InsideRule::mean)
        return fmt::format(
            "shading.inside {} has no scene bound: where light lies in a slab may be off by much of the "
            "slab; allowed: front, mean",
            name_of(plan.inside.rule));
    const Volume& volume = *plan.volume;
    const double steepest = static_cast<double>(volume.largest - volume.smallest) / 2 + 1;
    const double brightest = brightest_of(s);
    for (const Wire wire : {Wire::gradient_lerp, Wire::gradient, Wire::normal, Wire::light, Wire::dot,
                            Wire::power, Wire::material, Wire::intensity, Wire::confidence, Wire::lit_color,
                            Wire::color, Wire::slab_color}) {
        if (std::find(plan.used_wires.begin(), plan.used_wires.end(), wire) == plan.used_wires.end())
            continue;
        const Spec& spec = plan.specs[wire];
        const bool is_gradient = wire == Wire::gradient_lerp || wire == Wire::gradient,
                   is_color = wire == Wire::lit_color || wire == Wire::color || wire == Wire::slab_color;
        const double most = is_gradient ? steepest
                            : is_color  ? brightest
                                        : 1,
                     held = std::ldexp(1.0, spec.format.integer_bits);
        if (held <= most || (held < 2 * most && is_color && spec.overflow == Overflow::wrap))
            return fmt::format(
                "precision.{}: {} cannot hold {:g}, and what a limit takes is no part of the bound; allowed: "
                "more integer bits",
                info(wire).name, to_string(spec), most);
    }
    const Spec& intensity = plan.specs[Wire::intensity];
    if (intensity.overflow == Overflow::wrap &&
        most_tint(s) + 1 >= std::ldexp(1.0, intensity.format.integer_bits))
        return fmt::format(
            "precision.intensity: {} cannot hold the sum of the lights, and what wraps is no part of the "
            "bound; allowed: more integer bits, or sat",
            to_string(intensity));
    return {};
}

LightErrors light_errors(const Plan& plan, const SampleErrors& samples) {
    LightErrors e;
    e.lit = plan.lit;
    if (!plan.lit) return e;
    const ShadingStage& s = plan.shading;
    const GradientStage& g = plan.gradient;
    e.brightest = brightest_of(s);
    e.of_displacement = samples.of_displacement, e.displacement = samples.displacement;
    e.per_turn = most_tint(s) * (s.material[1] + s.material[2] * steepest_highlight(s)) * (1 + 0x1p-40);

    // Lerps are contractions, and every level rounds once.
    const double lerp = taken_by(plan, g.to_first, Wire::gradient_lerp) +
                        taken_by(plan, g.to_second, Wire::gradient_lerp),
                 third = taken_by(plan, g.to_gradient, Wire::gradient),
                 scaled = g.isotropic ? 0 : taken_by(plan, g.to_scaled, Wire::gradient);
    e.of_rounding[index_of(Wire::gradient_lerp)] = kRoot3 * lerp;
    e.of_rounding[index_of(Wire::gradient)] = kRoot3 * (third + scaled);
    e.rounding = e.of_rounding.sum();

    // N.L and N.H: of either vector, and of the sum.
    const double light = kRoot3 * taken_by(plan, Wire::light);
    Shares dot = of_normal(plan).scaled(1 + light);
    dot[index_of(Wire::light)] += light;
    dot[index_of(Wire::dot)] += taken_by(plan, s.to_dot, Wire::dot);
    e.of_stage = of_sum(plan, dot, s.to_diffuse_sum, s.to_diffuse, s.kd, s.material[1]) +
                 of_sum(plan, of_power(plan, dot), s.to_specular_sum, s.to_specular, s.ks, s.material[2]);
    e.of_stage[index_of(Wire::material)] += off(s.ka, s.material[0], s.material_fraction);
    e.of_stage[index_of(Wire::lit_color)] += taken_by(plan, s.to_lit, Wire::lit_color);
    if (!g.isotropic) {
        double most = 0;
        for (std::size_t a = 0; a < 3; ++a)
            most = std::max(most,
                            off(g.spacing[a], g.spacing_exact[a], g.spacing_fraction) / g.spacing_exact[a]);
        e.of_stage[index_of(Wire::spacing)] += e.per_turn * (most < 0.5 ? most / (1 - most) : 2);
    }
    e.of_stage[kDoublesPay] += (s.material[1] + s.material[2]) * (g.vanishing / g.floor_exact + 0x1p-36);
    e.stage = e.of_stage.sum();
    return e;
}

CellLights::CellLights(const Plan& plan, const LightErrors& errors)
    : volume_(*plan.volume),
      rule_(plan.gradient.rule),
      floor_(plan.scene.shading.gradient_floor),
      rounding_(errors.rounding),
      by_ends_(lights_by_ends(plan.inside.rule)) {
    const double units = rule_ == GradientRule::sobel ? 32 : 2;
    for (int a = 0; a < 3; ++a) scale_[a] = plan.gradient.spacing_exact[static_cast<std::size_t>(a)] / units;
}

Vec3 CellLights::gradient_at(const std::array<std::int64_t, 3>& voxel) const {
    HWY_NAMESPACE::Neighbourhood<Bounded> near;
    near.volume = &volume_;
    Vec3 gradient;
    for (int a = 0; a < 3; ++a) gradient[a] = DifferenceField(near, rule_, a).at(voxel) * scale_[a];
    return gradient;
}

void CellLights::add_to(CellValues& values, const std::array<std::int64_t, 3>& cell) const {
    std::array<Vec3, 8> corner;
    Vec3 mean(0);
    bool flat = true;
    for (std::size_t i = 0; i < 8; ++i) {
        corner[i] = gradient_at({cell[0] + static_cast<std::int64_t>(i & 1),
                                 cell[1] + static_cast<std::int64_t>(i >> 1 & 1),
                                 cell[2] + static_cast<std::int64_t>(i >> 2)});
        mean = mean + corner[i];
        flat = flat && corner[i] == Vec3(0);
    }
    values.turn = values.weak = 0;
    if (flat) return;  // no word of it is anything but zero
    // All gradients of the cell lie in a cone about the mean, and are no shorter than along it.
    const double length = mean.length();
    const Vec3 about = length > 0 ? mean / length : Vec3(1, 0, 0);
    double least = std::numeric_limits<double>::infinity(), cosine = 1;
    for (const Vec3& g : corner) {
        const double along = g.dot(about);
        least = std::min(least, along);
        if (g != Vec3(0)) cosine = std::min(cosine, along / g.length());
    }
    const bool strong = !by_ends_ && least >= floor_;
    const double sine = std::sqrt(std::max(1 - cosine * cosine, 0.0)), shortest = strong ? least : floor_;
    double turn = 0;
    for (const std::size_t axis : {std::size_t{1}, std::size_t{2}, std::size_t{4}}) {
        double most = 0;
        for (std::size_t i = 0; i < 8; ++i) {
            if (i & axis) continue;
            const Vec3 change = corner[i | axis] - corner[i];
            double across = change.length();
            if (strong) {
                // Longer gradients turn no light: what is across any of the cone counts.
                const double along = std::abs(change.dot(about)),
                             beside = std::sqrt(std::max(across * across - along * along, 0.0));
                if (along * cosine > beside * sine) across = std::min(across, beside * cosine + along * sine);
            }
            most = std::max(most, across);
        }
        turn += most;
    }
    values.turn = turn / shortest * (1 + 0x1p-40);
    values.weak = 1 / std::max(by_ends_ ? 0.0 : least - rounding_, floor_);
}

}  // namespace squint
