// What a reader in a child process returns: a header of text lines, and the voxels in a memory file.
#pragma once

#include "core/volume_stored.h"

#include <string_view>

namespace squint {

/// Both sides speak this version, which is the first line: the reader must belong to the library.
inline constexpr std::string_view kHandoverHead = "squint-read 1";
/// The child's descriptor of the memory file, open for writing.
inline constexpr int kVoxelsDescriptor = 3;

/// The header of `stored`; its voxels lie in the memory file, along the steps of its axes in world space.
struct Handover {
    StoredVolume stored;  // no bytes; spacing, axis and flipped follow from the steps
    std::vector<std::string> notes;
};

std::string text_of(const Handover& handover);
/// Parses a header.  Throws InputError where text_of() cannot have written it, or a number in it cannot be.
Handover handover_from(std::string_view text, const std::string& where);

}  // namespace squint
