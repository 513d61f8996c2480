#include "scene/from_data.h"

#include "core/import/kind.h"
#include "core/portable_math.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace squint {
namespace {

/// Number of voxels looked at, evenly spaced: enough for a percentile.
constexpr std::int64_t kMostVoxels = std::int64_t{1} << 22;

/// visit(index, level) for them.
template <class Visit>
void visit_voxels(const Volume& volume, const Visit& visit) {
    const std::int64_t voxels = volume.voxels();
    std::int64_t apart = std::max<std::int64_t>(1, voxels / kMostVoxels);
    if (apart > 1) apart |= 1;  // odd, so not a multiple of a row's length that is a power of two
    const auto* bytes = static_cast<const std::uint8_t*>(volume.data.get());
    const auto* words = static_cast<const std::uint16_t*>(volume.data.get());
    for (std::int64_t i = 0; i < voxels; i += apart)
        visit(i, volume.type == ScalarType::u8 ? bytes[i] : words[i]);
}

/// Last levels of what is taken for background and of what is taken for soft; the rest is dense.
struct Splits {
    std::size_t background, soft;
};

/// A histogram: how many of those voxels have each level.
struct Levels {
    std::vector<std::int64_t> count;
    std::int64_t all = 0;

    explicit Levels(const Volume& volume) : count(volume.largest + std::size_t{1}) {
        visit_voxels(volume, [&](std::int64_t, std::size_t level) { ++count[level], ++all; });
    }

    std::int64_t above(std::size_t split) const {
        std::int64_t sum = 0;
        for (std::size_t level = split + 1; level < count.size(); ++level) sum += count[level];
        return sum;
    }

    /// The share of voxels between two levels.
    double share(double first, double last) const {
        std::int64_t sum = 0;
        for (std::size_t level = 0; level < count.size(); ++level)
            if (first <= static_cast<double>(level) && static_cast<double>(level) <= last)
                sum += count[level];
        return static_cast<double>(sum) / static_cast<double>(all);
    }

    /// The level up to which a part of those in (split, last] lies.
    std::size_t percentile(std::size_t split, double part, std::size_t last) const {
        const auto wanted = part * static_cast<double>(above(split) - above(last));
        std::int64_t seen = 0;
        for (std::size_t level = split + 1; level <= last && level < count.size(); ++level) {
            seen += count[level];
            if (static_cast<double>(seen) >= wanted) return level;
        }
        return std::min(last, count.size() - 1);
    }
    std::size_t percentile(std::size_t split, double part) const {
        return percentile(split, part, count.size() - 1);
    }

    /// The levels from `first` on in three classes whose means lie farthest apart for their sizes (Otsu 1979, section
    /// III.C), found over 256 ranges of levels, of which the last takes the brightest thousandth.
    Splits three_classes(std::size_t first) const {
        constexpr std::size_t kRanges = 256;
        const std::size_t top = std::max(first, percentile(first, 0.999)),
                          width = (top - first + kRanges) / kRanges, ranges = (top - first) / width + 1;
        // Voxels, and the sum of their ranges' numbers, before each range.
        std::vector<double> voxels(ranges + 1), sums(ranges + 1);
        for (std::size_t level = first; level < count.size(); ++level) {
            const std::size_t range = std::min((level - first) / width, ranges - 1);
            voxels[range + 1] += static_cast<double>(count[level]);
        }
        for (std::size_t range = 0; range < ranges; ++range) {
            sums[range + 1] = sums[range] + static_cast<double>(range) * voxels[range + 1];
            voxels[range + 1] += voxels[range];
        }
        const auto spread = [&](std::size_t from, std::size_t to) {
            const double n = voxels[to] - voxels[from], sum = sums[to] - sums[from];
            return n > 0 ? sum * sum / n : 0;
        };
        double best = -1;
        std::size_t background = ranges, soft = ranges;
        for (std::size_t i = 1; i < ranges; ++i)
            for (std::size_t j = i + 1; j <= ranges; ++j) {
                const double apart = spread(0, i) + spread(i, j) + spread(j, ranges);
                if (apart > best) best = apart, background = i, soft = j;
            }
        return {first + background * width - 1, soft == ranges ? count.size() - 1 : first + soft * width - 1};
    }

