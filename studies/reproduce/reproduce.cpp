#include "studies/reproduce/reproduce.h"

#include "core/atomic_file.h"
#include "core/compare.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/image.h"
#include "core/volume_source.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "scene/scene.h"
#include "studies/reproduce/angles.h"
#include "studies/reproduce/slab_light.h"
#include "studies/sweep/evaluate.h"
#include "truth/reference.h"
#include "truth/slab_check.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <optional>

namespace squint::reproduce {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kBlack[3] = {0, 0, 0};
constexpr double kManyTurns = 64;  // slabs of a ray that turn far: black in a preview

/// What was made before: items by name, each with the key of what it was made from.
class Ledger {
  public:
    explicit Ledger(std::string path) : path_(std::move(path)) {
        std::ifstream file(path_);
        if (file) items_ = Json::parse(file, nullptr, false);
        if (!items_.is_object()) items_ = Json::object();
    }
    const Json* find(const std::string& name, const std::string& key) const {
        const auto found = items_.find(name);
        return found != items_.end() && found->value("key", "") == key ? &*found : nullptr;
    }
    void put(const std::string& name, Json item) {
        items_[name] = std::move(item);
        write_text_whole(path_, items_.dump(1) + "\n");
    }

  private:
    std::string path_;
    Json items_;
};

std::string key_of(const std::vector<std::string>& parts) {
    Hasher hasher;
    hasher.text(sweep::program_record().dump());
    for (const std::string& part : parts) hasher.text(part);
    return hasher.hex();
}

/// A file that a scene names by SQUINT_DATA and that is not there: its name and why; empty otherwise.
std::string missing_data(const Scene& scene) {
    const std::string& file = scene.volume.file;
    if (file.find("${SQUINT_DATA}") == std::string::npos) return {};
    const std::string name = fs::path(file).filename().string();
    const char* folder = std::getenv("SQUINT_DATA");
    if (!folder || !*folder) return name + " is missing: neither --data nor SQUINT_DATA names its folder";
    std::error_code ignored;
    if (!fs::exists(expand_path(file, scene.folder, "volume.file"), ignored))
        return fmt::format("{} is missing in {}", name, folder);
    return {};
}

class Maker {
  public:
    Maker(const Figure& figure, const Settings& settings)
        : figure_(figure),
          settings_(settings),
          folder_(settings.folder + "/" + figure.name),
          ledger_(folder_ + "/made.json") {}

    Result make() {
        const int all = static_cast<int>(figure_.pictures.size() + figure_.rows.size());
        int done = 0;
        const auto say = [&](const std::string& what) {
            if (settings_.progress) settings_.progress(what, done++, all);
        };
        for (const PictureOrder& order : figure_.pictures) say(order.name), picture(order);
        for (const RowOrder& order : figure_.rows) say(order.what), row(order);
        return std::move(result_);
    }

  private:
    struct Made {
        std::string key, refused;
        std::shared_ptr<const Image> image;
        std::optional<SlabLight> light;
    };

    void note(const std::string& text) {
        if (std::find(result_.notes.begin(), result_.notes.end(), text) == result_.notes.end())
            result_.notes.push_back(text);
    }
    std::string path(const std::string& file) const { return folder_ + "/" + file; }
    RenderOptions options() const {
        RenderOptions o;
        o.threads = settings_.threads, o.cancelled = settings_.cancelled, o.progress = settings_.part;
        return o;
    }

    Scene named_scene(const std::string& name) const {
        return name.empty() ? built_in_scene() : read_scene(settings_.scene_file(name));
    }
    /// Its own scene, or where data is missing the one that stands in for it.
    Scene scene_of(const std::string& own, const std::vector<std::string>& more) {
        const std::string& name = own.empty() ? figure_.scene : own;
        Scene scene = named_scene(name);
        if (const std::string missing = missing_data(scene); !missing.empty()) {
            note(fmt::format("{}; {} stands in for it", missing,
                             figure_.stand_in.empty() ? "the built-in head" : figure_.stand_in));
            scene = named_scene(figure_.stand_in);
        }
        std::vector<std::string> all = figure_.settings;
        all.insert(all.end(), more.begin(), more.end());
        all.insert(all.end(), settings_.overrides.begin(), settings_.overrides.end());
        scene = scene_with(std::move(scene), all);
        scene.precision = resolved_precision(scene);
        return scene;
    }
    std::shared_ptr<const Volume> volume_of(const Scene& scene) {
        const VolumeSource source = volume_source(scene);
        std::string name;
        for (const auto& [key, value] : resolved(scene))
            if (key.starts_with("volume.")) name += fmt::format("{}={}\n", key, value);
        name += source.file;
        if (name != volume_name_ || !volume_) {
            volume_.reset();
            volume_ = std::make_shared<const Volume>(load_volume(source, {}, nullptr));
            volume_name_ = name;
        }
        return volume_;
    }
    Plan plan_of(const Scene& scene, int frame = 0) { return make_plan(scene, volume_of(scene), frame); }
    static std::string identity(const Plan& plan) {
        std::string text = plan.real_name();
        for (const auto& [name, value] : exr_attributes(plan)) text += fmt::format("{}={}\n", name, value);
        return text;
    }

