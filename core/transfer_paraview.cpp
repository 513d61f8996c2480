// ParaView's colour maps.
#include "core/color_spaces.h"
#include "core/transfer_import.h"
#include "core/transfer_text.h"

#include <algorithm>

namespace squint {
namespace {

using namespace transfer_text;

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

}  // namespace

TransferFunction import_paraview_json(const std::string& path, const std::string& map, bool srgb,
                                      double unit_distance) {
    return from_json(path, [&](const Json& document) {
        TransferFunction function = paraview_function(chosen_map(document, map, path), srgb, path);
        function.unit_distance = unit_distance;
        return function;
    });
}

}  // namespace squint
