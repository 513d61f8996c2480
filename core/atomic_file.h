// Writes output files so that each appears whole or not at all, also after Ctrl-C.
#pragma once

#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>

namespace squint {

/// Calls `write(temporary_path)` (the temporary keeps the extension), syncs the file and renames it to
/// `path`.  On a failure, or when the process is interrupted (remove_temporaries), removes the temporary.
/// Throws InputError naming `path` and the reason.
void write_whole(const std::string& path, const std::function<void(const std::string&)>& write);
void write_text_whole(const std::string& path, std::string_view text);
void write_parts_whole(const std::string& path,
                       std::initializer_list<std::string_view> parts);  // one after the other

/// Removes every temporary that is being written.  Async-signal-safe: for a signal handler.
void remove_temporaries() noexcept;

}  // namespace squint
