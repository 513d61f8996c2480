#include "fixedpoint/calculator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string_view>

namespace squint {
namespace {

constexpr int kMostDigits = 18, kMostExponent = 18;
constexpr Int128 kMostWhole = Int128{1} << 60;  // 64 fraction bits and a sticky bit on top: 125 bits

/// floor(value 2^f) of a decimal number, and whether the number exceeds it.
struct Decimal {
    Exact floor;
    bool sticky = false;
};

Int128 power_of_ten(int n) {
    Int128 power = 1;
    for (; n > 0; --n) power *= 10;
    return power;
}

std::string refuse_number(const std::string& text) {
    return fmt::format(
        "'{}' is not a number: write a decimal of at most {} digits (0.7, -1e-3), #raw (#22938) or 0xraw "
        "(0x599a)",
        text, kMostDigits);
}

/// "-12.5e-3" -> digits 125, scale 4 (digits / 10^scale).
bool parse_decimal(std::string_view text, Int128& digits, int& scale) {
    const bool negative = text.starts_with('-');
    if (negative || text.starts_with('+')) text.remove_prefix(1);
    digits = 0, scale = 0;
    int count = 0;
    bool point = false, any = false;
    std::size_t i = 0;
    for (;
         i < text.size() && (std::isdigit(static_cast<unsigned char>(text[i])) || (text[i] == '.' && !point));
         ++i) {
        if (text[i] == '.') {
            point = true;
            continue;
        }
        any = true;
        digits = 10 * digits + (text[i] - '0');
        count += count > 0 || text[i] != '0';
        scale += point;
        if (count > kMostDigits || scale > 2 * kMostDigits) return false;
    }
    if (!any) return false;
    if (i < text.size()) {
        if (text[i] != 'e' && text[i] != 'E') return false;
        const bool down = ++i < text.size() && text[i] == '-';
        if (i < text.size() && (text[i] == '-' || text[i] == '+')) ++i;
        if (i == text.size() || text.size() - i > 2) return false;
        int exponent = 0;
        for (; i < text.size(); ++i) {
            if (!std::isdigit(static_cast<unsigned char>(text[i]))) return false;
            exponent = 10 * exponent + (text[i] - '0');
        }
        if (exponent > kMostExponent) return false;
        scale += down ? exponent : -exponent;
    }
    if (scale < 0) digits *= power_of_ten(-scale), scale = 0;
    if (negative) digits = -digits;
    if (scale > 36) return false;
    const Int128 whole = digits / power_of_ten(scale);
    return whole < kMostWhole && whole > -kMostWhole;
}

/// One bit below the last and a sticky bit decide every rounding; more bits show the error.
constexpr int kGuardBits = 40;

Decimal at_fraction(Int128 digits, int scale, int fraction_bits) {
    const Int128 divisor = power_of_ten(scale);
    // digits 2^f may pass 127 bits: whole part first, then the rest bit by bit.
    Int128 whole = digits / divisor, rest = digits % divisor;
    if (rest < 0) rest += divisor, --whole;
    for (int bit = 0; bit < fraction_bits; ++bit) {
        rest *= 2, whole *= 2;
        if (rest >= divisor) rest -= divisor, ++whole;
    }
    return {{whole, fraction_bits}, rest != 0};
}

void finish(Calculation& c) {
    const Spec& spec = c.spec;
    // The sticky bit goes one bit below: under half a unit, above zero.
    const Int128 x = 2 * c.exact.value + (c.sticky ? 1 : 0);
    const Rescale to(c.exact.fraction_bits + 1, spec);
    const Int128 rounded = round_off(x, to);
    c.raw = static_cast<std::int64_t>(quantise(x, to));
    c.overflow = rounded != c.raw;
    c.inexact = c.sticky || (to.shift > 0 && (x & ((Int128{1} << to.shift) - 1)) != 0);
}

std::string parse_raw(const std::string& text, const Format& format, std::int64_t& raw) {
    const bool hexadecimal = text.starts_with("0x") || text.starts_with("0X");
    const std::string digits = text.substr(hexadecimal ? 2 : 1);
    std::size_t used = 0;
    long long value = 0;
    try {
        value = std::stoll(digits, &used, hexadecimal ? 16 : 10);
    } catch (const std::exception&) {
        return refuse_number(text);
    }
    if (used != digits.size() || std::isspace(static_cast<unsigned char>(digits[0])))
        return refuse_number(text);
    if (hexadecimal && format.is_signed && value > format.largest() && value < (1LL << format.width()))
        value -= 1LL << format.width();  // two's complement
    if (value < format.smallest() || value > format.largest())
        return fmt::format("'{}' is no raw number of {}: {} to {} are", text, to_string(format),
                           format.smallest(), format.largest());
    raw = value;
    return {};
}

bool is_raw(const std::string& text) {
    return text.starts_with('#') || text.starts_with("0x") || text.starts_with("0X");
}

/// Parses a Spec at the front of `words`: a format, then words for rounding and overflow.
bool take_spec(const std::vector<std::string>& words, std::size_t& at, Spec& spec) {
    Spec taken;
    if (at >= words.size() || !parse_format(words[at], taken.format).empty()) return false;
    for (++at; at < words.size(); ++at)
        if (!parse_rounding(words[at], taken.rounding).empty() &&
            !parse_overflow(words[at], taken.overflow).empty())
            break;
    spec = taken;
    return true;
}

std::string convert(const std::string& text, Calculation& c) {
    if (is_raw(text)) {
        if (const std::string wrong = parse_raw(text, c.spec.format, c.raw); !wrong.empty()) return wrong;
        c.exact = {c.raw, c.spec.format.fraction_bits};
        return {};
    }
    Int128 digits = 0;
    int scale = 0;
    if (!parse_decimal(text, digits, scale)) return refuse_number(text);
    const Decimal d = at_fraction(digits, scale, c.spec.format.fraction_bits + kGuardBits);
    c.exact = d.floor, c.sticky = d.sticky;
    finish(c);
    return {};
}

Exact product(const Exact& a, const Exact& b) {
    return {a.value * b.value, a.fraction_bits + b.fraction_bits};
}
Exact sum(const Exact& a, const Exact& b, int sign = 1) {
    const int f = std::max(a.fraction_bits, b.fraction_bits);
    return {a.value * (Int128{1} << (f - a.fraction_bits)) +
                sign * b.value * (Int128{1} << (f - b.fraction_bits)),
            f};
}

struct Operation {
    std::string_view name, sign;
    std::size_t operands;
    Exact (*apply)(const std::vector<Exact>&);
};
// The widest case: lerp of 24.0 and 0.24 with a signed 24.24 weight, 50 + 49 bits.
const Operation kOperations[] = {
    {"add", "+", 2, [](const std::vector<Exact>& x) { return sum(x[0], x[1]); }},
    {"sub", "-", 2, [](const std::vector<Exact>& x) { return sum(x[0], x[1], -1); }},
    {"mul", "*", 2, [](const std::vector<Exact>& x) { return product(x[0], x[1]); }},
    {"madd", "", 3, [](const std::vector<Exact>& x) { return sum(product(x[0], x[1]), x[2]); }},
    {"lerp", "", 3,
     [](const std::vector<Exact>& x) { return sum(x[0], product(x[2], sum(x[1], x[0], -1))); }},
};

const Operation* find_operation(const std::string& word) {
    for (const Operation& operation : kOperations)
        if (word == operation.name || (!operation.sign.empty() && word == operation.sign)) return &operation;
    return nullptr;
}

}  // namespace

std::string calculate(const std::vector<std::string>& given, Calculation& out) {
    // A Spec may be one word that contains spaces.
    std::vector<std::string> words;
    for (const std::string& word : given) {
        std::string part;
        for (const char c : word + " ") {
            if (!std::isspace(static_cast<unsigned char>(c))) {
                part += c;
            } else if (!part.empty()) {
                words.push_back(part);
                part.clear();
            }
        }
    }
    Calculation c;
    std::size_t at = 0;
    if (words.empty()) return "nothing to calculate: write a format and a number, as in u1.15 0.7";
    if (!take_spec(words, at, c.spec)) {
        Format ignored;
        return parse_format(words[0], ignored);
    }
    if (at == words.size())
        return fmt::format("'{}': a number or an operation is missing after it", words.back());
    const Operation* operation = find_operation(words[at]);
    if (!operation) {
        if (at + 1 != words.size())
            return fmt::format("'{}' is not an operation: add, sub, mul, madd or lerp", words[at]);
        if (const std::string wrong = convert(words[at], c); !wrong.empty()) return wrong;
        out = c;
        return {};
    }
    c.operation = operation->name;
    std::vector<Exact> operands;
    Spec spec = c.spec;
    for (++at; at < words.size(); ++at) {
        take_spec(words, at, spec);
        if (at == words.size()) return fmt::format("'{}': a number is missing after it", words.back());
        Calculation operand;
        operand.spec = spec;
        if (const std::string wrong = convert(words[at], operand); !wrong.empty()) return wrong;
        operands.push_back({operand.raw, spec.format.fraction_bits});
        c.operands.push_back(operand.raw), c.operand_formats.push_back(spec.format);
        c.operand_overflow.push_back(operand.overflow);
    }
    if (operands.size() != operation->operands)
        return fmt::format("{}: {} operands, but it takes {}", operation->name, operands.size(),
                           operation->operands);
    c.exact = operation->apply(operands);
    finish(c);
    out = c;
    return {};
}

std::string decimal(const Exact& exact) {
    const bool negative = exact.value < 0;
    auto magnitude = static_cast<unsigned __int128>(negative ? -exact.value : exact.value);
    unsigned __int128 whole = magnitude >> exact.fraction_bits;
    unsigned __int128 rest = magnitude & ((static_cast<unsigned __int128>(1) << exact.fraction_bits) - 1);
    std::string text;
    do text.insert(text.begin(), static_cast<char>('0' + static_cast<int>(whole % 10)));
    while (whole /= 10);
    if (rest != 0) text += '.';
    while (rest != 0) {
        rest *= 10;
        text += static_cast<char>('0' + static_cast<int>(rest >> exact.fraction_bits));
        rest &= (static_cast<unsigned __int128>(1) << exact.fraction_bits) - 1;
    }
    return (negative ? "-" : "") + text;
}

std::string hex(std::int64_t raw, const Format& format) {
    const std::uint64_t mask = (std::uint64_t{1} << format.width()) - 1;
    return fmt::format("0x{:0{}x}", static_cast<std::uint64_t>(raw) & mask, (format.width() + 3) / 4);
}

std::string bits(std::int64_t raw, const Format& format) {
    std::string text;
    for (int bit = format.width() - 1; bit >= 0; --bit) {
        if (bit == format.fraction_bits - 1) text += '.';
        text += ((raw >> bit) & 1) ? '1' : '0';
    }
    return text;
}

Exact error_of(const Calculation& c) {
    return sum({c.raw, c.spec.format.fraction_bits}, c.exact, -1);
}

double last_bits(const Calculation& c) {
    const Exact error = error_of(c);
    return std::ldexp(static_cast<double>(error.value), c.spec.format.fraction_bits - error.fraction_bits);
}

}  // namespace squint
