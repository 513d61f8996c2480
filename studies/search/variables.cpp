#include "studies/search/variables.h"

#include "core/error.h"
#include "scene/toml.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace squint::search {

using Part = sweep::WireEdit::Part;

Variables::Variables(Scenes& scenes, const std::vector<Wire>& asked, bool integer_bits)
    : integer_bits_(integer_bits) {
    std::vector<Plan> plans;
    std::set<Wire> used;
    for (std::size_t i = 0; i < scenes.count(); ++i) {
        plans.push_back(scenes.plan(i, {}));
        const Plan& plan = plans.back();
        if (plan.real)
            throw InputError(
                fmt::format("{}: precision.preset {} has no formats; allowed: another "
                            "preset, as with --set precision.preset=default",
                            scenes.name(i), plan.real_name()));
        scenes.check_preset(i, plan, plans[0].scene.precision.preset);
        for (const Wire wire : plan.used_wires) used.insert(wire), users_[wire].push_back(i);
    }
    preset_ = plans[0].scene.precision.preset;
    for (const Wire wire : scenes.chosen(asked, used)) add(wire, scenes, plans);
}

void Variables::add(Wire wire, Scenes& scenes, const std::vector<Plan>& plans) {
    const std::vector<std::size_t>& users = users_[wire];
    Spec spec = plans[users[0]].specs[wire];
    int most = spec.format.fraction_bits;
    for (const std::size_t i : users) {
        const Spec& other = plans[i].specs[wire];
        if (other.format.is_signed != spec.format.is_signed || other.rounding != spec.rounding ||
            other.overflow != spec.overflow)
            throw InputError(fmt::format(
                "precision.{}: {} in {}, {} in {}; allowed: one sign, rounding and overflow for all",
                info(wire).name, to_string(spec), scenes.name(users[0]), to_string(other), scenes.name(i)));
        if (!wide_.contains(i)) wide_.emplace(i, scenes.plan(i, preset_alone("wide")).specs);
        spec.format.integer_bits = std::max(spec.format.integer_bits, other.format.integer_bits);
        most = std::max({most, other.format.fraction_bits, wide_.at(i)[wire].format.fraction_bits});
    }
    wires_.push_back(wire), base_.push_back(spec), most_fraction_.push_back(most);
}

bool Variables::uses(std::size_t scene, Wire wire) const {
    const std::vector<std::size_t>& users = users_.at(wire);
    return std::find(users.begin(), users.end(), scene) != users.end();
}

Spec Variables::spec(const Lengths& lengths, std::size_t w) const {
    Spec spec = base_[w];
    spec.format.fraction_bits = lengths[w];
    if (integer_bits_) spec.format.integer_bits = lengths[w + base_.size()];
    return spec;
}

std::vector<sweep::WireEdit> Variables::edits(const Lengths& lengths) const {
    std::vector<sweep::WireEdit> edits;
    for (std::size_t w = 0; w < base_.size(); ++w) {
        const Format format = spec(lengths, w).format;
        edits.push_back({wires_[w], Part::fraction_bits, format.fraction_bits, {}});
        edits.push_back({wires_[w], Part::integer_bits, format.integer_bits, {}});
    }
    return edits;
}

Lengths Variables::most(bool wide) const {
    Lengths most;
    for (std::size_t w = 0; w < base_.size(); ++w)
        most.push_back(wide ? most_fraction_[w] : base_[w].format.fraction_bits);
    if (integer_bits_)
        for (const Spec& spec : base_) most.push_back(spec.format.integer_bits);
    return most;
}

std::pair<std::string, std::string> Variables::label(int variable, const Lengths& lengths) const {
    const auto v = static_cast<std::size_t>(variable), n = base_.size();
    return {fmt::format("{} {}", info(wires_[v % n]).name, v < n ? "fraction_bits" : "integer_bits"),
            toml_text(std::int64_t{lengths[v]})};
}

}  // namespace squint::search
