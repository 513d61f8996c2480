// The sRGB transfer curve (IEC 61966-2-1), with the same bits on every CPU.
#pragma once

namespace squint {

/// Both map [0, 1] to [0, 1]; below 0 they give 0, above 1 they continue the curve.
double srgb_from_linear(double linear);
double linear_from_srgb(double encoded);

}  // namespace squint
