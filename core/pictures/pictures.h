// Reads and writes picture files in a module, loaded with the first picture: OpenImageIO brings 250
// libraries, which cost a quarter of a second and 100 MB at every start.
#pragma once

#include "core/image.h"

#include <string>
#include <vector>

namespace squint::pictures {

/// A picture as it goes into a file.
struct Packed {
    enum class Type { u8, u32, f32 };
    struct PackedChannel {
        std::string name;
        Type type;
    };
    const char* format;  // OpenImageIO's name: "openexr", "png"
    int width, height;
    std::vector<PackedChannel> channels;
    const void* data;                                   // [row, column, channel], without gaps
    Attributes text;                                    // stored in the file
    std::vector<std::pair<std::string, int>> settings;  // of its encoder
};

/// One picture of a file as it is stored.
struct Page {
    enum class Type { u8, i8, u16, i16, u32, i32, f32, f64 };
    int width = 0, height = 0, channels = 0;
    Type type = Type::u8;
    std::vector<unsigned char> bytes;  // [row, column, channel], in this machine's order
};

/// The functions of the module.  They throw InputError, beginning with `path`.
struct Codec {
    int version;                                                            // of OpenImageIO: 20407 is 2.4.7
    std::string (*encode)(const Packed& picture, const std::string& path);  // -> the file's bytes
    Image (*read)(const std::string& path, Attributes* attributes);
    int (*count_pages)(const std::string& path);
    Page (*read_page)(const std::string& path,
                      int page);  // counted from 0; codes, neither scaled nor decoded
};

/// Loads the module on the first call: from beside the program in the build tree, or from an installation's
/// library folder.  Throws InputError if it is not there.
const Codec& codec();

/// The only symbol of the module: a function `const Codec* squint_picture_codec()`.
inline constexpr const char* kFile = "libsquint_pictures.so";
inline constexpr const char* kSymbol = "squint_picture_codec";

}  // namespace squint::pictures
