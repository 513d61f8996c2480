#include "studies/sweep/together.h"

#include "scene/toml.h"

#include <algorithm>
#include <map>
#include <optional>

namespace squint::sweep {
namespace {

/// One format of a wire with the error that it has alone.  `edit` makes it from the base point's.
struct Tried {
    int fraction_bits = 0;
    std::optional<double> error;  // none where the point failed
    std::optional<WireEdit> edit;
};

Tried tried(const Json& record, Wire wire, const std::string& against) {
    if (record["status"] != "done") return {};
    Format format;
    const std::string spec = record["wires"].value(info(wire).name, "");
    parse_format(spec.substr(0, spec.find(' ')), format);
    return {format.fraction_bits, record["error"][against]["color"]["rmse_lsb8"].get<double>(), {}};
}

/// The edit of the last format that keeps the bound, from the most bits down.
std::optional<WireEdit> first_within(std::vector<Tried> all) {
    std::stable_sort(all.begin(), all.end(),
                     [](const Tried& a, const Tried& b) { return a.fraction_bits > b.fraction_bits; });
    std::optional<WireEdit> found;
    for (const Tried& here : all) {
        if (!here.error || *here.error > kFirstWithin) break;
        found = here.edit;
    }
    return found;
}

bool edits_fraction_of_a_wire(const Point& base, const Point& point) {
    using Part = WireEdit::Part;
    if (point.edits.size() != base.edits.size() + 1) return false;
    const Part part = point.edits.back().part;
    return part == Part::fraction_bits || part == Part::fraction_offset;
}

}  // namespace

std::vector<Point> first_formats_together(const std::vector<ListedPoint>& entries,
                                          const std::function<Json(const std::string&)>& record_of,
                                          const std::string& against) {
    std::vector<Point> points;
    for (std::size_t i = 0; i < entries.size();) {
        const ListedPoint& base = entries[i];
        const Json record = record_of(base.hash);
        std::map<Wire, std::vector<Tried>> wires;
        while (++i < entries.size() && !entries[i].base) {
            const Point& point = entries[i].point;
            if (!edits_fraction_of_a_wire(base.point, point)) continue;
            const Wire wire = point.edits.back().wire;
            std::vector<Tried>& all = wires[wire];
            if (all.empty()) all.push_back(tried(record, wire, against));
            all.push_back(tried(record_of(entries[i].hash), wire, against));
            all.back().edit = point.edits.back();
        }
        Point together = base.point;
        for (const auto& [wire, all] : wires)
            if (const auto edit = first_within(all)) together.edits.push_back(*edit);
        if (together.edits.size() < base.point.edits.size() + 2) continue;
        together.varied = kTogether;
        together.values.emplace_back(kTogether, toml_text(std::string_view(kTogetherValue)));
        points.push_back(std::move(together));
    }
    return points;
}

}  // namespace squint::sweep
