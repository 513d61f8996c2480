#include "studies/sweep/report.h"

#include "core/error.h"
#include "pipeline/record.h"
#include "studies/sweep/answer.h"
#include "studies/sweep/report_page.h"
#include "studies/sweep/run.h"
#include "studies/sweep/run_folder.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

namespace squint::sweep {
namespace {

namespace fs = std::filesystem;

std::string bytes_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream bytes;
    bytes << file.rdbuf();
    return bytes.str();
}

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

// Costs of a point, by the names in its record.
constexpr std::array kCostNames{"bits",
                                "word_bits",
                                "multiplier_bits",
                                "divider_bits",
                                "rounding_bits",
                                "constant_multiplier_bits",
                                "lookups",
                                "lookup_bits",
                                "mean_bits",
                                "mean_multiplier_bits",
                                "mean_divider_bits",
                                "mean_rounding_bits",
                                "mean_constant_multiplier_bits",
                                "mean_lookups",
                                "mean_lookup_bits",
                                "table_bits",
                                "table_bytes",
                                "pixel_bits",
                                "buffer_bytes",
                                "voxel_bytes_per_sample",
                                "voxel_bytes_per_lit_sample",
                                "entry_bytes_per_sample"};

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
    for (const char* name : kCostNames)
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

// The indices of points that no other beats in both `cost` and error.
std::set<std::size_t> pareto_front(const Json& data) {
    std::vector<std::tuple<double, double, std::size_t>> all;
    for (std::size_t i = 0; i < data["points"].size(); ++i) {
        const Json& p = data["points"][i];
        if (p["status"] != "done" || p["error"].empty()) continue;
        const Json& first = p["error"].begin().value();
        all.emplace_back(p["cost"]["bits"].get<double>(), first["color"]["rmse"].get<double>(), i);
    }
    std::sort(all.begin(), all.end());
    std::set<std::size_t> front;
    double best = INFINITY;
    for (const auto& [cost, error, i] : all)
        if (error < best) best = error, front.insert(i);
    return front;
}

std::string base64(const std::string& bytes) {
    static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    out.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        unsigned word = 0;
        for (std::size_t k = 0; k < 3; ++k)
            word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (int k = 0; k < 4; ++k)
            out += static_cast<std::size_t>(k) <= bytes.size() - i ? kDigits[word >> (18 - 6 * k) & 63] : '=';
    }
    return out;
}

std::string deflated(const std::string& text) {
    uLongf size = compressBound(text.size());
    std::string packed(size, '\0');
    if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(text.data()),
                  text.size(), 6) != Z_OK)
        throw std::bad_alloc();
    packed.resize(size);
    return packed;
}

/// Pictures by name; those not `in_full` are shrunk until all fit.
class Pictures {
  public:
    explicit Pictures(std::int64_t room) : room_(room) {}
    void add(const std::string& name, const std::string& path, bool in_full) {
        std::string bytes = bytes_of(path);
        if (!bytes.empty() && names_.insert(name).second) all_.push_back({name, std::move(bytes), in_full});
    }
    struct Packed {
        Json index = Json::object();  // name -> width, height, stride, and its place in `text`
        std::string text;             // base64, one after the other
    };
    Packed packed() {
        std::int64_t full = 0, rest = 0;
        for (const Item& item : all_)
            (item.in_full ? full : rest) += static_cast<std::int64_t>(item.bytes.size()) * 4 / 3;
        // The area allowed to each picture that is not kept in full.
        const double left =
            std::max<double>(static_cast<double>(room_ - full), static_cast<double>(room_) / 4);
        const double keep = rest > 0 ? std::min(1.0, left / static_cast<double>(rest)) : 1;
        Packed packed;
        for (const Item& item : all_) append(packed, item, item.in_full ? 1 : keep);
        return packed;
    }

