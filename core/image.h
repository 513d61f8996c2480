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
    int left = 0, top = 0;    // position of the first pixel: the data window of an EXR that was read
    bool is_display = false;  // holds display codes, as read from an 8-bit file

    Channel* find(const std::string& name);
    const Channel* find(const std::string& name) const;
    Channel& add_float(std::string name);  // zeros
    Channel& add_words(std::string name);
};

/// Strings alone: OpenImageIO silently drops arrays of integers.
using Attributes = std::map<std::string, std::string>;

/// Writes an OpenEXR file, whole or not at all (write_whole).  It holds no time, host or
/// path.
void write_exr(const Image& image, const std::string& path, const Attributes& attributes);

/// Composites R G B A (premultiplied, linear) over `background` (linear) and writes an 8-bit sRGB PNG, whole
/// or not at all.  `level`: 1 compresses quickly, 9 to the smallest file.
void write_preview_png(const Image& image, const std::string& path, const double background[3],
                       int level = 6);

/// The picture of write_preview_png(), as read_image() would read it: R G B, codes over 255.
Image preview_of(const Image& image, const double background[3]);

/// Reads EXR, PNG and every other format that OpenImageIO opens by its extension.  Floats stay as stored,
/// 8-bit codes become 0 to 1 undecoded, UINT channels of EXR become words.  Find channels by name: the order
/// is the reader's.  Throws InputError; an EXR of several parts is refused.
Image read_image(const std::string& path, Attributes* attributes = nullptr);

}  // namespace squint
