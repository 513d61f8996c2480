// What a stage builds its constants from: the user's settings, the formats, and the volume.
#pragma once

#include "core/camera.h"
#include "core/transfer_function.h"
#include "core/volume.h"
#include "fixedpoint/quantise.h"
#include "scene/scene.h"
#include "scene/wires.h"

#include <string>

namespace squint {

struct StageInputs {
    const Scene& scene;
    const WireSpecs& specs;
    const Volume& volume;
    const Entries& entries;
    const Camera& camera;
    double most_steps = 1;       // slabs of the longest ray; not rounded to an integer
    bool lit = false;            // whether stages 3 and 5 run
    bool premultiplied = false;  // whether the classification's colours already carry their opacity
    InsideRule inside = InsideRule::front;  // where inside a slab its light is computed
};

/// A Rescale of numbers with `from_fraction` fraction bits to a wire.
Rescale rescale(const StageInputs& in, int from_fraction, Wire wire);
/// A wire's fraction bits.
int fraction(const StageInputs& in, Wire wire);
/// A wire's limits without rounding: for sums of numbers that already have its format.
Rescale limits_of(const StageInputs& in, Wire wire);
/// A wire's index in Rescale and Table.
constexpr int wire_index(Wire wire) {
    return static_cast<int>(wire);
}
/// The number of integer bits that hold values up to and including `value`.
int bits_for(double value);

/// Throws InputError naming the wire, where its format has fewer integer bits than `bits`, for `what`.
void require_integer_bits(const StageInputs& in, Wire wire, int bits, const std::string& what);
/// The same for fraction bits.
void require_fraction_bits(const StageInputs& in, Wire wire, int bits, const std::string& what);
/// Throws InputError naming the wire, where its format is unsigned.
void require_signed(const StageInputs& in, Wire wire);

}  // namespace squint
