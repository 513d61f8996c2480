// squint sweep: measures every point of a sweep file; a run that was killed is continued.
#include "cli/common.h"
#include "cli/shelf.h"
#include "core/error.h"
#include "studies/sweep/run.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

namespace squint::cli {
namespace {

using namespace squint::sweep;

std::string text_of(const Progress& p) {
    const double rate = p.seconds > 0 ? static_cast<double>(p.done) / p.seconds : 0;
    const double left = rate > 0 ? static_cast<double>(p.total - p.done) / rate : 0;
    return fmt::format("{} {}/{}, {:.1f} a second, {} left{}", p.doing, p.done, p.total, rate,
                       text_of_time(left), p.failed ? fmt::format(", {} failed", p.failed) : "");
}

int join(const SweepArguments& a) {
    const Collected c = collect(a.files, a.output);
    say(fmt::format("{}: {} points, {} of them different: {} copied, {} missing, {} failed\n", a.output,
                    c.points, c.distinct, c.copied, c.missing, c.failed));
    return c.missing + c.failed > 0 ? kSomeFailed : kDone;
}

int say_forecast(const SweepFile& sweep, const RunOptions& options) {
    const Forecast f = forecast(sweep, options);
    std::string text = fmt::format(
        "{} points, {} of them different, {} to compute; about {} ({:.0f} ms a point, {} pictures to compare "
        "with)\n",
        f.points, f.distinct, f.missing, text_of_time(f.seconds), 1000 * f.seconds_a_point, f.baselines);
    for (const std::string& line : f.lines) text += line + "\n";
    print(text);
    return kDone;
}

}  // namespace

int run(const SweepArguments& a) {
    if (a.collect) return join(a);
    if (a.files.size() != 1)
        throw InputError(fmt::format(
            "sweep: {} files given; allowed: one sweep file, or --collect and folders", a.files.size()));
    const SweepFile sweep = read_sweep(file_of(a.files[0]), a.overrides);
    RunOptions options;
    options.folder = a.output;
    options.shard = a.shard, options.shards = a.shards, options.threads = a.threads, options.redo = a.redo;
    options.cancelled = &interrupted;
    options.command = a.command;
    StatusLine line(!a.quiet);
    options.progress = [&](const Progress& p) {
        if (line.due() || p.done == p.total) line.show(text_of(p), p.done == p.total);
    };
    options.note = [&](const std::string& note) {
        if (!a.quiet) say(fmt::format("note: {}\n", note));
    };
    if (a.json_lines) options.finished = [](const Json& record) { print_json(record, -1); };
    const Interruptible here;
    if (a.dry_run) return say_forecast(sweep, options);
    const RunSummary s = run_sweep(sweep, options);
    line.clear();
    if (!a.quiet)
        say(fmt::format("{}: {} points, {} of them different: {} computed, {} there already, {} failed; {}\n",
                        a.output, s.points, s.distinct, s.computed, s.reused, s.failed,
                        text_of_time(s.seconds)));
    if (!a.quiet && !s.first_failure.empty())
        say(fmt::format("the first that failed: {}\n", s.first_failure));
    return s.failed > 0 ? kSomeFailed : kDone;
}

}  // namespace squint::cli
