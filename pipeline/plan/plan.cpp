#include "pipeline/plan/plan.h"

#include "pipeline/plan/ranges.h"
#include "pipeline/stages/ray_setup-inl.h"

#include "core/error.h"
#include "core/portable_math.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;

int bits_for(double value) {  // integer bits that hold values up to and including `value`
    return value < 1 ? 0 : std::bit_width(static_cast<std::uint64_t>(std::floor(value)));
}
int wire_index(Wire w) {
    return static_cast<int>(w);
}

// -------------------------------------------------------------------------------------------- rays

Vec3 clipped_low(const Plan& plan) {
    Vec3 low = plan.volume->origin;
    if (const auto& clip = plan.scene.clip.low)
        for (int a = 0; a < 3; ++a) low[a] = std::max(low[a], (*clip)[a]);
    return low;
}
Vec3 clipped_high(const Plan& plan) {
    Vec3 high = plan.volume->world_from_voxel(
        Vec3(plan.volume->dims.x - 1.0, plan.volume->dims.y - 1.0, plan.volume->dims.z - 1.0));
    if (const auto& clip = plan.scene.clip.high)
        for (int a = 0; a < 3; ++a) high[a] = std::min(high[a], (*clip)[a]);
    return high;
}

// The longest chord a ray can have, in steps.
// ----------------------------------------------------------------------------------------- formats

PresetInputs preset_inputs(const Plan& plan) {
    const Volume& volume = *plan.volume;
    PresetInputs in;
    in.scalar_bits = volume.scalar_bits;
    in.location_bits = std::max(
        1, bits_for(static_cast<double>(std::max({volume.dims.x, volume.dims.y, volume.dims.z})) - 1));
    in.entry_bits = std::max(1, bits_for(plan.entries.size() - 1));
    in.direction_bits = std::max(1, bits_for(plan.scene.sampling.step));
    in.ray_bits = std::max(1, bits_for(most_steps(plan)));
    double deepest = 0, total = 0;
    for (const Entry& e : plan.entries.entry) {
        deepest = std::max(deepest, e.extinction);
        total += e.opaque ? std::max(e.extinction, 1 / plan.step_world) : e.extinction;
    }
    in.depth_bits = std::max(1, bits_for(deepest * plan.step_world));
    in.total_depth_bits = std::max(1, bits_for(std::max(total, deepest) * plan.step_world));
    in.step = plan.scene.sampling.step;
    return in;
}

void apply_overrides(const PrecisionSettings& precision, WireSpecs& specs) {
    for (int w = 0; w < kWires; ++w) {
        const auto& text = precision.override_[static_cast<std::size_t>(w)];
        if (!text) continue;
        const auto wire = static_cast<Wire>(w);
        if (const std::string wrong = parse_spec(*text, specs[wire]); !wrong.empty())
            throw InputError(fmt::format("precision.{}: {}", info(wire).name, wrong));
    }
}

// A range that I bits cannot hold is refused with the I it needs.
void require_integer_bits(const Plan& plan, Wire wire, int bits, const std::string& what) {
    const Format& f = plan.specs[wire].format;
    if (f.integer_bits < bits)
        throw InputError(fmt::format("precision.{}: {} has {} integer bits, but {} needs {}", info(wire).name,
                                     to_string(f), f.integer_bits, what, bits));
}
void require_signed(const Plan& plan, Wire wire) {
    if (!plan.specs[wire].format.is_signed)
        throw InputError(
            fmt::format("precision.{}: {} is unsigned, but the wire carries negative numbers: write s{}.{}",
                        info(wire).name, to_string(plan.specs[wire].format),
                        plan.specs[wire].format.integer_bits, plan.specs[wire].format.fraction_bits));
}

CompositingForm form_of(const Scene& scene) {
    const CompositingForm form = scene.compositing.form;
    return form == CompositingForm::automatic ? preset_form(resolved_precision(scene).preset) : form;
}

