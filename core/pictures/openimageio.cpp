// The module libsquint_pictures.so: OpenImageIO behind core/pictures/pictures.h.
#include "core/error.h"
#include "core/pictures/pictures.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <new>

namespace squint::pictures {
namespace {

constexpr std::uint64_t kMostValues = std::uint64_t{1}
                                      << 31;  // width * height * channels of a file we agree to read
constexpr std::uint64_t kMostUnasked = std::uint64_t{1} << 22;  // as many without checking the file's size
constexpr std::uint64_t kMostValuesPerByte = 1032;              // deflate makes at most so many

/// The library's messages, joined into one line.
std::string one_line(std::string text) {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
    for (char& c : text)
        if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) > 0x7e) c = ' ';
    return text;
}

/// OpenImageIO's name for files of this extension; empty if it knows none.
std::string format_of(const std::string& path) {
    std::string extension = std::filesystem::path(path).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension.size() < 2) return "";
    for (const auto& [format, extensions] : OIIO::get_extension_map())
        if (std::find(extensions.begin(), extensions.end(), extension.substr(1)) != extensions.end())
            return format;
    return "";
}

OIIO::TypeDesc type_of(Packed::Type type) {
    switch (type) {
        case Packed::Type::u8:
            return OIIO::TypeDesc::UINT8;
        case Packed::Type::u32:
            return OIIO::TypeDesc::UINT32;
        case Packed::Type::f32:
            break;
    }
    return OIIO::TypeDesc::FLOAT;
}

/// Encodes in memory, because OpenImageIO's PNG writer does not notice a full disk.
std::string encode(const Packed& picture, const std::string& path) {
    OIIO::ImageSpec spec(picture.width, picture.height, static_cast<int>(picture.channels.size()),
                         type_of(picture.channels.front().type));
    spec.channelnames.clear();
    for (const Packed::PackedChannel& channel : picture.channels) {
        spec.channelnames.push_back(channel.name);
        spec.channelformats.push_back(type_of(channel.type));
    }
    for (const auto& [name, value] : picture.text) spec.attribute(name, value);
    for (const auto& [name, value] : picture.settings) spec.attribute(name, value);

    OIIO::Filesystem::IOVecOutput encoded;
    const auto output = OIIO::ImageOutput::create(picture.format);
    if (!output || !output->set_ioproxy(&encoded))
        throw InputError(
            fmt::format("{}: cannot write: OpenImageIO has no writer for {}", path, picture.format));
    // UNKNOWN: each channel keeps its type
    if (!output->open(path, spec) || !output->write_image(OIIO::TypeDesc::UNKNOWN, picture.data) ||
        !output->close())
        throw InputError(fmt::format("{}: cannot write: {}", path, one_line(output->geterror())));
    const auto& bytes = encoded.buffer();
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::unique_ptr<OIIO::ImageInput> open(const std::string& path) {
    std::error_code why;
    if (is_directory(std::filesystem::status(path, why)))
        why = std::make_error_code(std::errc::is_a_directory);
    if (why) throw InputError(fmt::format("{}: cannot read: {}", path, why.message()));
    const std::string format = format_of(path);
    if (format.empty())
        throw InputError(fmt::format(
            "{}: extension \"{}\" names no image format, allowed are .exr, .png and what OpenImageIO reads",
            path, std::filesystem::path(path).extension().string()));
    auto input = OIIO::ImageInput::create(format);
    OIIO::ImageSpec spec;
    if (!input)
        throw InputError(fmt::format("{}: cannot read: OpenImageIO has no reader for {}", path, format));
    if (!input->open(path, spec))
        throw InputError(fmt::format("{}: cannot read: {}", path, one_line(input->geterror())));
    return input;
}

/// Refuses what a header claims before memory is allocated for it.
void check_spec(const OIIO::ImageSpec& spec, const std::string& path) {
    std::error_code ignored;
    if (spec.deep || spec.depth > 1) throw InputError(path + ": deep or volume image, allowed is a flat one");
    if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1)
        throw InputError(fmt::format("{}: {} x {} pixels of {} channels, allowed is 1 or more of each", path,
                                     spec.width, spec.height, spec.nchannels));
    const std::uint64_t values =
        static_cast<std::uint64_t>(spec.width) * static_cast<std::uint64_t>(spec.height);
    if (values > kMostValues / static_cast<std::uint64_t>(spec.nchannels))
        throw InputError(fmt::format("{}: {} x {} pixels of {} channels, allowed is {} values", path,
                                     spec.width, spec.height, spec.nchannels, kMostValues));
    const std::uint64_t claimed = values * static_cast<std::uint64_t>(spec.nchannels);
    const std::uint64_t bytes = std::filesystem::file_size(path, ignored);
    if (claimed > kMostUnasked && claimed / kMostValuesPerByte > bytes)
        throw InputError(fmt::format("{}: {} bytes cannot hold {} x {} pixels of {} channels", path, bytes,
                                     spec.width, spec.height, spec.nchannels));
}