    // -------------------------------------------------------------------------------- pictures

    void picture(const PictureOrder& order) {
        Made& made = made_[order.name];
        try {
            switch (order.kind) {
                case PictureKind::difference:
                    return make_difference(order, made);
                case PictureKind::slab_light:
                    return make_plot(order, made);
                default:
                    return make_rendering(order, made);
            }
        } catch (const InputError& error) {
            made.refused = error.what();
            note(fmt::format("{}: not made: {}", order.name, error.what()));
        }
    }
    void keep(const std::string& name, const std::string& key) {
        ledger_.put(name, {{"key", key}}), ++result_.made;
    }
    void add_files(const std::vector<std::string>& names) {
        result_.files.insert(result_.files.end(), names.begin(), names.end());
    }
    bool all_there(const std::vector<std::string>& names) const {
        return std::all_of(names.begin(), names.end(),
                           [&](const auto& name) { return fs::exists(path(name)); });
    }

    void make_rendering(const PictureOrder& order, Made& made) {
        const Scene scene = scene_of(order.scene, order.settings);
        const Plan plan = plan_of(scene);
        const bool turns = order.kind == PictureKind::angles;
        made.key = key_of({identity(plan), std::to_string(static_cast<int>(order.kind))});
        const std::string exr = order.name + ".exr";
        const std::vector<std::string> files =
            turns ? std::vector{exr, order.name + ".60.png", order.name + ".90.png"}
                  : std::vector{exr, order.name + ".png"};
        if (ledger_.find(order.name, made.key) && all_there(files)) {
            made.image = std::make_shared<const Image>(read_image(path(exr)));
            ++result_.kept;
            return add_files(files);
        }
        Image image;
        if (turns)
            image = gradient_turns(plan, settings_.threads, settings_.cancelled);
        else if (order.kind == PictureKind::reference)
            image = render_reference(
                plan,
                {.threads = settings_.threads, .progress = settings_.part, .cancelled = settings_.cancelled});
        else
            image = render(plan, options()).image;
        Attributes attributes = exr_attributes(plan);
        if (order.kind != PictureKind::render)
            std::erase_if(attributes,
                          [](const auto& item) { return item.first.starts_with("squint.wire."); });
        write_exr(image, path(exr), attributes);
        const Vec3& b = scene.image.background;
        const double background[3] = {b.x, b.y, b.z};
        if (turns)
            for (const char* angle : {"60", "90"})
                write_preview_png(turns_preview(image, std::string("angle") + angle),
                                  path(fmt::format("{}.{}.png", order.name, angle)), kBlack);
        else
            write_preview_png(image, path(files[1]), background);
        made.image = std::make_shared<const Image>(std::move(image));
        add_files(files), keep(order.name, made.key);
    }
    /// The darker, the more slabs turn far.
    static Image turns_preview(const Image& counts, const std::string& channel) {
        Image image{counts.width, counts.height, {}};
        const std::vector<float>& count = counts.find(channel)->values;
        for (const char* name : {"R", "G", "B"}) {
            std::vector<float>& grey = image.add_float(name).values;
            for (std::size_t i = 0; i < grey.size(); ++i)
                grey[i] = static_cast<float>(1 - std::min(1.0, static_cast<double>(count[i]) / kManyTurns));
        }
        return image;
    }

    const Made& made_of(const std::string& name) const {
        const Made& made = made_.at(name);
        if (!made.refused.empty()) throw InputError(made.refused);
        return made;
    }

    void make_difference(const PictureOrder& order, Made& made) {
        const Made &a = made_of(order.of[0]), &b = made_of(order.of[1]);
        made.key = key_of({a.key, b.key, fmt::format("{}", order.gain)});
        const std::vector<std::string> files{order.name + ".exr", order.name + ".png"};
        if (ledger_.find(order.name, made.key) && all_there(files)) {
            ++result_.kept;
            return add_files(files);
        }
        write_exr(difference(colors_of(*a.image), colors_of(*b.image)), path(files[0]),
                  {{"squint.version", version()}});
        Image shown = difference(colors_of(*a.image), colors_of(*b.image), order.gain);
        std::erase_if(shown.channels, [](const Channel& c) { return c.name == "A"; });
        for (Channel& channel : shown.channels)
            for (float& value : channel.values) value = std::fabs(value);
        write_preview_png(shown, path(files[1]), kBlack);
        add_files(files), keep(order.name, made.key);
    }
    static Image colors_of(const Image& image) {
        Image colors{image.width, image.height, {}};
        for (const char* name : {"R", "G", "B", "A"})
            if (const Channel* channel = image.find(name)) colors.channels.push_back(*channel);
        return colors;
    }