void check_formats(const Plan& plan) {
    const Volume& v = *plan.volume;
    const auto longest = static_cast<double>(std::max({v.dims.x, v.dims.y, v.dims.z})) - 1;
    require_integer_bits(plan, Wire::location, bits_for(longest),
                         fmt::format("a volume of {} voxels along its longest axis", longest + 1));
    if (plan.specs[Wire::location].overflow == Overflow::wrap)
        throw InputError(
            "precision.location: wrap, but a location is held inside the volume: sat is allowed");
    require_signed(plan, Wire::direction);
    require_integer_bits(plan, Wire::direction, bits_for(plan.scene.sampling.step),
                         fmt::format("a step of {} voxels", plan.scene.sampling.step));
    require_integer_bits(plan, Wire::weight, 1, "a weight of 1.0");
    require_integer_bits(plan, Wire::length, 1, "a full step of 1.0");
    for (const Wire wire : {Wire::lerp_x, Wire::lerp_y, Wire::sample})
        require_integer_bits(plan, wire, bits_for(v.largest), fmt::format("the scalar {}", v.largest));
    require_integer_bits(
        plan, Wire::classification_input, bits_for(plan.entries.coordinate(v.largest)),
        fmt::format("entry {} of the transfer function", plan.entries.coordinate(v.largest)));
    if (form_of(plan.scene) != CompositingForm::unit255_blinn &&
        form_of(plan.scene) != CompositingForm::unit255_shift)
        require_integer_bits(plan, Wire::transparency, 1, "a transparency of 1.0");
    if (plan.lit)
        for (const Wire wire : {Wire::gradient_lerp, Wire::gradient, Wire::normal, Wire::light, Wire::dot})
            require_signed(plan, wire);
}

// ------------------------------------------------------------------------------------------ stages

Rescale rescale(const Plan& plan, int from_fraction, Wire wire) {
    return Rescale(from_fraction, plan.specs[wire], wire_index(wire));
}
int fraction(const Plan& plan, Wire wire) {
    return plan.specs[wire].format.fraction_bits;
}

// A limit that no rounding follows: sums of numbers that already stand in the wire's format.
Rescale limits_of(const Plan& plan, Wire wire) {
    return Rescale(fraction(plan, wire), plan.specs[wire], wire_index(wire));
}

void plan_location(Plan& plan) {
    LocationStage& s = plan.location;
    const Volume& v = *plan.volume;
    s.location = plan.specs[Wire::location], s.direction = plan.specs[Wire::direction],
    s.length = plan.specs[Wire::length];
    if (plan.scene.sampling.position == PositionRule::accumulate) {
        // Adding V again and again in the location's format is P0 + k q(V): the same integers.
        s.direction.format.fraction_bits = s.location.format.fraction_bits;
    }
    s.location_fraction = s.location.format.fraction_bits;
    s.direction_fraction = s.direction.format.fraction_bits;
    s.length_fraction = s.length.format.fraction_bits;
    s.common_fraction = std::max(s.location_fraction, s.direction_fraction);
    s.to_location = Rescale(s.common_fraction, s.location, wire_index(Wire::location));
    s.to_weight = rescale(plan, s.location_fraction, Wire::weight);
    s.to_first = Rescale(s.location_fraction, s.location, wire_index(Wire::location));
    s.to_direction = Rescale(s.direction_fraction, s.direction, wire_index(Wire::direction));
    s.to_length = rescale(plan, s.length_fraction, Wire::length);
    // Dropping less than a last bit of V moves sample k by less than k of them, and P0 has lost its own: so
    // far can P0 + kV leave the box.
    const auto drift =
        (static_cast<std::int64_t>(most_steps(plan) + 4) << (s.common_fraction - s.direction_fraction)) +
        (std::int64_t{1} << (s.common_fraction - s.location_fraction));
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        s.limit[a] = (v.dims[axis] - 1) << s.location_fraction;
        s.last_cell[a] = std::max<std::int64_t>(v.dims[axis] - 2, 0);
        s.low[a] = -drift;
        s.high[a] = (s.limit[a] << (s.common_fraction - s.location_fraction)) + drift;
    }
}

