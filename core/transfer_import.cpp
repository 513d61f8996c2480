#include "core/transfer_import.h"

#include "core/error.h"
#include "core/srgb.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <optional>
#include <span>

namespace squint {
namespace {

constexpr std::size_t kMostBytes = std::size_t{16} << 20;  // colour maps are a few kilobytes
constexpr std::size_t kMostPoints = 65536;

/// Text of a file for a message of one line.
std::string printable(std::string text) {
    for (char& c : text)
        if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) > 0x7e) c = ' ';
    return text;
}
std::string excerpt(const std::string& text) {
    return printable(text.size() > 60 ? text.substr(0, 60) + "..." : text);
}

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
    throw InputError(fmt::format("{}: {}", path, what));
}

std::string read_text(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) refuse(path, "cannot be opened");
    std::string text;
    for (char part[1 << 16]; text.size() <= kMostBytes && file;) {
        file.read(part, sizeof part);
        text.append(part, static_cast<std::size_t>(file.gcount()));
    }
    if (file.bad()) refuse(path, "cannot be read");
    if (text.size() > kMostBytes)
        refuse(path, fmt::format("larger than {} bytes, no transfer function is", kMostBytes));
    return text;
}

Vec3 decoded(const Vec3& color, bool srgb) {
    return srgb ? Vec3(linear_from_srgb(color.x), linear_from_srgb(color.y), linear_from_srgb(color.z))
                : color;
}

/// Groups of `stride` numbers, each beginning with its value.
void check_groups(std::span<const double> numbers, std::size_t stride, const std::string& path,
                  const std::string& name) {
    if (numbers.empty() || numbers.size() % stride != 0)
        refuse(path,
               fmt::format("{} has {} numbers, allowed is {} for every point", name, numbers.size(), stride));
    if (numbers.size() / stride > kMostPoints)
        refuse(path,
               fmt::format("{} has {} points, allowed is {}", name, numbers.size() / stride, kMostPoints));
}

std::vector<ColorPoint> color_points(std::span<const double> numbers, bool srgb, const std::string& path,
                                     const std::string& name) {
    check_groups(numbers, 4, path, name);
    for (std::size_t i = 0; i < numbers.size(); ++i)  // before decoding, which would hide a colour below 0
        if (i % 4 != 0 && !(numbers[i] >= 0 && numbers[i] <= 1))
            refuse(path, fmt::format("{}, point {}: {}, allowed is 0 to 1", name, i / 4 + 1, numbers[i]));
    std::vector<ColorPoint> points;
    for (std::size_t i = 0; i < numbers.size(); i += 4)
        points.push_back({numbers[i], decoded({numbers[i + 1], numbers[i + 2], numbers[i + 3]}, srgb)});
    return points;
}

/// The last look at what was imported: order and ranges, with the file's name in front.
TransferFunction checked(TransferFunction function, const std::string& path) {
    function.name = path;
    check(function);
    return function;
}

// ---- ParaView

std::vector<double> json_numbers(const nlohmann::json& map, const char* key, const std::string& path) {
    const auto& list = map.at(key);
    if (!list.is_array()) refuse(path, fmt::format("{} is not a list of numbers", key));
    std::vector<double> numbers;
    for (const auto& item : list) {
        if (!item.is_number())
            refuse(path, fmt::format("{} holds {}, allowed are numbers", key, excerpt(item.dump())));
        numbers.push_back(item.get<double>());
    }
    return numbers;
}

/// The one colour map of the file: an object, or a list of one.
const nlohmann::json& only_map(const nlohmann::json& document, const std::string& path) {
    if (document.is_array() && document.size() != 1)
        refuse(path, fmt::format("a list of {} colour maps, allowed is one", document.size()));
    const nlohmann::json& map = document.is_array() ? document[0] : document;
    if (!map.is_object()) refuse(path, "not a ParaView colour map, allowed is an object or a list of one");
    return map;
}

