#include "scene/rules.h"

#include "core/procedural.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace squint {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

constexpr Limits kLimits[] = {
    {"volume.dims", 1, 1 << 30},
    {"volume.offset", 0},
    {"volume.spacing", 0, kNone, true},
    {"volume.bits", 0, 16},
    {"volume.component", 0, 65535},
    {"volume.series", 0, 100000},
    {"transfer_function.unit_distance", 0},
    {"transfer_function.entries", 2, 65536, false, false, 0},
    {"camera.azimuth", -36000, 36000},
    {"camera.elevation", -90, 90},
    {"camera.height", 0, kNone, true},
    {"camera.fov_y", 0, 180, true, true},
    {"camera.turntable", 1, 10000},
    {"image.width", 1, 16384},
    {"image.height", 1, 16384},
    {"image.background", 0, 1},
    {"sampling.step", 0, kNone, true},
    {"sampling.termination", 0, 1, false, true},
    {"shading.ka", 0, 1},
    {"shading.kd", 0, 1},
    {"shading.ks", 0, 1},
    {"shading.exponent", 1, 4096},
    {"shading.exaggeration", 0, 7},
    {"shading.gradient_floor", 0, 65536},
    {"shading.cool", 0, 1},
    {"shading.warm", 0, 1},
    {"shading.cool_share", 0, 1},
    {"shading.warm_share", 0, 1},
    {"classification.order", 1, orders_of(Method::pips).most},
    {"classification.table_size", 64, 4096},
    {"precision.budget", 0, kNone, true},
    {"lights.color", 0, 1},
};
constexpr Limits kNoLimits{""};

}  // namespace

std::string Limits::text() const {
    std::string text;
    if (std::isfinite(low) && std::isfinite(high) && !low_open && !high_open)
        text = fmt::format(" from {} to {}", low, high);
    else if (std::isfinite(low) && std::isfinite(high))
        text = fmt::format(" {} {} and {} {}", low_open ? "above" : "of at least", low,
                           high_open ? "below" : "at most", high);
    else if (std::isfinite(low))
        text = low_open ? fmt::format(" above {}", low) : fmt::format(" of {} or more", low);
    return std::isnan(also) ? text : text + fmt::format(", or {}", also);
}

const Limits& limits_of(std::string_view key) {
    const auto* found =
        std::find_if(std::begin(kLimits), std::end(kLimits), [&](const Limits& l) { return l.key == key; });
    return found == std::end(kLimits) ? kNoLimits : *found;
}

std::vector<std::string_view> words_of(std::string_view key) {
    if (key == "volume.type") return {"u8", "i8", "u16", "i16", "u32", "i32", "u64", "i64", "f32", "f64"};
    if (key == "volume.space") return {"file", "lps"};
    if (key == "volume.procedural") {
        std::vector<std::string_view> names;
        for (const ProceduralField& field : procedural_fields()) names.push_back(field.name);
        return names;
    }
    if (key == "transfer_function.preset") {
        static const std::vector<std::string> presets = transfer_function_presets();
        return {presets.begin(), presets.end()};
    }
    if (key == "volume.endian") return {"little", "big"};
    if (key == "transfer_function.color_space") return {"linear", "srgb"};
    if (key == "precision.preset") return {std::begin(kPrecisionPresets), std::end(kPrecisionPresets)};
    return {};
}

bool may_be_empty(std::string_view key) {
    return key == "volume.type" || key == "volume.procedural" || key == "transfer_function.preset";
}

std::vector<std::size_t> counts_of(std::string_view key) {
    if (key == "volume.window") return {2};
    return {1, 3};
}

}  // namespace squint
