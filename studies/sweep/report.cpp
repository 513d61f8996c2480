// What a report tells of a run: its points, its answer, and what was not measured.
#include "studies/sweep/report.h"

#include "core/error.h"
#include "pipeline/record.h"
#include "studies/sweep/answer.h"
#include "studies/sweep/run.h"
#include "studies/sweep/run_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>

namespace squint::sweep {
namespace {

namespace fs = std::filesystem;

std::string quoted(const std::string& word) {  // quotes for a shell
    std::string text = "'";
    for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

// Drops all but the last setting of each key.
std::string command_of(const Json& record) {
    std::string text = "squint render";
    if (const std::string scene = record.value("scene", ""); !scene.empty()) text += " " + quoted(scene);
    const auto settings = settings_of(record.at("settings"));
    const auto key = [](const std::string& setting) { return setting.substr(0, setting.find('=')); };
    for (std::size_t i = 0; i < settings.size(); ++i) {
        const bool again =
            std::any_of(settings.begin() + static_cast<std::ptrdiff_t>(i) + 1, settings.end(),
                        [&](const std::string& later) { return key(later) == key(settings[i]); });
        if (!again) text += " --set " + quoted(settings[i]);
    }
    return text + " -o " + record.at("hash").get<std::string>().substr(0, 12) + ".exr";
}

Json error_of(const Json& figures) {
    Json json;
    json["max"] = figures["max_error_lsb8"], json["rmse"] = figures["rmse_lsb8"],
    json["bias"] = figures["bias_lsb8"], json["psnr"] = figures["psnr"];
    if (figures.contains("ssim")) json["ssim"] = figures["ssim"];
    return json;
}

Json point_of(const Json& record) {
    Json p{{"hash", record["hash"]}, {"status", record["status"]}, {"command", command_of(record)}};
    if (record["status"] != "done") return p["reason"] = record.value("reason", ""), p;
    for (const auto& [name, channels] : record["error"].items())
        for (const auto& [channel, figures] : channels.items()) p["error"][name][channel] = error_of(figures);
    if (record.contains("time")) p["ms"] = record["time"]["ms"], p["model"] = record["time"]["model"];
    p["path"] = record["path"], p["why"] = record["why"];
    p["samples"] = record["samples"];
    p["picture_hash"] = record["picture_hash"];
    p["width"] = record["width"], p["height"] = record["height"];
    p["volume"] = record["volume"]["name"];
    const Json& cost = record["cost"];
    for (const char* name : kCostFigures)
        if (cost.contains(name)) p["cost"][name] = cost[name];  // old records have fewer
    for (const auto& [stage, figures] : cost["stages"].items())
        p["stages"][stage] = {figures["word_bits"], figures["multiplier_bits"]};
    p["wires"] = record["wires"];
    p["baselines"] = record["baselines"];
    p["color_above_alpha"] = record["color_above_alpha_lsb8"];
    for (const char* name : {"conservation", "stuck", "warnings"})
        if (record.contains(name)) p[name] = record[name];
    if (record.contains("audit")) p["audit"] = record["audit"];
    return p;
}

/// What a sweep can measure, with a word and a line for where it was not measured.
constexpr std::array<std::string_view, 3> kMeasurements[] = {
    {"time", "time", "Time: this sweep is not timed (measure.repeats)."},
    {"real", "rounding alone", "Rounding alone, against the same pipeline in double (measure.real)."},
    {"reference", "the whole error", "The whole error, against the exact integral (measure.reference)."},
    {"srgb", "errors on an sRGB display", "Errors as an sRGB display shows them (measure.srgb)."},
    {"ssim", "SSIM", "SSIM (measure.ssim)."},
    {"audit", "ranges of wires", "Ranges, saturation, wrap and stuck transparency (measure.audit)."},
    {"conservation", "C + T", "C + T for white matter (measure.conservation)."},
};

/// Whether points differ in more than formats: points with one exact picture then have several without rounding.
bool varies_the_method(const Json& points) {
    std::set<std::string> real, reference;
    for (const Json& point : points)
        if (point.contains("baselines") && point["baselines"].contains("real") &&
            point["baselines"].contains("reference"))
            real.insert(point["baselines"]["real"].get<std::string>()),
                reference.insert(point["baselines"]["reference"].get<std::string>());
    return real.size() > reference.size();
}

void add_what_was_not_measured(Json& data, const Json& sweep, const Json& points, std::size_t missing) {
    const auto measured = sweep["measured"].get<std::vector<std::string>>();
    Json &words = data["unmeasured"] = Json::array(), &lines = data["not_measured"] = Json::array();
    const bool audited =
        std::any_of(points.begin(), points.end(), [](const Json& p) { return p.contains("audit"); });
    for (const auto& [name, word, line] : kMeasurements) {
        if (std::any_of(measured.begin(), measured.end(),
                        [name = name](const std::string& m) { return m.starts_with(name); }))
            continue;
        if (name == "audit" && audited)
            lines.push_back(
                "Ranges, saturation, wrap and stuck transparency of other points than the base "
                "(measure.audit).");
        else
            words.push_back(word), lines.push_back(line);
    }
    if (!data.contains("search"))
        words.push_back("other views"),
            lines.push_back("Other views than the scene's own: squint search holds some out.");
    lines.push_back(
        "Area and energy of hardware: bits are counted from the formats, by the rules in docs/sweeps.md.");
    if (missing > 0) lines.push_back(fmt::format("{} points have no record yet.", missing));
    const auto failed =
        std::count_if(points.begin(), points.end(), [](const Json& p) { return p["status"] == "failed"; });
    if (failed > 0) lines.push_back(fmt::format("{} points failed: the table has their reasons.", failed));
}

}  // namespace

Json wires_by_stage() {
    Json stages = Json::object();
    for (const WireInfo& wire : kWireInfo) stages[std::string(wire.stage)].push_back(wire.name);
    return stages;
}

Json report_data(const std::string& run, double most_error) {
    const Json sweep = read_json(run + "/sweep.json");
    if (sweep.value("schema", "") != "squint.sweep/1")
        throw InputError(fmt::format("{}/sweep.json: found another schema; allowed: squint.sweep/1", run));
    Json data{{"schema", "squint.report/1"},
              {"title", sweep["title"].get<std::string>().empty() ? sweep["file"] : sweep["title"]},
              {"note", sweep["note"]},
              {"file", sweep["file"]},
              {"text", sweep["text"]},
              {"mode", sweep["mode"]},
              {"axes", sweep["axes"]},
              {"stages", wires_by_stage()},
              {"measured", sweep["measured"]}};
    if (sweep.contains("search")) data["search"] = sweep["search"];
    Json points = Json::array(), entries = Json::array();
    std::map<std::string, std::size_t> index;
    std::set<std::string> against, missing, programs;
    for (const Json& entry : sweep["points"]) {
        const std::string hash = entry["hash"];
        const auto [at, is_new] = index.try_emplace(hash, points.size());
        if (is_new) {
            const std::string path = point_path(run, hash);
            std::error_code ignored;
            if (!fs::exists(path, ignored)) {
                index.erase(at), missing.insert(hash);
                continue;
            }
            const Json record = read_json(path);
            programs.insert(record["version"].get<std::string>() + " " +
                            record["program"].get<std::string>());
            points.push_back(point_of(record));
            if (record["status"] == "done")
                for (const auto& [name, figures] : record["error"].items()) against.insert(name);
        }
        Json line{{"point", index[hash]}, {"values", entry["values"]}};
        if (entry.contains("varied")) line["varied"] = entry["varied"];
        entries.push_back(line);
    }
    Json names = Json::array();
    const bool method = varies_the_method(points);
    for (const char* first : {method ? "reference" : "real", method ? "real" : "reference"})
        if (against.erase(first)) names.push_back(first);
    for (const std::string& name : against) names.push_back(name);
    data["against"] = names;
    add_what_was_not_measured(data, sweep, points, missing.size());
    data["points"] = std::move(points), data["entries"] = std::move(entries);
    data["answer"] = answer_of(data, most_error);
    data["programs"] = programs;
    Json runs = Json::array();
    std::vector<fs::path> files;
    std::error_code ignored;
    for (const auto& file : fs::directory_iterator(run + "/runs", ignored))
        if (file.path().extension() == ".json") files.push_back(file.path());
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) runs.push_back(read_json(file.string()));
    data["runs"] = std::move(runs);
    data["version"] = version();
    return data;
}

}  // namespace squint::sweep
