// A report as one page, which asks for nothing from a network.
#include "core/error.h"
#include "studies/sweep/report.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <set>
#include <sstream>

// The page as the build made it (tools/report).  The assembler copies the file: as an array, a megabyte would take the compiler a minute.
asm(".section .rodata\n"
    ".balign 16\n"
    "squint_report_page_begin:\n"
    ".incbin \"" SQUINT_REPORT_PAGE
    "\"\n"
    "squint_report_page_end:\n"
    ".byte 0\n"
    ".previous\n");
extern "C" const char squint_report_page_begin[], squint_report_page_end[];

namespace squint::sweep {
namespace {

std::string bytes_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream bytes;
    bytes << file.rdbuf();
    return bytes.str();
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

}  // namespace

std::string report_html(const Json& data, const std::string& run, std::int64_t most_picture_bytes) {
    const std::set<std::size_t> front = pareto_front(data);
    Pictures pictures(most_picture_bytes);
    const auto add = [&](const char* room, const std::string& name, bool in_full) {
        pictures.add(name, fmt::format("{}/{}/{}.values", run, room, name), in_full);
    };
    const Json& points = data["points"];
    for (std::size_t i = 0; i < points.size() && !run.empty(); ++i) {
        add("pictures", points[i]["hash"], i == 0 || front.contains(i));
        if (points[i].contains("baselines"))
            for (const auto& [name, key] : points[i]["baselines"].items()) add("baselines", key, true);
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
    std::string page(squint_report_page_begin, squint_report_page_end);
    replace_once(page, "@PICTURES@", packed.text);
    replace_once(page, "@AUDITS@", text(audits));
    replace_once(page, "@DATA@", text(whole));
    for (const char* place : {"@HEADING@", "@TITLE@"})
        replace_once(page, place, escaped_html(data["title"].get<std::string>()));
    return page;
}

}  // namespace squint::sweep
