#include "pipeline/stages/interpolation.h"

#include "pipeline/stages/inputs.h"
#include "pipeline/stages/presets.h"

#include <fmt/format.h>

#include <algorithm>

namespace squint {

std::vector<WireFormats> interpolation_wires(const PresetInputs& in) {
    constexpr Rounding trn = Rounding::trn;
    const int scalar = in.scalar_bits;
    // Lerp levels are cut so that every exact product fits a 32-bit word, I + level + weight <= 31: with 12
    // bits of weight, the middle levels have 19 - I fraction bits.
    const Spec level = unsigned_spec(scalar, 31 - scalar - weight_bits(in), kHalvesUp),
               squeeze = unsigned_spec(12, 12, trn), whole = unsigned_spec(scalar, 0, trn),
               wide = unsigned_spec(scalar, std::min(20, 30 - scalar), kToEven);
    return {
        {Wire::lerp_x, level, squeeze, whole, wide},
        {Wire::lerp_y, level, squeeze, whole, wide},
        {Wire::sample, unsigned_spec(scalar, std::min(12, 24 - scalar), kHalvesUp), squeeze, whole, wide}};
}

InterpolationStage build_interpolation(const StageInputs& in) {
    require_integer_bits(in, Wire::weight, 1, "a weight of 1.0");
    for (const Wire wire : {Wire::lerp_x, Wire::lerp_y, Wire::sample})
        require_integer_bits(in, wire, bits_for(in.volume.largest),
                             fmt::format("the scalar {}", in.volume.largest));
    InterpolationStage s;
    s.weight_bits = fraction(in, Wire::weight);
    s.to_x = rescale(in, s.weight_bits, Wire::lerp_x);
    s.to_y = rescale(in, fraction(in, Wire::lerp_x) + s.weight_bits, Wire::lerp_y);
    s.to_sample = rescale(in, fraction(in, Wire::lerp_y) + s.weight_bits, Wire::sample);
    s.sample_fraction = fraction(in, Wire::sample);
    s.to_x_sum = limits_of(in, Wire::lerp_x), s.to_y_sum = limits_of(in, Wire::lerp_y),
    s.to_sum = limits_of(in, Wire::sample);
    s.two_products = in.scene.sampling.lerp == LerpRule::two_products;
    s.nearest = in.scene.sampling.interpolation == InterpolationRule::nearest;
    return s;
}

}  // namespace squint
