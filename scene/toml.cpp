#include "scene/toml.h"

#include "core/error.h"
#include "core/read_whole.h"
#include "core/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace squint {
namespace {
[[noreturn]] void toml_promise_broken(const char* promise) {
    throw std::logic_error(promise);
}
}  // namespace
}  // namespace squint

// toml++ 3.3 aborts on some texts ("[&") where its asserts are on, and accepts them silently under NDEBUG:
// here its asserts throw.
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
        std::ostringstream written;
        if (const auto* date = node.as_date()) written << date->get();
        if (const auto* time = node.as_time()) written << time->get();
        if (const auto* both = node.as_date_time()) written << both->get();
        value.text = written.str();
    }
    return value;
}

void refuse_unsafe_bytes(std::string_view text, const std::string& name) {
    int line = 1, column = 1;
    for (std::size_t i = 0; i < text.size(); ++column) {
        const auto byte = static_cast<unsigned char>(text[i]);
        const bool line_break = byte == '\n' || (byte == '\r' && i + 1 < text.size() && text[i + 1] == '\n');
        const char32_t code = next_code_point(text, i);
        const bool is_control = code < 0x20 || (code >= 0x7f && code < 0xa0);
        if (!line_break && byte != '\t' && (is_control || code == 0xfffd))
            throw InputError(
                fmt::format("{}:{}:{}: found byte 0x{:02x}; allowed: UTF-8 without control characters", name,
                            line, column, byte));
        if (byte == '\n') ++line, column = 0;
    }
}

/// toml++ 3.3 is safe with ASCII alone.  Every other character goes through it as a name, `@0:fc;`, whose
/// beginning occurs in no text.
class AsciiText {
  public:
    explicit AsciiText(std::string_view text) {
        int number = 0;
        do mark_ = fmt::format("@{}:", number++);
        while (text.find(std::string_view(mark_).substr(1)) != std::string_view::npos);
        int line = 1, column = 1;
        for (std::size_t i = 0; i < text.size(); ++column) {
            const std::size_t at = i;
            const char32_t code = next_code_point(text, i);
            if (code < 0x80) {
                ascii_ += text[at];
                if (text[at] == '\n') ++line, column = 0;
                continue;
            }
            const std::string name = fmt::format("{}{:x};", mark_, static_cast<unsigned>(code));
            names_.push_back({line, column, static_cast<int>(name.size()) - 1});
            ascii_ += name;
        }
    }
    const std::string& text() const { return ascii_; }

    void restore(TomlValue& value) const {
        if (names_.empty()) return;
        restore(value.text), restore(value.key);
        place(value.line, value.column), place(value.key_line, value.key_column);
        for (TomlValue& item : value.items) restore(item);
    }
    /// Maps a column of the ASCII text to the column of the text itself.
    void place(int line, int& column) const {
        const auto first = std::lower_bound(names_.begin(), names_.end(), line,
                                            [](const Name& name, int at) { return name.line < at; });
        for (auto name = first; name != names_.end() && name->line == line && name->column < column; ++name)
            column -= std::min(name->more, column - name->column);
    }

  private:
    struct Name {
        int line, column, more;  // extra columns of its name
    };

    void restore(std::string& value) const {
        for (std::size_t at = 0; (at = value.find(mark_, at)) != std::string::npos; ++at) {
            char* end = nullptr;
            const unsigned long code = std::strtoul(value.c_str() + at + mark_.size(), &end, 16);
            const auto size = static_cast<std::size_t>(end - value.c_str()) + 1 - at;
            if (*end == ';' && code >= 0x80 && code <= 0x10ffff)
                value.replace(at, size, utf8_of(static_cast<char32_t>(code)));
        }
    }

    std::string mark_, ascii_;
    std::vector<Name> names_;  // in order
};

// --- Texts ---------------------------------------------------------------------------------------

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

/// Insertions, deletions, changes and swaps of neighbours from a to b (optimal string alignment).
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
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
    if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
    refuse_unsafe_bytes(text, name);
    const AsciiText ascii(text);
    try {
        TomlValue value = from_node(toml::parse(ascii.text(), name));
        ascii.restore(value);
        return value;
    } catch (const toml::parse_error& error) {
        const int line = static_cast<int>(error.source().begin.line);
        int column = static_cast<int>(error.source().begin.column);
        ascii.place(line, column);
        throw InputError(
            fmt::format("{}:{}:{}: not TOML: {}", name, line, column, excerpt(error.description(), 160)));
    } catch (const std::logic_error&) {
        throw InputError(fmt::format("{}: not TOML that can be read: a name in brackets is broken", name));
    }
}

std::string read_toml_text(const std::string& path) {
    return read_whole(path, "a text file in TOML", kLargestText);
}
TomlValue read_toml(const std::string& path) {
    return parse_toml(read_toml_text(path), path);
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
    // At most a third of the letters may differ.  Half of a word, rightly begun, counts as
    // near.
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