void plan_interpolation(Plan& plan) {
    InterpolationStage& s = plan.interpolation;
    s.weight_bits = fraction(plan, Wire::weight);
    s.to_x = rescale(plan, s.weight_bits, Wire::lerp_x);
    s.to_y = rescale(plan, fraction(plan, Wire::lerp_x) + s.weight_bits, Wire::lerp_y);
    s.to_sample = rescale(plan, fraction(plan, Wire::lerp_y) + s.weight_bits, Wire::sample);
    s.sample_fraction = fraction(plan, Wire::sample);
    s.nearest = plan.scene.sampling.interpolation == InterpolationRule::nearest;
}

void plan_gradient(Plan& plan) {
    GradientStage& s = plan.gradient;
    const Volume& v = *plan.volume;
    s.rule = plan.scene.shading.gradient;
    s.weight_bits = fraction(plan, Wire::weight);
    s.sample_fraction = fraction(plan, Wire::sample);
    // Differences are twice (central), 32 times (Sobel) or once (analytic) the gradient: so many fraction
    // bits to begin with.
    const int first = s.rule == GradientRule::central ? 1 : s.rule == GradientRule::sobel ? 5 : 0;
    s.to_first = rescale(plan, first + s.weight_bits, Wire::gradient_lerp);
    s.to_second = rescale(plan, fraction(plan, Wire::gradient_lerp) + s.weight_bits, Wire::gradient_lerp);
    s.to_gradient =
        rescale(plan,
                s.rule == GradientRule::central_samples ? s.sample_fraction + 1
                                                        : fraction(plan, Wire::gradient_lerp) + s.weight_bits,
                Wire::gradient);
    s.spacing_fraction = fraction(plan, Wire::spacing);
    s.to_scaled = rescale(plan, fraction(plan, Wire::gradient) + s.spacing_fraction, Wire::gradient);
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        s.spacing_exact[a] = v.smallest_spacing() / v.spacing[axis];
        s.spacing[a] = quantise_real(s.spacing_exact[a], plan.specs[Wire::spacing]);
    }
    s.isotropic = v.spacing.x == v.spacing.y && v.spacing.y == v.spacing.z;
    s.normal_fraction = fraction(plan, Wire::normal);
    s.to_normal = Rescale(-kNormalGuard, plan.specs[Wire::normal], wire_index(Wire::normal));
    s.to_normal.divides = true;
}

void plan_input(Plan& plan) {
    InputStage& s = plan.input;
    s.scaled = plan.entries.scalars_per_entry != 1;
    s.scale_exact = 1 / plan.entries.scalars_per_entry;
    // Entries per level with 20 significant bits.
    s.scale_fraction = s.scaled ? std::clamp(20 - bits_for(s.scale_exact) +
                                                 std::max(0, bits_for(plan.entries.scalars_per_entry) - 1),
                                             0, 36)
                                : 0;
    s.scale =
        s.scaled
            ? static_cast<std::int64_t>(std::floor(s.scale_exact * std::ldexp(1.0, s.scale_fraction) + 0.5))
            : 1;
    s.to_input = rescale(plan, fraction(plan, Wire::sample) + s.scale_fraction, Wire::classification_input);
    s.highest = static_cast<std::int64_t>(plan.entries.size() - 1)
                << fraction(plan, Wire::classification_input);
    plan.to_average = rescale(plan, fraction(plan, Wire::classification_input), Wire::classification_input);
}

ClassificationInputs classification_inputs(const Plan& plan) {
    double step = plan.step_world;
    if (plan.projection_mode)
        step = plan.entries.unit_distance;  // one scalar stands for the ray: its opacity as declared
    return {
        plan.entries, plan.specs, plan.scene.classification, step, fraction(plan, Wire::classification_input),
        false};
}

