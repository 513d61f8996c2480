#include "studies/sweep/answer.h"

#include "fixedpoint/format.h"
#include "studies/sweep/together.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace squint::sweep {
namespace {

using Json = nlohmann::ordered_json;

/// "color 11, step 0.5"; "the base point" where nothing is varied.
std::string label_of(const Json& entry) {
    std::string text;
    for (const auto& [axis, value] : entry["values"].items()) {
        std::string name = axis;
        if (axis == kTogether) {  // says itself what it is
            text += (text.empty() ? "" : ", ") + value.get<std::string>();
            continue;
        }
        for (const char* part : {" fraction_bits", " integer_bits"})
            if (name.ends_with(part))
                name.replace(name.size() - std::strlen(part), std::string::npos,
                             part[1] == 'f' ? " F" : " I");
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", name,
                            value.is_string() ? value.get<std::string>() : value.dump());
    }
    return text.empty() ? "the base point" : text;
}

std::string count(double number) {
    return fmt::format("{}", static_cast<std::int64_t>(std::llround(number)));
}

/// "31 % fewer bits than" or "5 % more bits than".
std::string saving_text(double percent) {
    return fmt::format("{:.3g} % {} bits than", std::abs(percent), percent >= 0 ? "fewer" : "more");
}

int width_of(const Json& point, const std::string& wire) {
    const std::string spec = point["wires"].value(wire, "");
    Format format;
    return parse_format(spec.substr(0, spec.find(' ')), format).empty() ? format.width() : 0;
}

/// Sets answer["wire"], ["format"] and ["bits_a_bit"] to the wire whose bits cost most at `point`, among those that
/// the sweep varies alone.  A bit of a wire costs what the bits of a point rise by between the wire's narrowest and
/// widest format, divided by the difference of their widths.
void find_dearest_wire(const Json& data, const Json& point, Json& answer) {
    struct Ends {
        int narrow = 0, wide = 0;
        double least = 0, most = 0;  // bits of those points
    };
    std::map<std::string, Ends> wires;
    for (const Json& entry : data["entries"]) {
        const Json& at = data["points"][entry["point"].get<std::size_t>()];
        const std::string varied = entry.value("varied", "");
        if (!varied.ends_with("_bits") && !varied.ends_with("_offset")) continue;
        const std::string wire = varied.substr(0, varied.find(' '));
        const int width = at["status"] == "done" ? width_of(at, wire) : 0;
        if (width == 0 || varied.find(' ') != varied.rfind(' ')) continue;  // "all wires fraction_bits"
        const double bits = at["cost"]["bits"];
        Ends& ends = wires.try_emplace(wire, Ends{width, width, bits, bits}).first->second;
        if (width < ends.narrow) ends.narrow = width, ends.least = bits;
        if (width > ends.wide) ends.wide = width, ends.most = bits;
    }
    double dearest = 0;
    for (const auto& [wire, ends] : wires) {
        if (ends.wide == ends.narrow) continue;
        const double a_bit = (ends.most - ends.least) / (ends.wide - ends.narrow);
        const int width = width_of(point, wire);
        if (a_bit * width <= dearest) continue;
        dearest = a_bit * width;
        answer["wire"] = wire, answer["bits_a_bit"] = a_bit;
        answer["format"] = point["wires"][wire];
    }
}

/// "weight (u1.8 trn sat): each of its bits costs 530"
std::string dearest_text(const Json& answer) {
    return fmt::format("{} ({}): each of its bits costs {:.3g}", answer["wire"].get<std::string>(),
                       answer["format"].get<std::string>(), answer["bits_a_bit"].get<double>());
}

Json answer_of_search(const Json& data) {
    const Json& search = data["search"];
    const Json &found = search["found"], &squeeze = search["squeeze"], &scene = search["scene"];
    const double bits = found["bits"], bound = search["max_error_lsb8"];
    Json answer{{"bound", bound},
                {"figure", search["figure"] == "max" ? "max" : "rmse"},
                {"against", "real"},
                {"bits", bits},
                {"error", found["error_lsb8"]},
                {"than", "as the scene says"},
                {"than_bits", scene["bits"]},
                {"saving_percent", 100 * (1 - bits / scene["bits"].get<double>())},
                {"unseen_margin", found["other_views_margin_lsb8"]}};
    find_dearest_wire(data, found, answer);
    const bool kept = !found["error_lsb8"].is_null() && found["error_lsb8"].get<double>() <= bound;
    const Json& margin = answer["unseen_margin"];
    answer["good"] = kept && !margin.is_null() && margin.get<double>() >= 0;
    const auto error = [](const Json& of) {
        return of["error_lsb8"].is_null() ? "none" : fmt::format("{:.3g}", of["error_lsb8"].get<double>());
    };
    std::string text = fmt::format(
        "{} bits keep a {} error of {} LSB8 ({:g} was asked for): {} the scene's own {} (error {}), {} "
        "Squeeze's table of "
        "{} (error {}).",
        count(bits), search["figure"] == "max" ? "greatest" : "rms", error(found), bound,
        saving_text(answer["saving_percent"]), count(scene["bits"]), error(scene),
        saving_text(100 * (1 - bits / squeeze["bits"].get<double>())), count(squeeze["bits"]),
        error(squeeze));
    if (answer.contains("wire"))
        text += fmt::format(" The wire that costs most is {}.", dearest_text(answer));
    if (margin.is_null())
        text += " Views that took no part were not measured.";
    else
        text += fmt::format(" On {} views that took no part the error is {:.3g} LSB8 {} the bound.",
                            search["other_degrees"].size(), std::abs(margin.get<double>()),
                            margin.get<double>() >= 0 ? "inside" : "BEYOND");
    answer["text"] = text;
    return answer;
}

