// Flags that several verbs share, and the reading of their values.
#pragma once

#include "cli/flags.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace squint::cli {

/// A scene, from a file or built in, and its settings in the order given.
struct SceneArguments {
    std::string file;
    std::vector<std::string> overrides;
};

/// SCENE.toml, --series, --set and --size.
void add_scene(Flags& f, SceneArguments& scene);
void add_json_flag(Flags& f, bool& json);
void add_series(Flags& f, std::vector<std::string>& overrides);
void add_set(Flags& f, std::vector<std::string>& overrides, const char* help);
void add_size(Flags& f, std::vector<std::string>& overrides);

// Each throws InputError: the flag, what was found, what is allowed.
int integer_of(const std::string& text, const char* flag, const char* allowed);
/// "512x256" -> two numbers.
std::pair<int, int> pair_of(const std::string& text, char separator, const char* flag, const char* allowed);
/// "800M" -> bytes, at least 1.
std::int64_t size_of(const std::string& text, const std::string& flag);

}  // namespace squint::cli
