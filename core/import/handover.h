// What a reader in a child process hands back: a header of text lines, and the voxels in a memory file.
#pragma once

#include "core/volume_stored.h"

#include <string_view>

namespace squint {

/// The version both sides speak, in the first line; the program beside the library must be its own.
inline constexpr std::string_view kHandoverHead = "squint-read 1";
/// Where the child finds the memory file, open for writing.
inline constexpr int kVoxelsDescriptor = 3;

/// The header of `stored`, whose voxels lie in the memory file, along the steps of its axes in world space.
struct Handover {
    StoredVolume stored;  // no bytes; spacing, axis and flipped follow from the steps
    std::vector<std::string> notes;
};

std::string text_of(const Handover& handover);
/// Throws InputError where the text is none of text_of()'s, or a number in it cannot be.
Handover handover_from(std::string_view text, const std::string& where);

}  // namespace squint
