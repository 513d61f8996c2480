#include "fixedpoint/quantise.h"

namespace squint {

std::int64_t quantise_real(double x, const Spec& spec) {
    return quantise_real(x, static_cast<double>(spec.format.one()), Rescale(spec.format.fraction_bits, spec));
}

}  // namespace squint