Image read(const std::string& path, Attributes* attributes) {
    const auto input = open(path);
    const OIIO::ImageSpec spec = input->spec();
    check_spec(spec, path);
    if (input->seek_subimage(1, 0))
        throw InputError(fmt::format("{}: holds several pictures (parts of an EXR), allowed is one", path));
    (void)input->geterror();  // that there is no other
    if (!input->seek_subimage(0, 0))
        throw InputError(fmt::format("{}: cannot read: {}", path, one_line(input->geterror())));
    Image image;
    image.width = spec.width, image.height = spec.height;
    image.left = spec.x, image.top = spec.y;
    image.is_display = spec.format == OIIO::TypeDesc::UINT8;
    try {
        for (int c = 0; c < spec.nchannels; ++c) {
            const bool words =
                spec.channelformat(c) == OIIO::TypeDesc::UINT32;  // else OpenImageIO would divide by 2^32 - 1
            Channel& channel = image.channels.emplace_back(Channel{spec.channel_name(c), {}, {}});
            const std::size_t pixels =
                static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height);
            words ? channel.words.resize(pixels) : channel.values.resize(pixels);
            void* data = words ? static_cast<void*>(channel.words.data()) : channel.values.data();
            if (!input->read_image(0, 0, c, c + 1, words ? OIIO::TypeDesc::UINT32 : OIIO::TypeDesc::FLOAT,
                                   data))
                throw InputError(fmt::format("{}: cannot read: {}", path, one_line(input->geterror())));
        }
    } catch (const std::bad_alloc&) {
        throw InputError(
            fmt::format("{}: {} x {} pixels do not fit into memory", path, spec.width, spec.height));
    }
    if (attributes)
        for (const auto& parameter : spec.extra_attribs)
            if (parameter.type() == OIIO::TypeDesc::STRING)
                (*attributes)[parameter.name().string()] = parameter.get_string();
    return image;
}

constexpr std::pair<OIIO::TypeDesc::BASETYPE, Page::Type> kPageTypes[] = {
    {OIIO::TypeDesc::UINT8, Page::Type::u8},   {OIIO::TypeDesc::INT8, Page::Type::i8},
    {OIIO::TypeDesc::UINT16, Page::Type::u16}, {OIIO::TypeDesc::INT16, Page::Type::i16},
    {OIIO::TypeDesc::UINT32, Page::Type::u32}, {OIIO::TypeDesc::INT32, Page::Type::i32},
    {OIIO::TypeDesc::FLOAT, Page::Type::f32},  {OIIO::TypeDesc::DOUBLE, Page::Type::f64},
};

int count_pages(const std::string& path) {
    constexpr int kMost = 65536;
    const auto input = open(path);
    int pages = 1;
    while (pages < kMost && input->seek_subimage(pages, 0)) ++pages;
    (void)input->geterror();  // that there is no other
    return pages;
}

Page read_page(const std::string& path, int page) {
    const auto input = open(path);
    if (!input->seek_subimage(page, 0))
        throw InputError(fmt::format("{}: cannot read page {}: {}", path, page, one_line(input->geterror())));
    const OIIO::ImageSpec spec = input->spec();
    check_spec(spec, path);
    const auto* type = std::find_if(std::begin(kPageTypes), std::end(kPageTypes),
                                    [&](const auto& known) { return known.first == spec.format.basetype; });
    if (type == std::end(kPageTypes) || !spec.channelformats.empty())
        throw InputError(fmt::format("{}: its pixels are {}, but integers and floats of one type are allowed",
                                     path, spec.format.c_str()));
    Page read{spec.width, spec.height, spec.nchannels, type->second, {}};
    read.bytes.resize(spec.image_bytes());
    if (!input->read_image(page, 0, 0, spec.nchannels, spec.format, read.bytes.data()))
        throw InputError(fmt::format("{}: cannot read: {}", path, one_line(input->geterror())));
    return read;
}

}  // namespace
}  // namespace squint::pictures

extern "C" __attribute__((visibility("default"))) const squint::pictures::Codec* squint_picture_codec() {
    using namespace squint::pictures;
    static const Codec codec{OIIO::openimageio_version(), encode, read, count_pages, read_page};
    return &codec;
}
