#include "core/text.h"

#include <fmt/format.h>

namespace squint {

char32_t next_code_point(std::string_view text, std::size_t& i) {
    const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(text[at]); };
    const unsigned char first = byte(i++);
    const int more = first < 0x80                    ? 0
                     : first >= 0xc2 && first < 0xe0 ? 1
                     : first >= 0xe0 && first < 0xf0 ? 2
                     : first >= 0xf0 && first < 0xf5 ? 3
                                                     : -1;
    if (more < 0 || i + static_cast<std::size_t>(more) > text.size()) return 0xfffd;
    char32_t code = more == 0 ? first : first & (0x3fu >> more);
    for (int k = 0; k < more; ++k) {
        const unsigned char next = byte(i + static_cast<std::size_t>(k));
        if ((next & 0xc0u) != 0x80u) return 0xfffd;
        code = (code << 6) | (next & 0x3fu);
    }
    constexpr char32_t kLeast[] = {0, 0x80, 0x800, 0x10000};
    if (code < kLeast[more] || (code >= 0xd800 && code < 0xe000) || code > 0x10ffff) return 0xfffd;
    i += static_cast<std::size_t>(more);
    return code;
}

std::string utf8_of(char32_t code) {
    const auto tail = [&](int shift) { return static_cast<char>(0x80 | ((code >> shift) & 0x3f)); };
    if (code < 0x80) return {static_cast<char>(code)};
    if (code < 0x800) return {static_cast<char>(0xc0 | (code >> 6)), tail(0)};
    if (code < 0x10000) return {static_cast<char>(0xe0 | (code >> 12)), tail(6), tail(0)};
    return {static_cast<char>(0xf0 | (code >> 18)), tail(12), tail(6), tail(0)};
}

std::string printable(std::string_view text) {
    std::string out;
    for (std::size_t i = 0; i < text.size();) {
        const char32_t code = next_code_point(text, i);
        if (code >= 0x20 && code <= 0x7e)
            out += static_cast<char>(code);
        else if (code < 0xa0 || code == 0xfffd)
            out += '?';
        else
            out += code <= 0xffff ? fmt::format("\\u{:04X}", static_cast<unsigned>(code))
                                  : fmt::format("\\U{:08X}", static_cast<unsigned>(code));
    }
    return out;
}

std::string excerpt(std::string_view text, std::size_t most) {
    return text.size() > most ? printable(text.substr(0, most)) + "..." : printable(text);
}

std::string message_text(std::string_view text) {
    constexpr std::size_t kMost = 400, kBegin = 240;
    const std::string line = printable(text);
    if (line.size() <= kMost) return line;
    return line.substr(0, kBegin) + " ... " + line.substr(line.size() - (kMost - kBegin - 5));
}

}  // namespace squint
