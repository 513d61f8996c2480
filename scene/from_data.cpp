#include "scene/from_data.h"

#include "core/import/kind.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace squint {
namespace {

/// Number of voxels looked at, evenly spaced: enough for a percentile.
constexpr std::int64_t kMostVoxels = std::int64_t{1} << 22;

/// A histogram: how many of those voxels have each level.
struct Levels {
    std::vector<std::int64_t> count;
    std::int64_t all = 0;

    explicit Levels(const Volume& volume) : count(volume.largest + std::size_t{1}) {
        const std::int64_t voxels = volume.voxels();
        std::int64_t apart = std::max<std::int64_t>(1, voxels / kMostVoxels);
        if (apart > 1) apart |= 1;  // odd, so not a multiple of a row's length that is a power of two
        const auto* bytes = static_cast<const std::uint8_t*>(volume.data.get());
        const auto* words = static_cast<const std::uint16_t*>(volume.data.get());
        for (std::int64_t i = 0; i < voxels; i += apart, ++all)
            ++count[volume.type == ScalarType::u8 ? bytes[i] : words[i]];
    }

    /// The share of voxels between two levels.
    double share(double first, double last) const {
        std::int64_t sum = 0;
        for (std::size_t level = 0; level < count.size(); ++level)
            if (first <= static_cast<double>(level) && static_cast<double>(level) <= last)
                sum += count[level];
        return static_cast<double>(sum) / static_cast<double>(all);
    }

    /// The level whose two sides have the greatest variance between them (Otsu 1979, equation 18).
    std::size_t threshold() const {
        double sum = 0, below = 0, sum_below = 0, best = -1;
        for (std::size_t level = 0; level < count.size(); ++level)
            sum += static_cast<double>(level) * static_cast<double>(count[level]);
        std::size_t split = 0;
        for (std::size_t level = 0; level < count.size(); ++level) {
            below += static_cast<double>(count[level]);
            sum_below += static_cast<double>(level) * static_cast<double>(count[level]);
            const double above = static_cast<double>(all) - below;
            if (below == 0 || above <= 0) continue;
            const double apart = sum_below / below - (sum - sum_below) / above;
            const double between = below * above * apart * apart;
            if (between > best) best = between, split = level;
        }
        return split;
    }

    /// The level below which `part` of the voxels above `split` lies.
    double percentile(std::size_t split, double part) const {
        std::int64_t above = 0, seen = 0;
        for (std::size_t level = split + 1; level < count.size(); ++level) above += count[level];
        for (std::size_t level = split + 1; level < count.size(); ++level) {
            seen += count[level];
            if (static_cast<double>(seen) >= part * static_cast<double>(above))
                return static_cast<double>(level);
        }
        return static_cast<double>(count.size() - 1);
    }
};

/// Whether there is air near -1000 HU, soft tissue or water near 0, and nothing that no scanner stores.
bool is_hounsfield(const Volume& volume, const Levels& levels) {
    if (volume.modality == "CT") return true;
    if (!volume.modality.empty() || volume.value_scale <= 0) return false;
    const auto level_of = [&](double hu) { return (hu - volume.value_offset) / volume.value_scale; };
    const double least = volume.value_offset + volume.value_scale * volume.smallest,
                 greatest = volume.value_offset + volume.value_scale * volume.largest;
    return least >= -4096 && least <= -850 && greatest >= 200 && greatest <= 32767 &&
           levels.share(level_of(-4096), level_of(-850)) > 0.02 &&
           levels.share(level_of(-200), level_of(200)) > 0.02;
}

/// Opacity that rises from a split of the histogram to its brightest voxels.  The fainter matter lets light
/// pass through 256 steps across the volume, whatever its units.
TransferFunctionSettings histogram_function(const Volume& volume, const Levels& levels, std::size_t split) {
    struct Stop {
        double level, r, g, b, alpha;
    };
    const double middle = levels.percentile(split, 0.5), bright = levels.percentile(split, 0.9),
                 brightest = levels.percentile(split, 0.995);
    Stop stops[] = {
        {static_cast<double>(split), 0.45, 0.18, 0.10, 0},
        {middle, 0.80, 0.45, 0.25, 0.10},
        {bright, 0.95, 0.78, 0.52, 0.35},
        {brightest, 1.00, 0.97, 0.90, 0.80},
    };
    TransferFunctionSettings settings;
    double last = -1;
    for (Stop& stop : stops) {
        stop.level = std::max(stop.level, last + 1);
        last = stop.level;
    }
    if (volume.value_scale < 0) std::reverse(std::begin(stops), std::end(stops));
    for (const Stop& s : stops)
        settings.points.push_back(
            {volume.value_offset + volume.value_scale * s.level, s.r, s.g, s.b, s.alpha});
    const Vec3 size = Vec3(volume.dims) * volume.spacing;
    settings.unit_distance = size.length() / 256;
    return settings;
}

}  // namespace

Scene scene_asked_for(const std::string& file, const std::vector<std::string>& overrides) {
    const auto sets_file = [](const std::string& text) { return text.starts_with("volume.file"); };
    const bool of_data =
        file.empty() ? std::any_of(overrides.begin(), overrides.end(), sets_file) : looks_like_volume(file);
    Scene scene = of_data        ? scene_with(scene_of_data(file), overrides)
                  : file.empty() ? scene_with(built_in_scene(), overrides)
                                 : read_scene(file, overrides);
    scene.precision = resolved_precision(scene);
    return scene;
}

Scene scene_of_data(const std::string& file) {
    Scene scene;
    scene.name = file;
    scene.volume.procedural.clear();
    scene.volume.file = file;
    scene.lights = {{.headlight = true}};
    scene.shading.ka = 0.25, scene.shading.kd = 0.6, scene.shading.ks = 0.15;
    scene.classification.method = Method::pips;
    return scene;
}

bool has_transfer_function(const Scene& scene) {
    const auto& tf = scene.transfer_function;
    return !tf.points.empty() || !tf.color.empty() || !tf.opacity.empty() || !tf.preset.empty() ||
           !tf.file.empty();
}

void complete_from_data(Scene& scene, const Volume& volume, std::vector<std::string>& notes) {
    if (has_transfer_function(scene)) return;
    const Levels levels(volume);
    const bool ct = is_hounsfield(volume, levels);
    const std::size_t split = levels.threshold();
    const TransferFunctionSettings given = std::exchange(scene.transfer_function, {});
    TransferFunctionSettings& chosen = scene.transfer_function;
    if (ct)
        chosen.preset = "ct_skin_and_bone";
    else
        chosen = histogram_function(volume, levels, split);
    if (given.unit_distance > 0) chosen.unit_distance = given.unit_distance;
    chosen.entries = given.entries, chosen.range = given.range;
    notes.push_back(
        ct ? fmt::format(
                 "{}: no transfer function is given: ct_skin_and_bone is taken, for CT in Hounsfield units "
                 "({})",
                 volume.name,
                 volume.modality == "CT" ? "stated by the file" : "its air and soft tissue are recognised")
           : fmt::format(
                 "{}: no transfer function is given: one from the histogram is taken, clear below {:.6g}",
                 volume.name, volume.value_offset + volume.value_scale * static_cast<double>(split)));
}

}  // namespace squint
