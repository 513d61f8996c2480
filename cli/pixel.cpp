// squint pixel: every wire of one ray, sample by sample.
#include "cli/common.h"
#include "cli/verb.h"
#include "core/error.h"
#include "pipeline/machines/model.h"
#include "pipeline/record.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>

namespace squint::cli {
namespace {

struct PixelArguments {
    std::vector<std::string> words;  // [SCENE.toml] X Y as given; split below
    SceneArguments scene;
    int column = 0, row = 0;
    std::pair<int, int> samples{0, -1};  // first and last; last -1: all samples
    bool json = false;
};

using Json = nlohmann::ordered_json;

bool wanted(const PixelArguments& a, std::int64_t slab) {
    return slab < 0 || (slab >= a.samples.first && (a.samples.second < 0 || slab <= a.samples.second));
}
const Format& format_of(const Plan& plan, int wire) {
    return plan.specs.spec[static_cast<std::size_t>(wire)].format;
}

/// What arrived on a wire: its word, or without rounding its value.
double value_of(const Plan& plan, const TraceEvent& event) {
    const Format& format = format_of(plan, event.wire);
    return plan.real ? event.exact / static_cast<double>(format.one()) : to_real(event.raw, format);
}

std::string heading(const Plan& plan, const PixelArguments& a, const RayTrace& trace) {
    const RaySetup& s = trace.setup;
    std::string text = fmt::format("pixel {} {}: {} slabs", a.column, a.row, s.slabs);
    if (s.slabs == 0) return text + ", the ray misses the volume\n";
    text += fmt::format(", the last {:.6g} of a step long; a step is {:g} world units\n", s.last_length,
                        plan.step_world);
    text += fmt::format("first sample at voxel {:.6f} {:.6f} {:.6f}, V = {:.6f} {:.6f} {:.6f}\n", s.first.x,
                        s.first.y, s.first.z, s.step.x, s.step.y, s.step.z);
    if (plan.real)
        text += fmt::format("precision is {}: nothing is rounded; the formats are those of wide\n",
                            plan.real_name());
    return text + "\n";
}

std::string events_text(const Plan& plan, const PixelArguments& a, const RayTrace& trace) {
    std::vector<std::vector<std::string>> rows{{"slab", "wire", "format", "value", "raw", "exact", "error"}};
    std::int64_t last = -2;
    for (const RayTrace::Event& e : trace.events) {
        if (!wanted(a, e.slab)) continue;
        const auto w = static_cast<std::size_t>(e.event.wire);
        const Format& format = format_of(plan, e.event.wire);
        // The exact value in the units of the value; the error in units of the wire's last bit.
        rows.push_back(
            {e.slab == last ? ""
             : e.slab < 0   ? "set-up"
                            : std::to_string(e.slab),
             std::string(kWireInfo[w].name), to_string(format),
             fmt::format("{:.9g}", value_of(plan, e.event)), plan.real ? "-" : std::to_string(e.event.raw),
             fmt::format("{:.9g}", e.event.exact / static_cast<double>(format.one())),
             plan.real ? "-" : fmt::format("{:+.3f}", static_cast<double>(e.event.raw) - e.event.exact)});
        last = e.slab;
    }
    return rows.size() == 1 ? "" : table_text(rows) + "error: value less exact, in units of the last bit\n";
}

Json json_of_trace(const Plan& plan, const PixelArguments& a, const RayTrace& trace) {
    const RaySetup& s = trace.setup;
    Json events = Json::array();
    for (const RayTrace::Event& e : trace.events)
        if (wanted(a, e.slab)) {
            const Format& format = format_of(plan, e.event.wire);
            events.push_back({{"slab", e.slab},
                              {"wire", kWireInfo[static_cast<std::size_t>(e.event.wire)].name},
                              {"format", to_string(format)},
                              {"value", value_of(plan, e.event)},
                              {"exact", e.event.exact / static_cast<double>(format.one())}});
            if (!plan.real) events.back()["raw"] = e.event.raw;
        }
    return {{"schema", "squint.pixel/1"},
            {"version", version()},
            {"column", a.column},
            {"row", a.row},
            {"real", plan.real},
            {"slabs", s.slabs},
            {"last_length", s.last_length},
            {"first_voxel", {s.first.x, s.first.y, s.first.z}},
            {"step_voxels", {s.step.x, s.step.y, s.step.z}},
            {"color", {trace.color[0], trace.color[1], trace.color[2], trace.color[3]}},
            {"events", events}};
}

int run(const PixelArguments& a) {
    const Plan plan = plan_of(a.scene);
    if (a.column < 0 || a.column >= plan.camera.width || a.row < 0 || a.row >= plan.camera.height)
        throw InputError(fmt::format("pixel: {} {} is outside the picture; allowed: 0 to {} and 0 to {}",
                                     a.column, a.row, plan.camera.width - 1, plan.camera.height - 1));
    const RayTrace trace = trace_ray(plan, a.column, a.row);
    if (a.json) return print_json(json_of_trace(plan, a, trace)), kDone;
    const auto& c = trace.color;
    print(heading(plan, a, trace) + events_text(plan, a, trace) +
          fmt::format("\nR {:.9g}  G {:.9g}  B {:.9g}  A {:.9g}\n", c[0], c[1], c[2], c[3]));
    return kDone;
}

void flags(Flags& f, PixelArguments& a) {
    f.add("scene_x_y", a.words, "Scene file (built-in when left out), column from the left, row from the top")
        .value("[SCENE.toml] X Y")
        .required();
    add_set(f, a.scene.overrides, "Set any key of the scene; may be repeated, the last wins");
    add_size(f, a.scene.overrides);
    f.read(
         "--samples",
         [&](const std::string& text) {
             constexpr const char* kAllowed = "FIRST:LAST, as in 10:12";
             a.samples = pair_of(text, ':', "--samples", kAllowed);
             if (a.samples.first < 0 || a.samples.second < a.samples.first)
                 throw InputError(fmt::format("--samples: found \"{}\"; allowed: {}", text, kAllowed));
         },
         "Only these samples, counted from 0, both ends included")
        .value("A:B");
    add_json_flag(f, a.json);
    f.then([&a] {
        const std::vector<std::string>& words = a.words;
        if (words.size() < 2 || words.size() > 3)
            throw InputError(fmt::format(
                "pixel: {} words given; allowed: [SCENE.toml] X Y, as in squint pixel head.toml 256 100",
                words.size()));
        if (words.size() == 3) a.scene.file = words[0];
        a.column = integer_of(words[words.size() - 2], "pixel: X", "a column, 0 at the left");
        a.row = integer_of(words[words.size() - 1], "pixel: Y", "a row, 0 at the top");
    });
}

}  // namespace

namespace verbs {
extern const Verb pixel{
    .name = "pixel",
    .heading = "What happens inside",
    .help = "Show every wire of one pixel's ray, sample by sample",
    .footer = "Example:\n  squint pixel head.toml 256 100 --samples 10:12",
    .describe = described<PixelArguments, flags, run>,
};
}

}  // namespace squint::cli
