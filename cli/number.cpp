// squint number: a calculator in formats, for people (arguments) and for programs (a line an operation).
#include "cli/common.h"
#include "core/error.h"
#include "fixedpoint/calculator.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <iostream>
#include <string>

namespace squint::cli {
namespace {

std::string flags_of(const Calculation& c) {
    if (c.inexact && c.overflow) return "inexact,overflow";
    return c.inexact ? "inexact" : c.overflow ? "overflow" : "-";
}
Exact value_of(const Calculation& c) {
    return {c.raw, c.spec.format.fraction_bits};
}
// What lies beyond the guard bits of a decimal does not show in six digits of an error.
std::string error_text(const Calculation& c) {
    return !c.inexact && !c.overflow ? "0"
                                     : fmt::format("{:+.6g}", static_cast<double>(last_bits(c)) /
                                                                  static_cast<double>(c.spec.format.one()));
}

std::string for_people(const Calculation& c) {
    std::string text = fmt::format("{}\n", to_string(c.spec));
    for (std::size_t i = 0; i < c.operands.size(); ++i) {
        const Format& f = c.operand_formats[i];
        text += fmt::format("  {:<8}{} = {} (raw {})\n", i == 0 ? c.operation : "", to_string(f),
                            decimal({c.operands[i], f.fraction_bits}), c.operands[i]);
    }
    text += fmt::format("  raw     {}\n  hex     {}\n  bits    {}\n  value   {}\n", c.raw,
                        hex(c.raw, c.spec.format), bits(c.raw, c.spec.format), decimal(value_of(c)));
    text += fmt::format("  error   {}", error_text(c));
    if (c.inexact || c.overflow) text += fmt::format(" ({:+.6g} of the last bit)", last_bits(c));
    return text + fmt::format("\n  flags   {}\n", flags_of(c));
}

/// raw hex bits value error flags
std::string for_programs(const Calculation& c) {
    return fmt::format("{} {} {} {} {} {}\n", c.raw, hex(c.raw, c.spec.format), bits(c.raw, c.spec.format),
                       decimal(value_of(c)), error_text(c), flags_of(c));
}

std::string as_json(const Calculation& c) {
    nlohmann::ordered_json json{{"format", to_string(c.spec)},
                                {"raw", c.raw},
                                {"hex", hex(c.raw, c.spec.format)},
                                {"bits", bits(c.raw, c.spec.format)},
                                {"value", decimal(value_of(c))},
                                {"error_last_bits", last_bits(c)},
                                {"inexact", c.inexact},
                                {"overflow", c.overflow}};
    return json.dump() + "\n";
}

}  // namespace

int run(const NumberArguments& a) {
    Calculation c;
    if (!a.words.empty()) {
        if (const std::string wrong = calculate(a.words, c); !wrong.empty())
            throw InputError("number: " + wrong);
        print(a.json ? as_json(c) : for_people(c));
        return kDone;
    }
    std::string line;
    for (int number = 1; std::getline(std::cin, line); ++number) {
        if (const auto comment = line.find(" //"); comment != std::string::npos) line.resize(comment);
        if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
        if (const std::string wrong = calculate({line}, c); !wrong.empty())
            throw InputError(fmt::format("standard input:{}: {}", number, wrong));
        print(a.json ? as_json(c) : for_programs(c));
    }
    return kDone;
}

}  // namespace squint::cli
