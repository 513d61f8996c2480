#include "scene/toml.h"

#include "core/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace squint {
namespace {
[[noreturn]] void toml_promise_broken(const char* promise) {
    throw std::logic_error(promise);
}
}  // namespace
}  // namespace squint

// toml++ 3.3 aborts on some texts ("[&") where its asserts are on, and drops them where NDEBUG is set: they
// shall throw.
#undef NDEBUG
#define TOML_ASSERT(promise) ((promise) ? void() : ::squint::toml_promise_broken(#promise))
#define TOML_EXCEPTIONS 1
#include <toml++/toml.h>

namespace squint {
namespace {

constexpr std::size_t kLargestText = std::size_t{1} << 24;

// --- From toml++'s tree to ours ------------------------------------------------------------------

TomlValue from_node(const toml::node& node) {
    TomlValue value;
    value.line = static_cast<int>(node.source().begin.line);
    value.column = static_cast<int>(node.source().begin.column);
    using Kind = TomlValue::Kind;
    if (const auto* table = node.as_table()) {
        value.kind = Kind::table;
        for (const auto& [key, entry] : *table) {
            TomlValue item = from_node(entry);
            item.key = std::string(key.str());
            item.key_line = static_cast<int>(key.source().begin.line);
            item.key_column = static_cast<int>(key.source().begin.column);
            value.items.push_back(std::move(item));
        }
        std::stable_sort(value.items.begin(), value.items.end(), [](const TomlValue& a, const TomlValue& b) {
            return std::pair(a.key_line, a.key_column) < std::pair(b.key_line, b.key_column);
        });
    } else if (const auto* list = node.as_array()) {
        value.kind = Kind::list;
        for (const auto& entry : *list) value.items.push_back(from_node(entry));
    } else if (const auto* text = node.as_string()) {
        value.kind = Kind::string;
        value.text = text->get();
    } else if (const auto* integer = node.as_integer()) {
        value.kind = Kind::integer;
        value.integer = integer->get();
        value.number = static_cast<double>(integer->get());
    } else if (const auto* number = node.as_floating_point()) {
        value.kind = Kind::number;
        value.number = number->get();
    } else if (const auto* flag = node.as_boolean()) {
        value.kind = Kind::boolean;
        value.flag = flag->get();
    } else {
        value.kind = Kind::date;
        std::ostringstream text;
        if (const auto* date = node.as_date()) text << date->get();
        if (const auto* time = node.as_time()) text << time->get();
        if (const auto* both = node.as_date_time()) text << both->get();
        value.text = text.str();
    }
    return value;
}

void refuse_unsafe_bytes(std::string_view text, const std::string& name) {
    int line = 1, column = 1;
    for (std::size_t i = 0; i < text.size(); ++i, ++column) {
        const auto byte = static_cast<unsigned char>(text[i]);
        const bool line_break = byte == '\n' || (byte == '\r' && i + 1 < text.size() && text[i + 1] == '\n');
        if (!line_break && byte != '\t' && (byte < 0x20 || byte > 0x7e))
            throw InputError(
                fmt::format("{}:{}:{}: found byte 0x{:02x}; allowed: printable ASCII, tabs and line breaks "
                            "(\\u00e9 in a string for others)",
                            name, line, column, byte));
        if (byte == '\n') ++line, column = 0;
    }
}

// One line: toml++ quotes keys and characters as they come.
std::string one_line(std::string_view text) {
    std::string line;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        line += byte < 0x20 || byte > 0x7e ? ' ' : c;
    }
    return line;
}

// --- Texts ---------------------------------------------------------------------------------------

/// The code point that starts at `i` in UTF-8, moving `i` past it; U+FFFD for a byte that starts none.
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
    if ((code >= 0xd800 && code < 0xe000) || code > 0x10ffff) return 0xfffd;
    i += static_cast<std::size_t>(more);
    return code;
}

std::string escaped(std::string_view text, std::size_t most) {
    std::string out;
    for (std::size_t i = 0; i < text.size();) {
        if (out.size() >= most) return out + "...";
        const char32_t code = next_code_point(text, i);
        if (code == '"' || code == '\\')
            out += {'\\', static_cast<char>(code)};
        else if (code == '\n')
            out += "\\n";
        else if (code == '\t')
            out += "\\t";
        else if (code >= 0x20 && code <= 0x7e)
            out += static_cast<char>(code);
        else if (code <= 0xffff)
            out += fmt::format("\\u{:04X}", static_cast<unsigned>(code));
        else
            out += fmt::format("\\U{:08X}", static_cast<unsigned>(code));
    }
    return out;
}

bool is_bare_key(std::string_view key) {
    return !key.empty() && std::all_of(key.begin(), key.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
               c == '-';
    });
}

