#include "studies/sweep/run.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/read_whole.h"
#include "pipeline/render.h"
#include "scene/toml.h"
#include "studies/sweep/run_folder.h"
#include "studies/sweep/side_by_side.h"
#include "studies/sweep/together.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <set>

namespace squint::sweep {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

std::vector<ListedPoint> list_points(const SweepFile& sweep, Evaluator& evaluator, int threads,
                                     const std::atomic<bool>* cancelled) {
    std::vector<Wire> used;
    if (sweep.wires.present && sweep.wires.wires.empty()) used = evaluator.wires_in_use();
    std::vector<Point> points = expand(sweep, used);
    std::vector<ListedPoint> entries(points.size());
    side_by_side(points.size(), threads, [&](std::size_t i) {
        if (cancelled && *cancelled) throw Cancelled{};
        entries[i].hash = evaluator.prepare(points[i]).hash;
        entries[i].point = std::move(points[i]);
        entries[i].base = sweep.mode == Mode::one_at_a_time ? entries[i].point.varied.empty() : i == 0;
    });
    return entries;
}

class Runner {
  public:
    /// `dry`: writes nothing.
    Runner(const SweepFile& sweep, const RunOptions& options, bool dry)
        : sweep_(sweep),
          options_(options),
          dry_(dry),
          threads_(threads_for(options.threads)),
          evaluator_(sweep, dry ? "" : options.folder, options.cancelled) {}

    RunSummary run() {
        const auto begun = Clock::now();
        make_run_folder(options_.folder);
        find_missing();
        if (summary_.other_program > 0)
            note(fmt::format("{} points were computed by another build of squint; --redo computes them anew",
                             summary_.other_program));
        if (!missing_.empty()) {
            RunLog log(options_.folder, {{"command", options_.command},
                                         {"threads", threads_},
                                         {"shard", fmt::format("{}/{}", options_.shard, options_.shards)}});
            const auto write_run = [&](const char* state) {
                log.write(state, seconds_since(begun), {summary_.computed, summary_.reused, summary_.failed});
            };
            write_run("begun");
            try {
                make_baselines();
                compute();
            } catch (const Cancelled&) {
                write_run("interrupted");
                throw;
            }
            write_run("finished");
        }
        if (add_first_formats_together()) write_list();
        summary_.seconds = seconds_since(begun);
        return summary_;
    }

    Forecast forecast() {
        find_missing();
        Forecast f;
        f.points = summary_.points, f.distinct = summary_.distinct, f.missing = missing_.size();
        for (const ListedPoint& entry : entries_) {
            std::string line = entry.hash;
            for (const auto& [axis, label] : entry.point.values)
                line += fmt::format("  {} = {}", axis, label);
            f.lines.push_back(line);
        }
        const bool timed = sweep_.measure.repeats > 0;
        for (const std::size_t i : missing_) {
            const Prepared p = evaluator_.prepare(entries_[i].point);
            try {
                auto start = Clock::now();
                evaluator_.make_baselines(p, threads_);
                f.seconds_a_baseline = seconds_since(start);
                start = Clock::now();
                evaluator_.measure(p, timed ? threads_ : 1, timed);
                f.seconds_a_point = seconds_since(start);
                break;
            } catch (const InputError&) {  // this point fails: try the next
            }
        }
        std::set<std::string> keys;
        for (const std::size_t i : missing_) {
            const Prepared p = evaluator_.prepare(entries_[i].point);
            if (p.failure.empty()) try {
                    for (const std::string& key : evaluator_.baseline_keys(p)) keys.insert(key);
                } catch (const InputError&) {
                }
        }
        f.baselines = keys.size();
        const std::size_t a_point = 1 + sweep_.baselines.size();
        f.seconds = static_cast<double>(f.missing) * f.seconds_a_point / (timed ? 1 : threads_) +
                    static_cast<double>(f.baselines) / static_cast<double>(a_point) * f.seconds_a_baseline;
        return f;
    }

