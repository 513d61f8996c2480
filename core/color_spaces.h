// Interpolates colours of a colour map in the spaces that VTK's colour transfer functions have.
#pragma once

#include "core/vector.h"

namespace squint {

enum class ColorSpace { rgb, hsv, hsv_wrapped, lab, diverging, step };

/// The colour at `part` (0 to 1) of the way from `a` to `b`, all as a display takes them (R G B of sRGB, 0 to
/// 1). rgb: linear; hsv: linear in hue, saturation and value, wrapped: the shorter way round; lab: CIE
/// L*a*b*, white D65; diverging: Moreland, "Diverging color maps for scientific visualization", 2009, with
/// white between two saturated colours of different hue; step: `b`.  The same bits on every CPU.
Vec3 color_between(ColorSpace space, const Vec3& a, const Vec3& b, double part);

}  // namespace squint
