// TOML text -> a tree of plain values that remember where they stood.  toml.cpp is the only file that
// includes toml++.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace squint {

struct TomlValue {
    enum class Kind { string, integer, number, boolean, date, list, table };
    Kind kind = Kind::table;
    std::string text;  // of a string or a date
    std::int64_t integer = 0;
    double number = 0;  // of a number or an integer
    bool flag = false;
    std::vector<TomlValue>
        items;        // of a list; of a table: its entries in the order of the text, each with a key
    std::string key;  // of an entry of a table
    int key_line = 0, key_column = 0;
    int line = 0, column = 0;  // from 1; 0 where there is no place, as for the whole text

    const TomlValue* find(std::string_view name) const;  // entry of a table, or null
};

/// Parses a whole text in UTF-8.  Refuses control characters but tabs and line breaks.  Columns count characters.
/// Throws InputError `name:line:column: ...`.
TomlValue parse_toml(std::string_view text, const std::string& name);

/// Reads a file of at most 16 MiB and parses it.
TomlValue read_toml(const std::string& path);

/// TOML for a value, on one line and in ASCII; reads back as the same value.
std::string toml_text(double value);
std::string toml_text(bool value);
std::string toml_text(std::int64_t value);
std::string toml_text(std::string_view value);
std::string toml_text(const TomlValue& value);

/// A value for messages: short, on one line.
std::string described(const TomlValue& value);
/// A text for messages: in quotes, short, on one line, in ASCII.
std::string in_quotes(std::string_view text);

/// The candidate that `name` is most likely a slip of the keyboard for; empty if none is near.
std::string_view nearest_name(std::string_view name, const std::vector<std::string_view>& candidates);
/// "a, b or c".
std::string listed(const std::vector<std::string_view>& names);

}  // namespace squint
