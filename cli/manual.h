// What the command line understands, as a table: for man pages and for shells that complete.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace squint::cli {

struct FlagText {
    std::vector<std::string> names;  // "-o", "--output"; of a word without a flag: its name
    std::string value;               // "OUT.exr"; empty: takes none
    bool optional = false;           // the value may be left out
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

/// The forms that `manual()` has: "man", "scene" (both roff), "bash", "zsh", "fish".
inline constexpr std::string_view kManualForms[] = {"man", "scene", "bash", "zsh", "fish"};

/// "man": the page of a verb, or of the program where `verb` is empty; "scene": the page squint-scene(5) of every key;
/// else a shell's completion: verbs, flags, their words, and the keys, wires and presets of --set.
std::string manual(const ProgramText& program, std::string_view form, const std::string& verb);

}  // namespace squint::cli
