#include "studies/search/scenes.h"

#include "core/error.h"
#include "scene/toml.h"

#include <fmt/format.h>

#include <algorithm>

namespace squint::search {

Scenes::Scenes(const sweep::SweepFile& sweep, std::string folder, const std::atomic<bool>* cancelled)
    : sweep_(sweep), evaluator_(sweep, std::move(folder), cancelled) {}

std::size_t Scenes::count() const {
    return std::max<std::size_t>(sweep_.scenes.size(), 1);
}

std::string Scenes::name(std::size_t scene) const {
    return sweep_.scenes.empty() ? "the built-in scene" : sweep_.scenes[scene];
}

sweep::Prepared Scenes::prepared(const sweep::Point& point) {
    sweep::Prepared p = evaluator_.prepare(point);
    if (!p.failure.empty()) throw InputError(p.failure);
    return p;
}

Plan Scenes::plan(const sweep::Point& point) {
    const sweep::Prepared p = prepared(point);
    return make_plan(p.scene, p.volume);
}

Plan Scenes::plan(std::size_t scene, const std::vector<std::string>& overrides) {
    sweep::Point point;
    point.scene = scene, point.overrides = overrides;
    return plan(point);
}

void Scenes::check_preset(std::size_t scene, const Plan& plan, const std::string& of_first) const {
    if (const std::string& preset = plan.scene.precision.preset; preset != of_first)
        throw InputError(
            fmt::format("{}: preset {}, but {} has {}; allowed: one for all, as with --set "
                        "precision.preset=default",
                        name(scene), preset, name(0), of_first));
}

std::vector<Wire> Scenes::chosen(const std::vector<Wire>& asked, const std::set<Wire>& used) const {
    std::vector<std::string_view> names;
    for (const Wire wire : used) names.push_back(info(wire).name);
    for (const Wire wire : asked)
        if (!used.contains(wire))
            throw InputError(fmt::format("--wires: {} carries nothing in {}; allowed: {}", info(wire).name,
                                         count() > 1 ? "these scenes" : "this scene", listed(names)));
    return asked.empty() ? std::vector<Wire>(used.begin(), used.end()) : asked;
}

std::vector<std::string> preset_alone(std::string_view preset) {
    std::vector<std::string> overrides{fmt::format("precision.preset=\"{}\"", preset)};
    for (const WireInfo& wire : kWireInfo)
        overrides.push_back(fmt::format("precision.{}=\"auto\"", wire.name));
    return overrides;
}

}  // namespace squint::search
