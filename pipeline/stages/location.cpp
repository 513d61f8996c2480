#include "pipeline/stages/location.h"

#include "core/error.h"
#include "pipeline/stages/inputs.h"
#include "pipeline/stages/presets.h"

#include <fmt/format.h>

#include <algorithm>

namespace squint {

std::vector<WireFormats> location_wires(const PresetInputs& in) {
    constexpr Rounding trn = Rounding::trn;
    const Spec location = unsigned_spec(in.location_bits, held(31 - in.location_bits), kToEven);
    return {{Wire::location, location, unsigned_spec(11, 12, trn), unsigned_spec(11, 12, trn),
             unsigned_spec(in.location_bits, 24, kToEven)},
            {Wire::direction, signed_spec(in.direction_bits, location.format.fraction_bits, kToEven),
             signed_spec(1, 12, trn), signed_spec(1, 12, trn), signed_spec(in.direction_bits, 24, kToEven)},
            {Wire::weight, unsigned_spec(1, weight_bits(in), kHalvesUp), unsigned_spec(1, 12, trn),
             unsigned_spec(1, 8, trn), unsigned_spec(1, 20, kToEven)},
            // 2^-10 of a step that is 1 deep is a quarter of an LSB8.
            {Wire::length, unsigned_spec(1, held(9 + in.whole_depth_bits), kToEven),
             unsigned_spec(1, 15, trn), unsigned_spec(1, 15, trn), unsigned_spec(1, 22, kToEven)}};
}

LocationStage build_location(const StageInputs& in) {
    const auto longest =
        static_cast<double>(std::max({in.volume.dims.x, in.volume.dims.y, in.volume.dims.z})) - 1;
    require_integer_bits(in, Wire::location, bits_for(longest),
                         fmt::format("a volume of {} voxels along its longest axis", longest + 1));
    if (in.specs[Wire::location].overflow == Overflow::wrap)
        throw InputError(
            "precision.location: wrap, but a location is held inside the volume: sat is allowed");
    require_signed(in, Wire::direction);
    require_integer_bits(in, Wire::direction, bits_for(in.scene.sampling.step),
                         fmt::format("a step of {} voxels", in.scene.sampling.step));
    require_integer_bits(in, Wire::length, 1, "a full step of 1.0");
    LocationStage s;
    const Volume& v = in.volume;
    s.location = in.specs[Wire::location], s.direction = in.specs[Wire::direction],
    s.length = in.specs[Wire::length];
    if (in.scene.sampling.position == PositionRule::accumulate) {
        // Repeatedly adding V in the location's format gives P0 + k q(V): the same integers.
        s.direction.format.fraction_bits = s.location.format.fraction_bits;
    }
    s.location_fraction = s.location.format.fraction_bits;
    s.direction_fraction = s.direction.format.fraction_bits;
    s.length_fraction = s.length.format.fraction_bits;
    s.common_fraction = std::max(s.location_fraction, s.direction_fraction);
    s.to_location = Rescale(s.common_fraction, s.location, wire_index(Wire::location));
    s.to_weight = rescale(in, s.location_fraction, Wire::weight);
    s.to_first = Rescale(s.location_fraction, s.location, wire_index(Wire::location));
    s.to_direction = Rescale(s.direction_fraction, s.direction, wire_index(Wire::direction));
    s.to_length = rescale(in, s.length_fraction, Wire::length);
    // Dropping less than a last bit of V moves sample k by less than k last bits, and P0 is rounded, too: P0
    // + kV can leave the box by that much.
    const auto drift =
        (static_cast<std::int64_t>(in.most_steps + 4) << (s.common_fraction - s.direction_fraction)) +
        (std::int64_t{1} << (s.common_fraction - s.location_fraction));
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        s.limit[a] = (v.dims[axis] - 1) << s.location_fraction;
        s.last_cell[a] = std::max<std::int64_t>(v.dims[axis] - 2, 0);
        s.low[a] = -drift;
        s.high[a] = (s.limit[a] << (s.common_fraction - s.location_fraction)) + drift;
    }
    return s;
}

}  // namespace squint
