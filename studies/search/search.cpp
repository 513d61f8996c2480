#include "studies/search/search.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/parallel.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "scene/toml.h"
#include "studies/sweep/cost.h"
#include "studies/sweep/run.h"
#include "studies/sweep/run_folder.h"
#include "studies/sweep/side_by_side.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

namespace squint::search {

double Result::may_break_percent() const {
    return 100 * (1 - std::pow(0.05, 1 / static_cast<double>(other_degrees.size())));
}

namespace {

using namespace squint::sweep;
using Part = WireEdit::Part;

constexpr int kPictureSize = 96;  // pixels a side of pictures kept for reports
constexpr int kLeastHeldOut = 16;
constexpr int kMostSets = 12;  // of views held out, one after the other

/// A view: camera settings for each scene.
struct View {
    double degrees = 0;
    bool held_out = false;                            // nothing was decided by it
    std::vector<std::vector<std::string>> overrides;  // by scene
};

struct Picture {
    Prepared prepared;
    ListedPoint entry;
    std::size_t scene = 0;
};

SweepFile sweep_of(const Settings& s) {
    SweepFile sweep;
    sweep.name = "search", sweep.text = s.command;
    sweep.scenes = s.scenes, sweep.overrides = s.overrides;
    sweep.mode = Mode::one_at_a_time, sweep.seed = s.descent.seed;
    sweep.title = fmt::format("Search: the fewest {} with a {} error of at most {} LSB8{}",
                              s.cost == CostKind::bits   ? "bits"
                              : s.cost == CostKind::time ? "milliseconds"
                                                         : "bytes of tables",
                              s.figure == Figure::largest ? "greatest" : "rms", s.most_error,
                              s.srgb ? " on an sRGB display" : "");
    sweep.measure.ssim = false, sweep.measure.mean_cost = false;
    sweep.measure.srgb = s.srgb;
    sweep.measure.picture_size = kPictureSize;
    if (s.cost == CostKind::time) sweep.measure.repeats = s.repeats, sweep.measure.threads = s.threads;
    return sweep;
}

class Searcher {
  public:
    explicit Searcher(const Settings& settings)
        : s_(settings),
          sweep_(sweep_of(settings)),
          threads_(threads_for(settings.threads)),
          evaluator_(sweep_, settings.folder, settings.cancelled),
          wanted_(evaluator_.wanted()) {}

    Result run() {
        const auto begun = std::chrono::steady_clock::now();
        read_scenes();
        make_run_folder(s_.folder);
        for (const std::string& old : {formats_file(), search_file()}) std::filesystem::remove(old);
        RunLog log(s_.folder, {{"command", s_.command}, {"threads", threads_}, {"shard", "1/1"}});
        const auto write_log = [&](const char* state) {
            const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begun;
            log.write(state, seconds.count(), {computed_, pictures_ - computed_, failed_});
        };
        write_log("begun");
        try {
            make_views();
            Found found = descend();
            if (found.feasible) hold(found);
            result_.pictures = pictures_, result_.computed = computed_;
            if (found.feasible)
                finish(found);
            else
                write_trail();
        } catch (...) {
            write_trail();
            write_log("interrupted");
            throw;
        }
        write_log("finished");
        return std::move(result_);
    }

  private:
    std::string formats_file() const { return s_.folder + "/formats.toml"; }
    std::string search_file() const { return s_.folder + "/search.json"; }
    void write_trail() const {
        write_text_whole(s_.folder + "/sweep.json", dump(sweep_record(sweep_, entries_, wanted_)));
    }
    std::size_t scenes() const { return std::max<std::size_t>(sweep_.scenes.size(), 1); }

    // ------------------------------------------------------------------------------------ what is searched

    Plan plan_of(const Point& point) {
        const Prepared p = evaluator_.prepare(point);
        if (!p.failure.empty()) throw InputError(p.failure);
        return make_plan(p.scene, p.volume);
    }
    Plan plan_of(std::size_t scene, const std::vector<std::string>& overrides) {
        Point point;
        point.scene = scene, point.overrides = overrides;
        return plan_of(point);
    }

