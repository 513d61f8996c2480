// An output file appears whole or not at all, also after Ctrl-C.
#pragma once

#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>

namespace squint {

/// Calls `write(temporary_path)` (the temporary keeps the extension), then syncs it and renames it to `path`.  On any
/// failure, or when the process is interrupted (remove_temporaries), the temporary is removed.  Throws
/// InputError naming `path` and the reason.
void write_whole(const std::string& path, const std::function<void(const std::string&)>& write);
void write_text_whole(const std::string& path, std::string_view text);
void write_parts_whole(const std::string& path,
                       std::initializer_list<std::string_view> parts);  // one after the other

/// Async-signal-safe: removes every temporary now being written.  For a signal handler.
void remove_temporaries() noexcept;

}  // namespace squint
