// What a path names.
#pragma once

#include <string>

namespace squint {

/// Whether a path names a volume, by its name or its first bytes: a folder, or a file of a kind that
/// load_volume() reads.  A raw file is known by the extension .raw.
bool looks_like_volume(const std::string& path);

}  // namespace squint
