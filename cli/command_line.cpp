// The command line: the only file that includes CLI11.
#include "cli/command_line.h"

#include "cli/common.h"
#include "cli/verb.h"
#include "core/error.h"
#include "pipeline/record.h"
#include "scene/toml.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

namespace squint::cli {

// ------------------------------------------------------------------------------------ flags

Flag& Flag::value(const char* name) {
    return option_->type_name(name), *this;
}
Flag& Flag::required() {
    return option_->required(), *this;
}
Flag& Flag::one_of(const std::vector<std::string_view>& names) {
    return option_->check(CLI::IsMember(std::vector<std::string>(names.begin(), names.end()))), *this;
}
Flag& Flag::between(int least, int greatest) {
    return option_->check(CLI::Range(least, greatest)), *this;
}
Flag& Flag::positive() {
    return option_->check(CLI::PositiveNumber), *this;
}
Flag& Flag::not_negative() {
    return option_->check(CLI::NonNegativeNumber), *this;
}
Flag& Flag::separated_by_commas() {
    // One word, so that what follows is another argument.
    return option_->delimiter(',')->allow_extra_args(false), *this;
}
Flag& Flag::value_may_be_left_out() {
    return option_->expected(0, 1), *this;
}
Flag& Flag::in_order() {
    return option_->trigger_on_parse(), *this;
}
Flag& Flag::shows_default() {
    return option_->capture_default_str(), *this;
}
Flag& Flag::shows_default(const char* text) {
    return option_->default_str(text), *this;
}
bool Flag::given() const {
    return option_->count() > 0;
}

bool Flag::before(const Flag& other) const {
    // The options of a verb in the order in which they were given.
    const std::vector<CLI::Option*>& order = verb_->parse_order();
    const auto at = [&](const Flag& flag) { return std::find(order.begin(), order.end(), flag.option_); };
    return at(*this) < at(other);
}

template <class T>
Flag Flags::add(const char* names, T& variable, const char* help) {
    if constexpr (std::is_same_v<T, bool>)
        return Flag(*verb_, *verb_->add_flag(names, variable, help));
    else
        return Flag(*verb_, *verb_->add_option(names, variable, help));
}
template Flag Flags::add(const char*, bool&, const char*);
template Flag Flags::add(const char*, int&, const char*);
template Flag Flags::add(const char*, std::uint64_t&, const char*);
template Flag Flags::add(const char*, double&, const char*);
template Flag Flags::add(const char*, std::optional<double>&, const char*);
template Flag Flags::add(const char*, std::string&, const char*);
template Flag Flags::add(const char*, std::vector<int>&, const char*);
template Flag Flags::add(const char*, std::vector<std::string>&, const char*);

void Flags::clear(const char* names, bool& variable, const char* help) {
    verb_->add_flag_function(
        names, [&variable](std::int64_t) { variable = false; }, help);
}
void Flags::choose_index(const char* names, std::vector<std::string_view> allowed,
                         std::function<void(int)> choose, const char* help) {
    read(
        names,
        [allowed, choose = std::move(choose)](const std::string& name) {
            choose(static_cast<int>(std::find(allowed.begin(), allowed.end(), name) - allowed.begin()));
        },
        help)
        .one_of(allowed)
        .value("NAME");
}
Flag Flags::read(const char* names, std::function<void(const std::string&)> read, const char* help) {
    return Flag(*verb_, *verb_->add_option_function<std::string>(names, std::move(read), help));
}
Flag Flags::read_list(const char* names, std::function<void(const std::vector<std::string>&)> read,
                      const char* help) {
    return Flag(*verb_, *verb_->add_option_function<std::vector<std::string>>(names, std::move(read), help));
}
void Flags::then(std::function<void()> check) {
    verb_->callback(std::move(check));
}

// ---------------------------------------------------------------------------------- program

namespace {

/// Every verb with its flags.
struct Program {
    CLI::App app{"Fixed-point volume ray casting with every bit of every stage a setting.", "squint"};
    std::vector<CLI::App*> verbs;
    std::vector<std::function<int()>> run;  // of each verb

