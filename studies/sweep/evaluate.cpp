#include "studies/sweep/evaluate.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/module_file.h"
#include "core/read_whole.h"
#include "pipeline/audit_record.h"
#include "pipeline/machines/lanes/empty_space.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "scene/presets.h"
#include "scene/toml.h"
#include "studies/sweep/cost.h"
#include "studies/sweep/picture_figures.h"
#include "truth/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <thread>

namespace squint::sweep {
namespace {

constexpr int kMeanCostRays = 16;                                   // a side: some 40,000 slabs
constexpr std::size_t kMostRememberedBytes = std::size_t{1} << 28;  // of baseline pictures kept in memory

bool is_skipped(std::string_view key, const std::vector<std::string_view>& prefixes) {
    return std::any_of(prefixes.begin(), prefixes.end(),
                       [&](std::string_view prefix) { return key.starts_with(prefix); });
}

// All settings except `without`; paths are replaced by the hashes of what they name.
void add_settings(Hasher& hasher, const Scene& scene, const Volume& volume,
                  std::vector<std::string_view> without) {
    without.insert(without.end(), {"volume.", "transfer_function.", "precision."});
    for (const auto& [key, value] : resolved(scene))
        if (!is_skipped(key, without)) hasher.text(key), hasher.text(value);
    const auto number = [&](double x) { hasher.bytes(&x, sizeof x); };
    hasher.text(volume.content_hash);
    for (int a = 0; a < 3; ++a) number(volume.spacing[a]), number(volume.origin[a]);
    if (volume.turned())
        for (const Vec3& axis : volume.turn) number(axis.x), number(axis.y), number(axis.z);
    number(volume.value_scale), number(volume.value_offset), number(volume.scalar_bits);
    const TransferFunction tf = resolve_transfer_function(scene, volume);
    hasher.number(tf.color.size());
    for (const ColorPoint& p : tf.color)
        number(p.value), number(p.color.x), number(p.color.y), number(p.color.z);
    for (const OpacityPoint& p : tf.opacity) number(p.value), number(p.alpha);
    number(tf.unit_distance), number(tf.entries);
}

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const std::size_t n = values.size();
    return n % 2 ? values[n / 2] : (values[n / 2 - 1] + values[n / 2]) / 2;
}

std::string first_line(const std::string& file, std::string_view key) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);)
        if (line.starts_with(key) && line.find(':') != std::string::npos)
            return line.substr(std::min(line.find(':') + 2, line.size()));
    return {};
}

}  // namespace

Spec edited(Spec spec, const WireEdit& edit) {
    using Part = WireEdit::Part;
    Format& f = spec.format;
    switch (edit.part) {
        case Part::fraction_bits:
            f.fraction_bits = edit.number;
            break;
        case Part::fraction_offset:
            f.fraction_bits += edit.number;
            break;
        case Part::integer_bits:
            f.integer_bits = edit.number;
            break;
        case Part::integer_offset:
            f.integer_bits += edit.number;
            break;
        case Part::rounding:
            parse_rounding(edit.text, spec.rounding);
            break;
        case Part::overflow:
            parse_overflow(edit.text, spec.overflow);
            break;
    }
    if (f.integer_bits < 0 || f.integer_bits > kMostIntegerBits || f.fraction_bits < 0 ||
        f.fraction_bits > kMostFractionBits || f.integer_bits + f.fraction_bits < 1)
        throw InputError(fmt::format(
            "precision.{}: {} integer and {} fraction bits; allowed: 0 to {} each, 1 or more together",
            info(edit.wire).name, f.integer_bits, f.fraction_bits, kMostFractionBits));
    return spec;
}

Json program_record() {
    static const std::string hash = [] {
        Hasher hasher;
        hasher.text(read_whole(module_file(), "squint's own program"));
        return hasher.hex();
    }();
    return {{"version", version()}, {"program", hash}};
}

Json machine_record() {
    return {{"cpu", first_line("/proc/cpuinfo", "model name")},
            {"processors", std::max(1u, std::thread::hardware_concurrency())},
            {"compiler", __VERSION__}};
}

// ------------------------------------------------------------------------------------------------ Evaluator

Evaluator::Evaluator(const SweepFile& sweep, std::string folder, const std::atomic<bool>* cancelled)
    : sweep_(sweep), folder_(std::move(folder)), cancelled_(cancelled) {
    for (std::size_t i = 0; i < std::max<std::size_t>(sweep.scenes.size(), 1); ++i) {
        Scene base = sweep.scenes.empty() ? built_in_scene() : read_scene(scene_path(sweep, i));
        try {
            bases_.push_back(scene_with(std::move(base), sweep.overrides));
        } catch (const InputError& error) {
            throw InputError(fmt::format("{}: [base] or --set: {}", sweep.name, error.what()));
        }
    }
}

