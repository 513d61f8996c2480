// Texts from files and command lines in messages: one line of ASCII, so that no byte of theirs reaches a terminal.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace squint {

/// The code point that starts at `i` in UTF-8, moving `i` past it; U+FFFD for a byte that starts none.
char32_t next_code_point(std::string_view text, std::size_t& i);

/// UTF-8 of a code point.
std::string utf8_of(char32_t code);

/// Printable ASCII as it is, other characters as \u00FC, control characters and bytes of no character as ?.
std::string printable(std::string_view text);

/// The same, at most `most` characters: a longer text keeps its beginning.
std::string excerpt(std::string_view text, std::size_t most = 60);

/// A message of at most two lines of a terminal: a longer one keeps its beginning and its end, for where it was
/// and what is allowed stand there.
std::string message_text(std::string_view text);

}  // namespace squint
