// Reads whole files that are small: scenes, transfer functions, records.  Volumes are mapped (volume_data.h).
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <string_view>

namespace squint {

/// A file's bytes.  `allowed` says what may stand there.  Throws InputError `path: ...` if the file cannot be read or
/// has more than `most` bytes.
std::string read_whole(const std::string& path, std::string_view allowed,
                       std::size_t most = std::numeric_limits<std::size_t>::max());

}  // namespace squint