void find_unseen_inputs(Plan& plan) {
    const auto seen = [](const Entry& e) { return e.is_visible(); };
    const auto& entries = plan.entries.entry;
    const auto first = std::find_if(entries.begin(), entries.end(), seen) - entries.begin();
    const auto behind = std::find_if(entries.rbegin(), entries.rend(), seen).base() - entries.begin();
    const std::int64_t beside = 1 + plan.entry_reach;
    const int input_fraction = fraction(plan, Wire::classification_input);
    const auto input_at = [&](std::int64_t entry) {
        return std::min<std::int64_t>(entry << input_fraction, std::numeric_limits<std::int32_t>::max());
    };
    plan.unseen_to = first < beside ? -1 : input_at(first - beside);
    plan.unseen_from = input_at(behind - 1 + beside);
}

void plan_classification(Plan& plan) {
    plan.method = build_method(classification_inputs(plan));
    plan.needs_back =
        !plan.projection_mode && std::visit([](const auto& m) { return m.kNeedsBack; }, plan.method);
    plan.entry_reach = std::visit([](const auto& m) { return entry_reach(m); }, plan.method);
    find_unseen_inputs(plan);
    ClassificationReport report;
    std::visit([&](const auto& m) { m.describe(report); }, plan.method);
    plan.tables = std::move(report.tables);
    plan.notes.insert(plan.notes.end(), report.notes.begin(), report.notes.end());
}

void plan_shading(Plan& plan) {
    ShadingStage& s = plan.shading;
    const ShadingSettings& settings = plan.scene.shading;
    const bool premultiplied = std::visit([](const auto& m) { return m.kPremultiplied; }, plan.method);
    s.model = settings.model, s.power = settings.power, s.two_sided = settings.two_sided;
    s.premultiplied = premultiplied;
    s.color_fraction = premultiplied ? fraction(plan, Wire::slab_color) : fraction(plan, Wire::slab_ratio);
    s.light_fraction = fraction(plan, Wire::light), s.normal_fraction = fraction(plan, Wire::normal);
    s.dot_fraction = fraction(plan, Wire::dot), s.power_fraction = fraction(plan, Wire::power);
    s.intensity_fraction = fraction(plan, Wire::intensity),
    s.material_fraction = fraction(plan, Wire::material);
    s.light_spec = plan.specs[Wire::light];
    s.lights = static_cast<int>(plan.scene.lights.size());
    s.half_per_ray = plan.camera.projection == Projection::perspective;
    const Spec material = plan.specs[Wire::material];
    for (std::size_t l = 0; l < plan.scene.lights.size(); ++l) {
        const Light& light = plan.scene.lights[l];
        const Vec3 towards = light.headlight ? -plan.camera.view : light.direction.normalized();
        const Vec3 half = (towards - plan.camera.view).normalized();
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            s.light_exact[l][a] = towards[axis], s.half_exact[l][a] = half[axis],
            s.color_exact[l][a] = light.color[axis];
            s.light[l][a] = quantise_real(towards[axis], s.light_spec);
            s.half[l][a] = quantise_real(half[axis], s.light_spec);
            s.color[l][a] = quantise_real(light.color[axis], material);
        }
        s.white = s.white && light.color == Vec3(1, 1, 1);
    }
    s.material = {settings.ka, settings.kd, settings.ks};
    s.ka = quantise_real(settings.ka, material), s.kd = quantise_real(settings.kd, material),
    s.ks = quantise_real(settings.ks, material);
    s.squarings = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(settings.exponent))) - 1;
    if (settings.power == PowerRule::squaring && settings.exponent != std::ldexp(1.0, s.squarings))
        throw InputError(
            fmt::format("shading.exponent: {} is not a power of two, which shading.power = \"squaring\" "
                        "needs; use {} or power = \"table\"",
                        settings.exponent, std::ldexp(1.0, s.squarings)));
    // (p + 1) / 2: a whole exponent needs one fraction bit; another gets what 31 bits leave, 20 more at most.
    const int slope_bits = settings.exponent == std::floor(settings.exponent)
                               ? 1
                               : std::min(21, 32 - bits_for(settings.exponent + 2));
    s.parabola_slope =
        static_cast<std::int64_t>(std::floor(std::ldexp((settings.exponent + 1) / 2, slope_bits) + 0.5));
    s.power_table_bits = std::min(10, s.power_fraction);
    if (settings.power == PowerRule::table) {
        // 1024 rows, linear between them: error p^2 / 8 / 2^20 for exponent p.
        const int rows = 1 << s.power_table_bits;
        s.power_table = Table(rows + 1, 1);
        for (int i = 0; i <= rows; ++i)
            s.power_table.set(i, 0, portable::pow(std::ldexp(i, -s.power_table_bits), settings.exponent),
                              plan.specs[Wire::power]);
    }
    s.power_table.wire = wire_index(Wire::power);
    if (plan.lit && s.power_table.rows() > 0)
        plan.tables.push_back({"power", s.power_table.rows(), s.power_table.columns(),
                               static_cast<std::int64_t>(s.power_table.bytes()), "x^p over N.H"});
    s.to_light = rescale(plan, s.light_fraction, Wire::light);
    s.to_dot = rescale(plan, s.normal_fraction + s.light_fraction, Wire::dot);
    s.to_light_view = rescale(plan, 2 * s.light_fraction, Wire::dot);
    s.to_reflected = rescale(plan, 2 * s.dot_fraction, Wire::dot);
    s.to_power_input = rescale(plan, s.dot_fraction, Wire::power);
    s.to_power = rescale(plan, 2 * s.power_fraction, Wire::power);
    s.to_power_lerp = rescale(plan, 2 * s.power_fraction - s.power_table_bits, Wire::power);
    s.to_fall = rescale(plan, s.power_fraction + slope_bits, Wire::power);
    s.to_diffuse_sum = rescale(plan, s.dot_fraction + s.material_fraction, Wire::intensity);
    s.to_specular_sum = rescale(plan, s.power_fraction + s.material_fraction, Wire::intensity);
    s.to_diffuse = s.to_specular = rescale(plan, s.material_fraction + s.intensity_fraction, Wire::intensity);
    s.to_lit = rescale(plan, s.color_fraction + s.intensity_fraction, Wire::lit_color);
}

