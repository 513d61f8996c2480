// NRRD headers, read with teem, and the data they speak of.
#pragma once

#include "core/volume_stored.h"

namespace squint {

/// True when a file begins like a NRRD.
bool is_nrrd(const MappedFile& file);

/// Header and voxels of a NRRD (attached or detached; raw, gzip or ascii).  Throws InputError naming the file.
StoredVolume read_nrrd(const std::string& path, const MappedFile& file, const LoadLimits& limits,
                       std::vector<std::string>& notes);

}  // namespace squint
