#include "cli/common.h"

#include "cli/shelf.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/procedural.h"
#include "core/text.h"
#include "core/volume_source.h"
#include "scene/from_data.h"
#include "studies/search/auto_formats.h"

#include <fmt/format.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

namespace squint::cli {

namespace {
/// Its lines, each as printable() has it.
std::string printable_lines(std::string_view text) {
    std::string out;
    for (std::size_t end; (end = text.find('\n')) != std::string_view::npos; text.remove_prefix(end + 1))
        out += printable(text.substr(0, end)) + '\n';
    return out + printable(text);
}
}  // namespace

void print(std::string_view given) {
    const std::string text = printable_lines(given);
    if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
        throw InputError(fmt::format("standard output: cannot write: {}", std::strerror(errno)));
}

void say(std::string_view text) {
    std::fputs(printable_lines(text).c_str(), stderr);
}

void print_json(const nlohmann::ordered_json& json, int indent) {
    print(json.dump(indent, ' ', true, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

void write_json(const std::string& path, const nlohmann::ordered_json& json) {
    if (path == "-") return print_json(json);
    write_text_whole(path, json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

Scene read(const SceneArguments& arguments) {
    return scene_asked_for(file_of(arguments.file), arguments.overrides);
}

Scene scene_of_volume(const std::string& name_or_file, const std::vector<std::string>& overrides) {
    Scene any = built_in_scene();  // stands for any scene: only its volume counts
    any.volume = {};
    Scene scene = scene_with(any, overrides);
    if (name_or_file.empty()) return scene;
    if (find_procedural(name_or_file))
        scene.volume.procedural = name_or_file, scene.volume.file.clear();
    else
        scene.volume.file = name_or_file, scene.volume.procedural.clear();
    return scene;
}

std::shared_ptr<const Volume> load(const Scene& scene, std::vector<std::string>& notes,
                                   std::int64_t max_bytes) {
    LoadLimits limits;
    if (max_bytes > 0) limits.max_bytes = std::min(limits.max_bytes, max_bytes);
    return std::make_shared<const Volume>(load_volume(volume_source(scene), limits, &notes));
}

std::shared_ptr<const Volume> load_and_complete(const SceneArguments& arguments, Scene& scene,
                                                std::vector<std::string>& notes,
                                                std::vector<std::string>& warnings, std::int64_t max_bytes,
                                                bool progress) {
    auto volume = load(scene, notes, max_bytes);
    complete_from_data(scene, *volume, notes);
    if (is_of_data(file_of(arguments.file), arguments.overrides)) frame_data(scene, *volume);
    const Interruptible here;
    StatusLine line(progress && scene.precision.preset == "auto");
    const search::AutoFormats chosen = search::choose_formats(
        scene, volume, {.threads = 0, .cancelled = &interrupted, .progress = [&](const std::string& text) {
                            line.show(text);
                        }});
    line.clear();
    notes.insert(notes.end(), chosen.notes.begin(), chosen.notes.end());
    warnings.insert(warnings.end(), chosen.warnings.begin(), chosen.warnings.end());
    return volume;
}

Plan plan_of(const SceneArguments& arguments) {
    Scene scene = read(arguments);
    std::vector<std::string> notes, warnings;
    const auto volume = load_and_complete(arguments, scene, notes, warnings);
    Plan plan = plan_asked_for(scene, volume);
    plan.warnings.insert(plan.warnings.begin(), warnings.begin(), warnings.end());
    plan.notes.insert(plan.notes.begin(), notes.begin(), notes.end());
    return plan;
}

std::string text_of_bytes(std::int64_t bytes) {
    const char* units[] = {"bytes", "KiB", "MiB", "GiB", "TiB"};
    auto value = static_cast<double>(bytes);
    int unit = 0;
    while (value >= 1024 && unit < 4) value /= 1024, ++unit;
    return unit == 0 ? fmt::format("{} {}", bytes, units[0]) : fmt::format("{:.1f} {}", value, units[unit]);
}

std::string text_of_count(std::int64_t count) {
    if (count < 10000) return std::to_string(count);
    const char* units[] = {"", " k", " M", " G", " T"};
    auto value = static_cast<double>(count);
    int unit = 0;
    while (value >= 1000 && unit < 4) value /= 1000, ++unit;
    return fmt::format("{:.1f}{}", value, units[unit]);
}

std::string table_text(const std::vector<std::vector<std::string>>& rows, std::string_view indent) {
    std::vector<std::size_t> width;
    std::vector<bool> numeric;
    for (std::size_t r = 0; r < rows.size(); ++r)
        for (std::size_t c = 0; c < rows[r].size(); ++c) {
            if (width.size() <= c) width.push_back(0), numeric.push_back(true);
            const std::string& cell = rows[r][c];
            width[c] = std::max(width[c], printable(cell).size());
            if (r > 0 && !cell.empty() && cell != "-" && cell.find_first_of("0123456789") > 1)
                numeric[c] = false;
        }
    std::string text;
    for (const auto& row : rows) {
        std::string line(indent);
        for (std::size_t c = 0; c < row.size(); ++c) {
            if (c > 0) line += "  ";
            const std::string cell = printable(row[c]);
            line +=
                numeric[c] ? fmt::format("{:>{}}", cell, width[c]) : fmt::format("{:<{}}", cell, width[c]);
        }
        line.erase(line.find_last_not_of(' ') + 1);
        text += line + "\n";
    }
    return text;
}

StatusLine::StatusLine(bool wanted) : shown_(wanted), terminal_(isatty(STDERR_FILENO)) {
    if (!terminal_) last_ = std::chrono::steady_clock::now();  // work of less than ten seconds needs no line
}

void StatusLine::clear() const {
    if (shown_ && terminal_) std::fputs("\r\033[K", stderr);
}

bool StatusLine::due() const {
    using namespace std::chrono;
    return shown_ && steady_clock::now() - last_ >= (terminal_ ? milliseconds(100) : milliseconds(10'000));
}

void StatusLine::show(const std::string& text, bool last) {
    if (!shown_ || (!(last && terminal_) && !due())) return;
    last_ = std::chrono::steady_clock::now();
    const std::string line = printable(text);
    std::fputs((terminal_ ? "\r\033[K" + line : line + "\n").c_str(), stderr);
}

void ProgressBar::operator()(double part) {
    const std::lock_guard lock(mutex_);
    const int percent = static_cast<int>(100 * part);
    if (percent <= percent_ || !line_.due()) return;
    percent_ = percent;
    const std::string bar(static_cast<std::size_t>(percent * 2 / 5), '#'),
        head = what_.empty() ? "" : what_ + ": ";
    line_.show(line_.rewrites() ? fmt::format("{}[{:<40}] {:3} %", head, bar, percent)
                                : fmt::format("{}{} %", head, percent));
}

std::string text_of_time(double seconds) {
    if (seconds < 60) return fmt::format("{:.1f} s", seconds);
    const auto whole = std::lround(seconds);
    if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
    return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

}  // namespace squint::cli
