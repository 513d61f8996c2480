// Readers that use other people's parsers run in a child process, `squint-read`, with limits on memory, time
// and files: whatever a hostile file does to a parser, it costs one line.
#pragma once

#include "core/volume_stored.h"

#include <string>
#include <string_view>

namespace squint {

/// Reads `source.file` with the reader of that kind ("dicom", "nifti", "vti", "pictures").  Throws InputError
/// with what the reader refused, or that it died, took too long or is not installed.
StoredVolume read_in_child(std::string_view kind, const VolumeSource& source, const LoadLimits& limits,
                           std::vector<std::string>& notes);

/// The program that read_in_child() runs: named by the variable SQUINT_READ, or beside the running program,
/// in ../libexec/squint beside it, or where it was installed.  Empty if there is none.
std::string reader_program();

}  // namespace squint
