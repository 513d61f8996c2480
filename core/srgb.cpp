#include "core/srgb.h"

#include "core/portable_math.h"

namespace squint {

double srgb_from_linear(double linear) {
    if (linear <= 0) return 0;
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * portable::pow(linear, 1 / 2.4) - 0.055;
}

double linear_from_srgb(double encoded) {
    if (encoded <= 0) return 0;
    return encoded <= 0.04045 ? encoded / 12.92 : portable::pow((encoded + 0.055) / 1.055, 2.4);
}

}  // namespace squint
