#include "studies/sweep/points.h"

#include "core/error.h"
#include "scene/toml.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace squint::sweep {
namespace {

constexpr std::size_t kMostPoints = 10'000'000;

void take(Point& point, const Axis& axis, const Choice& choice) {
    point.overrides.insert(point.overrides.end(), choice.overrides.begin(), choice.overrides.end());
    point.edits.insert(point.edits.end(), choice.edits.begin(), choice.edits.end());
    point.values.emplace_back(axis.name, choice.label);
}

// Every combination of the axes laid over every point.
std::vector<Point> crossed(std::vector<Point> points, const std::vector<const Axis*>& axes) {
    for (const Axis* axis : axes) {
        if (points.size() * axis->choices.size() > kMostPoints)
            throw InputError(
                fmt::format("{}: more than {} points; allowed: fewer values, or mode = \"random\"", axis->at,
                            kMostPoints));
        std::vector<Point> next;
        next.reserve(points.size() * axis->choices.size());
        for (const Point& point : points)
            for (const Choice& choice : axis->choices)
                next.push_back(point), take(next.back(), *axis, choice);
        points = std::move(next);
    }
    return points;
}

std::vector<Axis> wire_axes(const WireAxes& w, const std::vector<Wire>& used) {
    using Part = WireEdit::Part;
    std::vector<Axis> axes;
    const std::vector<Wire>& wires = w.wires.empty() ? used : w.wires;
    const auto add = [&](const std::string& name, const std::vector<Wire>& of, Part part,
                         const std::vector<int>& numbers, const std::vector<std::string>& words) {
        Axis axis{name, {}, false, {}};
        for (const int n : numbers) {
            axis.choices.push_back({toml_text(std::int64_t{n}), {}, {}});
            for (const Wire wire : of) axis.choices.back().edits.push_back({wire, part, n, {}});
        }
        for (const std::string& word : words) {
            axis.choices.push_back({toml_text(std::string_view(word)), {}, {}});
            for (const Wire wire : of) axis.choices.back().edits.push_back({wire, part, 0, word});
        }
        if (!axis.choices.empty()) axes.push_back(std::move(axis));
    };
    const auto each = [&](const std::string& name, const std::vector<Wire>& of) {
        add(name + " fraction_bits", of, Part::fraction_bits, w.fraction_bits, {});
        add(name + " fraction_offset", of, Part::fraction_offset, w.fraction_offset, {});
    };
    const auto rest = [&](const std::string& name, const std::vector<Wire>& of) {
        add(name + " integer_bits", of, Part::integer_bits, w.integer_bits, {});
        add(name + " integer_offset", of, Part::integer_offset, w.integer_offset, {});
    };
    for (const Wire wire : wires) each(std::string(info(wire).name), {wire});
    for (const Wire wire : wires) rest(std::string(info(wire).name), {wire});
    for (const Wire wire : wires)
        add(std::string(info(wire).name) + " rounding", {wire}, Part::rounding, {}, w.rounding);
    if (w.together && wires.size() > 1) {
        each("all wires", wires), rest("all wires", wires);
        add("all wires rounding", wires, Part::rounding, {}, w.rounding);
    }
    return axes;
}

// splitmix64 (Steele, Lea and Flood 2014): the same numbers on every machine.
struct Random {
    std::uint64_t state;
    std::uint64_t next() {
        std::uint64_t z = state += 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    std::size_t below(std::size_t n) {  // by rejection, without bias
        const std::uint64_t limit = ~std::uint64_t{0} / n * n;
        std::uint64_t x;
        do x = next();
        while (x >= limit);
        return x % n;
    }
};

// Draws distinct combinations evenly; takes all where there are no more.
std::vector<Point> drawn(const SweepFile& sweep, const Point& start, const std::vector<const Axis*>& axes,
                         Random& random) {
    double all = 1;
    for (const Axis* axis : axes) all *= static_cast<double>(axis->choices.size());
    if (all <= static_cast<double>(sweep.samples)) return crossed({start}, axes);
    std::vector<Point> points;
    std::set<std::vector<std::size_t>> seen;
    while (points.size() < static_cast<std::size_t>(sweep.samples)) {
        std::vector<std::size_t> at;
        for (const Axis* axis : axes) at.push_back(random.below(axis->choices.size()));
        if (!seen.insert(at).second) continue;
        points.push_back(start);
        for (std::size_t a = 0; a < axes.size(); ++a) take(points.back(), *axes[a], axes[a]->choices[at[a]]);
    }
    return points;
}

}  // namespace

std::vector<Point> expand(const SweepFile& sweep, const std::vector<Wire>& used) {
    std::vector<Point> starts;
    for (std::size_t s = 0; s < std::max<std::size_t>(sweep.scenes.size(), 1); ++s) {
        Point point;
        point.scene = s;
        if (sweep.scenes.size() > 1)
            point.values.emplace_back("scene", toml_text(std::string_view(sweep.scenes[s])));
        starts.push_back(std::move(point));
    }
    std::vector<const Axis*> cross, alone;
    for (const Axis& axis : sweep.axes)
        (axis.cross || sweep.mode == Mode::product ? cross : alone).push_back(&axis);
    starts = crossed(std::move(starts), cross);
    if (sweep.mode == Mode::product) return starts;

    std::vector<Point> points;
    Random random{sweep.seed};
    const std::vector<Axis> of_wires =
        sweep.wires.present ? wire_axes(sweep.wires, used) : std::vector<Axis>{};
    for (const Axis& axis : of_wires) alone.push_back(&axis);
    for (const Point& start : starts) {
        if (sweep.mode == Mode::random) {
            for (Point& point : drawn(sweep, start, alone, random)) points.push_back(std::move(point));
            continue;
        }
        points.push_back(start);
        for (const Axis* axis : alone)
            for (const Choice& choice : axis->choices) {
                points.push_back(start), take(points.back(), *axis, choice);
                points.back().varied = axis->name;
            }
    }
    return points;
}

}  // namespace squint::sweep
