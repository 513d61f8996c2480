#include "fixedpoint/format.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <sstream>
#include <utility>

namespace squint {
namespace {

constexpr std::array<std::pair<Rounding, std::string_view>, 4> kRoundings{{
    {Rounding::trn, "trn"},
    {Rounding::trn_zero, "trn_zero"},
    {Rounding::rnd, "rnd"},
    {Rounding::rnd_conv, "rnd_conv"},
}};
constexpr std::array<std::pair<Overflow, std::string_view>, 2> kOverflows{{
    {Overflow::sat, "sat"},
    {Overflow::wrap, "wrap"},
}};

template <class Table, class Value>
std::string name_of(const Table& table, Value value) {
    for (const auto& [candidate, name] : table)
        if (candidate == value) return std::string(name);
    return "?";
}

template <class Table, class Value>
bool value_of(const Table& table, std::string_view text, Value& out) {
    for (const auto& [candidate, name] : table)
        if (name == text) return out = candidate, true;
    return false;
}

// One or two digits at `position`; -1 if there are none.
int small_number(std::string_view text, std::size_t& position) {
    int value = -1;
    for (int digits = 0;
         digits < 2 && position < text.size() && std::isdigit(static_cast<unsigned char>(text[position]));
         ++digits)
        value = (value < 0 ? 0 : value) * 10 + (text[position++] - '0');
    return value;
}

}  // namespace

std::string to_string(const Format& f) {
    return fmt::format("{}{}.{}", f.is_signed ? 's' : 'u', f.integer_bits, f.fraction_bits);
}
std::string to_string(Rounding rounding) {
    return name_of(kRoundings, rounding);
}
std::string to_string(Overflow overflow) {
    return name_of(kOverflows, overflow);
}
std::string to_string(const Spec& s) {
    return fmt::format("{} {} {}", to_string(s.format), to_string(s.rounding), to_string(s.overflow));
}

std::string parse_format(std::string_view text, Format& out) {
    const auto refuse = [&] {
        return fmt::format(
            "'{}' is not a format: write u or s, 0 to {} integer bits, a point, 0 to {} fraction bits, as in "
            "u1.15",
            text, kMostIntegerBits, kMostFractionBits);
    };
    if (text.size() < 4 || (text[0] != 'u' && text[0] != 's')) return refuse();
    std::size_t position = 1;
    Format format{.is_signed = text[0] == 's'};
    format.integer_bits = small_number(text, position);
    if (position >= text.size() || text[position] != '.') return refuse();
    ++position;
    format.fraction_bits = small_number(text, position);
    if (position != text.size() || format.integer_bits < 0 || format.fraction_bits < 0 ||
        format.integer_bits > kMostIntegerBits || format.fraction_bits > kMostFractionBits ||
        format.integer_bits + format.fraction_bits < 1)
        return refuse();
    out = format;
    return {};
}

std::string parse_rounding(std::string_view text, Rounding& out) {
    if (value_of(kRoundings, text, out)) return {};
    return fmt::format("'{}' is not a rounding: trn, trn_zero, rnd or rnd_conv", text);
}

std::string parse_overflow(std::string_view text, Overflow& out) {
    if (value_of(kOverflows, text, out)) return {};
    return fmt::format("'{}' is not an overflow rule: sat or wrap", text);
}

std::string parse_spec(std::string_view text, Spec& out) {
    std::istringstream words{std::string(text)};
    std::string word;
    Spec spec = out;
    int formats = 0, roundings = 0, overflows = 0;
    while (words >> word) {
        if (value_of(kRoundings, word, spec.rounding))
            ++roundings;
        else if (value_of(kOverflows, word, spec.overflow))
            ++overflows;
        else if (parse_format(word, spec.format).empty())
            ++formats;
        else
            return fmt::format(
                "'{}' is not a format, a rounding (trn, trn_zero, rnd, rnd_conv) or an overflow rule (sat, "
                "wrap)",
                word);
    }
    if (formats + roundings + overflows == 0 || formats > 1 || roundings > 1 || overflows > 1)
        return fmt::format("'{}': expected a format, a rounding and an overflow rule, each once at most",
                           text);
    out = spec;
    return {};
}

}  // namespace squint
