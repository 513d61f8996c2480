#include "core/exr_header.h"

#include "core/error.h"
#include "core/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
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
        if (attribute == "dataWindow" && length == 16) check_window();
        if (attribute == "tiles" && length >= 8) check_pixels("tile", number(at_), number(at_ + 4));
        if (type == "preview" && length >= 8)
            if (std::uint64_t{number(at_)} * number(at_ + 4) > length / 4)
                refuse(fmt::format("its preview claims {} x {} pixels in {} bytes", number(at_),
                                   number(at_ + 4), length));
        at_ += length;
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
