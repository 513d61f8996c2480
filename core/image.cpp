#include "core/image.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/srgb.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <memory>
#include <new>
#include <span>

namespace squint {
namespace {

constexpr std::uint64_t kMostValues = std::uint64_t{1}
                                      << 31;  // width * height * channels of a file we agree to read
constexpr std::uint64_t kMostUnasked = std::uint64_t{1} << 26;  // as many without a look at the file's size
constexpr std::uint64_t kMostValuesPerByte = 4096;              // deflate reaches 1,032 bytes a byte
constexpr const char* kNoTime =
    "1970:01:01 00:00:00";  // OpenImageIO stamps the present time where there is none

/// Messages of the library in one line.
std::string one_line(std::string text) {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
    for (char& c : text)
        if (static_cast<unsigned char>(c) < 0x20) c = ' ';
    return text;
}

std::size_t pixels(const Image& image) {
    return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
}

Channel& add(Image& image, std::string name) {
    return image.channels.emplace_back(Channel{std::move(name), {}, {}});
}

/// The name that OpenImageIO has for the files of this extension; empty if it knows none.
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

/// Writes packed pixels of `spec` to a file of a named format, whole or not at all.  Encoded in memory first:
/// OpenImageIO's PNG writer does not notice a full disk.
void write(const std::string& path, const char* format, const OIIO::ImageSpec& spec, OIIO::TypeDesc type,
           const void* data) {
    OIIO::Filesystem::IOVecOutput encoded;
    const auto output = OIIO::ImageOutput::create(format);
    if (!output || !output->set_ioproxy(&encoded))
        throw InputError(fmt::format("{}: cannot write, OpenImageIO has no writer for {}", path, format));
    if (!output->open(path, spec) || !output->write_image(type, data) || !output->close())
        throw InputError(fmt::format("{}: cannot write: {}", path, one_line(output->geterror())));
    const auto& bytes = encoded.buffer();
    write_text_whole(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

/// Every channel holds one value a pixel, and there is a pixel: promises of the caller, checked where a file
/// would tell.
void check_shape(const Image& image, const std::string& path) {
    if (image.width < 1 || image.height < 1 || image.channels.empty())
        throw InputError(fmt::format("{}: {} x {} pixels of {} channels, allowed is 1 or more of each", path,
                                     image.width, image.height, image.channels.size()));
    for (const Channel& channel : image.channels)
        if ((channel.is_words() ? channel.words.size() : channel.values.size()) != pixels(image))
            throw InputError(fmt::format("{}: channel {} has not {} x {} values", path, channel.name,
                                         image.width, image.height));
}

/// 8-bit sRGB of linear light, half a step rounded up: the number of codes whose lower edge is reached.  NaN
/// is black.
class Encoder {
  public:
    Encoder() {
        for (std::size_t i = 0; i < edge_.size(); ++i)
            edge_[i] = linear_from_srgb((static_cast<double>(i) + 0.5) / 255);
        for (std::size_t i = 0; i < first_.size(); ++i)
            first_[i] = static_cast<std::uint8_t>(
                std::upper_bound(edge_.begin(), edge_.end(), static_cast<double>(i) / kBuckets) -
                edge_.begin());
    }
    std::uint8_t operator()(double linear) const {
        if (!(linear > 0)) return 0;
        std::size_t code = first_[static_cast<std::size_t>(std::min(linear, 1.0) * kBuckets)];
        while (code < edge_.size() && linear >= edge_[code]) ++code;
        return static_cast<std::uint8_t>(code);
    }

  private:
    static constexpr int kBuckets = 1024;  // of [0, 1]: at most a few edges in each
    std::array<double, 255> edge_{};
    std::array<std::uint8_t, kBuckets + 1> first_{};  // code at a bucket's lower end
};

std::unique_ptr<OIIO::ImageInput> open(const std::string& path) {
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored))
        throw InputError(path + ": cannot read, there is no such file");
    if (std::filesystem::is_directory(path, ignored))
        throw InputError(path + ": cannot read, it is a folder");
    const std::string format = format_of(path);
    if (format.empty())
        throw InputError(fmt::format(
            "{}: extension \"{}\" names no image format, allowed are .exr, .png and what OpenImageIO reads",
            path, std::filesystem::path(path).extension().string()));
    auto input = OIIO::ImageInput::create(format);
    OIIO::ImageSpec spec;
    if (!input)
        throw InputError(fmt::format("{}: cannot read, OpenImageIO has no reader for {}", path, format));
    if (!input->open(path, spec))
        throw InputError(fmt::format("{}: cannot read: {}", path, one_line(input->geterror())));
    return input;
}

/// Refuses what a header claims before memory is asked for.
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

}  // namespace

Channel* Image::find(const std::string& name) {
    const auto found =
        std::find_if(channels.begin(), channels.end(), [&](const Channel& c) { return c.name == name; });
    return found == channels.end() ? nullptr : &*found;
}
const Channel* Image::find(const std::string& name) const {
    return const_cast<Image*>(this)->find(name);
}

Channel& Image::add_float(std::string name) {
    Channel& channel = add(*this, std::move(name));
    channel.values.resize(pixels(*this));
    return channel;
}
Channel& Image::add_words(std::string name) {
    Channel& channel = add(*this, std::move(name));
    channel.words.resize(pixels(*this));
    return channel;
}

void write_exr(const Image& image, const std::string& path, const Attributes& attributes) {
    check_shape(image, path);
    const std::size_t count = image.channels.size();
    OIIO::ImageSpec spec(image.width, image.height, static_cast<int>(count), OIIO::TypeDesc::FLOAT);
    spec.channelnames.clear();
    for (const Channel& channel : image.channels) {
        spec.channelnames.push_back(channel.name);
        spec.channelformats.push_back(channel.is_words() ? OIIO::TypeDesc::UINT32 : OIIO::TypeDesc::FLOAT);
    }
    for (const auto& [name, value] : attributes) spec.attribute(name, value);
    spec.attribute("compression", "zip");
    spec.attribute("DateTime", kNoTime);

    // Floats and words are both 32 bits: one packed array holds either.
    std::vector<std::uint32_t> packed(pixels(image) * count);
    for (std::size_t c = 0; c < count; ++c) {
        const Channel& channel = image.channels[c];
        for (std::size_t i = 0; i < pixels(image); ++i)
            packed[i * count + c] =
                channel.is_words() ? channel.words[i] : std::bit_cast<std::uint32_t>(channel.values[i]);
    }
    write(path, "openexr", spec, OIIO::TypeDesc::UNKNOWN,
          packed.data());  // UNKNOWN: each channel in its own type
}

void write_preview_png(const Image& image, const std::string& path, const double background[3], int level) {
    static const Encoder encode_8bit;
    check_shape(image, path);
    const Channel* alpha = image.find("A");
    std::vector<std::uint8_t> packed(pixels(image) * 3);
    for (std::size_t c = 0; c < 3; ++c) {
        const Channel* color = image.find(std::string(1, "RGB"[c]));
        if (!color || color->is_words())
            throw InputError(fmt::format("{}: no channel {} of floats to show", path, "RGB"[c]));
        for (std::size_t i = 0; i < pixels(image); ++i) {
            const double clear = alpha ? 1 - static_cast<double>(alpha->values[i]) : 0;
            packed[i * 3 + c] = encode_8bit(static_cast<double>(color->values[i]) + clear * background[c]);
        }
    }
    OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:ColorSpace", "sRGB");
    spec.attribute("png:compressionLevel", level);
    write(path, "png", spec, OIIO::TypeDesc::UINT8, packed.data());
}

Image read_image(const std::string& path, Attributes* attributes) {
    const auto input = open(path);
    const OIIO::ImageSpec spec = input->spec();
    check_spec(spec, path);
    Image image;
    image.width = spec.width, image.height = spec.height;
    try {
        for (int c = 0; c < spec.nchannels; ++c) {
            const bool words =
                spec.channelformat(c) == OIIO::TypeDesc::UINT32;  // else OpenImageIO would divide by 2^32 - 1
            Channel& channel =
                words ? image.add_words(spec.channel_name(c)) : image.add_float(spec.channel_name(c));
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

}  // namespace squint
