#include "pipeline/plan/plan.h"

#include "pipeline/plan/demands.h"
#include "pipeline/plan/findings.h"
#include "pipeline/plan/kept_method.h"
#include "pipeline/plan/ranges.h"
#include "pipeline/plan/short_slabs.h"
#include "pipeline/stages/inputs.h"
#include "pipeline/stages/ray_setup-inl.h"

#include "core/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;

// -------------------------------------------------------------------------------------------- rays

struct Box {
    Vec3 low, high;
};
Box common(const Box& a, const Box& b) {
    Box box;
    for (int i = 0; i < 3; ++i)
        box.low[i] = std::max(a.low[i], b.low[i]), box.high[i] = std::min(a.high[i], b.high[i]);
    return box;
}
bool empty(const Box& box) {
    return !(box.low.x < box.high.x && box.low.y < box.high.y && box.low.z < box.high.z);
}
/// The least box along other axes that holds a box.
Box bounds_along(const std::array<Vec3, 3>& axes, const Box& box) {
    const Vec3 middle = (box.low + box.high) * 0.5, half = (box.high - box.low) * 0.5;
    Box bounds;
    for (int i = 0; i < 3; ++i) {
        const Vec3& axis = axes[static_cast<std::size_t>(i)];
        const double at = middle.dot(axis),
                     reach = half.dot(Vec3(std::abs(axis.x), std::abs(axis.y), std::abs(axis.z)));
        bounds.low[i] = at - reach, bounds.high[i] = at + reach;
    }
    return bounds;
}

/// The volume's box, and what the scene's clip box leaves of it: of a turned volume by a box of its own, too.
void set_boxes(Plan& plan) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    const Volume& v = *plan.volume;
    const ClipSettings& clip = plan.scene.clip;
    const Box kept{clip.low.value_or(Vec3(-kFar)), clip.high.value_or(Vec3(kFar))};
    Box box{v.box_low(), v.box_high()};
    if (!v.turned()) {
        box = common(box, kept);
    } else if (clip.low || clip.high) {
        const std::array<Vec3, 3> world{v.grid_from_world(Vec3(1, 0, 0)), v.grid_from_world(Vec3(0, 1, 0)),
                                        v.grid_from_world(Vec3(0, 0, 1))};
        plan.clip = TurnedBox{world, kept.low, kept.high};
        const Box seen = common(bounds_along(world, box), kept);
        box = empty(seen) ? Box{box.low, box.low} : common(box, bounds_along(v.turn, seen));
    }
    plan.box_low = box.low, plan.box_high = box.high;
}

// ----------------------------------------------------------------------------------------- formats

void apply_overrides(const PrecisionSettings& precision, WireSpecs& specs) {
    for (int w = 0; w < kWires; ++w) {
        const auto& text = precision.override_[static_cast<std::size_t>(w)];
        if (!text) continue;
        const auto wire = static_cast<Wire>(w);
        if (const std::string wrong = parse_spec(*text, specs[wire]); !wrong.empty())
            throw InputError(fmt::format("precision.{}: {}", info(wire).name, wrong));
    }
}

// ---------------------------------------------------------------------------------- classification

ClassificationInputs classification_inputs(const Plan& plan) {
    double step = plan.step_world;
    if (plan.projection_mode)
        step = plan.entries.unit_distance;  // one scalar stands for the ray, with its opacity as declared
    return {plan.entries,
            plan.specs,
            plan.scene.classification,
            step,
            plan.specs[Wire::classification_input].format.fraction_bits,
            false,
            plan.projection_mode ? 1 : most_steps(plan),
            plan.lit ? plan.scene.shading.inside : std::nullopt};
}

void find_unseen_inputs(Plan& plan) {
    const auto seen = [](const Entry& e) { return e.is_visible(); };
    const auto& entries = plan.entries.entry;
    const auto first = std::find_if(entries.begin(), entries.end(), seen) - entries.begin();
    const auto behind = std::find_if(entries.rbegin(), entries.rend(), seen).base() - entries.begin();
    const std::int64_t beside = 1 + plan.entry_reach;
    const int input_fraction = plan.specs[Wire::classification_input].format.fraction_bits;
    const auto input_at = [&](std::int64_t entry) {
        return std::min<std::int64_t>(entry << input_fraction, std::numeric_limits<std::int32_t>::max());
    };
    plan.unseen_to = first < beside ? -1 : input_at(first - beside);
    plan.unseen_from = input_at(behind - 1 + beside);
}

