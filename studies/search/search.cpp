#include "studies/search/search.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/parallel.h"
#include "scene/toml.h"
#include "studies/search/result_files.h"
#include "studies/search/tried_pictures.h"
#include "studies/search/variables.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>

namespace squint::search {

double Result::may_break_percent() const {
    return 100 * (1 - std::pow(0.05, 1 / static_cast<double>(other_degrees.size())));
}

namespace {

using namespace squint::sweep;

constexpr int kPictureSize = 96;  // pixels a side of pictures kept for reports
constexpr int kMostSets = 12;     // of views held out, one after the other

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
          scenes_(sweep_, settings.folder, settings.cancelled),
          variables_(scenes_, settings.wires, settings.integer_bits),
          tried_(settings, sweep_, scenes_, variables_) {
        result_.wires = variables_.wires();
    }

    Result run() {
        const auto begun = std::chrono::steady_clock::now();
        make_run_folder(s_.folder);
        remove_result_files(s_.folder);
        RunLog log(s_.folder,
                   {{"command", s_.command}, {"threads", threads_for(s_.threads)}, {"shard", "1/1"}});
        const auto write_log = [&](const char* state) {
            const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begun;
            const TriedPictures::Counts& counts = tried_.counts();
            log.write(state, seconds.count(),
                      {counts.computed, counts.pictures - counts.computed, counts.failed});
        };
        write_log("begun");
        try {
            tried_.add_views();
            Found found = descend();
            if (found.feasible) hold(found);
            result_.sets = tried_.sets();
            if (found.feasible)
                finish(found);
            else
                write_trail(tried_.trail());
            result_.pictures = tried_.counts().pictures, result_.computed = tried_.counts().computed;
        } catch (...) {
            write_trail(tried_.trail());
            write_log("interrupted");
            throw;
        }
        write_log("finished");
        return std::move(result_);
    }

  private:
    void write_trail(const Json& trail) const { write_text_whole(s_.folder + "/sweep.json", dump(trail)); }
    Point in_formats(const Lengths& lengths) const {
        Point point;
        point.edits = variables_.edits(lengths);
        return point;
    }

    // ------------------------------------------------------------------------------------ trials

    std::vector<Trial> evaluate(std::span<const Lengths> vectors, std::span<const Step> steps) {
        std::vector<Picture> pictures;
        std::size_t each = 0;
        for (std::size_t i = 0; i < vectors.size(); ++i) {
            // The report draws what each wire needs alone.
            const bool alone = steps[i].phase == Phase::alone || steps[i].phase == Phase::top;
            Reason reason{
                std::string(kPhaseNames[static_cast<std::size_t>(alone ? Phase::alone : steps[i].phase)]),
                steps[i].restart};
            if (alone && steps[i].variable >= 0)
                reason.varied = variables_.label(steps[i].variable, vectors[i]);
            std::vector<Picture> of = tried_.pictures(in_formats(vectors[i]), reason, false);
            each = of.size();
            for (Picture& picture : of) pictures.push_back(std::move(picture));
        }
        const std::vector<Json> records = tried_.records(pictures);
        std::vector<Trial> trials;
        for (std::size_t i = 0; i < vectors.size(); ++i) {
            const Summary sum = tried_.summary(std::span(pictures).subspan(i * each, each),
                                               std::span(records).subspan(i * each, each));
            if (steps[i].phase == Phase::top) top_failure_ = sum.failure;
            trials.push_back(sum.trial);
        }
        result_.trials += vectors.size();
        say(steps.back(), trials);
        return trials;
    }

    void say(const Step& step, const std::vector<Trial>& trials) const {
        if (!s_.progress) return;
        const Trial& t = *std::min_element(trials.begin(), trials.end(),
                                           [](const Trial& a, const Trial& b) { return a.error < b.error; });
        s_.progress(fmt::format("{}{}: {} trials, {} pictures; error {:.4g} of {:.4g} LSB8 at {:.0f} bits",
                                kPhaseNames[static_cast<std::size_t>(step.phase)],
                                step.restart > 0 ? fmt::format(", restart {}", step.restart) : "",
                                result_.trials, tried_.counts().pictures, t.error, s_.most_error, t.bits));
    }

    // ------------------------------------------------------------------------------------ the search

    Problem problem_up_to(Lengths most) {
        Problem problem;
        problem.most = std::move(most);
        problem.most_error = s_.most_error;
        problem.shaken = variables_.wires().size();  // fraction bits: too small a range is no place to start
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
        const Lengths own = variables_.most(false);
        const Step top{Phase::top, 0, -1};
        const bool roomy = evaluate({&own, 1}, {&top, 1})[0].error <= s_.most_error / 2;
        Found found = find_lengths(problem_up_to(variables_.most(!roomy)), s_.descent);
        if (std::isinf(found.top.error))  // no word holds that many
            found = find_lengths(problem_up_to(own), s_.descent);
        if (!top_failure_.empty()) throw InputError(top_failure_);
        if (!found.feasible) result_.failure = not_enough(found.top.error, "");
        return found;
    }

