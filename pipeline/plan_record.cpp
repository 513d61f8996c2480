#include "pipeline/plan_record.h"

#include "pipeline/machines/lanes/lane_renderer.h"
#include "pipeline/record.h"

#include <nlohmann/json.hpp>

#include <array>
#include <string_view>

namespace squint {
namespace {

using Json = nlohmann::ordered_json;

struct FindTables {
    std::vector<TableReport>& tables;
    void operator()(const Rescale&) const {}
    void operator()(const auto& table) const {
        if (table.rows() == 0) return;
        const std::string_view name =
            table.wire < 0 ? "table" : kWireInfo[static_cast<std::size_t>(table.wire)].name;
        tables.push_back(
            {std::string(name), table.rows(), table.columns(), static_cast<std::int64_t>(table.bytes()), {}});
    }
};

}  // namespace

std::vector<TableReport> tables_of(const Plan& plan) {
    if (!plan.tables.empty()) return plan.tables;
    std::vector<TableReport> tables;
    Plan visited = plan;
    visit_stages(visited, FindTables{tables});
    return tables;
}

std::optional<int> lane_bits(const Plan& plan, std::size_t stage) {
    if (lanes::what_needs_the_model(plan) || (plan.projection_mode && stage >= 2)) return {};
    const lanes::StageWays ways = lanes::ways_of(plan);
    return std::array{ways.location,       ways.interpolation, ways.gradient,
                      ways.classification, ways.shading,       ways.compositing}[stage]
        .bits;
}

PathOf path_of(const Plan& plan) {
    if (const auto obstacle = lanes::what_needs_the_model(plan)) return {"model", *obstacle};
    return {"lanes", lanes::words_in_lanes(plan)};
}

Json json_of_plan(const Plan& plan) {
    Json stages = Json::array(), tables = Json::array(), wires = Json::object();
    const Json all_wires = json_of_wires(plan);
    for (const Wire wire : plan.used_wires)
        wires[std::string(info(wire).name)] = all_wires[std::string(info(wire).name)];
    for (std::size_t i = 0; i < plan.stages.size(); ++i) {
        const StageReport& s = plan.stages[i];
        stages.push_back({{"name", s.name}, {"modelled", s.modelled}, {"why", s.why}});
        if (!s.modelled || plan.real) continue;
        const std::optional<int> bits = lane_bits(plan, i);
        stages.back().update({{"operand_bits", s.needs.operand_bits},
                              {"result_bits", s.needs.result_bits},
                              {"model_word_bits", plan.word_bits},
                              {"lane_bits", bits ? Json(*bits) : Json(nullptr)}});
    }
    for (const TableReport& t : tables_of(plan))
        tables.push_back({{"name", t.name},
                          {"rows", t.rows},
                          {"columns", t.columns},
                          {"bytes", t.bytes},
                          {"note", t.note}});
    return {{"schema", "squint.plan/2"},
            {"version", version()},
            {"scene", json_of_scene(plan.scene)},
            {"volume", json_of(*plan.volume)},
            {"real", plan.real},
            {"path", path_of(plan).path},
            {"why", path_of(plan).why},
            {"model_word_bits", plan.real ? Json(nullptr) : Json(plan.word_bits)},
            {"skips_empty_space", plan.skips_empty_space},
            {"stages", stages},
            {"wires", wires},
            {"tables", tables},
            {"memory", json_of(memory_of(plan, {}))},
            {"notes", plan.notes},
            {"warnings", plan.warnings}};
}

}  // namespace squint
