// squint sweep: every point of a sweep file, into a folder that a killed run goes on with.
#include "cli/common.h"
#include "core/error.h"
#include "pipeline/sweep/run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>

namespace squint::cli {
namespace {

using namespace squint::sweep;

std::string text_of_time(double seconds) {
    if (seconds < 60) return fmt::format("{:.1f} s", seconds);
    const auto whole = static_cast<long>(seconds + 0.5);
    if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
    return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

/// One line on a terminal, rewritten a few times a second.
class ProgressLine {
  public:
    explicit ProgressLine(bool wanted) : shown_(wanted && isatty(STDERR_FILENO)) {}
    ~ProgressLine() { clear(); }
    void clear() const {
        if (shown_) std::fputs("\r\033[K", stderr);
    }
    void operator()(const Progress& p) {
        const auto now = std::chrono::steady_clock::now();
        if (!shown_ || (p.done < p.total && now - last_ < std::chrono::milliseconds(100))) return;
        last_ = now;
        const double rate = p.seconds > 0 ? static_cast<double>(p.done) / p.seconds : 0;
        const double left = rate > 0 ? static_cast<double>(p.total - p.done) / rate : 0;
        std::fputs(fmt::format("\r\033[K{} {}/{}, {:.1f} a second, {} left{}", p.doing, p.done, p.total, rate,
                               text_of_time(left), p.failed ? fmt::format(", {} failed", p.failed) : "")
                       .c_str(),
                   stderr);
    }

  private:
    bool shown_;
    std::chrono::steady_clock::time_point last_{};
};

int join(const SweepArguments& a) {
    const Collected c = collect(a.files, a.output);
    std::fputs(fmt::format("{}: {} points, {} of them different: {} copied, {} missing, {} failed\n",
                           a.output, c.points, c.distinct, c.copied, c.missing, c.failed)
                   .c_str(),
               stderr);
    return c.missing + c.failed > 0 ? kSomeFailed : kDone;
}

int say_forecast(const SweepFile& sweep, const RunOptions& options) {
    const Forecast f = forecast(sweep, options);
    std::string text;
    for (const std::string& line : f.lines) text += line + "\n";
    text += fmt::format(
        "{} points, {} of them different, {} to compute; about {} ({:.0f} ms a point, {} pictures to compare "
        "with)\n",
        f.points, f.distinct, f.missing, text_of_time(f.seconds), 1000 * f.seconds_a_point, f.baselines);
    print(text);
    return kDone;
}

}  // namespace

int run(const SweepArguments& a) {
    if (a.collect) return join(a);
    if (a.files.size() != 1)
        throw InputError(fmt::format(
            "sweep: {} files given; allowed: one sweep file, or --collect and folders", a.files.size()));
    const SweepFile sweep = read_sweep(a.files[0], a.overrides);
    RunOptions options;
    options.folder = a.output;
    options.shard = a.shard, options.shards = a.shards, options.threads = a.threads, options.redo = a.redo;
    options.cancelled = &interrupted;
    options.command = a.command;
    ProgressLine line(!a.quiet);
    options.progress = [&](const Progress& p) { line(p); };
    options.note = [&](const std::string& note) {
        if (!a.quiet) std::fputs(fmt::format("note: {}\n", note).c_str(), stderr);
    };
    if (a.json_lines)
        options.finished = [](const Json& record) {
            print(record.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n");
        };
    const Interruptible here;
    if (a.dry_run) return say_forecast(sweep, options);
    const RunSummary s = run_sweep(sweep, options);
    line.clear();
    if (!a.quiet)
        std::fputs(
            fmt::format("{}: {} points, {} of them different: {} computed, {} there already, {} failed; {}\n",
                        a.output, s.points, s.distinct, s.computed, s.reused, s.failed,
                        text_of_time(s.seconds))
                .c_str(),
            stderr);
    return s.failed > 0 ? kSomeFailed : kDone;
}

}  // namespace squint::cli
