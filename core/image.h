// Images of named channels, and their files.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace squint {

/// A channel holds either linear floats or raw fixed-point words (kept as UINT in EXR).
struct Channel {
    std::string name;
    std::vector<float> values;         // width * height, row 0 on top; empty for words
    std::vector<std::uint32_t> words;  // two's complement raw words; empty for floats
    bool is_words() const { return !words.empty(); }
};

struct Image {
    int width = 0, height = 0;
    std::vector<Channel> channels;
    int left = 0, top = 0;    // where its first pixel stands: the data window of an EXR that was read
    bool is_display = false;  // codes for a display, as read from an 8-bit file

    Channel* find(const std::string& name);
    const Channel* find(const std::string& name) const;
    Channel& add_float(std::string name);  // zeros
    Channel& add_words(std::string name);
};

/// Strings only: OpenImageIO drops arrays of integers silently.
using Attributes = std::map<std::string, std::string>;

/// Writes through a temporary beside `path`, renamed into place: whole or not at all.  No time, host or path
/// in the file.
void write_exr(const Image& image, const std::string& path, const Attributes& attributes);

/// R G B A premultiplied linear -> over `background` (linear) -> 8-bit sRGB PNG.  Written whole or not at
/// all. `level`: 1 is quick, 9 small.
void write_preview_png(const Image& image, const std::string& path, const double background[3],
                       int level = 6);

/// What write_preview_png() writes, as read_image() reads it back: R G B, codes over 255.
Image preview_of(const Image& image, const double background[3]);

/// EXR, PNG and whatever else OpenImageIO opens by its extension.  Floats as stored, 8-bit codes as 0 to 1
/// without decoding; UINT channels of EXR as words.  Channels come in the order of the reader: find them by
/// name.  One picture a file: a second part of an EXR is refused.  Throws InputError.
Image read_image(const std::string& path, Attributes* attributes = nullptr);

}  // namespace squint
