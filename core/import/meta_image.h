// MetaImage (.mha, .mhd): a header of "Key = Value" lines over raw, zlib or text data, as ITK writes them.
#pragma once

#include "core/volume_stored.h"

namespace squint {

/// Header and voxels, world axes LPS.  Throws InputError naming the file.
StoredVolume read_meta_image(const std::string& path, const MappedFile& file, const LoadLimits& limits,
                             std::vector<std::string>& notes);

}  // namespace squint
