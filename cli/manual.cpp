#include "cli/manual.h"

#include "cli/shelf.h"
#include "core/procedural.h"
#include "scene/rules.h"
#include "scene/scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>
#include <type_traits>

namespace squint::cli {
namespace {

/// A key for --set and its words; none where it takes numbers or paths.
struct Key {
    std::string name, help;
    std::vector<std::string> words;
};

std::vector<Key> keys() {
    std::vector<Key> list;
    const Scene defaults;
    visit_scene(defaults, [&]<class T>(std::string_view key, const T&, std::string_view help) {
        Key entry{std::string(key), std::string(help), {}};
        using Value = typename std::conditional_t<is_optional<T>, T, std::optional<T>>::value_type;
        if constexpr (std::is_enum_v<Value>)
            for (const std::string_view word : names_of<Value>()) entry.words.emplace_back(word);
        if constexpr (std::is_same_v<Value, bool>) entry.words = {"true", "false"};
        if constexpr (std::is_same_v<Value, std::string>)
            for (const std::string_view word : words_of(key)) entry.words.emplace_back(word);
        list.push_back(entry);
    });
    list.push_back({"lights", "headlight: one along the camera's axis; []: none", {"headlight", "[]"}});
    return list;
}

// ------------------------------------------------------------------------------------------------ man

/// Escapes text so that roff sees no request in it.
std::string roff(std::string_view text) {
    std::string out;
    for (const char c : text) {
        if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) out += "\\&";
        if (c == '\\')
            out += "\\e";
        else if (c == '-')
            out += "\\-";
        else
            out += c;
    }
    return out;
}

std::string as_typed(std::string_view text) {
    return fmt::format(".nf\n{}\n.fi\n", roff(text));
}

std::string flag_line(const FlagText& flag) {
    std::string line;
    for (const std::string& name : flag.names)
        line += fmt::format("{}\\fB{}\\fR", line.empty() ? "" : ", ", roff(name));
    if (flag.value.empty()) return line;
    const std::string value = "\\fI" + roff(flag.value) + "\\fR";
    return line + (flag.optional ? " [" + value + "]" : " " + value);
}

std::string flags_section(std::string_view title, const std::vector<FlagText>& flags) {
    if (flags.empty()) return "";
    std::string text = fmt::format(".SH {}\n", title);
    for (const FlagText& flag : flags) text += fmt::format(".TP\n{}\n{}\n", flag_line(flag), roff(flag.help));
    return text;
}

std::string head(const ProgramText& program, std::string name, int section) {
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::toupper(c); });
    return fmt::format(".TH {} {} \"\" \"squint {}\" \"squint\"\n", roff(name), section, program.version);
}

constexpr std::string_view kSeeAlso =
    ".SH SEE ALSO\n.BR squint (1),\n.BR squint\\-scene (5)\n.PP\nThe pages below share/doc/squint.\n";

std::string man_of(const ProgramText& program, const VerbText& verb) {
    std::string synopsis;
    for (const FlagText& word : verb.words)
        synopsis += fmt::format(" \\fI{}\\fR", roff(word.value.empty() ? word.names[0] : word.value));
    return head(program, "squint-" + verb.name, 1) +
           fmt::format(".SH NAME\nsquint\\-{} \\- {}\n", verb.name, roff(verb.help)) +
           fmt::format(".SH SYNOPSIS\n\\fBsquint {}\\fR [\\fIFLAGS\\fR]{}\n", verb.name, synopsis) +
           flags_section("WORDS", verb.words) + flags_section("FLAGS", verb.flags) +
           (verb.footer.empty() ? "" : ".SH NOTES AND EXAMPLES\n" + as_typed(verb.footer)) +
           std::string(kSeeAlso);
}

std::string man_of(const ProgramText& program) {
    std::string text =
        head(program, "squint", 1) +
        fmt::format(".SH NAME\nsquint \\- {}\n.SH SYNOPSIS\n\\fBsquint\\fR \\fIVERB\\fR [\\fIFLAGS\\fR]\n",
                    roff(program.help)) +
        ".SH VERBS\n";
    std::string group;
    for (const VerbText& verb : program.verbs) {
        if (verb.group != group) text += fmt::format(".SS {}\n", roff(group = verb.group));
        text += fmt::format(".TP\n\\fBsquint\\-{}\\fR(1)\n{}\n", verb.name, roff(verb.help));
    }
    return text + flags_section("FLAGS", program.flags) + ".SH NOTES AND EXAMPLES\n" +
           as_typed(program.footer) + std::string(kSeeAlso);
}

