#include "core/image.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/exr_header.h"
#include "core/pictures/pictures.h"
#include "core/preview.h"
#include "core/srgb.h"
#include "core/volume_data.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>

namespace squint {
namespace {

constexpr const char* kNoTime =
    "1970:01:01 00:00:00";  // OpenImageIO adds the present time where none is given

std::size_t pixels(const Image& image) {
    return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
}

Channel& add(Image& image, std::string name) {
    return image.channels.emplace_back(Channel{std::move(name), {}, {}});
}

/// Writes bytes whole or not at all.
void write(const pictures::Packed& picture, const std::string& path) {
    write_text_whole(path, pictures::codec().encode(picture, path));
}

/// The caller promises one value a pixel in every channel, and at least one pixel; checked here, because a
/// file would show it otherwise.
void check_shape(const Image& image, const std::string& path) {
    if (image.width < 1 || image.height < 1 || image.channels.empty())
        throw InputError(fmt::format("{}: {} x {} pixels of {} channels, allowed is 1 or more of each", path,
                                     image.width, image.height, image.channels.size()));
    for (const Channel& channel : image.channels)
        if ((channel.is_words() ? channel.words.size() : channel.values.size()) != pixels(image))
            throw InputError(fmt::format("{}: channel {} has not {} x {} values", path, channel.name,
                                         image.width, image.height));
}

/// The 8-bit sRGB code of linear light, rounded to nearest: the number of codes whose lower edge it reaches.
/// NaN gives 0.
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
    static constexpr int kBuckets = 1024;  // over [0, 1]: each holds a few edges at most
    std::array<double, 255> edge_{};
    std::array<std::uint8_t, kBuckets + 1> first_{};  // the code at a bucket's lower end
};

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
    pictures::Packed packed_picture{"openexr", image.width, image.height, {}, nullptr, attributes, {}};
    for (const Channel& channel : image.channels)
        packed_picture.channels.push_back(
            {channel.name, channel.is_words() ? pictures::Packed::Type::u32 : pictures::Packed::Type::f32});
    packed_picture.text["compression"] = "zip";
    packed_picture.text["DateTime"] = kNoTime;

    // Floats and words are both 32 bits: one packed array holds either.
    std::vector<std::uint32_t> packed(pixels(image) * count);
    for (std::size_t c = 0; c < count; ++c) {
        const Channel& channel = image.channels[c];
        for (std::size_t i = 0; i < pixels(image); ++i)
            packed[i * count + c] =
                channel.is_words() ? channel.words[i] : std::bit_cast<std::uint32_t>(channel.values[i]);
    }
    packed_picture.data = packed.data();
    write(packed_picture, path);
}

namespace {
/// R G B side by side, 8-bit sRGB.
std::vector<std::uint8_t> preview_codes(const Image& image, const std::string& path,
                                        const double background[3]) {
    static const Encoder encode_8bit;
    check_shape(image, path);
    const Channel* alpha = image.find("A");
    if (alpha && alpha->is_words()) alpha = nullptr;
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
    return packed;
}
}  // namespace

Image preview_of(const Image& image, const double background[3]) {
    const std::vector<std::uint8_t> codes = preview_codes(image, "preview", background);
    Image shown{image.width, image.height, {}, image.left, image.top, true};
    for (std::size_t c = 0; c < 3; ++c) {
        Channel& channel = shown.add_float(std::string(1, "RGB"[c]));
        for (std::size_t i = 0; i < channel.values.size(); ++i)
            channel.values[i] = static_cast<float>(codes[i * 3 + c]) * (1.0F / 255);
    }
    return shown;
}

namespace {
/// Encodes an image in a format of OpenImageIO, with one setting of its encoder.
void write_8bit(const char* format, const std::pair<std::string, int>& setting, const Image& image,
                const std::string& path, const double background[3]) {
    const std::vector<std::uint8_t> packed = preview_codes(image, path, background);
    constexpr auto kByte = pictures::Packed::Type::u8;
    write({format,
           image.width,
           image.height,
           {{"R", kByte}, {"G", kByte}, {"B", kByte}},
           packed.data(),
           {{"oiio:ColorSpace", "sRGB"}},
           {setting}},
          path);
}
}  // namespace

void write_preview_png(const Image& image, const std::string& path, const double background[3], int level) {
    write_8bit("png", {"png:compressionLevel", level}, image, path, background);
}

void write_preview(const Image& image, const std::string& path, const double background[3]) {
    constexpr int kQuality = 95;
    if (path.ends_with(".jpg") || path.ends_with(".jpeg"))
        return write_8bit("jpeg", {"CompressionQuality", kQuality}, image, path, background);
    write_preview_png(image, path, background);
}

Image read_image(const std::string& path, Attributes* attributes) {
    std::error_code ignored;
    if (path.ends_with(".exr") && std::filesystem::is_regular_file(path, ignored)) {
        const MappedFile file = map_file(path);
        check_exr_header(file.bytes.get(), file.size, path);
    }
    return pictures::codec().read(path, attributes);
}

const pictures::Codec& pictures::codec() {
    // Searched where the run path of the program or the library says; stays loaded until the process ends.
    static const Codec& loaded = []() -> const Codec& {
        void* const module = dlopen(kFile, RTLD_LAZY | RTLD_LOCAL);
        void* const symbol = module ? dlsym(module, kSymbol) : nullptr;
        if (!symbol) throw InputError(fmt::format("pictures cannot be read or written: {}", dlerror()));
        return *reinterpret_cast<const Codec* (*)()>(symbol)();
    }();
    return loaded;
}

}  // namespace squint
