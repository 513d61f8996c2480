// NRRD headers, read with teem, and the data they speak of.
#pragma once

#include "core/volume_stored.h"

namespace squint {

/// True when a file begins like a NRRD.
bool is_nrrd(const MappedFile& file);

/// Header and voxels of a NRRD (attached or detached, raw or gzip).  Throws InputError naming the file.
StoredVolume read_nrrd(const std::string& path, const MappedFile& file, const LoadLimits& limits,
                       std::vector<std::string>& notes);

/// `file` from byte `offset` on must hold exactly the voxels of `stored`; `reason` may add how to mend it.
void take_mapped(StoredVolume& stored, const MappedFile& file, std::size_t offset, const std::string& where);

}  // namespace squint
