// Pictures for looking at.
#pragma once

#include "core/image.h"

#include <string>

namespace squint {

/// What write_preview_png() writes, as PNG, or as JPEG where the name ends in .jpg or .jpeg.  The file appears whole or
/// not at all.  Throws InputError.
void write_preview(const Image& image, const std::string& path, const double background[3]);

}  // namespace squint