    explicit Program(const std::string& command = "") {
        app.set_version_flag("--version", "squint " + version());
        app.require_subcommand(0, 1);
        for (const Verb* verb : all_verbs()) {
            CLI::App& sub = *app.add_subcommand(verb->name, verb->help)->group(verb->heading);
            Flags flags(sub, command);
            verbs.push_back(&sub), run.push_back(verb->describe(flags));
            sub.footer(verb->footer);
        }
        app.footer(
            "`squint VERB --help` has every flag and an example; `squint render --scene-reference` every key "
            "of "
            "a scene.\n"
            "Exit codes: 0 done, 1 a comparison failed, 2 usage or input, 3 some points failed, 70 internal "
            "error, 130 interrupted.\n\n"
            "Example:\n  squint render -o out.exr --preview out.png");
    }
    /// The place of a verb; -1 for none.
    int find(const std::string& name) const {
        for (std::size_t v = 0; v < verbs.size(); ++v)
            if (verbs[v]->get_name() == name) return static_cast<int>(v);
        return -1;
    }
    std::vector<std::string> names() const {
        std::vector<std::string> all;
        for (const CLI::App* verb : verbs) all.push_back(verb->get_name());
        return all;
    }
};

/// The command as a shell would accept it.
std::string command_text(int argc, char** argv) {
    std::string text = "squint";
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        const bool plain =
            !word.empty() && word.find_first_of(" '\"$&;()[]{}*?<>|\\`!#~\n\t") == std::string::npos;
        text += ' ';
        if (plain) {
            text += word;
            continue;
        }
        text += '\'';
        for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
        text += '\'';
    }
    return text;
}

std::vector<std::string> flags_of(const CLI::App& verb) {
    std::vector<std::string> names;
    for (const CLI::Option* option : verb.get_options())
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    return names;
}

/// A message and where help is: a clause of its own after a question.
std::string with_help(const std::string& message, const std::string& where) {
    return message + (message.ends_with('?') ? " See " : "; see ") + where;
}

/// CLI11's message on one line, with where help is.  Names a misspelt word before a missing one.
std::string message_of(const CLI::App& verb, const CLI::ParseError& error) {
    std::string message = error.what();
    for (const std::string& word : verb.remaining())
        if (word.starts_with("--")) {
            const std::string flag = word.substr(0, word.find('='));
            const std::vector<std::string> flags = flags_of(verb);
            const std::string_view near = nearest_name(flag, {flags.begin(), flags.end()});
            message = fmt::format("unknown flag {}{}", in_quotes(flag),
                                  near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near));
            break;
        }
    std::replace(message.begin(), message.end(), '\n', ' ');
    while (!message.empty() && (message.back() == ' ' || message.back() == '.')) message.pop_back();
    return with_help(fmt::format("{}: {}", verb.get_name(), message),
                     fmt::format("squint {} --help", verb.get_name()));
}

FlagText text_of(const CLI::Option& option) {
    FlagText flag{{},
                  "",
                  option.get_expected_min() == 0 && option.get_expected_max() > 0,
                  {},
                  option.get_description()};
    for (const std::string& name : option.get_snames()) flag.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) flag.names.push_back("--" + name);
    if (option.get_positional()) flag.names.push_back(option.get_name());
    if (option.get_items_expected_max() == 0) return flag;
    // CLI11 joins a value's name and its check: "NAME:{auto,model,lanes}".
    const std::string type = option.get_type_name();
    const std::size_t colon = type.find(':'),
                      open = type.find('{', colon == std::string::npos ? type.size() : colon);
    flag.value = type.substr(0, colon);
    if (open != std::string::npos) {
        std::string word;
        for (const char c : type.substr(open + 1))
            if (c == ',' || c == '}')
                flag.choices.push_back(std::exchange(word, ""));
            else
                word += c;
    }
    return flag;
}

VerbText text_of(const CLI::App& app) {
    VerbText verb{app.get_name(), app.get_group(), app.get_description(), app.get_footer(), {}, {}};
    for (const CLI::Option* option : app.get_options())
        (option->get_positional() ? verb.words : verb.flags).push_back(text_of(*option));
    return verb;
}

std::function<int()> printed(const std::string& text) {
    return [text] { return print(text), kDone; };
}

}  // namespace

ProgramText program_text() {
    const Program program;
    const CLI::App& app = program.app;
    ProgramText text{app.get_description(), app.get_footer(), version(), text_of(app).flags, {}};
    for (const CLI::App* verb : program.verbs) text.verbs.push_back(text_of(*verb));
    return text;
}

std::string help_text(const std::string& verb) {
    const Program program;
    if (verb.empty()) return program.app.help();
    const int at = program.find(verb);
    if (at < 0) throw InputError("help: " + unknown("verb", verb, program.names()));
    return program.verbs[static_cast<std::size_t>(at)]->help("squint");
}

std::string unknown(const char* what, const std::string& name, const std::vector<std::string>& names) {
    const std::vector<std::string_view> candidates(names.begin(), names.end());
    const std::string_view near = nearest_name(name, candidates);
    return fmt::format(
        "unknown {} {}; {}", what, in_quotes(name),
        near.empty() ? "allowed: " + listed(candidates) : fmt::format("did you mean \"{}\"?", near));
}

std::function<int()> parse(int argc, char** argv) {
    if (argc < 2) return printed(help_text(""));
    const std::string command = command_text(argc, argv);
    Program program(command);
    CLI::App& app = program.app;
    const auto chosen = [&]() -> std::string {
        const auto verbs = app.get_subcommands();
        return verbs.empty() ? "" : verbs[0]->get_name();
    };
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        return printed(help_text(chosen()));
    } catch (const CLI::CallForVersion&) {
        return printed("squint " + version() + "\n");
    } catch (const CLI::ParseError& error) {
        if (!chosen().empty()) throw InputError(message_of(*app.get_subcommands()[0], error));
        const std::vector<std::string> words = app.remaining();
        const bool flag = !words.empty() && words[0].starts_with('-');
        throw InputError(with_help(
            words.empty() ? error.what()
                          : unknown(flag ? "flag" : "verb", words[0], flag ? flags_of(app) : program.names()),
            "squint help"));
    }
    const int verb = program.find(chosen());
    if (verb < 0) throw InputError("no verb given; see squint help");
    return program.run[static_cast<std::size_t>(verb)];
}

}  // namespace squint::cli
