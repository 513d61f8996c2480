#include "core/transfer_import.h"

#include "core/color_spaces.h"
#include "core/error.h"
#include "core/read_whole.h"
#include "core/srgb.h"
#include "core/text.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <optional>
#include <span>

namespace squint {
namespace {

constexpr std::size_t kMostBytes = std::size_t{16} << 20;  // colour maps are a few kilobytes
constexpr std::size_t kMostPoints = 65536;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
    throw InputError(fmt::format("{}: {}", path, what));
}

std::string read_text(const std::string& path) {
    return read_whole(path, "a transfer function of ParaView, 3D Slicer or ImageVis3D", kMostBytes);
}

Vec3 decoded(const Vec3& color, bool srgb) {
    return srgb ? Vec3(linear_from_srgb(color.x), linear_from_srgb(color.y), linear_from_srgb(color.z))
                : color;
}

/// Groups of `stride` numbers; each group begins with its value.
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

/// Checks the order and the ranges of an imported function; messages begin with the file's name.
TransferFunction checked(TransferFunction function, const std::string& path) {
    function.name = path;
    check(function);
    return function;
}

// ---- JSON

using Json = nlohmann::json;

/// Removes a comma with only space and comments before a closing bracket: editors of text leave them.
std::string without_trailing_commas(std::string text) {
    std::size_t comma = std::string::npos;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '"') {
            for (++i; i < text.size() && text[i] != '"'; ++i) i += text[i] == '\\';
        } else if (c == '/' && i + 1 < text.size() && (text[i + 1] == '/' || text[i + 1] == '*')) {
            const std::size_t end = text.find(text[i + 1] == '/' ? "\n" : "*/", i + 2);
            i = end == std::string::npos ? text.size() : end + (text[i + 1] == '*');
            continue;
        } else if (c == ',') {
            comma = i;
            continue;
        } else if (std::isspace(static_cast<unsigned char>(c))) {
            continue;
        } else if ((c == ']' || c == '}') && comma != std::string::npos) {
            text[comma] = ' ';
        }
        comma = std::string::npos;
    }
    return text;
}

/// Parses JSON, and accepts comments and trailing commas.
Json read_json(const std::string& path) {
    return Json::parse(without_trailing_commas(read_text(path)), nullptr, true, true);
}

