#include "pipeline/record.h"

#include "core/hash.h"
#include "pipeline/audit_record.h"
#include "pipeline/machines/certificate.h"
#include "pipeline/machines/lanes/lane_renderer.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <type_traits>

namespace squint {
namespace {

using Json = nlohmann::ordered_json;

Image colors_of(const Image& image) {
    Image colors{image.width, image.height, {}};
    for (const char* name : {"R", "G", "B", "A"})
        if (const Channel* channel = image.find(name)) colors.channels.push_back(*channel);
    return colors;
}

/// "/home/ann/head.nrrd" -> "head.nrrd": a record names no folder of this machine.
std::string without_folders(const std::string& quoted) {
    if (!quoted.starts_with("\"/")) return quoted;
    return '"' + quoted.substr(quoted.rfind('/') + 1);
}

const StageReport* find_stage(const Plan& plan, std::string_view name) {
    for (const StageReport& stage : plan.stages)
        if (stage.name == name) return &stage;
    return nullptr;
}

template <class T>
Json json_of_setting(const T& value);
Json json_of_setting(const Vec3& v) {
    return {v.x, v.y, v.z};
}
Json json_of_setting(const ValueRange& range) {
    return range.of_data ? Json("data") : Json(range.ends);
}
Json json_of_setting(const Light& light) {
    Json json = Json::object();
    visit_light(light, [&](std::string_view name, const auto& setting, std::string_view) {
        json[std::string(name)] = json_of_setting(setting);
    });
    return json;
}
Json json_of_setting(const std::vector<Light>& lights) {
    Json json = Json::array();
    for (const Light& light : lights) json.push_back(json_of_setting(light));
    return json;
}
template <class T>
Json json_of_setting(const std::optional<T>& value) {
    return value ? json_of_setting(*value) : Json(nullptr);
}
template <class T>
Json json_of_setting(const T& value) {
    if constexpr (std::is_enum_v<T>)
        return name_of(value);
    else
        return value;
}

struct SumTables {
    std::int64_t& bytes;
    void operator()(const Rescale&) const {}
    void operator()(const auto& table) const { bytes += static_cast<std::int64_t>(table.bytes()); }
};

}  // namespace

std::string version() {
    return SQUINT_VERSION;
}

Attributes exr_attributes(const Plan& plan, int frame) {
    Attributes attributes;
    for (const auto& [key, value] : resolved(plan.scene)) {
        const bool path = key.ends_with(".file") || key == "precision.preset";
        attributes["squint." + key] = path ? without_folders(value) : value;
    }
    for (int w = 0; w < kWires; ++w) {
        const auto wire = static_cast<Wire>(w);
        attributes[fmt::format("squint.wire.{}", info(wire).name)] =
            plan.real ? plan.real_name() : to_string(plan.specs[wire]);
    }
    attributes["squint.volume.hash"] = plan.volume->content_hash;
    attributes["squint.version"] = version();
    if (plan.scene.camera.turntable > 1) attributes["squint.frame"] = std::to_string(frame);
    return attributes;
}

std::string picture_hash(const Image& image) {
    Hasher hasher;
    hasher.number(static_cast<std::uint64_t>(image.width));
    hasher.number(static_cast<std::uint64_t>(image.height));
    for (const Channel& channel : image.channels) {
        hasher.text(channel.name);
        hasher.bytes(channel.words.data(), channel.words.size() * sizeof(std::uint32_t));
        hasher.bytes(channel.values.data(), channel.values.size() * sizeof(float));
    }
    return hasher.hex();
}

std::int64_t image_bytes(const Scene& scene) {
    const OutputSettings& o = scene.output;
    const std::int64_t channels = 4 + 2 * o.depth + 3 * o.normals + o.samples + o.transparency + 4 * o.fixed;
    return 4 * channels * scene.image.width * scene.image.height;
}

std::int64_t table_bytes(const Plan& plan) {
    std::int64_t bytes = 0;
    Plan visited = plan;  // copies share tables
    visit_stages(visited, SumTables{bytes});
    return bytes + static_cast<std::int64_t>(plan.entries.entry.size() * sizeof(Entry));
}

Memory memory_of(const Plan& plan, const RenderStatistics& statistics) {
    const Volume& v = *plan.volume;
    const std::int64_t voxel_bytes = v.voxels() * static_cast<std::int64_t>(v.scalar_bytes());
    return {.volume = v.mapped ? 0 : voxel_bytes,
            .mapped = v.mapped ? voxel_bytes : 0,
            .tables = table_bytes(plan),
            .image = image_bytes(plan.scene),
            .buffers = statistics.bytes};
}

namespace {
Plan with_preset(const Plan& plan, const char* preset, int frame) {
    Scene scene = plan.scene;
    scene.precision = {};
    scene.precision.preset = preset;
    return make_plan(scene, plan.volume, frame);
}
}  // namespace

Plan real_plan(const Plan& plan, int frame) {
    return with_preset(plan, "real", frame);
}

std::array<bool, kWires> wires_of(std::string_view stage) {
    std::array<bool, kWires> wires{};
    for (std::size_t w = 0; w < wires.size(); ++w) wires[w] = stage.empty() || kWireInfo[w].stage == stage;
    return wires;
}

int error_lattice(const Plan& plan) {
    constexpr std::int64_t kFewPixels = 128 * 128;
    return std::int64_t{plan.camera.width} * plan.camera.height <= kFewPixels ? 1 : every_for_some_rays(plan);
}

namespace {

/// Colours without rounding by lanes of floats, if they can, and if on a lattice, where `exact` has them in double,
/// they are that much nearer to them than the picture is.
std::optional<Image> drawn_by_floats(const Plan& plan, const Image& picture, const Image& exact, int every,
                                     const RenderOptions& options, int frame) {
    constexpr double kNearer = 20;  // dB: what they err by changes the measured figure by 0.05 dB at most
    const Plan floats = with_preset(plan, "float32", frame);
    if (lanes::what_needs_the_model(floats)) return std::nullopt;
    Image drawn = render(floats, options).image;
    const Comparison theirs = compare_colors(thinned(drawn, every), exact),
                     ours = compare_colors(thinned(picture, every), exact);
    for (const char* channel : {"RGB", "A"}) {
        const std::optional<double> measured = ours.channel(channel, true).psnr,
                                    of_floats = theirs.channel(channel, true).psnr;
        if (of_floats && (!measured || *of_floats < *measured + kNearer)) return std::nullopt;
    }
    return drawn;
}

}  // namespace

Errors rounding_errors(const Plan& plan, const Image& picture, const RenderOptions& options, int frame,
                       ErrorRays rays) {
    RenderOptions plain = options;
    plain.audit = false;
    plain.path = Path::automatic, plain.target.clear();
    Plan colors = plan;  // which alone are compared
    colors.scene.output = {}, colors.wants_depth = false;
    Errors errors;
    errors.every = rays == ErrorRays::all ? 1 : error_lattice(plan);
    const Plan real = real_plan(colors, frame);
    const Image some = render_thinned(real, plain, errors.every);
    std::optional<Image> whole;
    if (errors.every == 1)
        whole = some;
    else if (!plan.real)
        whole = drawn_by_floats(colors, picture, some, errors.every, plain, frame);
    errors.by_floats = errors.every > 1 && whole;
    errors.against_real = compare_colors(picture, whole ? *whole : render(real, plain).image);
    for (const std::string_view name : kStages) {
        const StageReport* stage = find_stage(plan, name);
        if (plan.real || !stage || !stage->modelled) continue;
        Plan alone = colors;
        set_active(alone, wires_of(name));
        errors.stages.push_back(
            {std::string(name), compare_colors(render_thinned(alone, plain, errors.every), some)});
    }
    return errors;
}

Comparison compare_colors(const Image& picture, const Image& other) {
    return compare(colors_of(picture), colors_of(other));
}

std::vector<std::string> warnings_of(const Plan& plan, const Rendering& rendering) {
    std::vector<std::string> warnings = plan.warnings;
    const std::vector<float>& alpha = rendering.image.find("A")->values;
    const auto empty = [](const std::string& warning) {
        return warning.find("the picture is empty") != std::string::npos;
    };
    if (std::none_of(alpha.begin(), alpha.end(), [](float a) { return a > 0; }) &&
        std::none_of(warnings.begin(), warnings.end(), empty))
        warnings.push_back(rendering.statistics.rays == 0
                               ? "the picture is empty: no ray meets the volume; see camera and clip"
                               : "the picture is empty: no sample on its rays has an opacity above 0; see "
                                 "transfer_function, clip and camera");
    return warnings;
}

// ------------------------------------------------------------------------------------------------ JSON

Json json_of(const Difference& d) {
    Json json{{"pixels", d.pixels},
              {"identical", d.identical},
              {"psnr", d.psnr ? Json(*d.psnr) : Json(nullptr)},
              {"rmse_lsb8", d.rmse * 255},
              {"bias_lsb8", d.bias * 255},
              {"max_error_lsb8", d.largest * 255},
              {"max_error_at", {d.largest_x, d.largest_y}}};
    if (d.ssim) json["ssim"] = *d.ssim;
    return json;
}

Json json_of(const Comparison& comparison) {
    Json all = Json::object(), foreground = Json::object();
    for (const Difference& d : comparison.all) all[d.channel] = json_of(d);
    for (const Difference& d : comparison.foreground) foreground[d.channel] = json_of(d);
    return {{"all", all}, {"foreground", foreground}};
}

Json json_of(const Errors& errors) {
    Json json = Json::object();
    if (errors.against_real) json["against_real"] = json_of(*errors.against_real);
    if (errors.against_reference) json["against_reference"] = json_of(*errors.against_reference);
    if (errors.against_real) {
        json["by_floats"] = errors.by_floats, json["every"] = errors.every;
        json["stages"] = Json::array();
        for (const StageError& stage : errors.stages)
            json["stages"].push_back({{"stage", stage.stage}, {"against_real", json_of(stage.against_real)}});
    }
    return json;
}

Json json_of(const Memory& m) {
    return {{"volume_bytes", m.volume}, {"mapped_bytes", m.mapped},  {"table_bytes", m.tables},
            {"image_bytes", m.image},   {"buffer_bytes", m.buffers}, {"total_bytes", m.total()}};
}

Json json_of(const Volume& v) {
    const Vec3 origin = v.world_from_voxel(Vec3(0));
    Json json{{"name", v.name},
              {"dims", {v.dims.x, v.dims.y, v.dims.z}},
              {"type", v.type == ScalarType::u8 ? "u8" : "u16"},
              {"scalar_bits", v.scalar_bits},
              {"spacing", {v.spacing.x, v.spacing.y, v.spacing.z}},
              {"origin", {origin.x, origin.y, origin.z}},
              {"scalar_range", {v.smallest, v.largest}},
              {"value_range",
               {v.value_scale * v.smallest + v.value_offset, v.value_scale * v.largest + v.value_offset}},
              {"hash", v.content_hash}};
    for (std::size_t a = 0; v.turned() && a < 3; ++a)
        json["axes"].push_back({v.turn[a].x, v.turn[a].y, v.turn[a].z});
    return json;
}

Json json_of_scene(const Scene& scene) {
    Json json = Json::object();
    visit_scene(scene, [&](std::string_view key, const auto& setting, std::string_view) {
        if (key == "shading.model") json["lights"] = json_of_setting(scene.lights);
        json[std::string(key)] = json_of_setting(setting);
    });
    return json;
}

Json json_of_wires(const Plan& plan) {
    Json json = Json::object();
    for (int w = 0; w < kWires; ++w) {
        const auto wire = static_cast<Wire>(w);
        const Spec& spec = plan.specs[wire];
        if (plan.real) {
            json[std::string(info(wire).name)] = {{"stage", info(wire).stage}, {"format", plan.real_name()}};
            continue;
        }
        json[std::string(info(wire).name)] = {{"stage", info(wire).stage},
                                              {"format", to_string(spec.format)},
                                              {"rounding", to_string(spec.rounding)},
                                              {"overflow", to_string(spec.overflow)},
                                              {"width", spec.format.width()}};
    }
    return json;
}

Json json_of(const RefinedSlabs& refined) {
    return {{"looked_twice", refined.looked_twice}, {"in_two", refined.in_two}, {"in_four", refined.in_four}};
}

Json json_of(const Plan& plan, const Rendering& rendering, const Errors* errors, bool audit) {
    const RenderStatistics& s = rendering.statistics;
    Json json{{"hash", picture_hash(rendering.image)},
              {"seconds", s.seconds},
              {"setup_seconds", s.setup_seconds},
              {"rays", s.rays},
              {"samples", s.samples},
              {"visited", s.visited},
              {"refined", json_of(s.refined)},
              {"path", s.path},
              {"target", s.target},
              {"layout", s.layout},
              {"why", s.why},
              {"threads", s.threads},
              {"memory", json_of(memory_of(plan, s))}};
    if (errors) json["error"] = json_of(*errors);
    if (audit) json["audit"] = json_of_audit(plan, s);
    return json;
}

}  // namespace squint