TransferFunction paraview_function(const nlohmann::json& map, bool srgb, const std::string& path) {
    if (map.contains("ColorSpace") && map["ColorSpace"] != "RGB")
        refuse(path, fmt::format("ColorSpace {}, allowed is \"RGB\": export the map with that interpolation",
                                 excerpt(map["ColorSpace"].dump())));
    if (!map.contains("RGBPoints")) refuse(path, "there is no RGBPoints, allowed are continuous colour maps");
    const std::vector<double> colors = json_numbers(map, "RGBPoints", path);

    TransferFunction function;
    function.color = color_points(colors, srgb, path, "RGBPoints");
    if (!map.contains("Points") ||
        map["Points"].is_null()) {  // what ParaView shows of a map that has colours alone
        function.opacity = {{function.color.front().value, 0}, {function.color.back().value, 1}};
        return function;
    }
    const std::vector<double> opacities = json_numbers(map, "Points", path);
    check_groups(opacities, 4, path, "Points");
    for (std::size_t i = 0; i < opacities.size(); i += 4) {
        if (opacities[i + 2] != 0.5 || opacities[i + 3] != 0)
            refuse(path, fmt::format(
                             "Points, point {}: midpoint {} and sharpness {}, allowed are 0.5 and 0 (linear)",
                             i / 4 + 1, opacities[i + 2], opacities[i + 3]));
        function.opacity.push_back({opacities[i], opacities[i + 1]});
    }
    return function;
}

// ---- 3D Slicer

/// The lines of a file, without the ends of lines and without empty ones.
std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        std::string line = text.substr(at, end - at);
        while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back()))) line.pop_back();
        if (!line.empty()) lines.push_back(std::move(line));
        at = end + 1;
    }
    return lines;
}

/// One number of a line of text, for a "C" locale whatever the program's is.
std::optional<double> number_at(const std::string& line, std::size_t& at) {
    at = std::min(line.find_first_not_of(" \t", at), line.size());
    const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
    double number = 0;
    const auto [stopped, error] = std::from_chars(line.data() + at, line.data() + end, number);
    if (error != std::errc{} || stopped != line.data() + end || at == end) return std::nullopt;
    at = end;
    return number;
}

/// A line "N a b c ...": N numbers follow.
std::vector<double> counted_numbers(const std::string& line, const std::string& path,
                                    const std::string& name) {
    std::size_t at = 0;
    const std::optional<double> count = number_at(line, at);
    if (!count || *count < 0 || *count > 4.0 * kMostPoints || *count != std::floor(*count))
        refuse(path, fmt::format("{}: \"{}\" does not begin with a count of numbers", name, excerpt(line)));
    std::vector<double> numbers;
    while (line.find_first_not_of(" \t", at) != std::string::npos) {
        const std::optional<double> number = number_at(line, at);
        if (!number)
            refuse(path, fmt::format("{}: \"{}\" is not a number", name, excerpt(line.substr(at, 20))));
        numbers.push_back(*number);
    }
    if (numbers.size() != static_cast<std::size_t>(*count))
        refuse(path,
               fmt::format("{}: {} numbers, the count before them says {}", name, numbers.size(), *count));
    return numbers;
}

TransferFunction slicer_function(const std::vector<std::string>& lines, bool srgb, const std::string& path) {
    constexpr std::size_t kSettings =
        6;  // interpolation, shade, diffuse, ambient, specular, power: the scene's own affair
    if (lines.size() != kSettings + 3)
        refuse(path,
               fmt::format("{} lines, allowed are 9: six settings, scalar opacity, gradient opacity, colour",
                           lines.size()));
    for (std::size_t i = 0; i < kSettings; ++i) {
        std::size_t at = 0;
        if (!number_at(lines[i], at) || at != lines[i].size())
            refuse(path, fmt::format("line {}: \"{}\", allowed is one number", i + 1, excerpt(lines[i])));
    }
    const auto opacities = counted_numbers(lines[kSettings], path, "scalar opacity");
    const auto gradients = counted_numbers(lines[kSettings + 1], path, "gradient opacity");
    const auto colors = counted_numbers(lines[kSettings + 2], path, "colour");
    check_groups(opacities, 2, path, "scalar opacity");
    if (!gradients.empty()) check_groups(gradients, 2, path, "gradient opacity");
    for (std::size_t i = 1; i < gradients.size(); i += 2)
        if (gradients[i] != 1)
            refuse(path,
                   fmt::format(
                       "gradient opacity of {}, allowed is 1 everywhere: opacity depends on the scalar alone",
                       gradients[i]));

    TransferFunction function;
    function.color = color_points(colors, srgb, path, "colour");
    for (std::size_t i = 0; i < opacities.size(); i += 2)
        function.opacity.push_back({opacities[i], opacities[i + 1]});
    return function;
}

// ---- Presets

struct Preset {
    std::string_view name;
    std::vector<ColorPoint> color;      // HU; linear light
    std::vector<OpacityPoint> opacity;  // of one millimetre
};