    void make_plot(const PictureOrder& order, Made& made) {
        made.light = slab_light(order.angle, order.exponent);
        made.key = key_of({fmt::format("{} {}", order.angle, order.exponent)});
        const std::vector<std::string> files{order.name + ".svg", order.name + ".csv"};
        if (ledger_.find(order.name, made.key) && all_there(files)) {
            ++result_.kept;
            return add_files(files);
        }
        write_text_whole(path(files[0]), svg_of(*made.light)),
            write_text_whole(path(files[1]), csv_of(*made.light));
        add_files(files), keep(order.name, made.key);
    }

    // ------------------------------------------------------------------------------------ rows

    void row(const RowOrder& order) {
        Row row{order.what, unit_of(order.measure), {}, order.paper, {}};
        try {
            if (order.of.empty())
                measure_scene(order, row);
            else
                measure_pictures(order, row);
        } catch (const InputError& error) {
            row.refused = error.what();
        }
        result_.rows.push_back(std::move(row));
    }

    void measure_pictures(const RowOrder& order, Row& row) {
        const Made& a = made_of(order.of[0]);
        switch (order.measure) {
            case Measure::normal_length: {
                const auto errors = a.light->length_errors();
                row.ours = {errors[0], errors[1]};
                return;
            }
            case Measure::angles:
                row.ours = {share(*a.image, "angle60"), share(*a.image, "angle90")};
                return;
            case Measure::opacity: {
                const Channel& alpha = *a.image->find("A");
                const auto middle =
                    static_cast<std::size_t>(a.image->height / 2) * static_cast<std::size_t>(a.image->width) +
                    static_cast<std::size_t>(a.image->width / 2);
                row.ours = {100 * static_cast<double>(alpha.values[middle])};
                return;
            }
            default:
                return compare_pictures(order, compare_colors(*a.image, *made_of(order.of[1]).image), row);
        }
    }
    static double share(const Image& counts, const std::string& channel) {
        const auto sum = [&](const std::string& name) {
            double all = 0;
            for (const float value : counts.find(name)->values) all += static_cast<double>(value);
            return all;
        };
        const double slabs = sum("slabs");
        return slabs > 0 ? 100 * sum(channel) / slabs : 0;
    }
    static void compare_pictures(const RowOrder& order, const Comparison& comparison, Row& row) {
        constexpr double kSame = std::numeric_limits<double>::infinity();
        switch (order.measure) {
            case Measure::psnr:
                for (const char* channel : {"R", "G", "B"})
                    row.ours.push_back(comparison.channel(channel, false).psnr.value_or(kSame));
                return;
            case Measure::foreground_psnr:
                row.ours = {comparison.channel("RGB", true).psnr.value_or(kSame)};
                return;
            case Measure::rms:
                row.ours = {255 * comparison.channel("RGB", true).rmse};
                return;
            case Measure::largest:
                row.ours = {255 * comparison.channel("RGB", true).largest};
                return;
            default:
                row.ours = {255 * comparison.channel("A", true).bias};
        }
    }

    void measure_scene(const RowOrder& order, Row& row) {
        const Scene scene = scene_of(order.scene, order.settings);
        const Plan plan = plan_of(scene);
        const std::string key = key_of({identity(plan), order.what, std::to_string(scene.camera.turntable)});
        if (const Json* item = ledger_.find(order.what, key)) {
            row.ours = item->at("values").get<std::vector<double>>();
            ++result_.kept;
            return;
        }
        switch (order.measure) {
            case Measure::slab_error: {
                const SlabCheck check = check_slabs(plan);
                row.ours = {std::max(check.largest_color, check.largest_alpha)};
                break;
            }
            case Measure::table_size:
                row.ours = {static_cast<double>(table_bytes(plan)) / 1024};
                break;
            case Measure::build_time:
                row.ours = {1000 * build_seconds(plan)};
                break;
            default:
                row.ours = {frames_a_second(scene)};
        }
        ledger_.put(order.what, {{"key", key}, {"values", row.ours}});
        ++result_.made;
    }
    /// From control points to words; the median.
    static double build_seconds(const Plan& plan) {
        constexpr double kEnough = 1.0;  // seconds of all
        using Clock = std::chrono::steady_clock;
        std::vector<double> seconds;
        double sum = 0;
        while (seconds.size() < 5 || (sum < kEnough && seconds.size() < 1001)) {
            const auto start = Clock::now();
            const Entries entries =
                sample_entries(resolve_transfer_function(plan.scene, *plan.volume), *plan.volume);
            const ClassificationMethod built =
                build_method({entries, plan.specs, plan.scene.classification, plan.step_world,
                              plan.specs[Wire::classification_input].format.fraction_bits, false});
            seconds.push_back(std::chrono::duration<double>(Clock::now() - start).count());
            sum += seconds.back();
        }
        std::nth_element(seconds.begin(), seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2),
                         seconds.end());
        return seconds[seconds.size() / 2];
    }
    /// Ray casting alone, over a full turn.
    double frames_a_second(const Scene& scene) {
        double seconds = 0;
        for (int frame = 0; frame < scene.camera.turntable; ++frame) {
            if (settings_.part) settings_.part(static_cast<double>(frame) / scene.camera.turntable);
            RenderOptions o = options();
            o.progress = nullptr;
            seconds += render(plan_of(scene, frame), o).statistics.seconds;
        }
        return scene.camera.turntable / seconds;
    }

