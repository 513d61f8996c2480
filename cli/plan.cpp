// squint plan: what a scene exercises, what is left out, and why.
#include "cli/common.h"
#include "cli/verb.h"
#include "pipeline/machines/scene_bound.h"
#include "pipeline/plan_record.h"
#include "pipeline/record.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <optional>

namespace squint::cli {
namespace {

struct PlanArguments {
    SceneArguments scene;
    bool json = false, brief = false, bound = false;
};

using Rows = std::vector<std::vector<std::string>>;

std::string in_words(const Plan& plan) {
    return plan.float32 ? "in float32" : "in double";
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

std::string bound_text(const SceneBound& b) {
    std::string text = fmt::format(
        "bound, proven: no pixel of any view, in any projection or size, is more than {:.4g} LSB8 from the "
        "picture without rounding\n"
        "  by entries {:.4g}, by blocks {:.4g}, by beams {:.4g} ({} beams; rays of {} samples at most)\n",
        b.most, b.by_entries, b.by_blocks, b.by_beams, b.beams, b.samples);
    if (!b.hopeless.empty()) text += "  hopeless: " + b.hopeless + "\n";
    text += fmt::format("  who pays, on the beam that decides: {} most\n", payer_name(b.payer));
    for (int p = 0; p < Shares::kMost; ++p)
        if (b.shares[p] >= b.most / 1000)
            text += fmt::format("    {:<20} {:>8.3g}\n", payer_name(p), b.shares[p]);
    text += fmt::format("  where: cells {} {} {} to {} {} {} pay {:.3g} of it, at entry {:.4g}\n",
                        b.block_first[0], b.block_first[1], b.block_first[2], b.block_last[0],
                        b.block_last[1], b.block_last[2], b.block_share, b.entry);
    return text;
}

int run(const PlanArguments& a) {
    const Plan plan = plan_of(a.scene);
    std::optional<SceneBound> bound;
    if (a.bound) {
        const Interruptible here;
        ProgressBar proof(true, "proof");
        bound = bound_scene(plan, {.cancelled = &interrupted, .progress = [&](double part) { proof(part); }});
    }
    if (a.json) {
        nlohmann::ordered_json record = json_of_plan(plan);
        if (bound) record["bound"] = json_of(*bound);
        return print_json(record), kDone;
    }
    if (bound) return print(bound_text(*bound)), kDone;
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
    if (const std::optional<RefinedRays> found = refined_rays(plan)) {
        const std::string refined = text_of(found->refined, found->slabs);
        text += fmt::format("slabs refined: {} of {}, on {} rays that were cast\n",
                            refined.empty() ? "none" : refined, text_of_count(found->slabs),
                            text_of_count(found->rays));
    }
    for (const std::string& note : plan.notes) text += "note: " + note + "\n";
    for (const std::string& warning : plan.warnings) text += "warning: " + warning + "\n";
    print(text);
    return kDone;
}

void flags(Flags& f, PlanArguments& a) {
    add_scene(f, a.scene);
    f.add("--brief", a.brief, "A line a stage: its wires and their formats");
    f.add("--bound", a.bound, "Prove how far any pixel of any view can be from the picture without rounding");
    add_json_flag(f, a.json);
}

}  // namespace

namespace verbs {
extern const Verb plan{
    .name = "plan",
    .heading = "What happens inside",
    .help = "Say what a scene exercises: stages, wires, formats, words, tables, and what is left out and why",
    .footer = "Example:\n  squint plan head.toml --set precision.preset=squeeze",
    .describe = described<PlanArguments, flags, run>,
};
}

}  // namespace squint::cli