  private:
    void note(const std::string& text) const {
        if (options_.note) options_.note(text);
    }
    void check_cancelled() const {
        if (options_.cancelled && *options_.cancelled) throw Cancelled{};
    }

    void find_missing() {
        entries_ = list_points(sweep_, evaluator_, threads_, options_.cancelled);
        const std::vector<std::string> wanted = evaluator_.wanted(), wanted_of_base = evaluator_.wanted(true);
        if (!dry_) write_list();
        std::map<std::string, std::size_t> first;
        for (std::size_t i = 0; i < entries_.size(); ++i) first.emplace(entries_[i].hash, i);
        std::vector<std::size_t> mine;
        for (const auto& [hash, i] : first) mine.push_back(i);
        std::sort(mine.begin(), mine.end());
        const auto shards = static_cast<std::size_t>(options_.shards);
        std::size_t number = 0;
        std::set<std::string> of_shard;
        for (const std::size_t i : mine) {
            if (number++ % shards != static_cast<std::size_t>(options_.shard - 1)) continue;
            of_shard.insert(entries_[i].hash);
            const RecordState state = options_.redo || options_.folder.empty()
                                          ? RecordState::missing
                                          : state_of(point_path(options_.folder, entries_[i].hash),
                                                     entries_[i].base ? wanted_of_base : wanted);
            if (state == RecordState::missing)
                missing_.push_back(i);
            else
                ++summary_.reused, summary_.other_program += state == RecordState::other_program;
        }
        summary_.distinct = of_shard.size();
        summary_.points = static_cast<std::size_t>(
            std::count_if(entries_.begin(), entries_.end(),
                          [&](const ListedPoint& e) { return of_shard.contains(e.hash); }));
    }

    void write_list() const {
        write_text_whole(options_.folder + "/sweep.json",
                         dump(sweep_record(sweep_, entries_, evaluator_.wanted())));
    }

    /// Measures the points of first_formats_together(); returns whether there are any.
    bool add_first_formats_together() {
        const bool compared = sweep_.measure.real || sweep_.measure.reference;
        if (sweep_.mode != Mode::one_at_a_time || !compared || options_.shards > 1) return false;
        const auto record_of = [&](const std::string& hash) {
            return read_json(point_path(options_.folder, hash));
        };
        const std::vector<Point> points =
            first_formats_together(entries_, record_of, sweep_.measure.real ? "real" : "reference");
        for (const Point& point : points) {
            check_cancelled();
            const Prepared prepared = evaluator_.prepare(point);
            const std::string path = point_path(options_.folder, prepared.hash);
            if (options_.redo || state_of(path, evaluator_.wanted()) == RecordState::missing)
                write_record(evaluator_, prepared, options_.folder, threads_, sweep_.measure.repeats > 0);
            entries_.push_back({point, prepared.hash});
        }
        return !points.empty();
    }

    void make_baselines() {
        const auto start = Clock::now();
        std::set<std::string> made;
        for (std::size_t n = 0; n < missing_.size(); ++n) {
            check_cancelled();
            const Prepared p = evaluator_.prepare(entries_[missing_[n]].point);
            if (!p.failure.empty()) continue;
            try {
                bool all = true;
                for (const std::string& key : evaluator_.baseline_keys(p)) all &= !made.insert(key).second;
                if (!all) evaluator_.make_baselines(p, threads_);
            } catch (const InputError&) {  // reported and recorded when the point's turn comes
            }
            report({"baselines", n + 1, missing_.size(), 0, seconds_since(start)});
        }
    }

    void report(const Progress& progress) const {
        if (options_.progress) options_.progress(progress);
    }

