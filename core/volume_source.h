// Where a volume comes from: the [volume] part of a scene, and the one function that loads it.
#pragma once

#include "core/volume.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace squint {

/// Exactly one of `file`, `procedural` is set.  Everything but these two has a default.
struct VolumeSource {
    std::string file = {};                // NRRD (.nrrd, .nhdr) or raw; variables already expanded
    std::string procedural = "phantom";   // used when `file` is empty; names in procedural.h
    std::vector<std::int64_t> dims = {};  // raw: required; procedural: optional (one number or three)
    std::string type = {};                // raw: u8, i16, u16, f32
    std::string endian = "little";        // raw: little, big
    std::int64_t offset = 0;              // raw: bytes to skip
    std::vector<double> spacing = {};     // raw: default 1 1 1; otherwise overrides the file's
    std::vector<double> window = {};      // [least, greatest] in the file's units; required for f32
    int bits = 0;  // float data: bits to quantise the window to (required there, 1 to 16)
    /// value = value_scale * stored + value_offset; absent: what the file declares, or 1 and 0.
    std::optional<double> value_scale = {}, value_offset = {};
};

struct LoadLimits {
    std::int64_t max_bytes = std::int64_t{1} << 40;  // refuse to hold more voxels than this in memory
};

/// Loads, checks, converts to levels and measures a volume.  Throws InputError naming the file and what is
/// wrong with it. `notes` receives one line for everything a user should know (float data quantised to n
/// bits, axes permuted, ...).
Volume load_volume(const VolumeSource& source, const LoadLimits& limits = {},
                   std::vector<std::string>* notes = nullptr);

/// Writes a volume as an attached NRRD (raw encoding), whole or not at all.
void save_nrrd(const Volume& volume, const std::string& path);

}  // namespace squint
