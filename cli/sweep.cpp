// squint sweep: measures every point of a sweep file; a run that was killed is continued.
#include "cli/common.h"
#include "cli/shelf.h"
#include "cli/verb.h"
#include "core/error.h"
#include "studies/sweep/run.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <tuple>

namespace squint::cli {
namespace {

struct SweepArguments {
    std::vector<std::string> files;  // the sweep, or the folders to join (collect)
    std::vector<std::string> overrides;
    std::string output = "run";
    std::string command;  // as typed, for records
    int shard = 1, shards = 1, threads = 0;
    bool collect = false, dry_run = false, redo = false, json_lines = false, quiet = false;
};

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

int run_on_these_threads(const SweepArguments& a) {
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

int run(const SweepArguments& a) {
    return on_threads_asked_for(a.threads, [&] { return run_on_these_threads(a); });
}

void flags(Flags& f, SweepArguments& a) {
    a.command = f.command();
    f.add("files", a.files, "Sweep file; with --collect the folders to join").required().value("SWEEP.toml");
    f.add("-o,--output", a.output, "Folder for the results; points that are there are not computed again")
        .value("RUN")
        .shows_default();
    add_set(f, a.overrides, "Set any key of the scene at every point; an axis of that key still wins");
    f.read(
         "--shard",
         [&](const std::string& text) {
             constexpr const char* kAllowed = "I/N, as in 1/4, with I from 1 to N";
             std::tie(a.shard, a.shards) = pair_of(text, '/', "--shard", kAllowed);
             if (a.shard < 1 || a.shards < a.shard)
                 throw InputError(fmt::format("--shard: found \"{}\"; allowed: {}", text, kAllowed));
         },
         "Compute only every N-th point, beginning with the I-th")
        .value("I/N");
    f.add("--collect", a.collect, "Join the folders of shards into one");
    f.add("--dry-run", a.dry_run, "Print an estimate of the time and the points, and stop");
    f.add("--redo", a.redo, "Compute points again that are there");
    f.add("--threads", a.threads,
          "Points at a time; threads of a point that is timed; default: one a processor")
        .between(1, 4096)
        .value("N");
    f.add("--json-lines", a.json_lines, "Print the record of each point as it is finished, a line each");
    f.add("-q,--quiet", a.quiet, "No progress, no summary");
}

}  // namespace

namespace verbs {
extern const Verb sweep{
    .name = "sweep",
    .heading = "Choosing formats",
    .help = "Render every point of a sweep file and measure its error, time and bits",
    .footer =
        "A killed run goes on where it was when the same command is given again.  Exit code 3: some points "
        "failed.\n\n"
        "A sweep file, bits.toml (docs/sweeps.md has every key; @sweeps/section5 and others come with "
        "squint):\n"
        "  scene = \"head.toml\"               # left out: the built-in scene\n"
        "  [base]                            # any key of a scene, for every point\n"
        "  image.width = 128\n"
        "  image.height = 128\n"
        "  [[axis]]                          # a key and its values\n"
        "  key = \"sampling.step\"\n"
        "  values = [1, 0.5]\n"
        "  [[axis]]                          # wires, and one part of their formats\n"
        "  wires = [\"color\", \"transparency\"]\n"
        "  fraction_bits = { from = 8, to = 15 }\n\n"
        "Examples:\n"
        "  squint sweep bits.toml -o bits && squint report bits\n"
        "  squint sweep @sweeps/compositing -o run && squint report run -o report.html\n"
        "  squint sweep head.toml --dry-run --set image.width=256 --set image.height=256\n"
        "  squint sweep head.toml --shard 2/8 -o piece2; squint sweep --collect piece* -o run",
    .describe = described<SweepArguments, flags, run>,
};
}

}  // namespace squint::cli