std::vector<Wire> Evaluator::wires_in_use() {
    std::vector<Wire> all;
    for (const Scene& base : bases_) {
        const std::vector<Wire> used = make_plan(base, volume_of(base)).used_wires;
        all.insert(all.end(), used.begin(), used.end());
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
}

std::shared_ptr<const Volume> Evaluator::volume_of(const Scene& scene) {
    std::string key = scene.folder;
    for (const auto& [name, value] : resolved(scene))
        if (name.starts_with("volume.")) key += '\n' + value;
    const std::lock_guard lock(volumes_mutex_);
    const auto [found, is_new] = volumes_.try_emplace(key);
    Loaded& loaded = found->second;
    if (is_new) try {
            loaded.volume = std::make_shared<const Volume>(load_volume(volume_source(scene)));
            // Now, and not while points run in parallel.
            lanes::block_ranges(*loaded.volume, lanes::all_blocks_of(*loaded.volume));
        } catch (const InputError& error) {
            loaded.failure = error.what();
        }
    if (!loaded.volume) throw InputError(loaded.failure);
    return loaded.volume;
}

// A preset's formats depend on volume, transfer function and step: asks a plan once for each.
WireSpecs Evaluator::preset_specs_of(const Scene& scene, const std::shared_ptr<const Volume>& volume) {
    Hasher hasher;
    add_settings(hasher, scene, *volume, {"image.", "output.", "classification.", "compositing."});
    hasher.text(scene.precision.preset);
    const std::string key = hasher.hex();
    {
        const std::lock_guard lock(specs_mutex_);
        if (const auto found = specs_.find(key); found != specs_.end()) return found->second;
    }
    Scene plain = scene;
    plain.precision.override_ = {};
    plain.classification = {};
    plain.classification.method = Method::pc;
    const WireSpecs specs = make_plan(plain, volume).specs;
    const std::lock_guard lock(specs_mutex_);
    return specs_.emplace(key, specs).first->second;
}

WireSpecs Evaluator::specs_of(const Scene& scene, const std::shared_ptr<const Volume>& volume) {
    WireSpecs specs;
    try {
        specs = preset_specs_of(scene, volume);
    } catch (const InputError&) {  // only the preset does not fit; the scene's own wires may help
        return make_plan(scene, volume).specs;
    }
    for (int w = 0; w < kWires; ++w)
        if (const auto& text = scene.precision.override_[static_cast<std::size_t>(w)])
            if (const std::string bad = parse_spec(*text, specs[static_cast<Wire>(w)]); !bad.empty())
                throw InputError(
                    fmt::format("precision.{}: {}", kWireInfo[static_cast<std::size_t>(w)].name, bad));
    return specs;
}

std::string Evaluator::identity(const Scene& scene, const std::shared_ptr<const Volume>& volume,
                                const WireSpecs& specs) {
    Hasher hasher;
    hasher.text("squint.point/2");
    add_settings(hasher, scene, *volume, {"compositing.form"});
    const CompositingForm form = scene.compositing.form;
    hasher.text(std::string(
        name_of(form == CompositingForm::automatic ? preset_form(scene.precision.preset) : form)));
    if (rounds_nothing(scene.precision.preset))
        hasher.text(scene.precision.preset);
    else
        for (const Spec& spec : specs.spec) hasher.text(to_string(spec));
    return hasher.hex();
}

Prepared Evaluator::prepare(const Point& point) {
    Prepared p;
    p.scene_file = scene_path(sweep_, point.scene);
    p.settings = sweep_.overrides;
    p.settings.insert(p.settings.end(), point.overrides.begin(), point.overrides.end());
    try {
        p.scene = scene_with(bases_[point.scene], point.overrides);
        p.scene.precision = resolved_precision(p.scene);
        p.volume = volume_of(p.scene);
        WireSpecs specs = specs_of(p.scene, p.volume);
        for (const WireEdit& edit : point.edits) {
            Spec& spec = specs[edit.wire];
            spec = edited(spec, edit);
            p.scene.precision.override_[static_cast<std::size_t>(edit.wire)] = to_string(spec);
        }
        std::vector<Wire> changed;
        for (const WireEdit& edit : point.edits)
            if (std::find(changed.begin(), changed.end(), edit.wire) == changed.end()) {
                changed.push_back(edit.wire);
                p.settings.push_back(
                    fmt::format("precision.{}=\"{}\"", info(edit.wire).name, to_string(specs[edit.wire])));
            }
        p.hash = identity(p.scene, p.volume, specs);
    } catch (const InputError& error) {
        p.failure = error.what();
        Hasher hasher;
        hasher.text("squint.point/2 failed"), hasher.text(p.scene_file);
        for (const std::string& text : p.settings) hasher.text(text);
        for (const WireEdit& e : point.edits)
            hasher.text(fmt::format("{} {} {} {}", static_cast<int>(e.wire), static_cast<int>(e.part),
                                    e.number, e.text));
        p.hash = hasher.hex();
    }
    return p;
}

// --------------------------------------------------------------------------------------- baselines

std::vector<Evaluator::BaselineScene> Evaluator::baselines_of(const Prepared& point) {
    std::vector<BaselineScene> all;
    const auto key = [&](const char* kind, const Scene& scene, std::vector<std::string_view> without) {
        Hasher hasher;
        hasher.text(kind);
        add_settings(hasher, scene, *point.volume, std::move(without));
        return hasher.hex();
    };
    Scene plain = point.scene;
    plain.output = {};
    if (sweep_.measure.real) {
        Scene real = plain;
        real.precision = {};
        real.precision.preset = "real";
        all.push_back({"real", key("real", real, {"image.background"}), real});
    }
    if (sweep_.measure.reference) {
        Scene exact = plain;
        exact.precision = {};
        all.push_back(
            {"reference",
             key("reference", exact,
                 {"image.background", "sampling.", "classification.", "shading.inside", "compositing.form"}),
             exact});
    }
    for (const Baseline& named : sweep_.baselines) {
        Scene scene = plain;
        const bool presets =
            std::any_of(named.overrides.begin(), named.overrides.end(),
                        [](const auto& text) { return text.starts_with("precision.preset="); });
        if (presets) scene.precision.override_ = {};
        scene = scene_with(scene, named.overrides);
        scene.precision = resolved_precision(scene);
        all.push_back(
            {named.name, identity(scene, volume_of(scene), specs_of(scene, volume_of(scene))), scene});
    }
    return all;
}

std::shared_ptr<const Image> Evaluator::remembered(const std::string& key) {
    const std::lock_guard lock(images_mutex_);
    const auto found = images_.find(key);
    return found == images_.end() ? nullptr : found->second;
}

void Evaluator::remember(const std::string& key, std::shared_ptr<const Image> image) {
    const std::lock_guard lock(images_mutex_);
    const std::size_t bytes =
        static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height) * 16;
    const std::size_t most = std::max<std::size_t>(kMostRememberedBytes / std::max<std::size_t>(bytes, 1), 2);
    while (images_by_age_.size() >= most)
        images_.erase(images_by_age_.front()), images_by_age_.erase(images_by_age_.begin());
    if (images_.emplace(key, std::move(image)).second) images_by_age_.push_back(key);
}

