// Resolves [transfer_function] to a TransferFunction.
#include "core/error.h"
#include "core/srgb.h"
#include "core/transfer_import.h"
#include "core/transfer_presets.h"
#include "scene/from_data.h"
#include "scene/scene.h"
#include "scene/toml.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

namespace squint {
namespace {

constexpr std::string_view kPhantom = "phantom";

Vec3 linear_color(const TransferFunctionSettings& settings, double r, double g, double b) {
    if (settings.color_space != "srgb") return Vec3(r, g, b);
    return Vec3(linear_from_srgb(r), linear_from_srgb(g), linear_from_srgb(b));
}

TransferFunction from_lists(const TransferFunctionSettings& settings) {
    TransferFunction function;
    for (const auto& p : settings.points) {
        function.color.push_back({p[0], linear_color(settings, p[1], p[2], p[3])});
        function.opacity.push_back({p[0], p[4]});
    }
    for (const auto& p : settings.color)
        function.color.push_back({p[0], linear_color(settings, p[1], p[2], p[3])});
    for (const auto& p : settings.opacity) function.opacity.push_back({p[0], p[1]});
    function.unit_distance = settings.unit_distance;
    return function;
}

TransferFunction from_preset(const Scene& scene) {
    const std::string& name = scene.transfer_function.preset;
    TransferFunction function;
    if (name == kPhantom) return from_lists(built_in_scene().transfer_function);
    if (find_transfer_preset(name, function)) return function;
    const std::vector<std::string> known = transfer_function_presets();
    throw InputError(fmt::format("{}: found {}; allowed: {}", where(scene, "transfer_function.preset"),
                                 in_quotes(name), listed({known.begin(), known.end()})));
}

TransferFunction from_file(const Scene& scene) {
    const auto& settings = scene.transfer_function;
    const std::string path = expand_path(settings.file, scene.folder, where(scene, "transfer_function.file"));
    const bool srgb = settings.color_space == "srgb";
    switch (function_file(settings.file)) {
        case FunctionFile::slicer_text:
            return import_slicer_vp(path, srgb);
        case FunctionFile::slicer_json:
            return import_slicer_json(path, srgb);
        case FunctionFile::imagevis3d:
            return import_imagevis3d(path, srgb, settings.unit_distance);
        case FunctionFile::paraview:
        case FunctionFile::unknown:
            break;
    }
    return import_paraview_json(path, settings.map, srgb, settings.unit_distance);
}

/// Moves the first and last of all points to the ends of the scene's range.
void stretch(TransferFunction& function, const Scene& scene, const Volume& volume) {
    const ValueRange& range = scene.transfer_function.range;
    if (!range.of_data && range.ends.empty()) return;
    double low = 0, high = 0;
    if (range.of_data)
        std::tie(low, high) =
            std::minmax({volume.value_at(volume.smallest), volume.value_at(volume.largest)});
    else
        low = range.ends[0], high = range.ends[1];
    const double first = std::min(function.color.front().value, function.opacity.front().value),
                 last = std::max(function.color.back().value, function.opacity.back().value);
    const std::string at = where(scene, "transfer_function.range");
    if (!(first < last))
        throw InputError(
            fmt::format("{}: all points stand at {}; allowed: points at two values or more", at, first));
    if (!(low < high))
        throw InputError(
            fmt::format("{}: every voxel is {}; allowed: two numbers, the first below the second", at, low));
    const double scale = (high - low) / (last - first);
    const auto moved = [&](double value) { return value == last ? high : low + (value - first) * scale; };
    for (ColorPoint& point : function.color) point.value = moved(point.value);
    for (OpacityPoint& point : function.opacity) point.value = moved(point.value);
}

}  // namespace

FunctionFile function_file(std::string_view name) {
    if (name.ends_with(".vp.json")) return FunctionFile::slicer_json;
    if (name.ends_with(".vp")) return FunctionFile::slicer_text;
    if (name.ends_with(".json")) return FunctionFile::paraview;
    return name.ends_with(".1dt") ? FunctionFile::imagevis3d : FunctionFile::unknown;
}

std::vector<std::string> transfer_function_presets() {
    std::vector<std::string> names = transfer_preset_names();
    names.emplace_back(kPhantom);
    return names;
}

TransferFunction resolve_transfer_function(const Scene& scene, const Volume& volume) {
    const auto& settings = scene.transfer_function;
    std::string_view key = "transfer_function.points";
    TransferFunction function;
    if (!has_transfer_function(scene))
        throw InputError(
            fmt::format("{}: found none; allowed: exactly one of points, color with opacity, preset, file",
                        where(scene, "transfer_function")));
    if (!settings.preset.empty())
        key = "transfer_function.preset", function = from_preset(scene);
    else if (!settings.file.empty())
        key = "transfer_function.file", function = from_file(scene);
    else
        key = settings.points.empty() ? "transfer_function.color" : key, function = from_lists(settings);
    // The scene's unit distance replaces that of a preset or a .vp file.
    if (settings.unit_distance > 0) function.unit_distance = settings.unit_distance;
    function.entries = settings.entries;
    function.name = where(scene, key);
    check(function);
    stretch(function, scene, volume);
    return function;
}

}  // namespace squint