std::string man_of_scene(const ProgramText& program) {
    std::string text = head(program, "squint-scene", 5) +
                       ".SH NAME\nsquint\\-scene \\- keys of a scene file\n.SH DESCRIPTION\nA scene is a "
                       "TOML file; every key can also be "
                       "set on the command line with \\fB\\-\\-set\\fR KEY=VALUE.\n.SH KEYS\n";
    for (const Key& key : keys()) {
        text += fmt::format(".TP\n\\fB{}\\fR\n{}\n", roff(key.name), roff(key.help));
        if (!key.words.empty())
            text += fmt::format(".br\n{}\n", roff(fmt::format("{}", fmt::join(key.words, ", "))));
    }
    return text + std::string(kSeeAlso);
}

// ------------------------------------------------------------------------------------------------ shells

bool takes_key(const FlagText& flag) {
    return flag.value == "KEY=VALUE";
}
std::vector<std::string> verb_names(const ProgramText& program) {
    std::vector<std::string> names;
    for (const VerbText& verb : program.verbs) names.push_back(verb.name);
    return names;
}
std::string in_single_quotes(std::string_view text) {
    std::string out = "'";
    for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out + "'";
}

std::string bash_of(const ProgramText& program) {
    std::string flags, values, words;
    for (const VerbText& verb : program.verbs) {
        std::string names;
        for (const FlagText& flag : verb.flags) {
            names += fmt::format("{}{}", names.empty() ? "" : " ", fmt::join(flag.names, " "));
            if (flag.choices.empty()) continue;
            for (const std::string& name : flag.names)
                values += fmt::format("        {}:{}) words={} ;;\n", verb.name, name,
                                      in_single_quotes(fmt::format("{}", fmt::join(flag.choices, " "))));
        }
        flags += fmt::format("        {}) words={} ;;\n", verb.name, in_single_quotes(names));
    }
    std::string names;
    for (const Key& key : keys()) {
        names += fmt::format("{}{}=", names.empty() ? "" : " ", key.name);
        if (!key.words.empty())
            words += fmt::format("        {}) words={} ;;\n", key.name,
                                 in_single_quotes(fmt::format("{}", fmt::join(key.words, " "))));
    }
    return fmt::format(R"(# bash completion of squint; written by `squint help --form bash`
_squint() {{
    local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD-1]}} verb=${{COMP_WORDS[1]}} words=
    COMPREPLY=()
    if [ "$COMP_CWORD" -eq 1 ]; then
        COMPREPLY=($(compgen -W '{verbs}' -- "$cur"))
        return
    fi
    # bash parts KEY=VALUE into three words
    local key=
    [ "$cur" = = ] && key=$prev cur=
    [ "$prev" = = ] && key=${{COMP_WORDS[COMP_CWORD-2]}}
    if [ -n "$key" ]; then
        case $key in
{key_words}        esac
        if [ -n "$words" ]; then COMPREPLY=($(compgen -W "$words" -- "$cur")); else compopt -o default; fi
        return
    fi
    if [ "$prev" = --set ]; then
        COMPREPLY=($(compgen -W '{keys}' -- "$cur"))
        compopt -o nospace
        return
    fi
    case $verb:$prev in
{values}    esac
    if [ -z "$words" ] && [ "${{cur:0:1}}" = - ]; then
        case $verb in
{flags}        esac
    fi
    if [ -z "$words" ] && [ "${{cur:0:1}}" = @ ]; then words='{shelf}'; fi
    if [ "$verb" = help ] && [ -z "$words" ]; then words='{verbs}'; fi
    if [ -n "$words" ]; then COMPREPLY=($(compgen -W "$words" -- "$cur")); else compopt -o default; fi
}}
complete -F _squint squint
)",
                       fmt::arg("verbs", fmt::join(verb_names(program), " ")), fmt::arg("key_words", words),
                       fmt::arg("keys", names), fmt::arg("values", values), fmt::arg("flags", flags),
                       fmt::arg("shelf", fmt::join(shelf(), " ")));
}

/// Text within an _arguments or _describe specification.
std::string zsh_text(std::string_view text) {
    std::string out;
    for (const char c : text) {
        if (c == ':' || c == '[' || c == ']' || c == '\\') out += '\\';
        out += c;
    }
    return out;
}