    // Until a set of views that decided nothing holds: those that broke the formats decide with the others.
    void hold(Found& found) {
        for (tried_.hold_out(); found.feasible && !holds_held_out(found.lengths); tried_.hold_out()) {
            if (tried_.sets() == kMostSets) {
                result_.failure = fmt::format(
                    "--max-error: found {:g}, but every one of {} sets of {} views held out breaks it; "
                    "allowed: a higher bound, or more --views to tune on",
                    s_.most_error, kMostSets, TriedPictures::held_out_a_set(s_));
                found.feasible = false;
                return;
            }
            tried_.let_all_decide();
            Found raised = raise_lengths(problem_up_to(variables_.most(true)), found.lengths);
            if (std::isinf(raised.top.error))  // no word holds that many
                raised = raise_lengths(problem_up_to(variables_.most(false)), found.lengths);
            if (!raised.feasible)
                result_.failure = not_enough(raised.top.error, " on a view that was held out");
            found.feasible = raised.feasible, found.lengths = raised.lengths;
        }
    }
    bool holds_held_out(const Lengths& lengths) {
        return summary_of(in_formats(lengths), "held out", true).trial.error <= s_.most_error;
    }
    Summary summary_of(const Point& formats, const std::string& phase, bool held_out) {
        std::vector<Picture> pictures = tried_.pictures(formats, {phase}, held_out);
        const std::vector<Json> records = tried_.records(pictures);
        return tried_.summary(pictures, records);
    }

    // ------------------------------------------------------------------------------------ the result

    Candidate judged(const std::string& name, const Point& formats, const std::string& axis,
                     std::vector<Spec> specs) {
        Candidate c{name, std::move(specs), 0, 0, 0, 0, 0, {}};
        for (const bool held_out : {false, true}) {
            const Summary sum = summary_of(formats, axis + (held_out ? ", other views" : ""), held_out);
            (held_out ? c.other_error : c.error) = sum.trial.error;
            if (!held_out) c.bits = sum.bits, c.table_bytes = sum.table_bytes, c.ms = sum.ms;
            if (!sum.failure.empty()) c.failure = sum.failure;
        }
        return c;
    }

    void finish(const Found& found) {
        std::vector<Spec> specs;
        for (std::size_t w = 0; w < variables_.wires().size(); ++w) {
            specs.push_back(variables_.spec(found.lengths, w));
            result_.alone.push_back(variables_.spec(found.alone, w));
        }
        for (const View& view : tried_.views())
            (view.held_out ? result_.other_degrees : result_.degrees).push_back(view.degrees);
        const Point formats = in_formats(found.lengths);
        result_.found = judged("found", formats, "found", specs);
        result_.scene = judged("as the scene says", {}, "as the scene says", variables_.base());
        Point squeeze;
        squeeze.overrides = preset_alone("squeeze");
        std::vector<Spec> squeezed;
        const WireSpecs of_squeeze = scenes_.plan(squeeze).specs;
        for (const Wire wire : result_.wires) squeezed.push_back(of_squeeze[wire]);
        result_.squeeze = judged("Squeeze's table", squeeze, "Squeeze's table", squeezed);
        result_.costs = found.costs;
        if (const std::size_t other = tried_.counts().other_program; other > 0 && s_.note)
            s_.note(fmt::format("{} pictures were computed by another build of squint", other));
        result_.formats_file = formats_file(s_.folder);
        write_formats(s_.folder, about_formats(), variables_.preset(), result_.wires, result_.found.specs);
        result_.json = json_of_result();
        Json trail = tried_.trail();
        trail["search"] = result_.json;
        write_trail(trail);
        write_search_record(s_.folder, result_.json);
        check_file(formats.edits);
    }

    std::string about_formats() const {
        return fmt::format(
            "# Found by squint search: {} error of at most {:g} LSB8{} with the fewest {}, on {} views of a "
            "turn\n"
            "# that it was chosen by and on {} that were held out.  Views, not a proof.\n"
            "#   squint render SCENE --set precision.preset=THIS_FILE\n",
            s_.figure == Figure::largest ? "a greatest" : "an rms", s_.most_error,
            s_.srgb ? " on an sRGB display" : "", kCostNames[static_cast<std::size_t>(s_.cost)],
            result_.degrees.size(), result_.other_degrees.size());
    }

    // A scene's own wires override those of a preset file.
    void check_file(const std::vector<WireEdit>& edits) {
        for (std::size_t i = 0; i < scenes_.count() && s_.note; ++i) {
            Point by_file, by_edits;
            by_file.scene = by_edits.scene = i;
            const std::string file = std::filesystem::absolute(result_.formats_file).string();
            by_file.overrides = {"precision.preset=" + toml_text(std::string_view(file))};
            by_edits.edits = edits;
            const Plan a = scenes_.plan(by_file), b = scenes_.plan(by_edits);
            for (const Wire wire : result_.wires)
                if (a.specs[wire] != b.specs[wire])
                    s_.note(fmt::format("{} sets precision.{} itself: that wins over {}", scenes_.name(i),
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
            json["wires"] = formats_record(result_.wires, c.specs);
            return json;
        };
        Json json = begin_record(s_);
        json.update({{"figure", kFigureNames[static_cast<std::size_t>(s_.figure)]},
                     {"transfer", s_.srgb ? "srgb" : "linear"},
                     {"cost", kCostNames[static_cast<std::size_t>(s_.cost)]},
                     {"seed", s_.descent.seed},
                     {"degrees", result_.degrees},
                     {"other_degrees", result_.other_degrees},
                     {"guarantee", "views"},
                     {"sets_held_out", result_.sets},
                     {"may_break_percent", result_.may_break_percent()},
                     {"trials", result_.trials},
                     {"pictures", tried_.counts().pictures},
                     {"descents", result_.costs},
                     {"preset", variables_.preset()},
                     {"found", candidate(result_.found)},
                     {"scene", candidate(result_.scene)},
                     {"squeeze", candidate(result_.squeeze)},
                     {"alone", formats_record(result_.wires, result_.alone)}});
        return json;
    }

    const Settings& s_;
    SweepFile sweep_;
    Scenes scenes_;
    Variables variables_;
    TriedPictures tried_;
    std::string top_failure_;
    Result result_;
};

}  // namespace

Result run_search(const Settings& settings) {
    return Searcher(settings).run();
}

}  // namespace squint::search
