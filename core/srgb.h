// The sRGB transfer curve (IEC 61966-2-1), with the same bits on every CPU.
#pragma once

namespace squint {

/// Both take [0, 1] to [0, 1]; what lies below 0 is 0, what lies above 1 continues the curve.
double srgb_from_linear(double linear);
double linear_from_srgb(double encoded);

}  // namespace squint