    std::vector<std::string> preset_alone(std::string_view preset) const {
        std::vector<std::string> overrides{fmt::format("precision.preset=\"{}\"", preset)};
        for (const WireInfo& wire : kWireInfo)
            overrides.push_back(fmt::format("precision.{}=\"auto\"", wire.name));
        return overrides;
    }

    void read_scenes() {
        std::vector<Plan> plans;
        std::set<Wire> used;
        for (std::size_t i = 0; i < scenes(); ++i) {
            plans.push_back(plan_of(i, {}));
            const Plan& plan = plans.back();
            if (plan.real)
                throw InputError(
                    fmt::format("{}: precision.preset {} has no formats; allowed: another "
                                "preset, as with --set precision.preset=default",
                                name_of_scene(i), plan.real_name()));
            if (plan.scene.precision.preset != plans[0].scene.precision.preset)
                throw InputError(
                    fmt::format("{}: preset {}, but {} has {}; allowed: one for all, as with --set "
                                "precision.preset=default",
                                name_of_scene(i), plan.scene.precision.preset, name_of_scene(0),
                                plans[0].scene.precision.preset));
            for (const Wire wire : plan.used_wires) used.insert(wire), users_[wire].push_back(i);
        }
        preset_ = plans[0].scene.precision.preset;
        for (const Wire wire : s_.wires.empty() ? std::vector<Wire>(used.begin(), used.end()) : s_.wires) {
            if (!used.contains(wire))
                throw InputError(fmt::format("--wires: {} carries nothing in {}; allowed: {}",
                                             info(wire).name, scenes() > 1 ? "these scenes" : "this scene",
                                             names_of(used)));
            add_variables(wire, plans);
        }
    }

    static std::string names_of(const std::set<Wire>& wires) {
        std::vector<std::string_view> names;
        for (const Wire wire : wires) names.push_back(info(wire).name);
        return listed(names);
    }
    std::string name_of_scene(std::size_t i) const {
        return sweep_.scenes.empty() ? "the built-in scene" : sweep_.scenes[i];
    }

    // One format serves all scenes: it has the integer bits of the scene that needs most.
    void add_variables(Wire wire, const std::vector<Plan>& plans) {
        Spec spec = plans[users_[wire][0]].specs[wire];
        int most = spec.format.fraction_bits;
        for (const std::size_t i : users_[wire]) {
            const Spec& other = plans[i].specs[wire];
            if (other.format.is_signed != spec.format.is_signed || other.rounding != spec.rounding ||
                other.overflow != spec.overflow)
                throw InputError(fmt::format(
                    "precision.{}: {} in {}, {} in {}; allowed: one sign, rounding and overflow for all",
                    info(wire).name, to_string(spec), name_of_scene(users_[wire][0]), to_string(other),
                    name_of_scene(i)));
            spec.format.integer_bits = std::max(spec.format.integer_bits, other.format.integer_bits);
            most = std::max({most, other.format.fraction_bits, wide(i)[wire].format.fraction_bits});
        }
        result_.wires.push_back(wire);
        base_.push_back(spec), most_fraction_.push_back(most);
    }

    const WireSpecs& wide(std::size_t scene) {
        const auto found = wide_.find(scene);
        return found != wide_.end()
                   ? found->second
                   : wide_.emplace(scene, plan_of(scene, preset_alone("wide")).specs).first->second;
    }

    // The variables: fraction bits of every wire, then integer bits of every wire.
    Spec spec_of(const Lengths& lengths, std::size_t w) const {
        Spec spec = base_[w];
        spec.format.fraction_bits = lengths[w];
        if (s_.integer_bits) spec.format.integer_bits = lengths[w + base_.size()];
        return spec;
    }
    std::vector<WireEdit> edits_of(const Lengths& lengths) const {
        std::vector<WireEdit> edits;
        for (std::size_t w = 0; w < base_.size(); ++w) {
            const Spec spec = spec_of(lengths, w);
            edits.push_back({result_.wires[w], Part::fraction_bits, spec.format.fraction_bits, {}});
            edits.push_back({result_.wires[w], Part::integer_bits, spec.format.integer_bits, {}});
        }
        return edits;
    }