// The errors of tables along the longest ray, each and their sum.
void report_approximations(Plan& plan) {
    if (plan.projection_mode) return;
    std::string parts;
    double sum = 0;
    for (const Approximation& a : plan.approximations) {
        sum += a.lsb8;
        parts += fmt::format("{}{} {:.2g}", parts.empty() ? "" : ", ", a.of, a.lsb8);
    }
    if (sum > 0)
        plan.notes.push_back(fmt::format(
            "what tables leave out, in all along the longest ray: at most {:.2g} of 255 ({})", sum, parts));
}

void plan_classification(Plan& plan) {
    const ClassificationInputs inputs = classification_inputs(plan);
    // Plans without rounding add exact values to their tables: those are their own.
    plan.method = plan.real ? build_method(inputs) : kept_method(*plan.volume, inputs);
    plan.needs_back =
        !plan.projection_mode && std::visit([](const auto& m) { return m.kNeedsBack; }, plan.method);
    if (plan.needs_back && plan.scene.sampling.interpolation == InterpolationRule::nearest)
        throw InputError(
            fmt::format("classification.method: {} integrates between two samples, where the nearest field "
                        "jumps: values between two labels are not in the volume; with "
                        "sampling.interpolation = \"nearest\" pc and pc_mid are allowed",
                        name_of(plan.scene.classification.method)));
    plan.entry_reach = std::visit([](const auto& m) { return entry_reach(m); }, plan.method);
    find_unseen_inputs(plan);
    ClassificationReport report;
    std::visit([&](const auto& m) { m.describe(report); }, plan.method);
    plan.tables = std::move(report.tables);
    if (const ClassificationSettings& c = plan.scene.classification; c.as_printed && c.method != Method::pips)
        report.notes.push_back(fmt::format(
            "classification.as_printed is ignored: it is of pips, and the method is {}", name_of(c.method)));
    plan.notes.insert(plan.notes.end(), report.notes.begin(), report.notes.end());
    plan.approximations = std::move(report.approximations);
    if (const Approximation a = shorter_slabs(plan); a.lsb8 > 0) plan.approximations.push_back(a);
    report_approximations(plan);
}

// ------------------------------------------------------------------------------------------- light

// The rule for light inside a slab: the scene's, or the method's default.
InsideRule inside_rule(Plan& plan) {
    const std::optional<InsideRule>& asked = plan.scene.shading.inside;
    const std::string_view method = name_of(plan.scene.classification.method);
    if (!plan.lit) return InsideRule::front;
    if (!plan.needs_back) {
        if (asked)
            plan.notes.push_back(
                fmt::format("shading.inside = \"{}\" is ignored: {} has one sample a slab, which lights it",
                            name_of(*asked), method));
        return InsideRule::front;
    }
    // A rule that looks into a slab wants tables that serve its parts, or pi2d's own of where its light lies.
    const bool has_parts = std::visit([](const auto& m) { return !m.kPremultiplied; }, plan.method);
    const bool has_fades = has_parts || plan.scene.classification.method == Method::pi2d;
    const auto is_allowed = [&](InsideRule rule) {
        return rule == InsideRule::adaptive ? has_parts : !lights_fade(rule) || has_fades;
    };
    if (asked && !is_allowed(*asked)) {
        std::string allowed;
        for (std::size_t i = 0; i < std::size(EnumNames<InsideRule>::names); ++i)
            if (is_allowed(static_cast<InsideRule>(i)))
                allowed += fmt::format("{}, ", EnumNames<InsideRule>::names[i]);
        throw InputError(fmt::format(
            "{}: found \"{}\", but {} has no tables {}; allowed: {}or classification.method = {}\"pips\" or "
            "\"leg\"",
            where(plan.scene, "shading.inside"), name_of(*asked), method,
            lights_fade(*asked) ? "of where light lies in a slab" : "for parts of a slab", allowed,
            lights_fade(*asked) ? "\"pi2d\", " : ""));
    }
    return asked.value_or(InsideRule::two_point);  // decision 0051
}