    const Figure& figure_;
    const Settings& settings_;
    std::string folder_;
    Ledger ledger_;
    Result result_;
    std::map<std::string, Made> made_;
    std::string volume_name_;
    std::shared_ptr<const Volume> volume_;
};

std::string text_of(double value) {
    if (std::isinf(value)) return "the same";
    const double size = std::abs(value);
    return size >= 100                ? fmt::format("{:.1f}", value)
           : size >= 0.1 || size == 0 ? fmt::format("{:.2f}", value)
                                      : fmt::format("{:.2g}", value);
}
std::string text_of(const std::vector<double>& values) {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : " ") + text_of(value);
    return text.empty() ? "-" : text;
}
std::string quoted(const std::string& text) {
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
}

}  // namespace

Result make(const Paper& paper, const Figure& figure, const Settings& settings) {
    const std::string folder = settings.folder + "/" + figure.name;
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw InputError(fmt::format("{}: cannot be made: {}", folder, error.message()));
    Result result = Maker(figure, settings).make();
    for (const std::string& name : figure.rows_of) {
        const Result part = make(paper, *paper.find(name), settings);
        for (Row row : part.rows) {
            row.what = name + ": " + row.what;
            result.rows.push_back(std::move(row));
        }
        for (const std::string& file : part.files)
            result.files.push_back(fmt::format("../{}/{}", name, file));
        for (const std::string& note : part.notes)
            if (std::find(result.notes.begin(), result.notes.end(), note) == result.notes.end())
                result.notes.push_back(note);
        result.made += part.made, result.kept += part.kept;
    }
    return result;
}

Json json_of(const Paper& paper, const Figure& figure, const Result& result) {
    Json rows = Json::array();
    for (const Row& row : result.rows) {
        Json item{{"what", row.what}, {"unit", row.unit}, {"ours", Json::array()}, {"paper", row.paper}};
        for (const double value : row.ours) item["ours"].push_back(std::isinf(value) ? Json() : Json(value));
        if (!row.refused.empty()) item["refused"] = row.refused;
        rows.push_back(item);
    }
    return {{"schema", "squint.reproduce/1"},
            {"version", version()},
            {"paper", paper.title},
            {"figure", figure.name},
            {"title", figure.title},
            {"look", figure.look},
            {"rows", rows},
            {"files", result.files},
            {"notes", result.notes}};
}

std::string markdown_of(const Paper& paper, const Figure& figure, const Result& result) {
    std::string text =
        fmt::format("## {}, {}: {}\n\n{}\n", paper.name, figure.name, figure.title, figure.look);
    if (!result.rows.empty()) text += "\n| | ours | paper | |\n|---|---|---|---|\n";
    for (const Row& row : result.rows)
        text += fmt::format("| {} | {} | {} | {} |\n", row.what,
                            row.refused.empty() ? text_of(row.ours) : "not measured: " + row.refused,
                            text_of(row.paper), row.unit);
    if (!result.notes.empty()) text += "\n";
    for (const std::string& note : result.notes) text += "- " + note + "\n";
    return text;
}

std::string csv_of(const Result& result) {
    std::string text = "what,number,ours,paper,unit\n";
    for (const Row& row : result.rows)
        for (std::size_t i = 0; i < std::max<std::size_t>(1, std::max(row.ours.size(), row.paper.size()));
             ++i)
            text += fmt::format("{},{},{},{},{}\n", quoted(row.what), i + 1,
                                i < row.ours.size() ? fmt::format("{:.6g}", row.ours[i]) : "",
                                i < row.paper.size() ? fmt::format("{:g}", row.paper[i]) : "", row.unit);
    return text;
}

}  // namespace squint::reproduce