    // ------------------------------------------------------------------------------------ views

    // Tuned on the turns 0, 1/n, 2/n ...
    void make_views() {
        for (int k = 0; k < s_.views; ++k) add_view(k, s_.views, false);
    }
    // As many anew, evenly spaced, at turns that no other set has: the golden section of a gap further on each.
    void hold_out() {
        constexpr int kGap = 1000;
        const int n = std::max(kLeastHeldOut, s_.views), first = (309 + 618 * result_.sets++) % kGap;
        for (View& view : views_) view.held_out = false;
        for (int i = 0; i < n; ++i) add_view(kGap * i + first, kGap * n, true);
    }
    void add_view(int frame, int grid, bool held_out) {
        View view{360.0 * frame / grid, held_out, {}};
        for (std::size_t i = 0; i < scenes(); ++i) view.overrides.push_back(turned(i, frame, grid));
        views_.push_back(std::move(view));
    }

    std::vector<std::string> turned(std::size_t scene, int frame, int grid) {
        if (frame == 0) return {};
        Point point;
        point.scene = scene;
        const Prepared p = evaluator_.prepare(point);
        CameraSettings settings = p.scene.camera;
        settings.turntable = grid;
        const Camera camera =
            make_camera(settings, *p.volume, p.scene.image.width, p.scene.image.height, frame);
        const auto vector = [](const char* key, const Vec3& v) {
            return fmt::format("camera.{}=[{}, {}, {}]", key, toml_text(v.x), toml_text(v.y), toml_text(v.z));
        };
        return {vector("eye", camera.eye), vector("center", camera.center), vector("up", camera.up)};
    }

    // ------------------------------------------------------------------------------------ pictures

    std::vector<Picture> pictures_of(const Point& formats, const std::string& phase, int restart,
                                     bool held_out, const std::pair<std::string, std::string>& varied) {
        std::vector<Picture> all;
        for (std::size_t scene = 0; scene < scenes(); ++scene)
            for (const View& view : views_) {
                if (view.held_out != held_out) continue;
                Picture picture;
                Point& point = picture.entry.point = formats;
                point.scene = picture.scene = scene;
                point.overrides.insert(point.overrides.end(), view.overrides[scene].begin(),
                                       view.overrides[scene].end());
                // Wires that this scene does not use keep their Spec, so that its points keep their names.
                std::erase_if(point.edits, [&](const WireEdit& edit) {
                    const auto& users = users_.at(edit.wire);
                    return std::find(users.begin(), users.end(), scene) == users.end();
                });
                const auto text = [](std::string_view value) { return toml_text(value); };
                point.values = {{"phase", text(phase)}, {"restart", toml_text(std::int64_t{restart})}};
                if (scenes() > 1) point.values.emplace_back("scene", text(sweep_.scenes[scene]));
                point.values.emplace_back("degrees", toml_text(view.degrees));
                if (!varied.first.empty()) point.values.push_back(varied), point.varied = varied.first;
                all.push_back(std::move(picture));
            }
        return all;
    }