  private:
    struct Item {
        std::string name, bytes;
        bool in_full;
    };
    static void append(Packed& to, const Item& item, double keep) {
        std::string kept = item.bytes;
        if (keep < 1) {
            const Image image = read_values(item.bytes);
            const double side = std::max(image.width, image.height) * std::sqrt(keep);
            kept = values_file(image, std::max(24, static_cast<int>(side)), 9);
        }
        int width = 0, height = 0, stride = 0;
        std::sscanf(kept.c_str(), "squint.values/1 %d %d %d", &width, &height, &stride);
        const std::string text = base64(kept.substr(kept.find('\n') + 1));
        to.index[item.name] = {{"w", width},
                               {"h", height},
                               {"s", keep < 1 ? stride : 1},
                               {"at", to.text.size()},
                               {"size", text.size()}};
        to.text += text;
    }
    std::int64_t room_;
    std::vector<Item> all_;
    std::set<std::string> names_;
};

void replace_once(std::string& text, std::string_view what, const std::string& with) {
    const std::size_t at = text.find(what);
    if (at == std::string::npos) throw InputError(fmt::format("report: the page lacks {}", what));
    text.replace(at, what.size(), with);
}

std::string escaped_html(const std::string& text) {
    std::string out;
    for (const char c : text)
        out += c == '<'   ? "&lt;"
               : c == '>' ? "&gt;"
               : c == '&' ? "&amp;"
               : c == '"' ? "&quot;"
                          : std::string(1, c);
    return out;
}

// ------------------------------------------------------------------------------------------ tables

std::string cell_text(const Json& value) {
    if (value.is_null()) return "";
    if (value.is_string()) return value.get<std::string>();
    if (value.is_number_float()) return fmt::format("{:.6g}", value.get<double>());
    return value.dump();
}

