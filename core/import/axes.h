// The directions in which a file's axes run -> a grid along world axes.  For the readers of volumes only.
#pragma once

#include "core/volume_stored.h"

#include <array>
#include <string_view>

namespace squint {

/// Sets axis, flipped, spacing, origin and turn from steps and first_voxel.  Axes along x, y and z in any order
/// and sense make no turn; others are put in the order and sense nearest to it, and what is left is the turn.
/// Throws InputError: a step that is zero or not finite, or axes that are not at right angles.
void take_axes(StoredVolume& stored);

/// Turns world axes that run from left to right or from back to front about, so that they are LPS.  Throws
/// InputError where the file does not name its axes.
void turn_to_lps(StoredVolume& stored);

inline constexpr std::string_view kLps = "left-posterior-superior";

}  // namespace squint
