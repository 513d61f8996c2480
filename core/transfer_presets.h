// Transfer functions for CT in HU.
#pragma once

#include "core/transfer_function.h"

#include <string>
#include <string_view>
#include <vector>

namespace squint {

/// ct_bone, ct_skin, ct_muscle, ct_lung, ct_vessels, ... in HU.  Their unit_distance is 1 mm, so spacings
/// must be in millimetres.
std::vector<std::string> transfer_preset_names();
bool find_transfer_preset(std::string_view name, TransferFunction& function);

}  // namespace squint
