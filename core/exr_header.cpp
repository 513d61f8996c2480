#include "core/exr_header.h"

#include "core/error.h"
#include "core/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <string_view>

namespace squint {
namespace {

constexpr std::uint32_t kMagic = 20000630;
constexpr std::uint32_t kMultiPart = 0x1000;        // a bit of the version field
constexpr std::uint64_t kMostPixelsPerByte = 1032;  // deflate makes at most 1032 bytes of one
constexpr std::uint64_t kFewPixels = 1 << 22;       // that any file may claim
constexpr std::uint64_t kMostLinesPerChunk =
    256;  // of every compression; each chunk has an offset of 8 bytes
constexpr std::uint64_t kFewLines = 1 << 16;

/// Bytes of an attribute's value.  OpenEXR reads so many, whatever length the file gives, and then takes what follows
/// for the next attribute.
struct FixedType {
    std::string_view name;
    std::uint64_t bytes;
};
constexpr FixedType kFixedTypes[] = {{"box2i", 16},
                                     {"box2f", 16},
                                     {"chromaticities", 32},
                                     {"compression", 1},
                                     {"deepImageState", 1},
                                     {"double", 8},
                                     {"envmap", 1},
                                     {"float", 4},
                                     {"int", 4},
                                     {"keycode", 28},
                                     {"lineOrder", 1},
                                     {"m33d", 72},
                                     {"m33f", 36},
                                     {"m44d", 128},
                                     {"m44f", 64},
                                     {"rational", 8},
                                     {"tiledesc", 9},
                                     {"timecode", 8},
                                     {"v2d", 16},
                                     {"v2f", 8},
                                     {"v2i", 8},
                                     {"v3d", 24},
                                     {"v3f", 12},
                                     {"v3i", 12}};

class Header {
  public:
    Header(const unsigned char* bytes, std::size_t size, const std::string& path)
        : bytes_(bytes), size_(size), path_(path) {}

    void check() {
        if (size_ < 8 || number(0) != kMagic) return;
        const bool several = (number(4) & kMultiPart) != 0;
        at_ = 8;
        check_part();
        if (several && at_ < size_ && bytes_[at_] != 0)
            throw InputError(
                fmt::format("{}: holds several pictures (parts of an EXR), allowed is one", path_));
    }

  private:
    [[noreturn]] void refuse(const std::string& what) const {
        throw InputError(fmt::format("{}: cannot read: the EXR header is damaged: {}", path_, what));
    }
    std::uint32_t number(std::size_t at) const {
        std::uint32_t value;
        std::memcpy(&value, bytes_ + at, sizeof value);
        return value;
    }
    std::string_view name() {
        const void* end = std::memchr(bytes_ + at_, 0, size_ - at_);
        if (!end) refuse("it has no end");
        const auto* begin = reinterpret_cast<const char*>(bytes_ + at_);
        const std::string_view text(
            begin, static_cast<std::size_t>(static_cast<const unsigned char*>(end) - bytes_) - at_);
        at_ += text.size() + 1;
        return text;
    }

    void check_part() {
        while (at_ < size_ && bytes_[at_] != 0) check_attribute();
        if (at_ >= size_) refuse("it has no end");
        ++at_;
    }
    void check_attribute() {
        const std::string_view attribute = name(), type = name();
        if (size_ - at_ < 4) refuse("it has no end");
        const std::uint64_t length = number(at_);
        at_ += 4;
        if (length > size_ - at_)
            refuse(fmt::format("attribute \"{}\" claims {} bytes, {} are left", excerpt(attribute), length,
                               size_ - at_));
        check_length(attribute, type, length);
        if (attribute == "dataWindow" && length == 16) check_window();
        if (attribute == "tiles" && length >= 8) check_pixels("tile", number(at_), number(at_ + 4));
        at_ += length;
    }
    /// An attribute's value ends where its length says.
    void check_length(std::string_view attribute, std::string_view type, std::uint64_t length) const {
        const auto* fixed = std::find_if(std::begin(kFixedTypes), std::end(kFixedTypes),
                                         [&](const FixedType& f) { return f.name == type; });
        if (fixed != std::end(kFixedTypes) && length != fixed->bytes)
            refuse(fmt::format("attribute \"{}\" has {} bytes, but its type, {}, has {}", excerpt(attribute),
                               length, type, fixed->bytes));
        const bool ends = type == "chlist"         ? channels_end(at_ + length)
                          : type == "stringvector" ? strings_end(at_ + length)
                          : type == "floatvector"  ? length % sizeof(float) == 0
                          : type == "preview"      ? preview_ends(length)
                                                   : true;
        if (!ends)
            refuse(fmt::format("attribute \"{}\", of type {}, does not end after its {} bytes",
                               excerpt(attribute), type, length));
    }
    /// A name, which zero ends, and 16 bytes each, up to an empty name.
    bool channels_end(std::size_t end) const {
        for (std::size_t at = at_; at < end;) {
            const void* zero = std::memchr(bytes_ + at, 0, end - at);
            if (!zero) return false;
            const auto next = static_cast<std::size_t>(static_cast<const unsigned char*>(zero) - bytes_) + 1;
            if (next == at + 1) return next == end;
            at = next + 16;
        }
        return false;
    }
    /// A length and so many bytes each.
    bool strings_end(std::size_t end) const {
        std::size_t at = at_;
        while (end - at >= 4) {
            const std::uint64_t length = number(at);
            at += 4;
            if (length > end - at) return false;
            at += length;
        }
        return at == end;
    }
    bool preview_ends(std::uint64_t length) const {
        if (length < 8) return false;
        const std::uint64_t width = number(at_), height = number(at_ + 4), pixels = (length - 8) / 4;
        return (length - 8) % 4 == 0 &&
               (width == 0 ? pixels == 0 : pixels % width == 0 && pixels / width == height);
    }
    void check_window() const {
        const auto extent = [&](std::size_t axis) {
            const auto low = static_cast<std::int32_t>(number(at_ + 4 * axis)),
                       high = static_cast<std::int32_t>(number(at_ + 8 + 4 * axis));
            return high < low ? 0 : static_cast<std::uint64_t>(std::int64_t{high} - low + 1);
        };
        const std::uint64_t width = extent(0), height = extent(1);
        check_pixels("picture", width, height);
        if (height > kFewLines && height / kMostLinesPerChunk * 8 > size_)
            refuse(fmt::format("{} lines in {} bytes", height, size_));
    }
    void check_pixels(const char* of, std::uint64_t width, std::uint64_t height) const {
        if (height != 0 && width > std::max(size_ * kMostPixelsPerByte, kFewPixels) / height)
            refuse(fmt::format("a {} of {} x {} pixels in {} bytes", of, width, height, size_));
    }

    const unsigned char* bytes_;
    std::size_t size_, at_ = 0;
    const std::string& path_;
};

}  // namespace

void check_exr_header(const unsigned char* bytes, std::size_t size, const std::string& path) {
    Header(bytes, size, path).check();
}

}  // namespace squint