    /// The records of pictures, in order.  Reads those that exist.
    std::vector<Json> records_of(std::vector<Picture>& pictures) {
        const bool timed = s_.cost == CostKind::time;
        const auto check = [&] {
            if (s_.cancelled && *s_.cancelled) throw Cancelled{};
        };
        side_by_side(pictures.size(), threads_, [&](std::size_t i) {
            check();
            pictures[i].prepared = evaluator_.prepare(pictures[i].entry.point);
            pictures[i].entry.hash = pictures[i].prepared.hash;
        });
        std::map<std::string, std::size_t> first;
        for (std::size_t i = 0; i < pictures.size(); ++i) {
            entries_.push_back(pictures[i].entry);
            first.emplace(pictures[i].entry.hash, i);
        }
        std::vector<std::size_t> fresh;
        for (const auto& [hash, i] : first)
            if (!records_.contains(hash)) fresh.push_back(i);
        for (const std::size_t i : fresh)  // one after the other, each on all threads
            if (pictures[i].prepared.failure.empty())
                evaluator_.make_baselines(pictures[i].prepared, threads_);
        side_by_side(fresh.size(), timed ? 1 : threads_, [&](std::size_t n) {
            check();
            const Picture& picture = pictures[fresh[n]];
            const std::string& hash = picture.entry.hash;
            const std::string path = point_path(s_.folder, hash);
            const RecordState state = state_of(path, wanted_);
            const bool there = state != RecordState::missing;
            Json record =
                there ? read_json(path)
                      : write_record(evaluator_, picture.prepared, s_.folder, timed ? threads_ : 1, timed);
            const std::lock_guard lock(mutex_);
            computed_ += !there, ++pictures_, failed_ += record["status"] != "done";
            other_program_ += state == RecordState::other_program;
            records_.emplace(hash, std::move(record));
        });
        std::vector<Json> out;
        for (const Picture& picture : pictures) out.push_back(records_.at(picture.entry.hash));
        return out;
    }

    struct Summary {
        Trial trial;
        double bits = 0, table_bytes = 0, ms = 0;
        std::string failure;
    };
    Summary summary_of(const std::vector<Picture>& pictures, const std::vector<Json>& records) const {
        Summary sum;
        double squares = 0, table_bits = 0, worst = 0;
        const auto n = static_cast<double>(records.size());
        for (std::size_t i = 0; i < records.size(); ++i) {
            const Json& record = records[i];
            if (record["status"] != "done") {
                sum.failure =
                    fmt::format("{}: {}", name_of_scene(pictures[i].scene), record.value("reason", ""));
                return sum;
            }
            const Json& error = record["error"]["real"];
            for (const char* channel : {s_.srgb ? "color_srgb" : "color", "alpha"}) {
                const double rms = error[channel]["rmse_lsb8"];
                const double figure =
                    s_.figure == Figure::rms ? rms : error[channel]["max_error_lsb8"].get<double>();
                worst = std::max(worst, figure), squares += rms * rms / (2 * n);
            }
            const Json& cost = record["cost"];
            sum.bits += cost["bits"].get<double>() / n;
            sum.table_bytes += cost["table_bytes"].get<double>() / n;
            table_bits += cost["table_bits"].get<double>() / n;
            if (record.contains("time")) sum.ms += record["time"]["ms"].get<double>() / n;
        }
        // A largest error counts with the mean square, as if it were four times its root.
        const double penalty = s_.figure == Figure::rms ? squares : squares + worst * worst / 16;
        sum.trial = {worst, penalty, sum.bits, sum.bits};
        if (s_.cost == CostKind::table_bytes)
            sum.trial.cost = sum.table_bytes, sum.trial.bits += 1e6 * table_bits;
        // Times within a twentieth count as equal: repeats differ by as much.
        if (s_.cost == CostKind::time) sum.trial.cost = std::floor(std::log(sum.ms) / std::log(1.05));
        return sum;
    }

    // ------------------------------------------------------------------------------------ the search

    std::vector<Trial> evaluate(std::span<const Lengths> vectors, std::span<const Step> steps) {
        std::vector<Picture> pictures;
        std::size_t each = 0;
        for (std::size_t i = 0; i < vectors.size(); ++i) {
            Point formats;
            formats.edits = edits_of(vectors[i]);
            std::pair<std::string, std::string> varied;
            // The report draws what each wire needs alone.
            const bool alone = steps[i].phase == Phase::alone || steps[i].phase == Phase::top;
            if (alone && steps[i].variable >= 0) varied = label_of(steps[i].variable, vectors[i]);
            const std::string phase(
                kPhaseNames[static_cast<std::size_t>(alone ? Phase::alone : steps[i].phase)]);
            std::vector<Picture> of = pictures_of(formats, phase, steps[i].restart, false, varied);
            each = of.size();
            for (Picture& picture : of) pictures.push_back(std::move(picture));
        }
        const std::vector<Json> records = records_of(pictures);
        std::vector<Trial> trials;
        for (std::size_t i = 0; i < vectors.size(); ++i) {
            const std::vector<Picture> of(pictures.begin() + static_cast<std::ptrdiff_t>(i * each),
                                          pictures.begin() + static_cast<std::ptrdiff_t>((i + 1) * each));
            const std::vector<Json> its(records.begin() + static_cast<std::ptrdiff_t>(i * each),
                                        records.begin() + static_cast<std::ptrdiff_t>((i + 1) * each));
            Summary sum = summary_of(of, its);
            if (steps[i].phase == Phase::top) top_ = sum;
            trials.push_back(sum.trial);
        }
        result_.trials += vectors.size();
        say(steps.back(), trials);
        return trials;
    }

