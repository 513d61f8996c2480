#include "pipeline/plan_record.h"

#include "pipeline/machines/lanes/lane_renderer.h"
#include "pipeline/machines/model.h"
#include "pipeline/plan/ranges.h"
#include "pipeline/record.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
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

Json json_of_refined(const Plan& plan) {
    const std::optional<RefinedRays> found = refined_rays(plan);
    if (!found) return nullptr;
    Json json = json_of(found->refined);
    json["rays"] = found->rays, json["slabs"] = found->slabs;
    return json;
}

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

std::optional<RefinedRays> refined_rays(const Plan& plan) {
    if (!plan.walls.looks_twice && !(plan.lit && plan.inside.rule == InsideRule::adaptive)) return {};
    constexpr double kMostSlabs = 1 << 18;
    const int side = std::clamp(static_cast<int>(std::sqrt(kMostSlabs / most_steps(plan))), 1, 16);
    const ModelRenderer model(plan);
    Image image;
    image.width = plan.camera.width, image.height = plan.camera.height;
    for (const char* name : {"R", "G", "B", "A"}) image.add_float(name);
    TileStatistics statistics;
    const int wide = std::min(side, image.width), high = std::min(side, image.height);
    for (int i = 0; i < wide; ++i)
        for (int j = 0; j < high; ++j) {
            const int x = (2 * i + 1) * image.width / (2 * wide), y = (2 * j + 1) * image.height / (2 * high);
            model.render_tile(x, y, x + 1, y + 1, image, statistics);
        }
    return RefinedRays{statistics.rays, statistics.samples, statistics.refined};
}

std::string text_of(const RefinedSlabs& refined, std::int64_t slabs) {
    std::string text;
    const auto add = [&](std::int64_t count, const char* what) {
        if (count == 0) return;
        text += fmt::format("{}{:.2g} % {}", text.empty() ? "" : ", ",
                            100 * static_cast<double>(count) / static_cast<double>(slabs), what);
    };
    add(refined.looked_twice, "looked at twice"), add(refined.in_two, "lit in two pieces"),
        add(refined.in_four, "in four");
    return text;
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
            {"refined", json_of_refined(plan)},
            {"notes", plan.notes},
            {"warnings", plan.warnings}};
}

}  // namespace squint
