#include "pipeline/plan/demands.h"

#include "core/portable_math.h"
#include "pipeline/plan/ranges.h"
#include "pipeline/plan/short_slabs.h"
#include "pipeline/stages/inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace squint {
namespace {

constexpr double kLsb8 = 255;

int bits_above(double value) {  // the least b with 2^b >= value, for value >= 1
    int bits = 0;
    while (std::ldexp(1.0, bits) < value) ++bits;
    return bits;
}
const Format& format_of(const Plan& plan, Wire wire) {
    return plan.specs[wire].format;
}

/// The error of a ray of up to `most` slabs whose opacity `alpha` errs by `error`: m error (1 - alpha)^m at
/// its worst length m.
double along_ray(double alpha, double error, double most) {
    const double slabs = std::min(most, 1 / alpha);
    return slabs * error * portable::exp(-slabs * alpha);
}

/// The depths of a full step that neighbouring entries share, among those that the data reaches: a ray meets
/// them again and again, so that roundings of one sign add up.  Also for data that spans less than an entry.
template <class F>
void for_even_matter(const Plan& plan, const F& f) {
    const Volume& v = *plan.volume;
    const std::vector<Entry>& entry = plan.entries.entry;
    const double low = plan.entries.coordinate(v.smallest), high = plan.entries.coordinate(v.largest);
    const int last = plan.entries.size() - 1;
    const auto depth_at = [&](double place) {
        const int i = std::clamp(static_cast<int>(std::floor(place)), 0, last - 1);
        const double a = entry[static_cast<std::size_t>(i)].extinction,
                     b = entry[static_cast<std::size_t>(i) + 1].extinction;
        return (a + (b - a) * (place - i)) * plan.step_world;
    };
    if (high - low < 1) f(depth_at(std::clamp((low + high) / 2, 0.0, double(last))));
    for (int i = std::max(0, static_cast<int>(std::floor(low))); i < last && i < high; ++i) {
        const Entry &a = entry[static_cast<std::size_t>(i)], &b = entry[static_cast<std::size_t>(i) + 1];
        if (a.opaque || b.opaque) continue;
        const double larger = std::max(a.extinction, b.extinction);
        if (std::abs(a.extinction - b.extinction) <= larger * 0x1p-10) f(larger * plan.step_world);
    }
}

/// The largest error, in LSB8, of a ray of even matter whose opacities err by `error`; and which opacity.
struct Faint {
    double lsb8 = 0, alpha = 0;
};
Faint faint_matter(const Plan& plan, double error) {
    Faint worst;
    if (plan.projection_mode) return worst;
    const double most = most_steps(plan);
    double before = 0;  // equal depths in a row are tried once
    for_even_matter(plan, [&](double depth) {
        if (!(depth > 0) || depth == before) return;
        before = depth;
        const double alpha = -portable::expm1(-depth), lsb8 = kLsb8 * along_ray(alpha, error, most);
        if (lsb8 > worst.lsb8) worst = {lsb8, alpha};
    });
    return worst;
}

double rounding_of(const Spec& spec) {
    const bool nearest = spec.rounding == Rounding::rnd || spec.rounding == Rounding::rnd_conv;
    return std::ldexp(nearest ? 0.5 : 1.0, -spec.format.fraction_bits);
}

double deepest_step(const Plan& plan) {
    double deepest = 0;
    for (const Entry& e : plan.entries.entry) deepest = std::max(deepest, e.extinction);
    return deepest * plan.step_world;
}
bool has_highlight(const Plan& plan) {
    return plan.lit && plan.scene.shading.ks > 0;
}

void warn_of_faint_matter(Plan& plan) {
    Wire coarsest = Wire::slab_alpha;
    for (const Wire wire : {Wire::table_alpha, Wire::contribution, Wire::transparency})
        if (rounding_of(plan.specs[wire]) > rounding_of(plan.specs[coarsest])) coarsest = wire;
    const Faint faint = faint_matter(plan, rounding_of(plan.specs[coarsest]));
    if (faint.lsb8 <= 1) return;
    plan.warnings.push_back(fmt::format(
        "faint matter: precision.{} is {}, whose rounding of an opacity of {:.3g} a step may cost the "
        "longest "
        "ray {:.2g} of 255; {} fraction bits on table_alpha, slab_alpha, contribution and transparency keep "
        "it below one",
        info(coarsest).name, to_string(plan.specs[coarsest]), faint.alpha, faint.lsb8,
        format_of(plan, coarsest).fraction_bits + bits_above(faint.lsb8)));
}
void warn_of_short_slabs(Plan& plan) {
    const double lsb8 = kLsb8 * deepest_step(plan) * rounding_of(plan.specs[Wire::length]);
    if (lsb8 <= 1 || plan.projection_mode) return;
    plan.warnings.push_back(
        fmt::format("short slabs: precision.length is {}, which may cost a ray's last slab {:.2g} of 255 in "
                    "matter {:.3g} deep a step; {} fraction bits keep it below one",
                    to_string(plan.specs[Wire::length]), lsb8, deepest_step(plan),
                    format_of(plan, Wire::length).fraction_bits + bits_above(lsb8)));
}
void warn_of_highlights(Plan& plan) {
    if (!has_highlight(plan)) return;
    // A dot product of two rounded words, and the squarings, each of which doubles the error before it.
    const double dot = rounding_of(plan.specs[Wire::dot]) + rounding_of(plan.specs[Wire::normal]) +
                       rounding_of(plan.specs[Wire::light]) + rounding_of(plan.specs[Wire::power]);
    const double lsb8 = kLsb8 * plan.scene.shading.ks * std::min(1.0, plan.scene.shading.exponent * dot);
    if (lsb8 <= 4) return;
    plan.warnings.push_back(
        fmt::format("narrow highlights: an exponent of {} makes {:.2g} of 255 of what dot, normal, light and "
                    "power round; "
                    "{} more fraction bits on each keep it below four",
                    plan.scene.shading.exponent, lsb8, bits_above(lsb8 / 4)));
}
void warn_of_shorter_slabs(Plan& plan) {
    for (const Approximation& a : plan.approximations)
        if (a.of == kShorterSlabs && a.lsb8 > 4)
            plan.warnings.push_back(
                fmt::format("short slabs: {} has tables for one length of slab, and the colour of a ray's "
                            "last one may be off "
                            "by {:.2g} of 255; a smaller step, or pips or leg, which ask for no length",
                            name_of(plan.scene.classification.method), a.lsb8));
}
void warn_of_weak_gradients(Plan& plan) {
    if (!plan.lit) return;
    // Two levels of lerps and the gradient round, on three axes.  The least gradient of neighbours that differ is half a
    // level long: its normal turns by the error over that, kd's cosine by as much, and u^n, whose steepest slope over the
    // angle is sqrt(n / e), by that many times more.
    const double component =
        2 * rounding_of(plan.specs[Wire::gradient_lerp]) + rounding_of(plan.specs[Wire::gradient]);
    const ShadingSettings& s = plan.scene.shading;
    const double turn = std::sqrt(3.0) * component / 0.5,
                 slope = s.kd + s.ks * std::sqrt(s.exponent * 0.36788);
    const double lsb8 = kLsb8 * std::min(s.kd + s.ks, slope * turn);
    if (lsb8 <= 4) return;
    plan.warnings.push_back(
        fmt::format("weak gradients: precision.gradient is {}, which may cost light {:.2g} of 255 where "
                    "neighbouring voxels differ by one "
                    "level; {} fraction bits on gradient and gradient_lerp keep it below four",
                    to_string(plan.specs[Wire::gradient]), lsb8,
                    format_of(plan, Wire::gradient).fraction_bits + bits_above(lsb8 / 4)));
}
void warn_of_bright_light(Plan& plan) {
    const ShadingSettings& s = plan.scene.shading;
    const double sum = s.ka + s.kd + s.ks;
    if (!plan.lit || !(sum > 1 + 1e-9)) return;
    plan.warnings.push_back(
        fmt::format("shading: ka + kd + ks is {:.4g}: a colour may be {:.4g} times its "
                    "opacity (C above A), which is not clamped; a sum of 1 keeps C <= A",
                    sum, sum));
}

}  // namespace