std::string zsh_of(const ProgramText& program) {
    std::string verbs, cases, key_words;
    for (const VerbText& verb : program.verbs) {
        verbs += fmt::format("        {}\n", in_single_quotes(verb.name + ":" + zsh_text(verb.help)));
        std::string arguments;
        for (const FlagText& flag : verb.flags)
            for (const std::string& name : flag.names) {
                std::string spec = fmt::format("*{}[{}]", name, zsh_text(flag.help));
                if (!flag.value.empty())
                    spec += fmt::format("{}{}:{}", flag.optional ? "::" : ":", zsh_text(flag.value),
                                        takes_key(flag) ? "_squint_keys"
                                        : flag.choices.empty()
                                            ? "_files"
                                            : fmt::format("({})", fmt::join(flag.choices, " ")));
                arguments += " \\\n            " + in_single_quotes(spec);
            }
        cases += fmt::format("        {}) _arguments{} \\\n            '*:file:{}' ;;\n", verb.name,
                             arguments, verb.name == "help" ? "_squint_verbs" : "_squint_files");
    }
    std::string names;
    for (const Key& key : keys()) {
        names += fmt::format("        {}\n", in_single_quotes(key.name + ":" + zsh_text(key.help)));
        if (!key.words.empty())
            key_words += fmt::format("        {}) compadd -- {} ;;\n", key.name, fmt::join(key.words, " "));
    }
    return fmt::format(R"(#compdef squint
# zsh completion of squint; written by `squint help --form zsh`
_squint_verbs() {{
    local -a verbs=(
{verbs}    )
    _describe verb verbs
}}
_squint_keys() {{
    if compset -P '*='; then
        case ${{IPREFIX%=}} in
{key_words}        *) _files ;;
        esac
        return
    fi
    local -a keys=(
{keys}    )
    _describe key keys -S =
}}
_squint_files() {{
    if [[ $PREFIX = @* ]]; then compadd -- {shelf}; else _files; fi
}}
_squint() {{
    if (( CURRENT == 2 )); then
        _squint_verbs
        return
    fi
    local verb=$words[2]
    shift words
    (( CURRENT-- ))
    case $verb in
{cases}    esac
}}
_squint "$@"
)",
                       fmt::arg("verbs", verbs), fmt::arg("keys", names), fmt::arg("key_words", key_words),
                       fmt::arg("cases", cases), fmt::arg("shelf", fmt::join(shelf(), " ")));
}

std::string fish_of(const ProgramText& program) {
    std::string text =
        "# fish completion of squint; written by `squint help --form fish`\n"
        "function __squint_keys\n    printf '%s\\n'";
    for (const Key& key : keys()) {
        text += fmt::format(" {}=", key.name);
        for (const std::string& word : key.words) text += " " + in_single_quotes(key.name + "=" + word);
    }
    text += "\nend\n";
    for (const VerbText& verb : program.verbs) {
        text += fmt::format("complete -c squint -f -n __fish_use_subcommand -a {} -d {}\n", verb.name,
                            in_single_quotes(verb.help));
        const std::string here =
            fmt::format("complete -c squint -n '__fish_seen_subcommand_from {}'", verb.name);
        for (const FlagText& flag : verb.flags) {
            text += here;
            for (const std::string& name : flag.names)
                text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
            if (!flag.value.empty() && !flag.optional) text += " -r";
            if (!flag.choices.empty())
                text += fmt::format(" -f -a {}",
                                    in_single_quotes(fmt::format("{}", fmt::join(flag.choices, " "))));
            if (takes_key(flag)) text += " -f -a '(__squint_keys)'";
            text += fmt::format(" -d {}\n", in_single_quotes(flag.help));
        }
    }
    text += fmt::format("complete -c squint -f -n '__fish_seen_subcommand_from help' -a '{}'\n",
                        fmt::join(verb_names(program), " "));
    return text +
           fmt::format("complete -c squint -n 'string match -q \"@*\" -- (commandline -ct)' -f -a '{}'\n",
                       fmt::join(shelf(), " "));
}

}  // namespace

std::string manual(const ProgramText& program, std::string_view form, const std::string& verb) {
    if (form == "bash") return bash_of(program);
    if (form == "zsh") return zsh_of(program);
    if (form == "fish") return fish_of(program);
    if (form == "scene") return man_of_scene(program);
    for (const VerbText& each : program.verbs)
        if (each.name == verb) return man_of(program, each);
    return man_of(program);
}

}  // namespace squint::cli