void plan_compositing(Plan& plan) {
    CompositingStage& s = plan.compositing;
    s.form = form_of(plan.scene);
    s.premultiplied = plan.shading.premultiplied;
    s.alpha_fraction = fraction(plan, Wire::slab_alpha);
    const int unlit = s.premultiplied ? fraction(plan, Wire::slab_color) : fraction(plan, Wire::slab_ratio);
    const int incoming = plan.lit ? fraction(plan, Wire::lit_color) : unlit;
    s.contribution_fraction = fraction(plan, Wire::contribution);
    s.transparency_fraction = fraction(plan, Wire::transparency);
    s.sum_fraction = fraction(plan, Wire::color);
    const int t = s.transparency_fraction;
    const bool carries_alpha = s.premultiplied || s.form == CompositingForm::w;
    s.to_slab_color = rescale(plan, incoming + s.alpha_fraction, Wire::slab_color);
    s.color_fraction = carries_alpha ? incoming : fraction(plan, Wire::slab_color);
    s.to_contribution = rescale(plan, s.alpha_fraction + t, Wire::contribution);
    s.to_color_sum = limits_of(plan, Wire::color),
    s.to_transparency_sum = limits_of(plan, Wire::transparency);
    switch (s.form) {
        case CompositingForm::w:
            s.to_color =
                rescale(plan, incoming + (s.premultiplied ? t : s.contribution_fraction), Wire::color);
            s.to_transparency = rescale(plan, std::max(t, s.contribution_fraction), Wire::transparency);
            break;
        case CompositingForm::back_to_front:
            s.to_color = rescale(plan, s.sum_fraction + s.alpha_fraction, Wire::color);
            s.to_transparency = rescale(plan, t + s.alpha_fraction, Wire::transparency);
            break;
        default:
            s.to_color = rescale(plan, s.color_fraction + t, Wire::color);
            s.to_transparency = rescale(plan, t + s.alpha_fraction, Wire::transparency);
    }
    // Codes of the [0, 2^F - 1] representation are integers: rounded to nearest, limited to the unit.
    s.alpha_to_code = s.color_to_code = Rescale(
        s.alpha_fraction, Spec{{t, 0, false}, Rounding::rnd, Overflow::sat}, wire_index(Wire::contribution));
    if (s.is_unit255()) {
        s.color_to_code = Rescale(s.color_fraction, Spec{{t, 0, false}, Rounding::rnd, Overflow::sat},
                                  wire_index(Wire::contribution));
        s.to_color_sum = Rescale(0, Spec{{t, 0, false}, Rounding::trn, plan.specs[Wire::color].overflow},
                                 wire_index(Wire::color));
    } else if (s.form == CompositingForm::back_to_front) {
        s.color_to_code = rescale(plan, s.color_fraction, Wire::color);
    }
    s.threshold_exact = plan.scene.sampling.termination;
    s.threshold = static_cast<std::int64_t>(std::ceil(s.threshold_exact * static_cast<double>(s.unit())));
    const bool identity = s.form != CompositingForm::unit255_shift &&
                          plan.scene.compositing.mode != CompositingMode::average &&
                          plan.scene.compositing.mode != CompositingMode::minip &&
                          !(plan.float32 && s.is_unit255());  // t u / u is not always t
    plan.skips_empty_space = identity;
    if (s.form == CompositingForm::w && plan.specs[Wire::contribution].rounding == Rounding::trn &&
        !plan.real)
        plan.warnings.push_back(
            "compositing form w with truncation loses thin fog altogether: use rnd_conv on contribution, or "
            "equation_9");
}

