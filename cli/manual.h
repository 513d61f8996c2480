// The command line as a table: for man pages and completions of shells.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace squint::cli {

struct FlagText {
    std::vector<std::string> names;  // "-o", "--output"; for a word without a flag, its name
    std::string value;               // "OUT.exr"; empty: takes no value
    bool optional = false;           // the value may be omitted
    std::vector<std::string> choices;
    std::string help;
};
struct VerbText {
    std::string name, group, help, footer;
    std::vector<FlagText> words, flags;
};
struct ProgramText {
    std::string help, footer, version;
    std::vector<FlagText> flags;
    std::vector<VerbText> verbs;
};

/// All forms of `manual()`: "man" and "scene" (roff), "bash", "zsh", "fish".
inline constexpr std::string_view kManualForms[] = {"man", "scene", "bash", "zsh", "fish"};

/// "man": the page of a verb, or of the program where `verb` is empty.  "scene": squint-scene(5), all keys.
/// Else a shell's completion: verbs, flags, their words; keys, wires and presets for --set.
std::string manual(const ProgramText& program, std::string_view form, const std::string& verb);

}  // namespace squint::cli