// Slabs of methods that know walls; as printed, one way is enough.
bool looks_twice(const Plan& plan) {
    const ClassificationSettings& c = plan.scene.classification;
    return plan.needs_back && c.opaque_prediction == WallRule::twice && !c.as_printed &&
           plan.entries.any_opaque();
}

// ----------------------------------------------------------------------- what is left out, and why

// A transparent sample changes nothing, so empty space can be skipped.
bool transparent_is_identity(const Plan& plan) {
    const CompositingMode mode = plan.scene.compositing.mode;
    return plan.compositing.form != CompositingForm::unit255_shift && mode != CompositingMode::average &&
           mode != CompositingMode::minip &&
           !(plan.float32 && (plan.compositing.is_unit255() ||  // t u / u is not always t
                              plan.compositing.form == CompositingForm::straight));
}

void report_shading(Plan& plan) {
    const Table& power = plan.shading.power_table;
    if (plan.lit && power.rows() > 0)
        plan.tables.push_back({"power", power.rows(), power.columns(),
                               static_cast<std::int64_t>(power.bytes()), "x^p over N.H"});
}

void warn_of_lost_fog(Plan& plan) {
    if (plan.compositing.form == CompositingForm::w &&
        plan.specs[Wire::contribution].rounding == Rounding::trn && !plan.real)
        plan.warnings.push_back(
            "compositing form w with truncation loses thin fog altogether: use rnd_conv on contribution, or "
            "equation_9");
}

void report_stages(Plan& plan) {
    for (const std::string_view name : kStages) plan.stages.push_back({std::string(name), true, {}, {}});
    auto leave_out = [&](std::size_t i, std::string why) {
        plan.stages[i].modelled = false, plan.stages[i].why = std::move(why);
    };
    if (!plan.lit) {
        const std::string why = plan.scene.lights.empty() ? "the scene has no light"
                                : plan.projection_mode    ? "mip, minip and average are not lit"
                                                          : "shading.model is none";
        leave_out(2, why), leave_out(4, why);
    }
}

}  // namespace

double most_steps(const Plan& plan) {
    const Vec3 diagonal = plan.box_high - plan.box_low;
    return std::max(1.0, std::sqrt(diagonal.dot(diagonal)) / plan.step_world);
}

RaySetup Plan::set_up(int column, int row) const {
    const auto ray = HWY_NAMESPACE::set_up_ray<double>(*this, column, row);
    const auto vector = [](const std::array<double, 3>& v) { return Vec3(v[0], v[1], v[2]); };
    return {.first = vector(ray.first),
            .last = vector(ray.last),
            .step = vector(ray.step),
            .direction = vector(ray.direction),
            .slabs = static_cast<int>(ray.slabs),
            .last_index = static_cast<int>(ray.last_index),
            .last_length = ray.last_length,
            .entry_distance = ray.entry_distance};
}

namespace {
// Lanes of floats need tables in floats, and room for the errors of floats.
void prepare_floats(Plan& plan) {
    need_floats(plan.method);
    for (const Table* table : {&plan.shading.power_table, &plan.shading.kept.arc, &plan.inside.even.rows})
        table->need_floats();
    // Lanes ask whether an entry is opaque where a lane is near one: none may be missed.
    const auto lower = [](EntryLookup& e) { e.least_opaque -= e.least_opaque >> 20; };
    std::visit(
        [&](auto& m) {
            if constexpr (requires { m.entries.least_opaque; })
                lower(m.entries);
            else
                lower(m.prefix.entries);
        },
        plan.method);
}
}  // namespace

