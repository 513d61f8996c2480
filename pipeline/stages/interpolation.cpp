#include "pipeline/stages/interpolation.h"

#include "pipeline/stages/inputs.h"

#include <fmt/format.h>

namespace squint {

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
    s.nearest = in.scene.sampling.interpolation == InterpolationRule::nearest;
    return s;
}

}  // namespace squint
