// A report as a table, for programs (CSV) and for papers (Markdown).
#include "studies/sweep/report.h"

#include <fmt/format.h>

#include <algorithm>

namespace squint::sweep {
namespace {

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
    for (const char* name : kCostFigures)
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

}  // namespace squint::sweep
