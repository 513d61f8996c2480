#include "pipeline/stages/inputs.h"

#include "core/error.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>

namespace squint {

Rescale rescale(const StageInputs& in, int from_fraction, Wire wire) {
    return Rescale(from_fraction, in.specs[wire], wire_index(wire));
}

int fraction(const StageInputs& in, Wire wire) {
    return in.specs[wire].format.fraction_bits;
}

Rescale limits_of(const StageInputs& in, Wire wire) {
    return Rescale(fraction(in, wire), in.specs[wire], wire_index(wire));
}

int bits_for(double value) {
    return value < 1 ? 0 : static_cast<int>(std::bit_width(static_cast<std::uint64_t>(std::floor(value))));
}

void require_integer_bits(const StageInputs& in, Wire wire, int bits, const std::string& what) {
    const Format& f = in.specs[wire].format;
    if (f.integer_bits < bits)
        throw InputError(fmt::format("precision.{}: {} has {} integer bits, but {} needs {}", info(wire).name,
                                     to_string(f), f.integer_bits, what, bits));
}

void require_fraction_bits(const StageInputs& in, Wire wire, int bits, const std::string& what) {
    const Format& f = in.specs[wire].format;
    if (f.fraction_bits < bits)
        throw InputError(fmt::format("precision.{}: {} has {} fraction bits, but {} needs {}",
                                     info(wire).name, to_string(f), f.fraction_bits, what, bits));
}
void require_signed(const StageInputs& in, Wire wire) {
    if (!in.specs[wire].format.is_signed)
        throw InputError(
            fmt::format("precision.{}: {} is unsigned, but the wire carries negative numbers: write s{}.{}",
                        info(wire).name, to_string(in.specs[wire].format), in.specs[wire].format.integer_bits,
                        in.specs[wire].format.fraction_bits));
}

}  // namespace squint
