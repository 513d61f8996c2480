#include "core/read_whole.h"

#include "core/error.h"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <system_error>

namespace squint {

std::string read_whole(const std::string& path, std::string_view allowed, std::size_t most) {
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    std::string bytes;
    std::array<char, 1 << 16> piece;
    while (file && bytes.size() <= most) {
        file.read(piece.data(), piece.size());
        bytes.append(piece.data(), static_cast<std::size_t>(file.gcount()));
    }
    if (!file.is_open() || file.bad())
        throw InputError(fmt::format("{}: cannot read: {}; allowed: {}", path,
                                     errno != 0 ? std::generic_category().message(errno) : "unknown reason",
                                     allowed));
    if (bytes.size() > most)
        throw InputError(
            fmt::format("{}: found more than {} bytes; allowed: {} of at most so many", path, most, allowed));
    return bytes;
}

}  // namespace squint