struct Candidate {
    std::size_t point = 0;
    const Json* entry = nullptr;
    double bits = 0, error = 0;
};

Json answer_of_sweep(const Json& data, double bound) {
    Json answer{{"bound", bound}, {"figure", "rmse"}, {"point", nullptr}, {"good", false}};
    if (data["against"].empty()) {
        answer["against"] = nullptr, answer["text"] = "No point was compared with anything.";
        return answer;
    }
    const std::string against = data["against"][0];
    answer["against"] = against;
    std::optional<Candidate> best, nearest, base, dearest;
    for (const Json& entry : data["entries"]) {
        Candidate c{entry["point"], &entry, 0, 0};
        const Json& point = data["points"][c.point];
        if (point["status"] != "done" || !point["error"].contains(against)) continue;
        const Json& error = point["error"][against]["color"]["rmse"];
        if (error.is_null()) continue;
        c.bits = point["cost"]["bits"], c.error = error;
        if (c.error <= bound &&
            (!best || c.bits < best->bits || (c.bits == best->bits && c.error < best->error)))
            best = c;
        if (!nearest || c.error < nearest->error) nearest = c;
        if (!dearest || c.bits > dearest->bits) dearest = c;
        if (!base && data["mode"] == "one_at_a_time" && !entry.contains("varied")) base = c;
    }
    const std::string asked = fmt::format("within {:g} LSB8 (RMSE against {})", bound, against);
    if (!best) {
        answer["text"] = nearest ? fmt::format("No point is {}: the nearest, {}, is at {:.3g}.", asked,
                                               label_of(*nearest->entry), nearest->error)
                                 : "No point has an error: all failed.";
        return answer;
    }
    const Candidate& than = base ? *base : *dearest;
    const double saving = 100 * (1 - best->bits / than.bits);
    answer["good"] = true, answer["point"] = best->point;
    answer["bits"] = best->bits, answer["error"] = best->error;
    answer["than"] = base ? "the base point" : "the dearest point", answer["than_bits"] = than.bits;
    answer["saving_percent"] = saving;
    std::string text = fmt::format("Cheapest {}: {}, {} bits at {:.3g} LSB8", asked, label_of(*best->entry),
                                   count(best->bits), best->error);
    if (best->point != than.point)
        text += fmt::format(", {} {}'s {}", saving_text(saving), answer["than"].get<std::string>(),
                            count(than.bits));
    text += ".";
    const Json& point = data["points"][best->point];
    double most = 0;
    if (point.contains("stages"))
        for (const auto& [stage, bits] : point["stages"].items()) {
            double sum = 0;
            for (const Json& part : bits) sum += part.is_number() ? part.get<double>() : 0;
            if (sum > most) most = sum, answer["stage"] = stage, answer["stage_bits"] = sum;
        }
    find_dearest_wire(data, point, answer);
    if (answer.contains("stage"))
        text += fmt::format(" Most of them are in {} ({})", answer["stage"].get<std::string>(), count(most));
    if (answer.contains("wire"))
        text +=
            (answer.contains("stage") ? "; the wire that costs most is " : " The wire that costs most is ") +
            dearest_text(answer);
    answer["text"] = text + (answer.contains("stage") || answer.contains("wire") ? "." : "");
    return answer;
}

}  // namespace

Json answer_of(const Json& data, double bound) {
    Json answer = data.contains("search") ? answer_of_search(data) : answer_of_sweep(data, bound);
    const auto unmeasured = data["unmeasured"].get<std::vector<std::string>>();
    if (!unmeasured.empty())
        answer["text"] = fmt::format("{} Not measured: {}.", answer["text"].get<std::string>(),
                                     fmt::join(unmeasured, ", "));
    return answer;
}

}  // namespace squint::sweep
