#include "pipeline/stages/compositing.h"

#include "pipeline/stages/inputs.h"
#include "scene/presets.h"

#include <algorithm>
#include <cmath>

namespace squint {

CompositingForm form_of(const Scene& scene) {
    const CompositingForm form = scene.compositing.form;
    return form == CompositingForm::automatic ? preset_form(resolved_precision(scene).preset) : form;
}

CompositingStage build_compositing(const StageInputs& in) {
    CompositingStage s;
    s.form = form_of(in.scene);
    if (!s.is_unit255()) require_integer_bits(in, Wire::transparency, 1, "a transparency of 1.0");
    s.premultiplied = in.premultiplied;
    s.alpha_fraction = fraction(in, Wire::slab_alpha);
    const int unlit = s.premultiplied ? fraction(in, Wire::slab_color) : fraction(in, Wire::slab_ratio);
    const int incoming = in.lit ? fraction(in, Wire::lit_color) : unlit;
    s.contribution_fraction = fraction(in, Wire::contribution);
    s.transparency_fraction = fraction(in, Wire::transparency);
    s.sum_fraction = fraction(in, Wire::color);
    const int t = s.transparency_fraction;
    const bool carries_alpha = s.premultiplied || s.form == CompositingForm::w;
    s.to_slab_color = rescale(in, incoming + s.alpha_fraction, Wire::slab_color);
    s.color_fraction = carries_alpha ? incoming : fraction(in, Wire::slab_color);
    s.to_contribution = rescale(in, s.alpha_fraction + t, Wire::contribution);
    s.to_color_sum = limits_of(in, Wire::color), s.to_transparency_sum = limits_of(in, Wire::transparency);
    switch (s.form) {
        case CompositingForm::w:
            s.to_color = rescale(in, incoming + (s.premultiplied ? t : s.contribution_fraction), Wire::color);
            s.to_transparency = rescale(in, std::max(t, s.contribution_fraction), Wire::transparency);
            break;
        case CompositingForm::back_to_front:
            s.to_color = rescale(in, s.sum_fraction + s.alpha_fraction, Wire::color);
            s.to_transparency = rescale(in, t + s.alpha_fraction, Wire::transparency);
            break;
        default:
            s.to_color = rescale(in, s.color_fraction + t, Wire::color);
            s.to_transparency = rescale(in, t + s.alpha_fraction, Wire::transparency);
    }
    // Codes of the [0, 2^F - 1] representation are integers: rounded to nearest, limited to the unit.
    s.alpha_to_code = s.color_to_code = Rescale(
        s.alpha_fraction, Spec{{t, 0, false}, Rounding::rnd, Overflow::sat}, wire_index(Wire::contribution));
    if (s.is_unit255()) {
        s.color_to_code = Rescale(s.color_fraction, Spec{{t, 0, false}, Rounding::rnd, Overflow::sat},
                                  wire_index(Wire::contribution));
        s.to_color_sum = Rescale(0, Spec{{t, 0, false}, Rounding::trn, in.specs[Wire::color].overflow},
                                 wire_index(Wire::color));
    } else if (s.form == CompositingForm::back_to_front) {
        s.color_to_code = rescale(in, s.color_fraction, Wire::color);
    }
    s.threshold_exact = in.scene.sampling.termination;
    s.threshold = static_cast<std::int64_t>(std::ceil(s.threshold_exact * static_cast<double>(s.unit())));
    return s;
}

}  // namespace squint