// -------------------------------------------------------------------------------------------- plan

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
// What lanes of floats need: tables in floats, and room for float's own errors.
void prepare_floats(Plan& plan) {
    need_floats(plan.method);
    plan.shading.power_table.need_floats();
    // Lanes ask whether an entry is opaque where any of them is near one: none may be missed.
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
    plan.camera = make_camera(scene.camera, v, scene.image.width, scene.image.height, frame);
    plan.entries = sample_entries(resolve_transfer_function(scene), v);
    plan.step_world = scene.sampling.step * v.smallest_spacing();
    plan.box_low = clipped_low(plan), plan.box_high = clipped_high(plan);
    if (most_steps(plan) > 16e6)
        throw InputError(
            fmt::format("sampling.step: {} makes rays of {:.0f} samples, and 16000000 are allowed",
                        scene.sampling.step, most_steps(plan)));
    plan.projection_mode = scene.compositing.mode != CompositingMode::over;
    plan.lit = !scene.lights.empty() && scene.shading.model != ShadingModel::none && !plan.projection_mode;
    const PrecisionSettings precision = resolved_precision(scene);
    plan.float32 = precision.preset == "float32";
    plan.real = rounds_nothing(precision.preset);
    plan.wants_depth = scene.output.depth;
    preset_specs(precision.preset, preset_inputs(plan), plan.specs);
    apply_overrides(precision, plan.specs);
    check_formats(plan);
    report_stages(plan);
    plan_location(plan);
    plan_interpolation(plan);
    plan_gradient(plan);
    plan_input(plan);
    plan_classification(plan);
    plan_shading(plan);
    plan_compositing(plan);
    choose_words(plan);
    if (plan.real) set_active(plan, {});
    if (plan.float32) prepare_floats(plan);
    return plan;
}

namespace {
struct Activate {
    const std::array<bool, kWires>& rounded;
    bool floats = false;  // unrounded cells of them will do
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
    plan.gradient.active = is(Wire::spacing);
    plan.shading.active = is(Wire::material);
    plan.real = true;
}

void attach_statistics(Plan& plan, std::array<WireStatistics, kWires>& statistics) {
    visit_stages(plan, Attach{statistics});
    Attach{statistics}(plan.to_average);
}

}  // namespace squint
