// squint plan: what a scene exercises, what is left out, and why.
#include "cli/common.h"
#include "pipeline/machines/lanes/lane_renderer.h"
#include "pipeline/record.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <array>
#include <optional>

namespace squint::cli {
namespace {

using Json = nlohmann::ordered_json;
using Rows = std::vector<std::vector<std::string>>;

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

/// Every table of the plan, as the plan reports them, or else as its stages hold them.
std::vector<TableReport> tables_of(const Plan& plan) {
    if (!plan.tables.empty()) return plan.tables;
    std::vector<TableReport> tables;
    Plan visited = plan;
    visit_stages(visited, FindTables{tables});
    return tables;
}

/// The bits of the lanes that run a stage; none where the model runs it.
std::optional<int> lane_bits(const Plan& plan, std::size_t stage) {
    if (lanes::what_needs_the_model(plan) || (plan.projection_mode && stage >= 2)) return {};
    const lanes::StageWays ways = lanes::ways_of(plan);
    return std::array{ways.location,       ways.interpolation, ways.gradient,
                      ways.classification, ways.shading,       ways.compositing}[stage]
        .bits;
}

std::string in_words(const Plan& plan) {
    return plan.float32 ? "in float32" : "in double";
}

/// How the scene will be rendered, and why: as `squint render` reports it.
struct PathOf {
    std::string path, why;
};
PathOf path_of(const Plan& plan) {
    if (const auto obstacle = lanes::what_needs_the_model(plan)) return {"model", *obstacle};
    return {"lanes", lanes::words_in_lanes(plan)};
}

std::string stages_text(const Plan& plan) {
    Rows rows{{"stage", "", "widest operand", "widest result", "model's word", "lanes", ""}};
    for (std::size_t i = 0; i < plan.stages.size(); ++i) {
        const StageReport& s = plan.stages[i];
        if (s.modelled && plan.real) {
            rows.push_back({s.name, in_words(plan), "-", "-", "-", "-", s.why});
        } else if (s.modelled) {
            const std::optional<int> bits = lane_bits(plan, i);
            rows.push_back({s.name, "modelled", std::to_string(s.needs.operand_bits),
                            std::to_string(s.needs.result_bits), std::to_string(plan.word_bits),
                            bits ? std::to_string(*bits) : "none", s.why});
        } else {
            rows.push_back({s.name, "left out", "-", "-", "-", "-", s.why});
        }
    }
    return table_text(rows, "  ");
}

std::string wires_text(const Plan& plan) {
    Rows rows{{"wire", "format", "rounding", "overflow", "width", "meaning"}};
    std::string_view stage;
    for (const Wire w : plan.used_wires) {
        const WireInfo& wire = info(w);
        if (wire.stage != stage) stage = wire.stage, rows.push_back({fmt::format("[{}]", stage)});
        const Spec& spec = plan.specs[w];
        rows.push_back({std::string(wire.name), to_string(spec.format), to_string(spec.rounding),
                        to_string(spec.overflow), std::to_string(spec.format.width()),
                        std::string(wire.meaning)});
    }
    return table_text(rows, "  ");
}

std::string tables_text(const Plan& plan) {
    Rows rows{{"table", "rows", "columns", "bytes", ""}};
    for (const TableReport& t : tables_of(plan))
        rows.push_back(
            {t.name, std::to_string(t.rows), std::to_string(t.columns), std::to_string(t.bytes), t.note});
    return table_text(rows, "  ");
}

/// A line for each stage: what it consists of.
std::string brief_text(const Plan& plan) {
    std::string text;
    for (const StageReport& stage : plan.stages) {
        std::string wires;
        for (const Wire w : plan.used_wires)
            if (info(w).stage == stage.name)
                wires += fmt::format("{}{} {}", wires.empty() ? "" : ", ", info(w).name,
                                     to_string(plan.specs[w].format));
        text += fmt::format("  {:<16} {}\n", stage.name,
                            !stage.modelled ? "left out: " + stage.why
                            : plan.real     ? in_words(plan)
                                            : wires);
    }
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
            {"notes", plan.notes},
            {"warnings", plan.warnings}};
}

}  // namespace

int run(const PlanArguments& a) {
    const Plan plan = plan_of(a.scene);
    if (a.json) return print_json(json_of_plan(plan)), kDone;
    const Volume& v = *plan.volume;
    const Memory memory = memory_of(plan, {});
    std::string text =
        fmt::format("{}: {}x{} pixels, {} in {} ({}x{}x{}, {} bits), precision {}\n",
                    plan.scene.name.empty() ? "built-in scene" : plan.scene.name, plan.camera.width,
                    plan.camera.height, name_of(plan.scene.classification.method), v.name, v.dims.x, v.dims.y,
                    v.dims.z, v.scalar_bits, plan.scene.precision.preset);
    if (a.brief) return print(text + brief_text(plan)), kDone;
    text += "\nstages (bits with sign)\n" + stages_text(plan);
    text += plan.float32 ? "\nevery wire is a float32: nothing else is rounded\n"
            : plan.real  ? "\nevery wire is a double: nothing is rounded\n"
                         : "\nwires\n" + wires_text(plan);
    text += "\ntables\n" + tables_text(plan);
    text += fmt::format("\nmemory: volume {}{}, tables {}, picture {}\n",
                        text_of_bytes(memory.volume + memory.mapped),
                        memory.mapped > 0 ? " (mapped from its file)" : "", text_of_bytes(memory.tables),
                        text_of_bytes(memory.image));
    text += plan.float32 ? "model: float32\n"
            : plan.real  ? "model: double\n"
                         : fmt::format("model: {}-bit integers\n", plan.word_bits);
    const PathOf way = path_of(plan);
    text += fmt::format("path: {}: {}\n", way.path, way.why);
    text += plan.skips_empty_space
                ? "empty space: skipped where it can be\n"
                : "empty space: visited, since a transparent sample is not the identity here\n";
    for (const std::string& note : plan.notes) text += "note: " + note + "\n";
    for (const std::string& warning : plan.warnings) text += "warning: " + warning + "\n";
    print(text);
    return kDone;
}

}  // namespace squint::cli
