// Colours between two points of a colour map, in the spaces that VTK's colour transfer functions interpolate in.
#pragma once

#include "core/vector.h"

namespace squint {

enum class ColorSpace { rgb, hsv, hsv_wrapped, lab, diverging, step };

/// The colour at `part` of the way, 0 to 1, from `a` to `b`, both as a display takes them (R G B of sRGB, 0 to 1).
/// rgb: linear; hsv: hue, saturation and value linear, wrapped: the shorter way round; lab: CIE L*a*b* of the white
/// D65; diverging: Moreland, "Diverging color maps for scientific visualization", 2009, with white between two
/// saturated colours of different hue; step: `b`.  Same bits on every processor.
Vec3 color_between(ColorSpace space, const Vec3& a, const Vec3& b, double part);

}  // namespace squint