    std::pair<std::string, std::string> label_of(int variable, const Lengths& lengths) const {
        const auto v = static_cast<std::size_t>(variable), n = base_.size();
        return {
            fmt::format("{} {}", info(result_.wires[v % n]).name, v < n ? "fraction_bits" : "integer_bits"),
            toml_text(std::int64_t{lengths[v]})};
    }

    void say(const Step& step, const std::vector<Trial>& trials) const {
        if (!s_.progress) return;
        const Trial& t = *std::min_element(trials.begin(), trials.end(),
                                           [](const Trial& a, const Trial& b) { return a.error < b.error; });
        s_.progress(fmt::format("{}{}: {} trials, {} pictures; error {:.4g} of {:.4g} LSB8 at {:.0f} bits",
                                kPhaseNames[static_cast<std::size_t>(step.phase)],
                                step.restart > 0 ? fmt::format(", restart {}", step.restart) : "",
                                result_.trials, pictures_, t.error, s_.most_error, t.bits));
    }

    // Of all variables: those of `wide`, or the scene's own.
    Lengths most_of(bool wide) const {
        Lengths most;
        for (std::size_t w = 0; w < base_.size(); ++w)
            most.push_back(wide ? most_fraction_[w] : base_[w].format.fraction_bits);
        if (s_.integer_bits)
            for (const Spec& spec : base_) most.push_back(spec.format.integer_bits);
        return most;
    }
    Problem problem_up_to(Lengths most) {
        Problem problem;
        problem.most = std::move(most);
        problem.most_error = s_.most_error;
        problem.shaken = base_.size();  // fraction bits: too small a range is no place to start
        problem.evaluate = [this](std::span<const Lengths> vectors, std::span<const Step> steps) {
            return evaluate(vectors, steps);
        };
        return problem;
    }
    std::string not_enough(double error, const std::string& where) const {
        const bool largest = s_.figure == Figure::largest;
        return fmt::format(
            "--max-error: found {:g}, but with every wire at its widest the {} error is {:.4g} LSB8{}; "
            "allowed: more than that{}",
            s_.most_error, largest ? "greatest" : "rms", error, where,
            largest ? ", or --figure rms where single pixels decide" : "");
    }

    Found descend() {
        // The scene's own formats are the top where they leave room below the bound: wider ones render more
        // slowly, and no wire of the result would need them.
        const Lengths own = most_of(false);
        const Step top{Phase::top, 0, -1};
        const bool roomy = evaluate({&own, 1}, {&top, 1})[0].error <= s_.most_error / 2;
        Found found = find_lengths(problem_up_to(most_of(!roomy)), s_.descent);
        if (std::isinf(found.top.error))  // no word holds that many
            found = find_lengths(problem_up_to(own), s_.descent);
        if (!top_.failure.empty()) throw InputError(top_.failure);
        if (!found.feasible) result_.failure = not_enough(found.top.error, "");
        return found;
    }