Plan make_plan(const Scene& scene, std::shared_ptr<const Volume> volume, int frame) {
    Plan plan;
    plan.scene = scene;
    plan.volume = std::move(volume);
    const Volume& v = *plan.volume;
    plan.camera =
        in_grid_space(make_camera(scene.camera, v, scene.image.width, scene.image.height, frame), v);
    plan.entries = sample_entries(resolve_transfer_function(scene, v), v);
    plan.step_world = scene.sampling.step * v.smallest_spacing();
    set_boxes(plan);
    if (most_steps(plan) > 16e6)
        throw InputError(
            fmt::format("sampling.step: {} makes rays of {:.0f} samples, and 16000000 are allowed",
                        scene.sampling.step, most_steps(plan)));
    plan.projection_mode = scene.compositing.mode != CompositingMode::over;
    plan.lit = !scene.lights.empty() && scene.shading.model != ShadingModel::none && !plan.projection_mode;
    const PrecisionSettings precision = resolved_precision(scene);
    if (precision.preset == "auto" && !has_all_formats(precision))
        throw InputError(
            "precision.preset: found \"auto\", whose formats are chosen for a command's own pictures; "
            "allowed "
            "here: another preset");
    plan.float32 = precision.preset == "float32";
    plan.real = rounds_nothing(precision.preset);
    plan.wants_depth = scene.output.depth;
    preset_specs(precision.preset, preset_inputs(plan), plan.specs);
    keep_sums_exact(scene, plan.specs);
    if (!plan.real) apply_overrides(precision, plan.specs);  // `real` has no formats to override
    report_stages(plan);
    StageInputs in{.scene = plan.scene,
                   .specs = plan.specs,
                   .volume = v,
                   .entries = plan.entries,
                   .camera = plan.camera,
                   .most_steps = most_steps(plan),
                   .lit = plan.lit};
    plan.location = build_location(in);
    plan.interpolation = build_interpolation(in);
    plan.input = build_input(in);
    plan.to_average = rescale(in, fraction(in, Wire::classification_input), Wire::classification_input);
    plan_classification(plan);
    in.premultiplied = std::visit([](const auto& m) { return m.kPremultiplied; }, plan.method);
    in.inside = inside_rule(plan);
    if (plan.lit && plan.needs_back)
        plan.stages[4].why = fmt::format("shading.inside = \"{}\"", name_of(in.inside));
    plan.inside = build_inside(in, plan.location);
    if (looks_twice(plan)) {
        plan.walls = build_walls(plan.entries, std::int64_t{v.largest} + 1);
        if (!plan.walls.between(v.smallest, v.largest)) plan.walls = {};  // no cell holds one
    }
    plan.gradient = build_gradient(in);
    if (plan.gradient.exaggerated.wanted) plan.box_gradient = build_box_gradient(in);
    plan.shading = build_shading(in);
    report_shading(plan);
    plan.compositing = build_compositing(in);
    plan.skips_empty_space = transparent_is_identity(plan);
    warn_of_lost_fog(plan);
    choose_words(plan);
    for (std::string& finding : findings_of(plan)) plan.warnings.push_back(std::move(finding));
    warn_of_formats(plan);
    if (plan.real) set_active(plan, {});
    if (plan.float32) prepare_floats(plan);
    return plan;
}

namespace {
struct Activate {
    const std::array<bool, kWires>& rounded;
    bool floats = false;  // float nodes suffice, without doubles
    void operator()(Rescale& r) const { r.active = r.wire >= 0 && rounded[static_cast<std::size_t>(r.wire)]; }
    void operator()(Table& t) const { t.active = t.wire >= 0 && rounded[static_cast<std::size_t>(t.wire)]; }
    void operator()(CellTable& t) const {
        t.active = t.wire >= 0 && rounded[static_cast<std::size_t>(t.wire)];
        if (!t.active && !floats) t.need_exact();
    }
};
struct Attach {
    std::array<WireStatistics, kWires>& statistics;
    void operator()(Rescale& r) const {
        if (r.wire >= 0) r.statistics = &statistics[static_cast<std::size_t>(r.wire)];
    }
    void operator()(Table&) const {}
    void operator()(CellTable&) const {}
};
}  // namespace

void set_active(Plan& plan, const std::array<bool, kWires>& rounded) {
    need_exact(plan.method, classification_inputs(plan));
    plan.float32 = plan.float32 && std::none_of(rounded.begin(), rounded.end(), [](bool r) { return r; });
    const Activate activate{rounded, plan.float32};
    visit_stages(plan, activate);
    activate(plan.to_average);
    const auto is = [&](Wire w) { return rounded[static_cast<std::size_t>(w)]; };
    plan.input.active = is(Wire::classification_input);
    plan.gradient.active = plan.box_gradient.active = is(Wire::spacing);
    plan.gradient.exaggerated.active = is(Wire::exaggeration);
    plan.shading.active = is(Wire::material);
    plan.inside.to_whole.active = is(plan.inside.color_wire);
    plan.real = true;
}

void attach_statistics(Plan& plan, std::array<WireStatistics, kWires>& statistics) {
    visit_stages(plan, Attach{statistics});
    Attach{statistics}(plan.to_average);
}

}  // namespace squint