    /// The mean level of those from `first` to `last`.
    double mean(std::size_t first, std::size_t last) const {
        double sum = 0, voxels = 0;
        for (std::size_t level = first; level <= last; ++level)
            sum += static_cast<double>(level) * static_cast<double>(count[level]),
                voxels += static_cast<double>(count[level]);
        return voxels > 0 ? sum / voxels : static_cast<double>(first);
    }

    /// Faint matter that fills the box and is hardly brighter than the background is background, too: resin about a
    /// specimen would hide it.
    Splits splits(std::size_t smallest) const {
        constexpr double kFills = 0.4, kHardlyBrighter = 0.25;
        const Splits found = three_classes(smallest);
        const std::size_t last = count.size() - 1;
        if (static_cast<double>(above(found.background)) < kFills * static_cast<double>(all) ||
            found.soft == last)
            return found;
        const double air = mean(smallest, found.background), faint = mean(found.background + 1, found.soft),
                     dense = mean(found.soft + 1, last);
        if (faint - air > kHardlyBrighter * (dense - air)) return found;
        return three_classes(found.background + 1);
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

/// From a split of the histogram to its brightest voxels, ever denser: soft matter is clear enough to see what is
/// dense in it.  Opacities are those of a 256th of the way across the volume, whatever its units.
TransferFunctionSettings histogram_function(const Volume& volume, const Levels& levels,
                                            const Splits& splits) {
    struct Stop {
        std::size_t level;
        double r, g, b, alpha;
    };
    const std::size_t least = splits.background;
    std::vector<Stop> stops{{least, 0.55, 0.20, 0.12, 0}};
    if (splits.soft < levels.count.size() - 1) {
        stops.push_back({levels.percentile(least, 0.5, splits.soft), 0.75, 0.35, 0.22, 0.06});
        stops.push_back({splits.soft, 0.90, 0.62, 0.42, 0.15});
    }
    const std::size_t dense = stops.back().level;
    stops.push_back({levels.percentile(dense, 0.5), 0.98, 0.88, 0.72, 0.5});
    stops.push_back({levels.percentile(dense, 0.95), 1.00, 0.97, 0.92, 0.9});
    for (std::size_t i = 1; i < stops.size(); ++i)
        stops[i].level = std::max(stops[i].level, stops[i - 1].level + 1);
    if (volume.value_scale < 0) std::reverse(stops.begin(), stops.end());
    TransferFunctionSettings settings;
    for (const Stop& s : stops)
        settings.points.push_back({volume.value_at(static_cast<double>(s.level)), s.r, s.g, s.b, s.alpha});
    const Vec3 size = Vec3(volume.dims) * volume.spacing;
    settings.unit_distance = size.length() / 256;
    return settings;
}

// ------------------------------------------------------------------------------------------ camera

/// What is seen of a volume along an axis, in world units: histograms from one end of its box to the other.
class Extent {
  public:
    Extent(double low, double high) : low_(low), width_((high - low) / kBins), count_(kBins) {}
    void add(double at, std::int64_t weight) {
        const double bin = std::clamp((at - low_) / width_, 0.0, kBins - 1.0);
        count_[static_cast<std::size_t>(bin)] += weight, all_ += weight;
    }
    /// All but a five-thousandth at either end: no speck of noise moves the camera.
    double first() const { return low_ + width_ * static_cast<double>(bin_at(all_ / kLeftOut)); }
    double last() const { return low_ + width_ * static_cast<double>(bin_at(all_ - all_ / kLeftOut) + 1); }
    double middle() const { return (first() + last()) / 2; }
    bool empty() const { return all_ == 0; }

  private:
    static constexpr int kBins = 2048, kLeftOut = 5000;
    /// The first bin up to which more than `wanted` lie, or all.
    std::size_t bin_at(std::int64_t wanted) const {
        std::int64_t seen = 0;
        std::size_t bin = 0;
        while (bin < count_.size() - 1 && (seen += count_[bin]) <= std::min(wanted, all_ - 1)) ++bin;
        return bin;
    }
    double low_, width_;
    std::int64_t all_ = 0;
    std::vector<std::int64_t> count_;
};

/// visit(place in grid space, weight) for voxels that a function shows: in 64ths, how opaque a 64th of the way across
/// the volume is of what they hold.
template <class Visit>
void visit_seen(const Volume& volume, const TransferFunction& function, const Visit& visit) {
    std::vector<int> weight(volume.largest + std::size_t{1});
    const double thick = (volume.box_high() - volume.box_low()).length() / 64 / function.unit_distance;
    for (std::size_t level = 0; level < weight.size(); ++level) {
        const double clear = 1 - function.alpha_at(volume.value_at(static_cast<double>(level)));
        weight[level] = static_cast<int>(64 * (1 - (clear > 0 ? portable::pow(clear, thick) : 0)));
    }
    visit_voxels(volume, [&](std::int64_t index, std::size_t level) {
        if (weight[level] == 0) return;
        const std::int64_t x = index % volume.dims.x, row = index / volume.dims.x;
        visit(volume.grid_from_voxel(Vec3(Index3(x, row % volume.dims.y, row / volume.dims.y))),
              weight[level]);
    });
}

/// Rounded to a thousandth of `size` or finer, in decimals: a scene is read by people.
double rounded(double x, double size) {
    int decimals = 3;
    for (; size < 1 && decimals < 12; size *= 10) ++decimals;
    for (; size >= 10 && decimals > 0; size /= 10) --decimals;
    return std::stod(fmt::format("{:.{}f}", x, decimals));
}

}  // namespace

bool is_of_data(const std::string& file, const std::vector<std::string>& overrides) {
    const auto sets_file = [](const std::string& text) { return text.starts_with("volume.file"); };
    return file.empty() ? std::any_of(overrides.begin(), overrides.end(), sets_file)
                        : looks_like_volume(file);
}

Scene scene_asked_for(const std::string& file, const std::vector<std::string>& overrides) {
    Scene scene = is_of_data(file, overrides) ? scene_with(scene_of_data(file), overrides)
                  : file.empty()              ? scene_with(built_in_scene(), overrides)
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
    const Splits splits = levels.splits(volume.smallest);
    const TransferFunctionSettings given = std::exchange(scene.transfer_function, {});
    TransferFunctionSettings& chosen = scene.transfer_function;
    if (ct)
        chosen.preset = "ct_skin_and_bone";
    else
        chosen = histogram_function(volume, levels, splits);
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
                 volume.name, volume.value_at(static_cast<double>(splits.background))));
}

