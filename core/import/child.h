// Readers built on other people's parsers run in a child process, `squint-read`, with limits on memory, time
// and files: a hostile file costs one line, whatever it does to the parser.
#pragma once

#include "core/volume_stored.h"

#include <string>
#include <string_view>

namespace squint {

/// Reads `source.file` with the reader of that kind ("dicom", "nifti", "vti", "pictures").  Throws InputError:
/// what the reader refused, or that it died, took too long or is not installed.
StoredVolume read_in_child(std::string_view kind, const VolumeSource& source, const LoadLimits& limits,
                           std::vector<std::string>& notes);

/// The program that read_in_child() runs: named by the variable SQUINT_READ, beside the running program, in
/// ../libexec/squint beside it, or where it was installed.  Empty where there is none.
std::string reader_program();

}  // namespace squint
