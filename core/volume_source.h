// Where a volume comes from: the [volume] part of a scene, and the function that loads it.
#pragma once

#include "core/volume.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace squint {

/// Exactly one of `file` and `procedural` is set.  All others have defaults.
struct VolumeSource {
    std::string file = {};                // a file or folder, variables already expanded: docs/formats.md
    std::string procedural = "phantom";   // used when `file` is empty; names in procedural.h
    std::vector<std::int64_t> dims = {};  // raw: required; procedural: optional (one number or three)
    std::string type = {};                // raw: u8, i8, u16, i16, u32, i32, u64, i64, f32, f64
    std::string endian = "little";        // raw: little, big
    std::int64_t offset = 0;              // raw: bytes to skip
    std::vector<double> spacing = {};     // raw: default 1 1 1; otherwise overrides the file's
    std::vector<double> window = {};      // [least, greatest] in the file's units; floats: default all finite
    int bits = 0;                         // float data: bits the window is quantised to, 1 to 16; 0: 16
    /// value = value_scale * stored + value_offset; absent: as the file declares, or 1 and 0.
    std::optional<double> value_scale = {}, value_offset = {};
    std::optional<double> nan = {};     // the value of voxels that are not a number
    std::optional<int> component = {};  // of files with several numbers a voxel or several times
    int series = 0;                     // DICOM: which of the series listed, from 1; 0: the only one
    std::string space = "file";         // world axes: as the file states them, or turned to "lps"
};

struct LoadLimits {
    std::int64_t max_bytes = std::int64_t{1} << 40;  // refuse to hold more voxels than this in memory
};

/// Loads a volume, checks it, converts it to levels and measures it.  Throws InputError naming the file and
/// what is wrong with it.  `notes` receives a line for each thing that a user should know (floats quantised
/// to n bits, axes permuted, ...).
Volume load_volume(const VolumeSource& source, const LoadLimits& limits = {},
                   std::vector<std::string>* notes = nullptr);

/// Writes a volume as an attached NRRD (raw encoding), whole or not at all.
void save_nrrd(const Volume& volume, const std::string& path);

}  // namespace squint