constexpr Vec3 kSkin(0.82, 0.46, 0.32), kFat(0.85, 0.62, 0.28), kFlesh(0.55, 0.11, 0.07),
    kBlood(0.66, 0.03, 0.02), kBone(0.90, 0.80, 0.62), kEnamel(1, 0.97, 0.90), kAir(0.10, 0.25, 0.55),
    kLung(0.75, 0.36, 0.28);

// On the Hounsfield scale air is -1000, lung -900 to -500, fat -120 to -60, water 0, muscle 30 to 70, blood
// with contrast 150 to 450, cancellous bone 200 to 700, cortical bone 700 to 2000, enamel above 2000.
const std::vector<Preset>& presets() {
    static const std::vector<Preset> list{
        // Bone alone, soft at its spongy edge.
        {"ct_bone",
         {{150, kFlesh}, {350, kBone}, {1500, kBone}, {2200, kEnamel}},
         {{150, 0}, {300, 0.08}, {700, 0.45}, {1500, 0.85}}},
        // The surface of bone, opaque: what a fracture looks like.
        {"ct_bone_surface", {{250, kBone}, {1500, kBone}, {2200, kEnamel}}, {{250, 0}, {300, 1}}},
        // The surface of the body: a thin rise from air, then dense.
        {"ct_skin", {{-500, kSkin}, {50, kSkin}, {300, kBone}}, {{-450, 0}, {-250, 0.5}, {-150, 0.9}}},
        // Skin as a veil with bone under it.
        {"ct_skin_and_bone",
         {{-400, kSkin}, {100, kSkin}, {250, kBone}, {2200, kEnamel}},
         {{-400, 0}, {-250, 0.03}, {-150, 0.01}, {150, 0.01}, {300, 0.3}, {1000, 0.9}}},
        // Muscle and organs; fat is a breath, bone shines through.
        {"ct_muscle",
         {{-150, kFat}, {-30, kFat}, {20, kFlesh}, {120, kFlesh}, {300, kBone}, {2000, kEnamel}},
         {{-150, 0}, {-60, 0.01}, {10, 0.03}, {50, 0.35}, {120, 0.35}, {250, 0.3}, {700, 0.8}}},
        // Airways and the tissue of the lung; the body around it stays clear.
        {"ct_lung",
         {{-1000, kAir}, {-900, kAir}, {-750, kLung}, {-400, kLung}},
         {{-1000, 0}, {-950, 0.004}, {-850, 0.015}, {-650, 0.08}, {-500, 0.12}, {-350, 0}}},
        // Vessels filled with contrast medium, before faint bone.
        {"ct_vessels",
         {{100, kFlesh}, {160, kBlood}, {400, kBlood}, {550, kBone}, {2000, kEnamel}},
         {{110, 0}, {170, 0.25}, {300, 0.7}, {420, 0.7}, {550, 0.15}, {1500, 0.25}}},
        // Everything at once, for a first look.
        {"ct_overview",
         {{-600, kLung},
          {-150, kFat},
          {-40, kFat},
          {30, kFlesh},
          {120, kFlesh},
          {250, kBone},
          {2000, kEnamel}},
         {{-700, 0}, {-400, 0.004}, {-100, 0.006}, {40, 0.03}, {150, 0.04}, {300, 0.3}, {1000, 0.8}}},
    };
    return list;
}

}  // namespace

std::vector<std::string> transfer_preset_names() {
    std::vector<std::string> names;
    for (const Preset& preset : presets()) names.emplace_back(preset.name);
    return names;
}

bool find_transfer_preset(std::string_view name, TransferFunction& function) {
    const auto found =
        std::find_if(presets().begin(), presets().end(), [&](const Preset& p) { return p.name == name; });
    if (found == presets().end()) return false;
    function = {};
    function.color = found->color, function.opacity = found->opacity;
    function.name = found->name;
    return true;
}

TransferFunction import_paraview_json(const std::string& path, bool srgb, double unit_distance) {
    const std::string text = read_text(path);
    try {
        const nlohmann::json document = nlohmann::json::parse(text);
        TransferFunction function = paraview_function(only_map(document, path), srgb, path);
        function.unit_distance = unit_distance;
        return checked(std::move(function), path);
    } catch (const nlohmann::json::exception& error) {
        refuse(path, fmt::format("not a JSON colour map: {}", printable(error.what())));
    }
}

TransferFunction import_slicer_vp(const std::string& path, bool srgb) {
    const std::string text = read_text(path);
    if (text.starts_with('{')) refuse(path, "a JSON volume property, allowed is the text format (.vp)");
    return checked(slicer_function(lines_of(text), srgb, path), path);
}

}  // namespace squint
