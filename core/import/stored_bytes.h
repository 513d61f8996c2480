// Voxels out of a file, for the readers of volumes only.
#pragma once

#include "core/volume_stored.h"

namespace squint {

/// The data file beside a header.  A header from elsewhere must not make us read any file it likes: throws
/// InputError for one outside the header's folder.
std::string data_path(const std::string& path, const std::string& name);

/// `file` from byte `offset` on must hold exactly the voxels of `stored`, which stay where they are.
void take_mapped(StoredVolume& stored, const MappedFile& file, std::size_t offset, const std::string& where);

/// The voxels are the gzip or zlib data in `packed` bytes from `offset` on, after `skip` inflated ones.
void take_inflated(StoredVolume& stored, const MappedFile& file, std::size_t offset, std::size_t packed,
                   std::size_t skip, const LoadLimits& limits, const std::string& where);

/// The voxels are numbers written as text, from byte `offset` to the end.
void take_ascii(StoredVolume& stored, const MappedFile& file, std::size_t offset, const LoadLimits& limits,
                const std::string& where);

/// `count` numbers a voxel, `run` numbers between two of the same voxel.
void take_components(StoredVolume& stored, std::int64_t count, std::int64_t run);

/// The component that the source names.  Throws InputError: several, and none is named.
void choose_component(StoredVolume& stored, const VolumeSource& source);

}  // namespace squint
