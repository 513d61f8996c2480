// Pictures for reports: few pixels, exact to 16 bits.
#include "core/error.h"
#include "studies/sweep/evaluate.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace squint::sweep {
namespace {

constexpr const char* kNames[] = {"R", "G", "B", "A"};

std::uint16_t word_of(float value) {
    return static_cast<std::uint16_t>(std::clamp(value, 0.0f, 1.0f) * 65535.0f + 0.5f);
}

}  // namespace

std::string values_file(const Image& image, int most, int level) {
    const int longest = std::max(image.width, image.height);
    const int stride = std::max(1, (longest + most - 1) / most);
    const int width = (image.width + stride - 1) / stride, height = (image.height + stride - 1) / stride;
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    std::string planes(pixels * 8, '\0');
    std::size_t at = 0;
    for (const char* name : kNames) {
        const Channel& channel = *image.find(name);
        for (int y = 0; y < height; ++y) {
            std::uint16_t left = 0;
            for (int x = 0; x < width; ++x, ++at) {
                const auto from =
                    static_cast<std::size_t>(y * stride) * static_cast<std::size_t>(image.width) +
                    static_cast<std::size_t>(x * stride);
                const std::uint16_t word = word_of(channel.values[from]);
                const auto change = static_cast<std::uint16_t>(word - left);
                planes[at] = static_cast<char>(change & 255);
                planes[at + 4 * pixels] = static_cast<char>(change >> 8);
                left = word;
            }
        }
    }
    uLongf size = compressBound(planes.size());
    std::string packed(size, '\0');
    const int status = compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                                 reinterpret_cast<const Bytef*>(planes.data()), planes.size(), level);
    if (status != Z_OK) throw std::bad_alloc();
    packed.resize(size);
    return fmt::format("squint.values/1 {} {} {}\n", width, height, stride) + packed;
}

Image read_values(const std::string& bytes) {
    int width = 0, height = 0, stride = 0;
    const std::size_t line = bytes.find('\n');
    if (line == std::string::npos || line > 80 ||
        std::sscanf(bytes.substr(0, line).c_str(), "squint.values/1 %d %d %d", &width, &height, &stride) !=
            3 ||
        width < 1 || height < 1 || width > 4096 || height > 4096)
        throw InputError("values file: damaged; allowed: what squint sweep writes");
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    std::string planes(pixels * 8, '\0');
    uLongf size = planes.size();
    if (uncompress(reinterpret_cast<Bytef*>(planes.data()), &size,
                   reinterpret_cast<const Bytef*>(bytes.data() + line + 1),
                   bytes.size() - line - 1) != Z_OK ||
        size != planes.size())
        throw InputError("values file: damaged; allowed: what squint sweep writes");
    Image image{width, height, {}};
    std::size_t at = 0;
    for (const char* name : kNames) {
        std::vector<float>& values = image.add_float(name).values;
        for (std::size_t i = 0; i < pixels; ++i, ++at) {
            const unsigned change = static_cast<unsigned char>(planes[at]) |
                                    static_cast<unsigned>(static_cast<unsigned char>(planes[at + 4 * pixels]))
                                        << 8;
            const unsigned left = i % static_cast<std::size_t>(width)
                                      ? static_cast<unsigned>(values[i - 1] * 65535.0f + 0.5f)
                                      : 0;
            values[i] = static_cast<float>((left + change) & 0xffff) / 65535.0f;
        }
    }
    return image;
}

}  // namespace squint::sweep