std::shared_ptr<const Image> Evaluator::baseline(const BaselineScene& of, int threads) {
    if (auto image = remembered(of.key)) return image;
    const std::string file = folder_.empty() ? "" : path("baselines", of.key + ".exr");
    std::error_code ignored;
    if (!file.empty() && std::filesystem::exists(file, ignored)) {
        auto image = std::make_shared<const Image>(colors_of(read_image(file)));
        remember(of.key, image);
        return image;
    }
    const auto volume = volume_of(of.scene);
    const Plan plan = make_plan(of.scene, volume);
    Image image;
    if (of.name == "reference") {
        ReferenceOptions options;
        options.threads = threads, options.cancelled = cancelled_;
        image = render_reference(plan, options);
    } else {
        RenderOptions options;
        options.threads = threads, options.cancelled = cancelled_;
        image = colors_of(render(plan, options).image);
    }
    if (!file.empty()) {
        write_exr(image, file, {{"squint.baseline", of.name}, {"squint.version", version()}});
        if (sweep_.measure.picture_size > 0)
            write_text_whole(path("baselines", of.key + ".values"),
                             values_file(image, sweep_.measure.picture_size));
    }
    auto shared = std::make_shared<const Image>(std::move(image));
    remember(of.key, shared);
    return shared;
}

void Evaluator::make_baselines(const Prepared& point, int threads) {
    if (!point.failure.empty()) return;
    for (const BaselineScene& of : baselines_of(point)) baseline(of, threads);
}

