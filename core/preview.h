// Writes pictures to look at.
#pragma once

#include "core/image.h"

#include <string>

namespace squint {

/// Writes the picture of write_preview_png() as PNG, or as JPEG where the name ends in .jpg or .jpeg: whole
/// or not at all.  Throws InputError.
void write_preview(const Image& image, const std::string& path, const double background[3]);

}  // namespace squint