void frame_data(Scene& scene, const Volume& volume) {
    constexpr double kMargin = 1.08;
    CameraSettings& camera = scene.camera;
    if (camera.eye || camera.center || camera.height || camera.projection != Projection::orthographic) return;
    const Camera aimed =
        in_grid_space(make_camera(camera, volume, scene.image.width, scene.image.height), volume);
    const TransferFunction function = resolve_transfer_function(scene, volume);
    const Vec3 middle = (volume.box_low() + volume.box_high()) * 0.5;
    const double most = (volume.box_high() - volume.box_low()).length() / 2;
    Extent across(-most, most), above(-most, most), ahead(-most, most);
    visit_seen(volume, function, [&](const Vec3& at, int weight) {
        const Vec3 p = at - middle;
        across.add(p.dot(aimed.right), weight), above.add(p.dot(aimed.up), weight);
        ahead.add(p.dot(aimed.view), weight);
    });
    if (across.empty()) return;
    const Vec3 center =
        middle + aimed.right * across.middle() + aimed.up * above.middle() + aimed.view * ahead.middle();
    const double tall = static_cast<double>(scene.image.height) / scene.image.width;
    double height = std::max(above.last() - above.first(), (across.last() - across.first()) * tall);
    if (camera.turntable > 1) {  // a ball that no turn leaves
        Extent far(0, 2 * most);
        visit_seen(volume, function,
                   [&](const Vec3& at, int weight) { far.add((at - center).length(), weight); });
        height = 2 * far.last() * std::max(1.0, tall);
    }
    height *= kMargin;
    if (!(height > 0)) return;
    const Vec3 world = volume.world_from_grid(center);
    camera.center = Vec3(rounded(world.x, height), rounded(world.y, height), rounded(world.z, height));
    camera.height = rounded(height, height);
}

}  // namespace squint
