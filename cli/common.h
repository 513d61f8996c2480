// Shared by several verbs.
#pragma once

#include "cli/common_flags.h"
#include "core/parallel.h"
#include "pipeline/plan/asked.h"

#include <nlohmann/json_fwd.hpp>

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace squint::cli {

inline constexpr int kDone = 0, kComparisonFailed = 1, kUsage = 2, kSomeFailed = 3, kInternal = 70,
                     kInterrupted = 130;

/// Writes lines of ASCII to standard output: other characters become \u00FC, control characters become ?.  Throws
/// InputError where that fails.
void print(std::string_view text);
/// Writes the same to standard error, where nobody hears of a failure.
void say(std::string_view text);
void print_json(const nlohmann::ordered_json& json, int indent = 2);
/// Writes to a file, whole or not at all, or to standard output for -.
void write_json(const std::string& path, const nlohmann::ordered_json& json);

/// What `run` returns, with all its work in parallel on so many threads; 0: one a processor.
template <class Run>
int on_threads_asked_for(int threads, const Run& run) {
    int code = kDone;
    on_threads(threads, [&] { code = run(); });
    return code;
}

/// scene_asked_for(), and @NAME means a scene that comes with squint; its transfer function may be missing until
/// load_and_complete().
Scene read(const SceneArguments& arguments);

/// A scene whose volume is NAME (procedural) or a file, with `volume.*` overrides.
Scene scene_of_volume(const std::string& name_or_file, const std::vector<std::string>& overrides);

/// Loads the scene's volume, and refuses one beyond `max_bytes` (0: no limit).  A scene without a transfer
/// function gets the data's own; where the arguments name a volume in place of a scene, the camera frames what it
/// shows.  The preset `auto` gets its formats; `warnings` hears where its budget is not met, and a terminal,
/// with `progress`, of every proof.
std::shared_ptr<const Volume> load_and_complete(const SceneArguments& arguments, Scene& scene,
                                                std::vector<std::string>& notes,
                                                std::vector<std::string>& warnings,
                                                std::int64_t max_bytes = 0, bool progress = true);

/// Loads the scene's volume, at most `max_bytes` (0: no limit).  `notes` receives what a user should know.
std::shared_ptr<const Volume> load(const Scene& scene, std::vector<std::string>& notes,
                                   std::int64_t max_bytes = 0);

/// Scene, volume and plan_asked_for() in one step; the volume's notes come before the plan's.
Plan plan_of(const SceneArguments& arguments);

/// "12.3 MiB", "4.1 M".
std::string text_of_bytes(std::int64_t bytes);
std::string text_of_count(std::int64_t count);

/// Rows of cells as lines with aligned columns, two spaces apart.  The first row is the head.  Numbers align
/// right.
std::string table_text(const std::vector<std::vector<std::string>>& rows, std::string_view indent = "");

/// A status line: on a terminal's standard error it is rewritten a few times a second; elsewhere (a log) a
/// line appears every ten seconds.
class StatusLine {
  public:
    explicit StatusLine(bool wanted);
    ~StatusLine() { clear(); }
    void clear() const;
    /// `last`: shows it at once, however soon after the one before.
    void show(const std::string& text, bool last = false);
    bool due() const;  // whether show() would show now
    bool rewrites() const { return terminal_; }

  private:
    bool shown_, terminal_;
    std::chrono::steady_clock::time_point last_;
};

/// A progress bar on a terminal's standard error; elsewhere a line every ten seconds.  Takes parts from any thread.
class ProgressBar {
  public:
    /// `what`: before the bar, with a colon; may be empty.
    explicit ProgressBar(bool wanted, std::string what = {}) : line_(wanted), what_(std::move(what)) {}
    void operator()(double part);

  private:
    StatusLine line_;
    std::string what_;
    int percent_ = -1;
    std::mutex mutex_;
};

/// "3.2 s", "12 min 5 s", "3 h 20 min".
std::string text_of_time(double seconds);

/// Set by Ctrl-C while a picture is being rendered (see main.cpp).
extern std::atomic<bool> interrupted;
/// During its life Ctrl-C sets `interrupted`; at other times it ends the program.
struct Interruptible {
    Interruptible();
    ~Interruptible();
};

}  // namespace squint::cli
