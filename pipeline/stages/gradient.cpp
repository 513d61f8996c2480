#include "pipeline/stages/gradient.h"

#include "pipeline/stages/inputs.h"

namespace squint {

GradientStage build_gradient(const StageInputs& in) {
    if (in.lit)
        for (const Wire wire : {Wire::gradient_lerp, Wire::gradient, Wire::normal}) require_signed(in, wire);
    GradientStage s;
    const Volume& v = in.volume;
    s.rule = in.scene.shading.gradient;
    s.weight_bits = fraction(in, Wire::weight);
    s.sample_fraction = fraction(in, Wire::sample);
    // Differences are twice (central), 32 times (Sobel) or once (analytic) the gradient: so many fraction
    // bits to begin with.
    const int first = s.rule == GradientRule::central ? 1 : s.rule == GradientRule::sobel ? 5 : 0;
    s.to_first = rescale(in, first + s.weight_bits, Wire::gradient_lerp);
    s.to_second = rescale(in, fraction(in, Wire::gradient_lerp) + s.weight_bits, Wire::gradient_lerp);
    s.to_gradient =
        rescale(in,
                s.rule == GradientRule::central_samples ? s.sample_fraction + 1
                                                        : fraction(in, Wire::gradient_lerp) + s.weight_bits,
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
    return s;
}

}  // namespace squint
