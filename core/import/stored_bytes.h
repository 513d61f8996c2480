// Reads voxels out of a file.  Only for readers of volumes.
#pragma once

#include "core/volume_stored.h"

#include <optional>

namespace squint {

/// The data file of a header.  Throws InputError for a file outside the header's folder: a header must not
/// make us read any file it likes.
std::string data_path(const std::string& path, const std::string& name);

/// Maps voxels: `file` from byte `offset` on must hold exactly those of `stored`, which stay in place.
void take_mapped(StoredVolume& stored, const MappedFile& file, std::size_t offset, const std::string& where);

/// Inflates voxels: gzip or zlib data in `packed` bytes from `offset` on, after `skip` inflated ones, or, where
/// `skip` is nothing, the last of them.
void take_inflated(StoredVolume& stored, const MappedFile& file, std::size_t offset, std::size_t packed,
                   std::optional<std::size_t> skip, const LoadLimits& limits, const std::string& where);

/// Parses voxels that are numbers written as text, from byte `offset` to the end.
void take_ascii(StoredVolume& stored, const MappedFile& file, std::size_t offset, const LoadLimits& limits,
                const std::string& where);

/// Notes components: `count` numbers a voxel, `run` numbers apart.
void take_components(StoredVolume& stored, std::int64_t count, std::int64_t run);

/// Chooses the component that the source names.  Throws InputError where there are several and none is named.
void choose_component(StoredVolume& stored, const VolumeSource& source);

}  // namespace squint
