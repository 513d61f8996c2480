// Turns the directions of a file's axes into a grid along world axes.  Only for readers of volumes.
#pragma once

#include "core/volume_stored.h"

#include <array>
#include <string_view>

namespace squint {

/// Sets axis, flipped, spacing, origin and turn from steps and first_voxel.  Axes along x, y and z, in any
/// order and sense, make no turn.  Others take the nearest order and sense, and the rest is the turn.  Throws
/// InputError for a step that is zero or not finite, and for axes not at right angles.
void take_axes(StoredVolume& stored);

/// Turns world axes that run left to right or back to front around, so that they are LPS.  Throws InputError
/// where the file does not name its axes.
void turn_to_lps(StoredVolume& stored);

inline constexpr std::string_view kLps = "left-posterior-superior";

}  // namespace squint
