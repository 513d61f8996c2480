#include "cli/common_flags.h"

#include "core/error.h"

#include <fmt/format.h>

#include <charconv>
#include <string_view>

namespace squint::cli {
namespace {

template <class Number>
Number number_of(const std::string& text, const char* flag, const char* allowed) {
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size())
        throw InputError(fmt::format("{}: found \"{}\"; allowed: {}", flag, text, allowed));
    return value;
}

}  // namespace

int integer_of(const std::string& text, const char* flag, const char* allowed) {
    return number_of<int>(text, flag, allowed);
}

std::pair<int, int> pair_of(const std::string& text, char separator, const char* flag, const char* allowed) {
    const std::size_t at = text.find(separator);
    if (at == std::string::npos)
        throw InputError(fmt::format("{}: found \"{}\"; allowed: {}", flag, text, allowed));
    return {number_of<int>(text.substr(0, at), flag, allowed),
            number_of<int>(text.substr(at + 1), flag, allowed)};
}

std::int64_t size_of(const std::string& text, const std::string& flag) {
    constexpr const char* kAllowed = "a number above 0 with K, M, G or T, as in 500M";
    std::string digits = text;
    if (!digits.empty() && digits.back() == 'B') digits.pop_back();
    int shift = 0;
    if (!digits.empty())
        if (const auto unit = std::string_view("KMGT").find(digits.back()); unit != std::string_view::npos)
            shift = 10 * (static_cast<int>(unit) + 1), digits.pop_back();
    const auto value = number_of<std::int64_t>(digits, flag.c_str(), kAllowed);
    if (value < 1 || value > (std::int64_t{1} << (62 - shift)))
        throw InputError(fmt::format("{}: found \"{}\"; allowed: {}", flag, text, kAllowed));
    return value << shift;
}

void add_json_flag(Flags& f, bool& json) {
    f.add("--json", json, "Print JSON");
}

void add_set(Flags& f, std::vector<std::string>& overrides, const char* help) {
    f.read(
         "--set", [&overrides](const std::string& text) { overrides.push_back(text); }, help)
        .in_order()
        .value("KEY=VALUE");
}

void add_size(Flags& f, std::vector<std::string>& overrides) {
    f.read(
         "--size",
         [&overrides](const std::string& text) {
             const auto [width, height] = pair_of(text, 'x', "--size", "WIDTHxHEIGHT, as in 800x600");
             overrides.push_back(fmt::format("image.width={}", width));
             overrides.push_back(fmt::format("image.height={}", height));
         },
         "Pixels; the same as setting image.width and image.height")
        .in_order()
        .value("WxH");
}

void add_series(Flags& f, std::vector<std::string>& overrides) {
    f.read(
         "--series", [&overrides](const std::string& text) { overrides.push_back("volume.series=" + text); },
         "Of a DICOM folder with several series: which, counted from 1")
        .in_order()
        .value("N");
}

void add_scene(Flags& f, SceneArguments& scene) {
    f.add("scene", scene.file,
          "Scene file (TOML), @NAME of one that comes with squint, or a volume or folder of "
          "slices, which makes "
          "a scene of its own; the built-in scene when left out")
        .value("SCENE.toml|VOLUME");
    add_series(f, scene.overrides);
    add_set(f, scene.overrides, "Set any key of the scene; may be repeated, the last wins");
    add_size(f, scene.overrides);
}

}  // namespace squint::cli
