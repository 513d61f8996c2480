// The header of an OpenEXR file, looked through before a library takes its word for sizes.
#pragma once

#include <cstddef>
#include <string>

namespace squint {

/// Throws InputError where an attribute reaches past the end of the file, or the pixels that the header claims are
/// more than its bytes can hold: a library would ask for that memory first.  Bytes that are no EXR are left to the
/// reader.  Layout: OpenEXR, "OpenEXR File Layout".
void check_exr_header(const unsigned char* bytes, std::size_t size, const std::string& path);

}  // namespace squint
