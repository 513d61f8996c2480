#include "pipeline/stages/compositing.h"

#include "pipeline/stages/inputs.h"
#include "pipeline/stages/presets.h"

#include <algorithm>
#include <cmath>

namespace squint {

CompositingForm form_of(const Scene& scene) {
    const CompositingForm form = scene.compositing.form;
    return form == CompositingForm::automatic ? preset_form(resolved_precision(scene).preset) : form;
}

void keep_sums_exact(const Scene& scene, WireSpecs& specs) {
    constexpr int kWidest = 29;  // the sum of two u1.29 fits a 32-bit lane
    if (form_of(scene) != CompositingForm::w_carry) return;
    const auto fraction_bits = [&](Wire wire) { return specs[wire].format.fraction_bits; };
    const int color = std::max(
        {fraction_bits(Wire::slab_ratio), fraction_bits(Wire::slab_color), fraction_bits(Wire::lit_color)});
    const int whole = color + std::max(fraction_bits(Wire::contribution), fraction_bits(Wire::transparency));
    specs[Wire::color].format.fraction_bits = std::min(whole, kWidest);
}

std::vector<WireFormats> compositing_wires(const PresetInputs& in) {
    std::vector<WireFormats> wires;
    for (const Wire wire : {Wire::contribution, Wire::color, Wire::transparency})
        wires.push_back({wire, unsigned_spec(1, accumulating_bits(in), kToEven),
                         unsigned_spec(1, 15, Rounding::trn), unsigned_spec(1, 8, Rounding::trn),
                         unsigned_spec(1, wide_accumulating_bits(in), kToEven)});
    return wires;
}

CompositingStage build_compositing(const StageInputs& in) {
    CompositingStage s;
    s.form = form_of(in.scene);
    if (s.is_unit255())
        require_fraction_bits(in, Wire::transparency, 1,
                              "a transparency of 1.0, which is 2^F - 1 in this form,");
    else
        require_integer_bits(in, Wire::transparency, 1, "a transparency of 1.0");
    s.premultiplied = in.premultiplied;
    s.alpha_fraction = fraction(in, Wire::slab_alpha);
    const int unlit = s.premultiplied ? fraction(in, Wire::slab_color) : fraction(in, Wire::slab_ratio);
    const int incoming = in.lit ? fraction(in, Wire::lit_color) : unlit;
    s.contribution_fraction = fraction(in, Wire::contribution);
    s.transparency_fraction = fraction(in, Wire::transparency);
    s.sum_fraction = fraction(in, Wire::color);
    const int t = s.transparency_fraction;
    const bool carries_alpha =
        s.premultiplied || s.takes_from_transparency() || s.form == CompositingForm::straight;
    s.to_slab_color = rescale(in, incoming + s.alpha_fraction, Wire::slab_color);
    s.color_fraction = carries_alpha ? incoming : fraction(in, Wire::slab_color);
    s.to_contribution = rescale(in, s.alpha_fraction + t, Wire::contribution);
    if (s.form == CompositingForm::w_carry) {
        require_integer_bits(in, Wire::contribution, 1, "an opacity of 1.0 in form w_carry");
        // Nothing is rounded, because the remainder is carried.
        Spec floor = in.specs[Wire::contribution];
        floor.rounding = Rounding::trn;
        s.to_contribution = Rescale(s.alpha_fraction + t, floor, wire_index(Wire::contribution));
    }
    s.to_color_sum = limits_of(in, Wire::color), s.to_transparency_sum = limits_of(in, Wire::transparency);
    switch (s.form) {
        case CompositingForm::w:
        case CompositingForm::w_carry:
            s.to_color = rescale(in, incoming + (s.premultiplied ? t : s.contribution_fraction), Wire::color);
            s.to_transparency = rescale(in, std::max(t, s.contribution_fraction), Wire::transparency);
            break;
        case CompositingForm::back_to_front:
            s.to_color = rescale(in, s.sum_fraction + s.alpha_fraction, Wire::color);
            s.to_transparency = rescale(in, t + s.alpha_fraction, Wire::transparency);
            break;
        case CompositingForm::straight:
            s.numerator_fraction = std::max(s.sum_fraction, s.color_fraction);
            s.to_color = rescale(in, s.numerator_fraction, Wire::color);
            s.to_color.divides = true;
            s.to_transparency = rescale(in, t + s.alpha_fraction, Wire::transparency);
            break;
        default:
            s.to_color = rescale(in, s.color_fraction + t, Wire::color);
            s.to_transparency = rescale(in, t + s.alpha_fraction, Wire::transparency);
    }
    // Codes of the [0, 2^F - 1] representation are integers: rounded to nearest, limited to 2^F - 1.
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