/// Insertions, deletions, changes and swaps of neighbours that lead from a to b (optimal string alignment).
int edit_distance(std::string_view a, std::string_view b) {
    std::vector<int> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    std::iota(last.begin(), last.end(), 0);
    for (std::size_t i = 1; i <= a.size(); ++i) {
        row[0] = static_cast<int>(i);
        for (std::size_t j = 1; j <= b.size(); ++j) {
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], before[j - 2] + 1);
        }
        std::swap(before, last);
        std::swap(last, row);
    }
    return last[b.size()];
}

}  // namespace

const TomlValue* TomlValue::find(std::string_view name) const {
    if (kind != Kind::table) return nullptr;
    for (const TomlValue& item : items)
        if (item.key == name) return &item;
    return nullptr;
}

TomlValue parse_toml(std::string_view text, const std::string& name) {
    if (text.size() > kLargestText)
        throw InputError(
            fmt::format("{}: found {} bytes; allowed: at most {}", name, text.size(), kLargestText));
    refuse_unsafe_bytes(text, name);
    try {
        return from_node(toml::parse(text, name));
    } catch (const toml::parse_error& error) {
        throw InputError(fmt::format("{}:{}:{}: not TOML: {}", name, error.source().begin.line,
                                     error.source().begin.column, one_line(error.description())));
    } catch (const std::logic_error&) {
        throw InputError(fmt::format("{}: not TOML that can be read: a name in brackets is broken", name));
    }
}

TomlValue read_toml(const std::string& path) {
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    std::string text;
    std::array<char, 1 << 16> piece;
    while (file && text.size() <= kLargestText) {
        file.read(piece.data(), piece.size());
        text.append(piece.data(), static_cast<std::size_t>(file.gcount()));
    }
    if (!file.is_open() || file.bad())
        throw InputError(fmt::format("{}: cannot be read: {}; allowed: a text file in TOML", path,
                                     errno != 0 ? std::generic_category().message(errno) : "unknown reason"));
    return parse_toml(text, path);
}

std::string toml_text(double value) {
    if (std::isnan(value)) return "nan";
    if (std::isinf(value)) return value < 0 ? "-inf" : "inf";
    const std::string shortest = fmt::format("{}", value);
    return shortest.find_first_of(".e") == std::string::npos ? shortest + ".0" : shortest;
}
std::string toml_text(bool value) {
    return value ? "true" : "false";
}
std::string toml_text(std::int64_t value) {
    return fmt::format("{}", value);
}
std::string toml_text(std::string_view value) {
    return '"' + escaped(value, std::string::npos) + '"';
}

std::string toml_text(const TomlValue& value) {
    using Kind = TomlValue::Kind;
    switch (value.kind) {
        case Kind::string:
            return toml_text(std::string_view(value.text));
        case Kind::integer:
            return toml_text(value.integer);
        case Kind::number:
            return toml_text(value.number);
        case Kind::boolean:
            return toml_text(value.flag);
        case Kind::date:
            return value.text;
        case Kind::list:
        case Kind::table:
            break;
    }
    std::string inside;
    for (const TomlValue& item : value.items) {
        if (!inside.empty()) inside += ", ";
        if (value.kind == Kind::table)
            inside += (is_bare_key(item.key) ? item.key : toml_text(std::string_view(item.key))) + " = ";
        inside += toml_text(item);
    }
    return value.kind == Kind::list ? '[' + inside + ']' : "{ " + inside + " }";
}

std::string described(const TomlValue& value) {
    using Kind = TomlValue::Kind;
    switch (value.kind) {
        case Kind::string:
            return "the string " + in_quotes(value.text);
        case Kind::date:
            return "a date or time";
        case Kind::table:
            return "a table";
        case Kind::list:
        case Kind::integer:
        case Kind::number:
        case Kind::boolean:
            break;
    }
    const std::string text = value.items.size() > 8 ? std::string() : toml_text(value);
    return !text.empty() && text.size() <= 60 ? text : fmt::format("a list of {}", value.items.size());
}

std::string in_quotes(std::string_view text) {
    return '"' + escaped(text, 60) + '"';
}

std::string_view nearest_name(std::string_view name, const std::vector<std::string_view>& candidates) {
    // A third of the letters may be wrong: more is another word.  Half a word or more that was begun right
    // counts as near.
    const int most = std::max(1, static_cast<int>(std::min<std::size_t>(name.size(), 64)) / 3);
    std::string_view best;
    int least = most + 1;
    if (name.size() > 64) return best;
    for (const std::string_view candidate : candidates) {
        int distance = edit_distance(name, candidate);
        if (name.size() >= 3 && candidate.starts_with(name)) distance = std::min(distance, most);
        if (distance < least) best = candidate, least = distance;
    }
    return best;
}

std::string listed(const std::vector<std::string_view>& names) {
    std::string text;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (i > 0) text += i + 1 == names.size() ? " or " : ", ";
        text += names[i];
    }
    return text;
}

}  // namespace squint
