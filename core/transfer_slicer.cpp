// 3D Slicer's volume properties, as text and as JSON.
#include "core/transfer_import.h"
#include "core/transfer_text.h"

#include <algorithm>
#include <cctype>
#include <cmath>

namespace squint {
namespace {

using namespace transfer_text;

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

}  // namespace

TransferFunction import_slicer_vp(const std::string& path, bool srgb) {
    const std::string text = read_text(path);
    if (text.starts_with('{')) return import_slicer_json(path, srgb);
    return checked(slicer_function(lines_of(text), srgb, path), path);
}

TransferFunction import_slicer_json(const std::string& path, bool srgb) {
    return from_json(path, [&](const Json& document) { return slicer_json_function(document, srgb, path); });
}

}  // namespace squint
