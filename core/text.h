// Makes text from files and command lines safe for messages: one line of ASCII, no raw bytes for a terminal.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace squint {

/// The code point that starts at `i` in UTF-8, moving `i` past it; U+FFFD for a byte that starts none.
char32_t next_code_point(std::string_view text, std::size_t& i);

/// A code point as UTF-8.
std::string utf8_of(char32_t code);

/// Keeps printable ASCII; other characters become \u00FC, control characters and invalid bytes become ?.
std::string printable(std::string_view text);

/// The same, cut to at most `most` characters: a longer text keeps its beginning.
std::string excerpt(std::string_view text, std::size_t most = 60);

/// Cuts a message to two lines of a terminal.  A longer one keeps its beginning, which says where it was, and
/// its end, which says what is allowed.
std::string message_text(std::string_view text);

}  // namespace squint
