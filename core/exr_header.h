// Checks the header of an OpenEXR file before a library allocates what it claims.
#pragma once

#include <cstddef>
#include <string>

namespace squint {

/// Throws InputError where an attribute reaches past the end of the file, or the header claims more pixels
/// than its bytes can hold: a library would ask for that memory first.  Accepts bytes that are no EXR: the
/// reader refuses them.  Layout: OpenEXR, "OpenEXR File Layout".
void check_exr_header(const unsigned char* bytes, std::size_t size, const std::string& path);

}  // namespace squint
