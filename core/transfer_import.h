// Transfer functions written by other programs, and presets for CT in HU.
#pragma once

#include "core/transfer_function.h"

#include <string>
#include <string_view>
#include <vector>

namespace squint {

/// ct_bone, ct_skin, ct_muscle, ct_lung, ct_vessels, ... in HU; unit_distance in millimetres.
std::vector<std::string> transfer_preset_names();
bool find_transfer_preset(std::string_view name, TransferFunction& function);

/// ParaView JSON colour map (RGBPoints and Points), or 3D Slicer .vp (documented subset).  `srgb` decodes colours first.
/// Throws InputError for everything outside the subset.
TransferFunction import_paraview_json(const std::string& path, bool srgb, double unit_distance);
TransferFunction import_slicer_vp(const std::string& path, bool srgb);

}  // namespace squint
