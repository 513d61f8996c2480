#include "studies/sweep/run_folder.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "pipeline/render.h"
#include "scene/toml.h"
#include "studies/sweep/run.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>

namespace squint::sweep {
namespace {

namespace fs = std::filesystem;

void make_folder(const std::string& path) {
    std::error_code error;
    fs::create_directories(path, error);
    if (error) throw InputError(fmt::format("{}: cannot make the folder: {}", path, error.message()));
}

}  // namespace

std::string now_text() {
    return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
}

void make_run_folder(const std::string& folder) {
    for (const char* room : {"points", "pictures", "baselines", "runs"}) make_folder(folder + "/" + room);
}

std::string dump(const Json& json) {
    return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string point_path(const std::string& folder, const std::string& hash) {
    return folder + "/points/" + hash + ".json";
}

Json sweep_record(const SweepFile& sweep, const std::vector<ListedPoint>& entries,
                  const std::vector<std::string>& wanted) {
    Json axes = Json::object();
    for (const ListedPoint& entry : entries)
        for (const auto& [axis, label] : entry.point.values) {
            Json& values = axes[axis];
            const Json value = value_of_label(label);
            if (!values.is_array()) values = Json::array();
            if (values.size() < 10'000 && std::find(values.begin(), values.end(), value) == values.end())
                values.push_back(value);
        }
    Json points = Json::array();
    for (const ListedPoint& entry : entries) {
        Json values = Json::object();
        for (const auto& [axis, label] : entry.point.values) values[axis] = value_of_label(label);
        Json point{{"hash", entry.hash}, {"values", values}};
        if (!entry.point.varied.empty()) point["varied"] = entry.point.varied;
        points.push_back(std::move(point));
    }
    constexpr const char* kModes[] = {"product", "one_at_a_time", "random"};
    Json scenes = Json::array();
    for (std::size_t i = 0; i < sweep.scenes.size(); ++i) scenes.push_back(scene_path(sweep, i));
    return {{"schema", "squint.sweep/1"},
            {"title", sweep.title},
            {"note", sweep.note},
            {"file", fs::path(sweep.name).filename().string()},
            {"text", sweep.text},
            {"scenes", scenes},
            {"overrides", sweep.overrides},
            {"mode", kModes[static_cast<int>(sweep.mode)]},
            {"seed", sweep.seed},
            {"measured", wanted},
            {"axes", axes},
            {"points", points}};
}

namespace {
Json json_of(const TomlValue& value) {
    using Kind = TomlValue::Kind;
    switch (value.kind) {
        case Kind::integer:
            return value.integer;
        case Kind::number:
            return value.number;
        case Kind::boolean:
            return value.flag;
        case Kind::string:
        case Kind::date:
            return value.text;
        case Kind::list:
        case Kind::table:
            break;
    }
    Json json = value.kind == Kind::list ? Json::array() : Json::object();
    for (const TomlValue& item : value.items)
        if (value.kind == Kind::list)
            json.push_back(json_of(item));
        else
            json[item.key] = json_of(item);
    return json;
}
std::string toml_of(const Json& json) {
    if (json.is_string()) return toml_text(std::string_view(json.get_ref<const std::string&>()));
    if (json.is_boolean()) return toml_text(json.get<bool>());
    if (json.is_number_float()) return toml_text(json.get<double>());
    if (json.is_number()) return toml_text(json.get<std::int64_t>());
    std::string inside;
    for (const auto& [key, item] : json.items())
        inside += (inside.empty() ? "" : ", ") +
                  (json.is_object() ? toml_text(std::string_view(key)) + " = " : std::string()) +
                  toml_of(item);
    return json.is_object() ? "{ " + inside + " }" : "[" + inside + "]";
}
}  // namespace

Json settings_record(const std::vector<std::string>& settings) {
    Json record = Json::object();
    for (const std::string& setting : settings) {
        const std::size_t equals = setting.find('=');
        const std::string key = setting.substr(0, equals), text = setting.substr(equals + 1);
        record.erase(key);  // the last one stays
        try {
            record[key] = json_of(parse_toml("v = " + text, "setting").items.at(0));
        } catch (const InputError&) {
            record[key] = text;  // a bare word
        }
    }
    return record;
}

std::vector<std::string> settings_of(const Json& recorded) {
    if (recorded.is_array()) return recorded.get<std::vector<std::string>>();
    std::vector<std::string> settings;
    for (const auto& [key, value] : recorded.items()) settings.push_back(key + '=' + toml_of(value));
    return settings;
}

RecordState state_of(const std::string& path, const std::vector<std::string>& wanted) {
    std::error_code ignored;
    if (!fs::exists(path, ignored)) return RecordState::missing;
    Json record;
    try {
        record = read_json(path);
        if (record.at("status") != "done") return RecordState::missing;  // its cause may be mended by now
        const auto measured = record.at("measured").get<std::vector<std::string>>();
        for (const std::string& name : wanted)
            if (std::find(measured.begin(), measured.end(), name) == measured.end())
                return RecordState::missing;
        return record.at("program") == program_record()["program"] ? RecordState::reusable
                                                                   : RecordState::other_program;
    } catch (const std::exception&) {
        return RecordState::missing;
    }
}

Json write_record(Evaluator& evaluator, const Prepared& point, const std::string& folder, int threads,
                  bool timed, bool base) {
    Json record{{"schema", "squint.point/2"}, {"hash", point.hash}};
    record.update(program_record());
    record["scene"] = point.scene_file;
    record["settings"] = settings_record(point.settings);
    record["measured"] = evaluator.wanted(base);
    std::string reason;
    try {
        const Json figures = evaluator.measure(point, threads, timed, base);
        record["status"] = "done";
        record.update(figures);
    } catch (const InputError& error) {
        reason = error.what();
    } catch (const std::bad_alloc&) {
        reason = "out of memory";
    } catch (const std::exception& error) {
        reason = fmt::format("internal error: {}", error.what());
    }
    if (!reason.empty()) record["status"] = "failed", record["reason"] = reason;
    write_text_whole(point_path(folder, point.hash), dump(record));
    return record;
}

RunLog::RunLog(const std::string& folder, const Json& about) {
    const auto ticks = std::chrono::system_clock::now().time_since_epoch().count();
    path_ = fmt::format("{}/runs/{:016x}-{}.json", folder, ticks, getpid());
    about_ = {{"schema", "squint.run/1"}, {"started", now_text()}, {"machine", machine_record()}};
    about_.update(about), about_.update(program_record());
}

void RunLog::write(const char* state, double seconds, const Counts& counts) {
    Json run = about_;
    run.update({{"seconds", seconds},
                {"state", state},
                {"computed", counts.computed},
                {"reused", counts.reused},
                {"failed", counts.failed}});
    write_text_whole(path_, dump(run));
}

}  // namespace squint::sweep
