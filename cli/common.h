// What several verbs need.
#pragma once

#include "cli/arguments.h"
#include "pipeline/plan/plan.h"

#include <nlohmann/json_fwd.hpp>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace squint::cli {

inline constexpr int kDone = 0, kComparisonFailed = 1, kUsage = 2, kSomeFailed = 3, kInternal = 70,
                     kInterrupted = 130;

/// Writes to standard output.  Throws InputError when it cannot be written.
void print(std::string_view text);
void print_json(const nlohmann::ordered_json& json);
/// To a file, whole or not at all, or - for standard output.
void write_json(const std::string& path, const nlohmann::ordered_json& json);

/// The scene asked for, its preset file merged in.  A volume where a scene is expected, or one set in place of the
/// built-in head, makes a scene of its own; its transfer function may still be missing: load() brings it.
Scene read(const SceneArguments& arguments);

/// A scene whose volume is NAME (procedural) or a file, with `volume.*` overrides.
Scene scene_of_volume(const std::string& name_or_file, const std::vector<std::string>& overrides);

/// The scene's volume, refused beyond `max_bytes` (0: no limit), as load(); a scene without a transfer function gets
/// the data's own.
std::shared_ptr<const Volume> load_and_complete(Scene& scene, std::vector<std::string>& notes,
                                                std::int64_t max_bytes = 0);

/// The scene's volume, refused beyond `max_bytes` (0: no limit).  `notes` gets what a user should know.
std::shared_ptr<const Volume> load(const Scene& scene, std::vector<std::string>& notes,
                                   std::int64_t max_bytes = 0);

/// make_plan(), whose messages begin with the place where the setting was given that they are about.
Plan plan_of(const Scene& scene, std::shared_ptr<const Volume> volume, int frame = 0);

/// Scene, volume and plan in one step; the volume's notes stand before the plan's own.
Plan plan_of(const SceneArguments& arguments);

/// "12.3 MiB", "4.1 M".
std::string text_of_bytes(std::int64_t bytes);
std::string text_of_count(std::int64_t count);

/// Rows of cells -> lines with aligned columns, two spaces apart.  The first row is the head; numbers go to
/// the right.
std::string table_text(const std::vector<std::vector<std::string>>& rows, std::string_view indent = "");

/// One line on a terminal's standard error, rewritten a few times a second; elsewhere (a log) a line every ten
/// seconds.
class StatusLine {
  public:
    explicit StatusLine(bool wanted);
    ~StatusLine() { clear(); }
    void clear() const;
    /// `last`: shown however soon it comes.
    void show(const std::string& text, bool last = false);
    bool due() const;  // whether show() would show something now
    bool rewrites() const { return terminal_; }

  private:
    bool shown_, terminal_;
    std::chrono::steady_clock::time_point last_;
};

/// "3.2 s", "12 min 5 s", "3 h 20 min".
std::string text_of_time(double seconds);

/// True after Ctrl-C while a picture is being rendered (see main.cpp).
extern std::atomic<bool> interrupted;
/// While it lives, Ctrl-C sets `interrupted`; otherwise it ends the program at once.
struct Interruptible {
    Interruptible();
    ~Interruptible();
};

}  // namespace squint::cli