    // Until a set of views that decided nothing holds: those that broke the formats decide with the others.
    void hold(Found& found) {
        for (hold_out(); found.feasible && !holds_held_out(found.lengths); hold_out()) {
            if (result_.sets == kMostSets) {
                result_.failure = fmt::format(
                    "--max-error: found {:g}, but every one of {} sets of {} views held out breaks it; "
                    "allowed: a "
                    "higher bound, or more --views to tune on",
                    s_.most_error, kMostSets, std::max(kLeastHeldOut, s_.views));
                found.feasible = false;
                return;
            }
            for (View& view : views_) view.held_out = false;
            Found raised = raise_lengths(problem_up_to(most_of(true)), found.lengths);
            if (std::isinf(raised.top.error))  // no word holds that many
                raised = raise_lengths(problem_up_to(most_of(false)), found.lengths);
            if (!raised.feasible)
                result_.failure = not_enough(raised.top.error, " on a view that was held out");
            found.feasible = raised.feasible, found.lengths = raised.lengths;
        }
    }
    bool holds_held_out(const Lengths& lengths) {
        Point formats;
        formats.edits = edits_of(lengths);
        std::vector<Picture> pictures = pictures_of(formats, "held out", 0, true, {});
        const std::vector<Json> records = records_of(pictures);
        return summary_of(pictures, records).trial.error <= s_.most_error;
    }

    // ------------------------------------------------------------------------------------ the result

    Candidate judged(const std::string& name, const Point& formats, const std::string& axis,
                     std::vector<Spec> specs) {
        Candidate c{name, std::move(specs), 0, 0, 0, 0, 0, {}};
        for (const bool held_out : {false, true}) {
            std::vector<Picture> pictures =
                pictures_of(formats, axis + (held_out ? ", other views" : ""), 0, held_out, {});
            const std::vector<Json> records = records_of(pictures);
            const Summary sum = summary_of(pictures, records);
            (held_out ? c.other_error : c.error) = sum.trial.error;
            if (!held_out) c.bits = sum.bits, c.table_bytes = sum.table_bytes, c.ms = sum.ms;
            if (!sum.failure.empty()) c.failure = sum.failure;
        }
        return c;
    }

    void finish(const Found& found) {
        Point formats;
        formats.edits = edits_of(found.lengths);
        std::vector<Spec> specs;
        for (std::size_t w = 0; w < base_.size(); ++w) {
            specs.push_back(spec_of(found.lengths, w));
            result_.alone.push_back(spec_of(found.alone, w));
        }
        for (const View& view : views_)
            (view.held_out ? result_.other_degrees : result_.degrees).push_back(view.degrees);
        result_.found = judged("found", formats, "found", specs);
        result_.scene = judged("as the scene says", {}, "as the scene says", base_);
        Point squeeze;
        squeeze.overrides = preset_alone("squeeze");
        std::vector<Spec> squeezed;
        const WireSpecs of_squeeze = plan_of(0, squeeze.overrides).specs;
        for (const Wire wire : result_.wires) squeezed.push_back(of_squeeze[wire]);
        result_.squeeze = judged("Squeeze's table", squeeze, "Squeeze's table", squeezed);
        result_.costs = found.costs;
        result_.pictures = pictures_, result_.computed = computed_;
        if (other_program_ > 0 && s_.note)
            s_.note(fmt::format("{} pictures were computed by another build of squint", other_program_));
        result_.formats_file = formats_file();
        write_text_whole(result_.formats_file, formats_text());
        result_.json = json_of_result();
        Json sweep = sweep_record(sweep_, entries_, wanted_);
        sweep["search"] = result_.json;
        write_text_whole(s_.folder + "/sweep.json", dump(sweep));
        write_text_whole(search_file(), dump(result_.json));
        check_file(formats.edits);
    }

    std::string formats_text() const {
        std::string text = fmt::format(
            "# Found by squint search: {} error of at most {:g} LSB8{} with the fewest {}, on {} views of a "
            "turn\n"
            "# that it was chosen by and on {} that were held out.  Views, not a proof.\n"
            "#   squint render SCENE --set precision.preset=THIS_FILE\n"
            "[precision]\npreset = \"{}\"\n",
            s_.figure == Figure::largest ? "a greatest" : "an rms", s_.most_error,
            s_.srgb ? " on an sRGB display" : "", kCostNames[static_cast<std::size_t>(s_.cost)],
            result_.degrees.size(), result_.other_degrees.size(), preset_);
        for (std::size_t w = 0; w < result_.wires.size(); ++w)
            text +=
                fmt::format("{} = \"{}\"\n", info(result_.wires[w]).name, to_string(result_.found.specs[w]));
        return text;
    }