    void compute() {
        const bool timed = sweep_.measure.repeats > 0;
        const auto start = Clock::now();
        side_by_side(missing_.size(), timed ? 1 : threads_, [&](std::size_t n) {
            check_cancelled();
            const ListedPoint& entry = entries_[missing_[n]];
            const Json record = write_record(evaluator_, evaluator_.prepare(entry.point), options_.folder,
                                             timed ? threads_ : 1, timed, entry.base);
            const std::lock_guard lock(mutex_);
            ++summary_.computed;
            if (record["status"] == "failed" && summary_.failed++ == 0)
                summary_.first_failure = record.value("reason", "");
            if (options_.finished) options_.finished(record);
            report({"points", summary_.computed, missing_.size(), summary_.failed, seconds_since(start)});
        });
    }

    const SweepFile& sweep_;
    const RunOptions& options_;
    bool dry_;
    int threads_;
    Evaluator evaluator_;
    std::vector<ListedPoint> entries_;
    std::vector<std::size_t> missing_;  // indices into entries_
    RunSummary summary_;
    std::mutex mutex_;
};

}  // namespace

Json value_of_label(const std::string& label) {
    if (label.starts_with('"')) return parse_toml("v = " + label, "label").items[0].text;
    if (label.find_first_of(".enifx") == std::string::npos) return std::stoll(label);
    return std::stod(label);
}

Json read_json(const std::string& path) {
    constexpr std::string_view kAllowed = "a file that squint wrote";
    const Json json = Json::parse(read_whole(path, kAllowed), nullptr, false);
    if (json.is_discarded()) throw InputError(fmt::format("{}: found no JSON; allowed: {}", path, kAllowed));
    return json;
}

RunSummary run_sweep(const SweepFile& sweep, const RunOptions& options) {
    return Runner(sweep, options, false).run();
}

Forecast forecast(const SweepFile& sweep, const RunOptions& options) {
    return Runner(sweep, options, true).forecast();
}

Collected collect(const std::vector<std::string>& pieces, const std::string& folder) {
    make_run_folder(folder);
    std::error_code ignored;
    const std::string joint = folder + "/sweep.json";
    Collected result;
    for (const std::string& piece : pieces) {
        const Json sweep = read_json(piece + "/sweep.json");
        if (!fs::exists(joint, ignored)) write_text_whole(joint, dump(sweep));
        if (read_json(joint)["points"] != sweep["points"])
            throw InputError(fmt::format("{}: belongs to another sweep than {}", piece, joint));
        for (const char* room :
             {"pictures", "baselines", "runs", "points"})  // points last: they vouch for the pictures
            for (const fs::directory_entry& file : fs::directory_iterator(piece + "/" + room, ignored)) {
                const std::string name = file.path().filename().string();
                const fs::path target = fs::path(folder) / room / name;
                if (fs::exists(target, ignored) && fs::equivalent(file.path(), target, ignored)) continue;
                if (std::strcmp(room, "points") == 0 && name.ends_with(".json") &&
                    fs::exists(target, ignored)) {
                    const Json here = read_json(target.string()), there = read_json(file.path().string());
                    if (here.value("status", "") == "done") {
                        if (there.value("status", "") == "done" &&
                            here["picture_hash"] != there["picture_hash"])
                            throw InputError(
                                fmt::format("{}: its picture differs from that in {}: two builds that "
                                            "do not give the same bits",
                                            file.path().string(), target.string()));
                        continue;
                    }
                }
                write_whole(target.string(), [&](const std::string& temporary) {
                    fs::copy_file(file.path(), temporary, fs::copy_options::overwrite_existing);
                });
                result.copied += std::strcmp(room, "points") == 0;
            }
    }
    const Json sweep = read_json(joint);
    std::set<std::string> hashes;
    for (const Json& point : sweep["points"])
        ++result.points, hashes.insert(point["hash"].get<std::string>());
    result.distinct = hashes.size();
    for (const std::string& hash : hashes) {
        const std::string path = point_path(folder, hash);
        if (!fs::exists(path, ignored))
            ++result.missing;
        else
            result.failed += read_json(path).value("status", "") != "done";
    }
    return result;
}

}  // namespace squint::sweep