std::vector<std::string> Evaluator::baseline_keys(const Prepared& point) {
    std::vector<std::string> keys;
    for (const BaselineScene& of : baselines_of(point)) keys.push_back(of.key);
    return keys;
}

// ----------------------------------------------------------------------------------------- figures

std::vector<std::string> Evaluator::wanted(bool base) const {
    const Measure& m = sweep_.measure;
    std::vector<std::string> names;
    if (m.real) names.push_back("real");
    if (m.reference) names.push_back("reference");
    for (const Baseline& named : sweep_.baselines) {
        std::string text = "baseline " + named.name;
        for (const std::string& setting : named.overrides) text += " " + setting;
        names.push_back(text);
    }
    if (m.srgb) names.push_back("srgb");
    if (m.ssim) names.push_back("ssim");
    if (m.mean_cost) names.push_back("mean cost");
    if (m.audit.value_or(base)) names.push_back("audit");
    if (m.conservation) names.push_back("conservation");
    if (m.repeats > 0) names.push_back(fmt::format("time of {} by {} threads", m.repeats, m.threads));
    if (m.exr) names.push_back("exr");
    if (m.picture_size > 0) names.push_back(fmt::format("pictures of {}", m.picture_size));
    return names;
}

Json Evaluator::measure(const Prepared& point, int threads, bool timed, bool base) {
    if (!point.failure.empty()) throw InputError(point.failure);
    const Measure& m = sweep_.measure;
    const Plan plan = make_plan(point.scene, point.volume);
    RenderOptions options;
    options.threads = timed && m.threads > 0 ? m.threads : threads;
    options.cancelled = cancelled_;
    const Rendering rendering = render(plan, options);
    const RenderStatistics& s = rendering.statistics;
    const Image colors = colors_of(rendering.image);

    Json json{{"picture_hash", picture_hash(rendering.image)},
              {"width", colors.width},
              {"height", colors.height},
              {"rays", s.rays},
              {"samples", s.samples},
              {"path", s.path},
              {"target", s.target},
              {"why", s.why}};
    if (timed) {
        std::vector<double> all;
        for (int i = 0; i < m.repeats; ++i) all.push_back(render(plan, options).statistics.seconds * 1000);
        json["time"] = {{"ms", median(all)},
                        {"all_ms", all},
                        {"setup_ms", s.setup_seconds * 1000},
                        {"threads", s.threads},
                        {"model", s.path == "model"}};
    }
    Json& error = json["error"] = Json::object();
    Json& against = json["baselines"] = Json::object();
    for (const BaselineScene& of : baselines_of(point)) {
        error[of.name] = errors_of(colors, *baseline(of, threads), m);
        against[of.name] = of.key;
    }
    json["color_above_alpha_lsb8"] = color_above_alpha(colors);
    if (m.conservation) json["conservation"] = conservation(point.scene, point.volume, options);
    if (m.audit.value_or(base && !plan.real)) {
        RenderOptions audited = options;
        audited.audit = true;
        const Rendering again = render(plan, audited);
        if (picture_hash(again.image) != picture_hash(rendering.image))
            throw std::logic_error("the audited model and the picture differ");
        json["audit"] = json_of_audit(plan, again.statistics);
        if (!plan.real) json["stuck"] = stuck_transparency(plan);
    }
    json["cost"] = json_of(m.mean_cost && !plan.real ? cost_of_picture(plan, kMeanCostRays) : cost_of(plan));
    Json& wires = json["wires"] = Json::object();
    for (const Wire wire : plan.used_wires)
        wires[std::string(info(wire).name)] = plan.real ? plan.real_name() : to_string(plan.specs[wire]);
    json["volume"] = {{"name", std::filesystem::path(point.volume->name).filename().string()},
                      {"hash", point.volume->content_hash}};
    if (!plan.warnings.empty()) json["warnings"] = plan.warnings;
    if (!folder_.empty() && m.picture_size > 0) {
        const Vec3& b = point.scene.image.background;
        const double background[3] = {b.x, b.y, b.z};
        write_preview_png(colors, path("pictures", point.hash + ".png"), background, 1);
        write_text_whole(path("pictures", point.hash + ".values"), values_file(colors, m.picture_size));
    }
    if (!folder_.empty() && m.exr)
        write_exr(rendering.image, path("pictures", point.hash + ".exr"), exr_attributes(plan));
    return json;
}

}  // namespace squint::sweep