    // A scene's own wires override those of a preset file.
    void check_file(const std::vector<WireEdit>& edits) {
        for (std::size_t i = 0; i < scenes() && s_.note; ++i) {
            Point by_file, by_edits;
            by_file.scene = by_edits.scene = i;
            const std::string file = std::filesystem::absolute(result_.formats_file).string();
            by_file.overrides = {"precision.preset=" + toml_text(std::string_view(file))};
            by_edits.edits = edits;
            const Plan a = plan_of(by_file), b = plan_of(by_edits);
            for (const Wire wire : result_.wires)
                if (a.specs[wire] != b.specs[wire])
                    s_.note(fmt::format("{} sets precision.{} itself: that wins over {}", name_of_scene(i),
                                        info(wire).name, result_.formats_file));
        }
    }
    Json json_of_result() const {
        const auto number = [](double x) { return std::isfinite(x) ? Json(x) : Json(); };
        const auto candidate = [&](const Candidate& c) {
            Json json{{"bits", c.bits}, {"table_bytes", c.table_bytes}};
            if (s_.cost == CostKind::time) json["ms"] = c.ms;
            json["error_lsb8"] = number(c.error), json["other_views_error_lsb8"] = number(c.other_error);
            json["margin_lsb8"] = number(s_.most_error - c.error);
            json["other_views_margin_lsb8"] = number(s_.most_error - c.other_error);
            if (!c.failure.empty()) json["failure"] = c.failure;
            Json& wires = json["wires"] = Json::object();
            for (std::size_t w = 0; w < result_.wires.size(); ++w)
                wires[std::string(info(result_.wires[w]).name)] = to_string(c.specs[w]);
            return json;
        };
        Json alone = Json::object();
        for (std::size_t w = 0; w < result_.wires.size(); ++w)
            alone[std::string(info(result_.wires[w]).name)] = to_string(result_.alone[w]);
        Json json{{"schema", "squint.search/1"}};
        json.update(program_record());
        json.update({{"command", s_.command},
                     {"scenes", sweep_.scenes},
                     {"max_error_lsb8", s_.most_error},
                     {"figure", kFigureNames[static_cast<std::size_t>(s_.figure)]},
                     {"transfer", s_.srgb ? "srgb" : "linear"},
                     {"cost", kCostNames[static_cast<std::size_t>(s_.cost)]},
                     {"seed", s_.descent.seed},
                     {"degrees", result_.degrees},
                     {"other_degrees", result_.other_degrees},
                     {"guarantee", "views"},
                     {"sets_held_out", result_.sets},
                     {"may_break_percent", result_.may_break_percent()},
                     {"trials", result_.trials},
                     {"pictures", pictures_},
                     {"descents", result_.costs},
                     {"preset", preset_},
                     {"found", candidate(result_.found)},
                     {"scene", candidate(result_.scene)},
                     {"squeeze", candidate(result_.squeeze)},
                     {"alone", alone}});
        return json;
    }

    const Settings& s_;
    SweepFile sweep_;
    int threads_;
    Evaluator evaluator_;
    std::vector<std::string> wanted_;
    std::string preset_;
    std::vector<Spec> base_;                          // of result_.wires, one for all scenes
    std::vector<int> most_fraction_;                  // of result_.wires
    std::map<Wire, std::vector<std::size_t>> users_;  // scenes that use each wire
    std::map<std::size_t, WireSpecs> wide_;
    std::vector<View> views_;
    std::vector<ListedPoint> entries_;
    std::map<std::string, Json> records_;
    Summary top_;
    std::size_t pictures_ = 0, computed_ = 0, failed_ = 0, other_program_ = 0;
    Result result_;
    std::mutex mutex_;
};

}  // namespace

Result run_search(const Settings& settings) {
    return Searcher(settings).run();
}

}  // namespace squint::search
