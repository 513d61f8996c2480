// Parses TOML text into a tree of plain values with their positions.  Only toml.cpp includes
// toml++.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace squint {

struct TomlValue {
    enum class Kind { string, integer, number, boolean, date, list, table };
    Kind kind = Kind::table;
    std::string text;  // of a string or date
    std::int64_t integer = 0;
    double number = 0;  // of a number or integer
    bool flag = false;
    std::vector<TomlValue> items;  // of a list; of a table: its entries with keys, in the order of the text
    std::string key;               // of an entry of a table
    int key_line = 0, key_column = 0;
    int line = 0, column = 0;  // from 1; 0 where there is none

    const TomlValue* find(std::string_view name) const;  // a table's entry, or null
};

/// Parses a text in UTF-8.  Refuses control characters except tabs and line breaks.  Columns count
/// characters. Throws InputError `name:line:column: ...`.
TomlValue parse_toml(std::string_view text, const std::string& name);

/// Reads a file of at most 16 MiB, and parses it.  Throws InputError.
std::string read_toml_text(const std::string& path);
TomlValue read_toml(const std::string& path);

/// A value as TOML, on one line and in ASCII; it reads back as the same value.
std::string toml_text(double value);
std::string toml_text(bool value);
std::string toml_text(std::int64_t value);
std::string toml_text(std::string_view value);
std::string toml_text(const TomlValue& value);

/// A value for messages: short and on one line.
std::string described(const TomlValue& value);
/// A text for messages: in quotes, short, on one line and in ASCII.
std::string in_quotes(std::string_view text);

/// The candidate that `name` most likely misspells; empty if none is near.
std::string_view nearest_name(std::string_view name, const std::vector<std::string_view>& candidates);
/// "a, b or c".
std::string listed(const std::vector<std::string_view>& names);

}  // namespace squint