PresetInputs preset_inputs(const Plan& plan) {
    const Volume& volume = *plan.volume;
    PresetInputs in;
    in.scalar_bits = volume.scalar_bits;
    in.location_bits = std::max(
        1, bits_for(static_cast<double>(std::max({volume.dims.x, volume.dims.y, volume.dims.z})) - 1));
    in.entry_bits = std::max(1, bits_for(plan.entries.size() - 1));
    in.direction_bits = std::max(1, bits_for(plan.scene.sampling.step));
    in.ray_bits = std::max(1, bits_for(most_steps(plan)));
    const double deepest = deepest_step(plan);
    double total = 0;
    for (const Entry& e : plan.entries.entry)
        total += e.opaque ? std::max(e.extinction, 1 / plan.step_world) : e.extinction;
    in.depth_bits = std::max(1, bits_for(deepest));
    in.total_depth_bits = std::max(1, bits_for(std::max(total * plan.step_world, deepest)));
    in.step = plan.scene.sampling.step;
    in.faint = faint_matter(plan, 0x1p-16).lsb8 > 0.5;
    in.whole_depth_bits = bits_for(deepest);
    // Where entries are fewer than by default, a level is a part of an entry and must tell opacities apart.
    const int levels = static_cast<int>(volume.largest_representable()) + 1;
    if (plan.entries.size() < std::min(levels, kDefaultEntries))
        in.entry_levels_bits = bits_above(plan.entries.scalars_per_entry);
    const int range = std::max(1, bits_for(static_cast<double>(volume.largest - volume.smallest)));
    in.gradient_bits = range < volume.scalar_bits ? range : 0;
    in.exponent = has_highlight(plan) ? plan.scene.shading.exponent : 1;
    return in;
}

void warn_of_formats(Plan& plan) {
    warn_of_bright_light(plan), warn_of_shorter_slabs(plan);
    if (plan.real) return;
    warn_of_faint_matter(plan), warn_of_short_slabs(plan), warn_of_highlights(plan),
        warn_of_weak_gradients(plan);
}

}  // namespace squint
