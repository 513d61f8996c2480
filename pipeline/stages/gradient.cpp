#include "pipeline/stages/gradient.h"

#include "pipeline/stages/inputs.h"
#include "pipeline/stages/inside.h"
#include "pipeline/stages/presets.h"

#include <algorithm>

namespace squint {

std::vector<WireFormats> gradient_wires(const PresetInputs& in) {
    constexpr Rounding trn = Rounding::trn;
    const int scalar = in.scalar_bits, range = in.gradient_bits > 0 ? in.gradient_bits : scalar,
              sharp = highlight_bits(in);
    // Weak gradients need fraction bits; half a difference of scalars has one bit less than they.
    const Spec standard = signed_spec(range, std::min(12, 32 - range - weight_bits(in)), kToEven),
               squeeze = signed_spec(12, 12, trn), eight_bit = signed_spec(scalar, 1, trn),
               wide = signed_spec(scalar, std::min(16, 30 - scalar), kToEven);
    return {{Wire::gradient_lerp, standard, squeeze, eight_bit, wide},
            {Wire::gradient, standard, squeeze, eight_bit, wide},
            {Wire::spline, signed_spec(1, 15, kToEven), signed_spec(1, 12, trn), signed_spec(1, 8, trn),
             signed_spec(1, 20, kToEven)},
            {Wire::spacing, unsigned_spec(1, 12, kToEven), unsigned_spec(1, 12, trn),
             unsigned_spec(1, 12, trn), unsigned_spec(1, 20, kToEven)},
            {Wire::normal, signed_spec(1, 15 + sharp, kToEven), signed_spec(1, 12, trn),
             signed_spec(1, 7, trn), signed_spec(1, held(20 + sharp), kToEven)},
            {Wire::exaggeration, unsigned_spec(3, 12, kToEven), unsigned_spec(3, 12, trn),
             unsigned_spec(3, 5, trn), unsigned_spec(3, 16, kToEven)},
            {Wire::confidence, unsigned_spec(1, 15, kToEven), unsigned_spec(1, 15, trn),
             unsigned_spec(1, 8, trn), unsigned_spec(1, 20, kToEven)}};
}

GradientStage build_gradient(const StageInputs& in) {
    if (in.lit)
        for (const Wire wire : {Wire::gradient_lerp, Wire::gradient, Wire::normal}) require_signed(in, wire);
    if (in.lit && in.scene.shading.gradient == GradientRule::cubic_spline) require_signed(in, Wire::spline);
    GradientStage s;
    const Volume& v = in.volume;
    s.rule = in.scene.shading.gradient;
    s.weight_bits = fraction(in, Wire::weight);
    s.sample_fraction = fraction(in, Wire::sample);
    // Differences are the gradient times 2 (central), 32 (Sobel) or 1 (analytic): that many fraction bits at
    // first.
    const int first = s.rule == GradientRule::central ? 1 : s.rule == GradientRule::sobel ? 5 : 0;
    s.spline_fraction = fraction(in, Wire::spline);
    s.to_spline = rescale(in, 3 * s.weight_bits + 1, Wire::spline);
    const int gained = s.rule == GradientRule::cubic_spline ? s.spline_fraction : s.weight_bits;
    s.to_first = rescale(in, first + gained, Wire::gradient_lerp);
    s.to_second = rescale(in, fraction(in, Wire::gradient_lerp) + gained, Wire::gradient_lerp);
    s.to_gradient =
        rescale(in,
                s.rule == GradientRule::central_samples ? s.sample_fraction + 1
                                                        : fraction(in, Wire::gradient_lerp) + gained,
                Wire::gradient);
    s.spacing_fraction = fraction(in, Wire::spacing);
    s.to_scaled = rescale(in, fraction(in, Wire::gradient) + s.spacing_fraction, Wire::gradient);
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        s.spacing_exact[a] = v.smallest_spacing() / v.spacing[axis];
        s.spacing[a] = quantise_real(s.spacing_exact[a], in.specs[Wire::spacing]);
    }
    s.isotropic = v.spacing.x == v.spacing.y && v.spacing.y == v.spacing.z;
    s.normal_fraction = fraction(in, Wire::normal);
    s.to_normal = Rescale(-kNormalGuard, in.specs[Wire::normal], wire_index(Wire::normal));
    s.to_normal.divides = true;
    const auto one = static_cast<double>(in.specs[Wire::gradient].format.one());
    s.vanishing = kVanishing * static_cast<double>(v.largest - v.smallest) * one;
    s.confidence_fraction = fraction(in, Wire::confidence);
    s.to_confidence = Rescale(0, in.specs[Wire::confidence], wire_index(Wire::confidence));
    s.to_confidence.divides = true;
    if (const double floor = in.scene.shading.gradient_floor; in.lit && floor > 0) {
        require_integer_bits(in, Wire::confidence, 1, "a confidence of 1.0");
        const std::int64_t scale = gradient_scale(in.inside, in.specs[Wire::gradient].format);
        fade_in_up_to(s, static_cast<double>(scale) * floor * one);
    }
    Exaggeration& e = s.exaggerated;
    e.exact = in.scene.shading.exaggeration;
    e.wanted = in.lit && e.exact > 0;
    e.raw = quantise_real(e.exact, in.specs[Wire::exaggeration]);
    e.fraction = fraction(in, Wire::exaggeration);
    e.to_length =
        rescale(in, fraction(in, Wire::gradient) + kNormalGuard + s.normal_fraction, Wire::gradient);
    return s;
}

GradientStage build_box_gradient(const StageInputs& in) {
    WireSpecs specs = in.specs;
    for (const Wire wire : {Wire::gradient_lerp, Wire::gradient}) {
        Format& f = specs[wire].format;
        f.integer_bits += kBoxBits, f.fraction_bits = std::max(0, f.fraction_bits - kBoxBits);
    }
    Scene scene = in.scene;
    scene.shading.gradient = GradientRule::central;
    scene.shading.gradient_floor = scene.shading.exaggeration = 0;
    StageInputs boxes{.scene = scene,
                      .specs = specs,
                      .volume = in.volume,
                      .entries = in.entries,
                      .camera = in.camera,
                      .most_steps = in.most_steps,
                      .lit = in.lit};
    GradientStage s = build_gradient(boxes);
    s.vanishing *= kBoxSide * kBoxSide * kBoxSide;
    return s;
}

}  // namespace squint
