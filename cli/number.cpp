// squint number: a calculator in formats, for people (arguments) and for programs (one operation a line).
#include "cli/common.h"
#include "cli/verb.h"
#include "core/error.h"
#include "core/text.h"
#include "fixedpoint/calculator.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <string>

namespace squint::cli {
namespace {

struct NumberArguments {
    std::vector<std::string> words;  // empty: read operations from standard input
    bool json = false;
};

bool any_operand_overflow(const Calculation& c) {
    return std::find(c.operand_overflow.begin(), c.operand_overflow.end(), true) != c.operand_overflow.end();
}
std::string flags_of(const Calculation& c) {
    std::string flags;
    const auto add = [&](bool set, const char* name) {
        if (set) flags += (flags.empty() ? "" : ",") + std::string(name);
    };
    add(c.inexact, "inexact"), add(c.overflow, "overflow"), add(any_operand_overflow(c), "operand-overflow");
    return flags.empty() ? "-" : flags;
}
Exact value_of(const Calculation& c) {
    return {c.raw, c.spec.format.fraction_bits};
}
// What lies beyond a decimal's guard bits does not show in six digits of an error.
std::string error_text(const Calculation& c) {
    return !c.inexact && !c.overflow ? "0"
                                     : fmt::format("{:+.6g}", static_cast<double>(last_bits(c)) /
                                                                  static_cast<double>(c.spec.format.one()));
}

std::string for_people(const Calculation& c) {
    std::string text = fmt::format("{}\n", to_string(c.spec));
    for (std::size_t i = 0; i < c.operands.size(); ++i) {
        const Format& f = c.operand_formats[i];
        text += fmt::format("  {:<8}{} = {} (raw {}){}\n", i == 0 ? c.operation : "", to_string(f),
                            decimal({c.operands[i], f.fraction_bits}), c.operands[i],
                            c.operand_overflow[i] ? ": what was given lies outside the format" : "");
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
                                {"overflow", c.overflow},
                                {"operand_overflow", any_operand_overflow(c)}};
    return json.dump() + "\n";
}

int run(const NumberArguments& a) {
    Calculation c;
    if (!a.words.empty()) {
        if (const std::string wrong = calculate(a.words, c); !wrong.empty())
            throw InputError("number: " + wrong);
        print(a.json ? as_json(c) : for_people(c));
        return kDone;
    }
    std::string line;
    bool any_wrong = false;
    for (int number = 1; std::getline(std::cin, line); ++number) {
        if (const auto comment = line.find(" //"); comment != std::string::npos) line.resize(comment);
        if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
        // A wrong line gets a line of output, too: the others still get their answers.
        if (const std::string wrong = calculate({line}, c); !wrong.empty()) {
            any_wrong = true;
            if (a.json)
                print_json({{"error", printable(wrong)}}, -1);
            else
                print("error\n");
            say(message_text(fmt::format("squint: standard input:{}: {}", number, wrong)) + "\n");
            continue;
        }
        print(a.json ? as_json(c) : for_programs(c));
    }
    return any_wrong ? kUsage : kDone;
}

void flags(Flags& f, NumberArguments& a) {
    f.add("words", a.words, "RESULT NUMBER, or RESULT OPERATION OPERAND...; standard input when left out")
        .value("");
    add_json_flag(f, a.json);
}

}  // namespace

namespace verbs {
extern const Verb number{
    .name = "number",
    .heading = "What happens inside",
    .help = "Calculate in fixed-point formats",
    .footer =
        "RESULT is a format with a rounding (trn, trn_zero, rnd, rnd_conv) and an overflow rule (sat, wrap), "
        "as in\n"
        "u1.15 trn sat; what is left out is rnd_conv and sat.  Signed formats begin with s.\n"
        "OPERATION is add or +, sub or -, mul or *, madd (a b c: a b + c), lerp (a b w: a + w (b - a)).\n"
        "An OPERAND is a format and a number; the format may be left out where it is the one before.  A "
        "number is\n"
        "decimal (0.7, -1e-3), a raw integer (#22938) or raw hexadecimal (0x599a).  A decimal is first "
        "rounded to its\n"
        "operand's format.  The operation is exact, and its result is quantised once.\n"
        "\n"
        "Examples:\n"
        "  squint number u1.15 0.7\n"
        "  squint number u1.15 trn mul u1.15 0.7 0.7\n"
        "  squint number s4.4 rnd wrap add u4.4 15.5 u1.8 0.75\n"
        "  squint number u12.4 lerp u12.0 100 200 u1.12 0.25\n"
        "  squint number u1.8 madd '#128' '#255' '#1'\n"
        "  printf 'u1.15 0.7\\nu0.8 mul 0.5 0.5\\n' | squint number",
    .describe = described<NumberArguments, flags, run>,
};
}

}  // namespace squint::cli