struct Column {
    std::string name;
    std::vector<std::string> cells;
};
std::vector<Column> columns_of(const Json& data) {
    std::vector<Column> columns;
    const Json &points = data["points"], &entries = data["entries"];
    const auto add = [&](const std::string& name, auto&& value) {
        Column column{name, {}};
        bool any = false;
        for (const Json& entry : entries) {
            const Json& point = points[entry["point"].get<std::size_t>()];
            column.cells.push_back(cell_text(value(entry, point)));
            any |= !column.cells.back().empty();
        }
        if (any) columns.push_back(std::move(column));
    };
    const auto at = [](const Json& json, std::initializer_list<const char*> path) {
        const Json* here = &json;
        for (const char* name : path) {
            if (!here->is_object() || !here->contains(name)) return Json();
            here = &(*here)[name];
        }
        return *here;
    };
    for (const auto& [axis, values] : data["axes"].items())
        add(axis, [&, axis = axis](const Json& entry, const Json&) {
            return at(entry, {"values", axis.c_str()});
        });
    add("varied", [&](const Json& entry, const Json&) { return at(entry, {"varied"}); });
    add("status", [&](const Json&, const Json& point) { return point["status"]; });
    for (const Json& against : data["against"]) {
        const std::string name = against.get<std::string>();
        for (const char* channel : {"color", "alpha", "color_srgb"})
            for (const char* figure : {"max", "rmse", "bias", "psnr", "ssim"})
                add(fmt::format("{} {} {}", name, channel, figure), [&](const Json&, const Json& point) {
                    return at(point, {"error", name.c_str(), channel, figure});
                });
    }
    add("ms", [&](const Json&, const Json& point) { return at(point, {"ms"}); });
    for (const char* name : {"path", "samples"})
        add(name, [&](const Json&, const Json& point) { return at(point, {name}); });
    for (const char* name : kCostNames)
        add(name, [&](const Json&, const Json& point) { return at(point, {"cost", name}); });
    add("C - A above 0", [&](const Json&, const Json& point) { return at(point, {"color_above_alpha"}); });
    add("C + T - 1 least", [&](const Json&, const Json& point) {
        return at(point, {"conservation", "least_lsb8"});
    });
    add("C + T - 1 most", [&](const Json&, const Json& point) {
        return at(point, {"conservation", "most_lsb8"});
    });
    add("stuck samples", [&](const Json&, const Json& point) {
        return at(point, {"stuck", "stuck_samples"});
    });
    add("picture hash", [&](const Json&, const Json& point) { return at(point, {"picture_hash"}); });
    add("reason", [&](const Json&, const Json& point) { return at(point, {"reason"}); });
    add("command", [&](const Json&, const Json& point) { return at(point, {"command"}); });
    return columns;
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
            const std::string path = run + "/points/" + hash + ".json";
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

std::string report_csv(const Json& data) {
    const std::vector<Column> columns = columns_of(data);
    const auto field = [](const std::string& text) {
        if (text.find_first_of(",\"\n") == std::string::npos) return text;
        std::string out = "\"";
        for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
        return out + '"';
    };
    std::string text;
    for (std::size_t c = 0; c < columns.size(); ++c) text += (c ? "," : "") + field(columns[c].name);
    text += "\n";
    for (std::size_t row = 0; row < data["entries"].size(); ++row) {
        for (std::size_t c = 0; c < columns.size(); ++c)
            text += (c ? "," : "") + field(columns[c].cells[row]);
        text += "\n";
    }
    return text;
}

std::string report_markdown(const Json& data) {
    std::string text = fmt::format("# {}\n\n", data["title"].get<std::string>());
    text += "**" + data["answer"]["text"].get<std::string>() + "**\n\n";
    if (const std::string note = data["note"]; !note.empty()) text += note + "\n\n";
    std::vector<Column> columns = columns_of(data);
    std::erase_if(columns, [](const Column& c) {  // a page has a limited width
        return c.name == "command" || c.name == "picture hash" || c.name.ends_with("_bits") ||
               c.name.ends_with("_sample") || c.name.ends_with("bias") || c.name == "buffer_bytes" ||
               c.name == "samples";
    });
    const auto field = [](std::string cell) {
        for (std::size_t at = 0; (at = cell.find('|', at)) != std::string::npos; at += 2)
            cell.insert(at, "\\");
        return cell;
    };
    text += "|";
    for (const Column& column : columns) text += " " + field(column.name) + " |";
    text += "\n|";
    for (std::size_t c = 0; c < columns.size(); ++c) text += "---|";
    text += "\n";
    for (std::size_t row = 0; row < data["entries"].size(); ++row) {
        text += "|";
        for (const Column& column : columns) text += " " + field(column.cells[row]) + " |";
        text += "\n";
    }
    text += "\nErrors in 1/255 of full scale, over the foreground; PSNR in dB, peak 1.\n\nNot measured:\n\n";
    for (const Json& line : data["not_measured"]) text += "- " + line.get<std::string>() + "\n";
    for (const Json& run : data["runs"])
        text +=
            fmt::format("\n`{}`: {}, {} processors, squint {}, {:.1f} s\n", run["command"].get<std::string>(),
                        run["machine"]["cpu"].get<std::string>(), run["machine"]["processors"].get<int>(),
                        run["version"].get<std::string>(), run["seconds"].get<double>());
    return text;
}

std::string report_html(const Json& data, const std::string& run, std::int64_t most_picture_bytes) {
    const std::set<std::size_t> front = pareto_front(data);
    Pictures pictures(most_picture_bytes);
    const Json& points = data["points"];
    for (std::size_t i = 0; i < points.size() && !run.empty(); ++i) {
        const std::string hash = points[i]["hash"];
        pictures.add(hash, run + "/pictures/" + hash + ".values", i == 0 || front.contains(i));
        if (points[i].contains("baselines"))
            for (const auto& [name, key] : points[i]["baselines"].items())
                pictures.add(key.get<std::string>(), run + "/baselines/" + key.get<std::string>() + ".values",
                             true);
    }
    const Pictures::Packed packed = pictures.packed();
    // Most of it is audits' counts, which are read when somebody looks at them.
    Json whole = data, audits = Json::object();
    whole["pictures"] = packed.index;
    for (Json& point : whole["points"])
        if (point.contains("audit")) {
            audits[point["hash"].get<std::string>()] = std::move(point["audit"]);
            point["audit"] = true;
        }
    const auto text = [](const Json& json) {
        return base64(deflated(json.dump(-1, ' ', true, Json::error_handler_t::replace)));
    };
    std::string page(report_page());
    replace_once(page, "@PICTURES@", packed.text);
    replace_once(page, "@AUDITS@", text(audits));
    replace_once(page, "@DATA@", text(whole));
    for (const char* place : {"@HEADING@", "@TITLE@"})
        replace_once(page, place, escaped_html(data["title"].get<std::string>()));
    return page;
}

}  // namespace squint::sweep