std::vector<double> json_numbers(const Json& map, const char* key, const std::string& path) {
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

/// Refuses a curve with a midpoint or a sharpness of its own: it is not piecewise linear.
void check_straight(double midpoint, double sharpness, const std::string& path, const std::string& name,
                    std::size_t point) {
    if (midpoint != 0.5 || sharpness != 0)
        refuse(path, fmt::format("{}, point {}: midpoint {} and sharpness {}, allowed are 0.5 and 0 (linear)",
                                 name, point + 1, midpoint, sharpness));
}

// ---- ParaView

std::string name_of(const Json& map) {
    const auto name = map.find("Name");
    return name != map.end() && name->is_string() ? name->get<std::string>() : "";
}

/// The colour map of that name, or the only one of the file, which is an object or a list.
const Json& chosen_map(const Json& document, const std::string& wanted, const std::string& path) {
    std::vector<const Json*> maps;
    if (document.is_array())
        for (const Json& map : document) maps.push_back(&map);
    else
        maps.push_back(&document);
    for (const Json* map : maps)
        if (!map->is_object())
            refuse(path, "not a ParaView colour map, allowed is an object or a list of them");
    if (wanted.empty() && maps.size() == 1) return *maps[0];
    std::string names;
    for (const Json* map : maps) {
        if (!wanted.empty() && name_of(*map) == wanted) return *map;
        names += (names.empty() ? "" : ", ") + name_of(*map);
    }
    refuse(path, fmt::format("{}: transfer_function.map chooses one of {}",
                             wanted.empty() ? fmt::format("a list of {} colour maps", maps.size())
                                            : fmt::format("no colour map \"{}\"", excerpt(wanted)),
                             excerpt(names, 200)));
}

ColorSpace color_space_of(const Json& map, const std::string& path) {
    const std::string space = map.contains("ColorSpace") && map["ColorSpace"].is_string()
                                  ? map["ColorSpace"].get<std::string>()
                              : map.contains("ColorSpace") ? map["ColorSpace"].dump()
                                                           : "RGB";
    const auto wraps = map.find("HSVWrap");
    const bool wrapped = wraps != map.end() && (wraps->is_boolean() ? wraps->get<bool>() : *wraps == 1);
    if (space == "RGB") return ColorSpace::rgb;
    if (space == "HSV") return wrapped ? ColorSpace::hsv_wrapped : ColorSpace::hsv;
    if (space == "Wrapped") return ColorSpace::hsv_wrapped;
    if (space == "Lab" || space == "CIELAB") return ColorSpace::lab;
    if (space == "Diverging") return ColorSpace::diverging;
    if (space == "Step") return ColorSpace::step;
    refuse(path,
           fmt::format(
               "ColorSpace \"{}\", allowed are RGB, HSV, Lab, CIELAB, Diverging and Step: export the map "
               "with one of them",
               excerpt(space)));
}

/// Points with R G B between them in their space -> points with linear colour between them.
std::vector<double> sampled(const std::vector<double>& points, ColorSpace space, const std::string& path) {
    if (space == ColorSpace::rgb || points.empty() || points.size() % 4 != 0) return points;
    const std::size_t count = points.size() / 4;
    const std::size_t pieces = std::clamp<std::size_t>(4096 / count, 16, 256);
    if (space != ColorSpace::step && count * pieces > kMostPoints)
        refuse(path, fmt::format("RGBPoints has {} points, allowed is {} where they are sampled", count,
                                 kMostPoints / pieces));
    std::vector<double> fine;
    const auto add = [&](double value, const Vec3& color) {
        fine.insert(fine.end(), {value, color.x, color.y, color.z});
    };
    const auto color_of = [&](std::size_t i) {
        return Vec3(points[4 * i + 1], points[4 * i + 2], points[4 * i + 3]);
    };
    for (std::size_t i = 0; i + 1 < count; ++i) {
        const double from = points[4 * i], to = points[4 * i + 4];
        add(from, color_of(i));
        if (space == ColorSpace::step) add(from, color_of(i + 1));
        for (std::size_t k = 1; k < pieces && space != ColorSpace::step; ++k) {
            const double part = static_cast<double>(k) / static_cast<double>(pieces);
            add(from + (to - from) * part, color_between(space, color_of(i), color_of(i + 1), part));
        }
    }
    add(points[4 * (count - 1)], color_of(count - 1));
    return fine;
}

TransferFunction paraview_function(const Json& map, bool srgb, const std::string& path) {
    const ColorSpace space = color_space_of(map, path);
    if (!map.contains("RGBPoints"))
        refuse(
            path,
            map.contains("IndexedColors")
                ? "a map of categories (IndexedColors), allowed are continuous ones (RGBPoints): write its "
                  "colours as transfer_function.points"
                : "there is no RGBPoints, allowed are continuous colour maps");
    const std::vector<double> colors = json_numbers(map, "RGBPoints", path);
    (void)color_points(colors, false, path,
                       "RGBPoints");  // a wrong point is named by its number in the file

    TransferFunction function;
    function.color = color_points(sampled(colors, space, path), srgb, path, "RGBPoints");
    if (!map.contains("Points") ||
        map["Points"].is_null()) {  // what ParaView shows for a map without opacities
        function.opacity = {{function.color.front().value, 0}, {function.color.back().value, 1}};
        return function;
    }
    const std::vector<double> opacities = json_numbers(map, "Points", path);
    check_groups(opacities, 4, path, "Points");
    for (std::size_t i = 0; i < opacities.size(); i += 4) {
        check_straight(opacities[i + 2], opacities[i + 3], path, "Points", i / 4);
        function.opacity.push_back({opacities[i], opacities[i + 1]});
    }
    return function;
}

// ---- 3D Slicer

/// The lines of a file, without line ends and without empty lines.
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

/// Parses a number of a line as the "C" locale does, whatever the program's locale.
std::optional<double> number_at(const std::string& line, std::size_t& at) {
    at = std::min(line.find_first_not_of(" \t", at), line.size());
    const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
    double number = 0;
    const auto [stopped, error] = std::from_chars(line.data() + at, line.data() + end, number);
    if (error != std::errc{} || stopped != line.data() + end || at == end) return std::nullopt;
    at = end;
    return number;
}

/// Parses a line "N a b c ...": N, then N numbers.
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

void check_gradient_opacity(double opacity, const std::string& path) {
    if (opacity != 1)
        refuse(path,
               fmt::format(
                   "gradient opacity of {}, allowed is 1 everywhere: opacity depends on the scalar alone "
                   "(in Slicer: Volume Rendering, Advanced, Gradient Opacity)",
                   opacity));
}

TransferFunction slicer_function(const std::vector<std::string>& lines, bool srgb, const std::string& path) {
    constexpr std::size_t kSettings =
        6;  // interpolation, shade, diffuse, ambient, specular, power: the scene decides these
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
    for (std::size_t i = 1; i < gradients.size(); i += 2) check_gradient_opacity(gradients[i], path);

    TransferFunction function;
    function.color = color_points(colors, srgb, path, "colour");
    for (std::size_t i = 0; i < opacities.size(); i += 2)
        function.opacity.push_back({opacities[i], opacities[i + 1]});
    return function;
}

/// A member of a JSON object; the error says what is there instead.
const Json& member(const Json& object, const char* key, const std::string& path) {
    const auto found = object.is_object() ? object.find(key) : object.end();
    if (found == object.end())
        refuse(path, fmt::format("there is no \"{}\" where a volume property has it", key));
    return *found;
}
double json_number(const Json& object, const char* key, const std::string& path) {
    const Json& value = member(object, key, path);
    if (!value.is_number())
        refuse(path, fmt::format("\"{}\" is {}, allowed is a number", key, excerpt(value.dump())));
    return value.get<double>();
}
double json_number_or(const Json& object, const char* key, double otherwise, const std::string& path) {
    return object.contains(key) ? json_number(object, key, path) : otherwise;
}
/// The points of one of a component's functions; calls take(point).
template <class Take>
void each_point(const Json& function, const std::string& name, const std::string& path, const Take& take) {
    const Json& points = member(function, "points", path);
    if (!points.is_array() || points.empty() || points.size() > kMostPoints)
        refuse(path, fmt::format("{} has {} points, allowed is 1 to {}", name, points.size(), kMostPoints));
    for (std::size_t i = 0; i < points.size(); ++i) {
        check_straight(json_number_or(points[i], "midpoint", 0.5, path),
                       json_number_or(points[i], "sharpness", 0, path), path, name, i);
        take(points[i]);
    }
}

TransferFunction slicer_json_function(const Json& document, bool srgb, const std::string& path) {
    const Json& properties = member(document, "volumeProperties", path);
    if (!properties.is_array() || properties.size() != 1)
        refuse(path, fmt::format("{} volume properties, allowed is one", properties.size()));
    const Json& components = member(properties[0], "components", path);
    if (!components.is_array() || components.size() != 1)
        refuse(path, fmt::format("{} components, allowed is one", components.size()));
    const Json& component = components[0];
    TransferFunction function;
    function.unit_distance = json_number_or(component, "scalarOpacityUnitDistance", 1, path);
    std::vector<double> colors;
    each_point(member(component, "rgbTransferFunction", path), "rgbTransferFunction", path,
               [&](const Json& point) {
                   colors.push_back(json_number(point, "x", path));
                   const std::vector<double> color = json_numbers(point, "color", path);
                   if (color.size() != 3)
                       refuse(path, fmt::format("a colour of {} numbers, allowed is 3", color.size()));
                   colors.insert(colors.end(), color.begin(), color.end());
               });
    function.color = color_points(colors, srgb, path, "rgbTransferFunction");
    each_point(member(component, "scalarOpacity", path), "scalarOpacity", path, [&](const Json& point) {
        function.opacity.push_back({json_number(point, "x", path), json_number(point, "y", path)});
    });
    if (component.contains("gradientOpacity") && !component.value("disableGradientOpacity", false))
        each_point(component["gradientOpacity"], "gradientOpacity", path,
                   [&](const Json& point) { check_gradient_opacity(json_number(point, "y", path), path); });
    return function;
}

// ---- ImageVis3D

TransferFunction imagevis3d_function(const std::string& text, bool srgb, const std::string& path) {
    std::vector<double> numbers;
    const std::string_view space = " \t\r\n";
    for (std::size_t at = text.find_first_not_of(space); at < text.size();) {
        const std::size_t end = std::min(text.find_first_of(space, at), text.size());
        std::size_t from = 0;
        const std::optional<double> number = number_at(text.substr(at, end - at), from);
        if (!number)
            refuse(path, fmt::format("\"{}\" is not a number", excerpt(text.substr(at, end - at), 20)));
        numbers.push_back(*number);
        at = std::min(text.find_first_not_of(space, end), text.size());
    }
    const std::size_t count = numbers.empty() ? 0 : (numbers.size() - 1) / 4;
    if (count < 2 || count > kMostPoints || numbers.size() != 4 * count + 1 ||
        numbers[0] != static_cast<double>(count))
        refuse(path, fmt::format("{} numbers, allowed are a count of 2 to {} and as many colours r g b a",
                                 numbers.size(), kMostPoints));
    TransferFunction function;
    std::vector<double> colors;
    for (std::size_t i = 0; i < count; ++i) {
        const double* rgba = &numbers[4 * i + 1];
        colors.insert(colors.end(), {static_cast<double>(i), rgba[0], rgba[1], rgba[2]});
        function.opacity.push_back({static_cast<double>(i), rgba[3]});
    }
    function.color = color_points(colors, srgb, path, "colours");
    return function;
}

/// Runs a reader of JSON and turns its errors into one line.
template <class Read>
TransferFunction from_json(const std::string& path, const Read& read) {
    try {
        return checked(read(read_json(path)), path);
    } catch (const Json::exception& error) {
        const std::string what = error.what();  // "[json.exception.parse_error.101] parse error at ..."
        const std::size_t begin = what.find("] ");
        refuse(path, fmt::format("not the JSON it should be: {}",
                                 excerpt(what.substr(begin == std::string::npos ? 0 : begin + 2), 120)));
    }
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
        // Bone alone, translucent at its spongy edge.
        {"ct_bone",
         {{150, kFlesh}, {350, kBone}, {1500, kBone}, {2200, kEnamel}},
         {{150, 0}, {300, 0.08}, {700, 0.45}, {1500, 0.85}}},
        // The surface of bone, opaque: shows fractures.
        {"ct_bone_surface", {{250, kBone}, {1500, kBone}, {2200, kEnamel}}, {{250, 0}, {300, 1}}},
        // The surface of the body: a thin rise from air, then dense.
        {"ct_skin", {{-500, kSkin}, {50, kSkin}, {300, kBone}}, {{-450, 0}, {-250, 0.5}, {-150, 0.9}}},
        // Skin as a veil over bone.
        {"ct_skin_and_bone",
         {{-400, kSkin}, {100, kSkin}, {250, kBone}, {2200, kEnamel}},
         {{-400, 0}, {-250, 0.03}, {-150, 0.01}, {150, 0.01}, {300, 0.3}, {1000, 0.9}}},
        // Muscle and organs; fat is faint, bone shines through.
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
        // All tissues at once, for a first look.
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

TransferFunction import_paraview_json(const std::string& path, const std::string& map, bool srgb,
                                      double unit_distance) {
    return from_json(path, [&](const Json& document) {
        TransferFunction function = paraview_function(chosen_map(document, map, path), srgb, path);
        function.unit_distance = unit_distance;
        return function;
    });
}

TransferFunction import_slicer_vp(const std::string& path, bool srgb) {
    const std::string text = read_text(path);
    if (text.starts_with('{')) return import_slicer_json(path, srgb);
    return checked(slicer_function(lines_of(text), srgb, path), path);
}

TransferFunction import_slicer_json(const std::string& path, bool srgb) {
    return from_json(path, [&](const Json& document) { return slicer_json_function(document, srgb, path); });
}

TransferFunction import_imagevis3d(const std::string& path, bool srgb, double unit_distance) {
    TransferFunction function = imagevis3d_function(read_text(path), srgb, path);
    function.unit_distance = unit_distance;
    return checked(std::move(function), path);
}

}  // namespace squint
