// Imports transfer functions of other programs.
#pragma once

#include "core/transfer_function.h"

#include <string>

namespace squint {

/// ParaView's JSON colour map: an object, or a list of which `map` names one (empty: the only one), with
///
///     "RGBPoints": [value, r, g, b, ...]                   required
///     "Points": [value, alpha, midpoint, sharpness, ...]   midpoint 0.5, sharpness 0; absent: alpha rises 0 to 1
///     "ColorSpace": "RGB"                                  absent: RGB; HSV ("HSVWrap": 1: the shorter way round),
///                                                          Lab, CIELAB, Diverging and Step are sampled
///
/// Values are taken as they are, in the units of the volume's file.  ParaView's own maps span [0, 1]:
/// `transfer_function.range` stretches them.  Other keys are ignored; comments and trailing commas are
/// accepted. `srgb` decodes the points' colours.  Throws InputError for all else.
TransferFunction import_paraview_json(const std::string& path, const std::string& map, bool srgb,
                                      double unit_distance);

/// 3D Slicer's text volume property (.vp): nine lines, empty ones apart,
///
///     interpolation, shade, diffuse, ambient, specular, power   a number each; ignored, the scene says how it is lit
///     N value alpha ...                                         scalar opacity: N numbers follow
///     N value alpha ...                                         gradient opacity: 1 everywhere, or no points
///     N value r g b ...                                         colour
///
/// Slicer stores no unit distance here: it is 1, VTK's default.  Throws InputError for all else.
TransferFunction import_slicer_vp(const std::string& path, bool srgb);

/// 3D Slicer's JSON volume property (.vp.json), one component: `rgbTransferFunction`, `scalarOpacity`,
/// `scalarOpacityUnitDistance` (absent: 1); `gradientOpacity` must be 1.  Throws InputError for all else.
TransferFunction import_slicer_json(const std::string& path, bool srgb);

/// ImageVis3D's one-dimensional function (.1dt): a count, then as many colours r g b a, for the values 0, 1,
/// 2 ... Throws InputError.
TransferFunction import_imagevis3d(const std::string& path, bool srgb, double unit_distance);

}  // namespace squint
