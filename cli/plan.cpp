// squint plan: what a scene exercises, and what was left out and why.
#include "cli/common.h"
#include "pipeline/machines/lanes/lane_renderer.h"
#include "pipeline/record.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <array>

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

/// Every table of the plan: as the plan reports them, or as its stages hold them.
std::vector<TableReport> tables_of(const Plan& plan) {
    if (!plan.tables.empty()) return plan.tables;
    std::vector<TableReport> tables;
    Plan visited = plan;
    visit_stages(visited, FindTables{tables});
    return tables;
}

struct FindWires {
    std::array<bool, kWires>& used;
    void operator()(const Rescale& rescale) const {
        if (rescale.wire >= 0) used[static_cast<std::size_t>(rescale.wire)] = true;
    }
    void operator()(const auto& table) const {
        if (table.wire >= 0 && table.rows() > 0) used[static_cast<std::size_t>(table.wire)] = true;
    }
};

/// The wires of stages that are modelled, less those that another method would need.
std::array<bool, kWires> wires_used(const Plan& plan) {
    std::array<bool, kWires> used{};
    Plan visited = plan;
    visit_stages(visited, FindWires{used});
    // Rounded once in the set-up, by no Rescale.
    used[static_cast<std::size_t>(Wire::spacing)] = !plan.gradient.isotropic;
    used[static_cast<std::size_t>(Wire::material)] = true;
    for (std::size_t w = 0; w < used.size(); ++w)
        for (const StageReport& stage : plan.stages)
            if (stage.name == kWireInfo[w].stage && !stage.modelled) used[w] = false;
    return used;
}

int word_of(int bits) {
    for (const int word : {16, 32, 64})
        if (bits <= word) return word;
    return 128;
}

const StageReport& stage_of(const Plan& plan, std::string_view name) {
    for (const StageReport& stage : plan.stages)
        if (stage.name == name) return stage;
    return plan.stages.front();
}

std::string in_words(const Plan& plan) {
    return plan.float32 ? "in float32" : "in double";
}

/// How it will be rendered, and why: as `squint render` reports it.
struct PathOf {
    std::string path, why;
};
PathOf path_of(const Plan& plan) {
    if (const auto obstacle = lanes::what_needs_the_model(plan)) return {"model", *obstacle};
    return {"lanes", lanes::words_in_lanes(plan)};
}

std::string stages_text(const Plan& plan) {
    Rows rows{{"stage", "", "widest operand", "widest result", "word", ""}};
    for (const StageReport& s : plan.stages) {
        if (s.modelled && plan.real)
            rows.push_back({s.name, in_words(plan), "-", "-", "-", s.why});
        else if (s.modelled)
            rows.push_back({s.name, "modelled", std::to_string(s.needs.operand_bits),
                            std::to_string(s.needs.result_bits), std::to_string(word_of(s.needs.result_bits)),
                            s.why});
        else
            rows.push_back({s.name, "left out", "-", "-", "-", s.why});
    }
    return table_text(rows, "  ");
}

std::string wires_text(const Plan& plan) {
    Rows rows{{"wire", "format", "rounding", "overflow", "width", "word", "meaning"}};
    std::string_view stage;
    const auto used = wires_used(plan);
    for (int w = 0; w < kWires; ++w) {
        const WireInfo& wire = kWireInfo[static_cast<std::size_t>(w)];
        const StageReport& report = stage_of(plan, wire.stage);
        if (!used[static_cast<std::size_t>(w)]) continue;
        if (wire.stage != stage) stage = wire.stage, rows.push_back({fmt::format("[{}]", stage)});
        const Spec& spec = plan.specs.spec[static_cast<std::size_t>(w)];
        rows.push_back({std::string(wire.name), to_string(spec.format), to_string(spec.rounding),
                        to_string(spec.overflow), std::to_string(spec.format.width()),
                        std::to_string(word_of(report.needs.result_bits)), std::string(wire.meaning)});
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

/// A line a stage: what it is made of.
std::string brief_text(const Plan& plan) {
    std::string text;
    const auto used = wires_used(plan);
    for (const StageReport& stage : plan.stages) {
        std::string wires;
        for (std::size_t w = 0; w < kWireInfo.size(); ++w)
            if (kWireInfo[w].stage == stage.name && used[w])
                wires += fmt::format("{}{} {}", wires.empty() ? "" : ", ", kWireInfo[w].name,
                                     to_string(plan.specs.spec[w].format));
        text += fmt::format("  {:<16} {}\n", stage.name,
                            !stage.modelled ? "left out: " + stage.why
                            : plan.real     ? in_words(plan)
                                            : wires);
    }
    return text;
}

Json json_of_plan(const Plan& plan) {
    Json stages = Json::array(), tables = Json::array();
    for (const StageReport& s : plan.stages) {
        stages.push_back({{"name", s.name}, {"modelled", s.modelled}, {"why", s.why}});
        if (s.modelled && !plan.real)
            stages.back().update({{"operand_bits", s.needs.operand_bits},
                                  {"result_bits", s.needs.result_bits},
                                  {"word_bits", word_of(s.needs.result_bits)}});
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
            {"wires", json_of_wires(plan)},
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
