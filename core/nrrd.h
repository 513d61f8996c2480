// Reads NRRD: teem parses the header, and we read the data.
#pragma once

#include "core/volume_stored.h"

namespace squint {

/// Whether a file begins like a NRRD.
bool is_nrrd(const MappedFile& file);

/// Reads header and voxels (attached or detached; raw, gzip or ascii).  Throws InputError naming the file.
StoredVolume read_nrrd(const std::string& path, const MappedFile& file, const LoadLimits& limits,
                       std::vector<std::string>& notes);

}  // namespace squint
