// One picture, whatever draws it: random small scenes give the same bits from the golden model and from the
// fast path, for every SIMD target of this machine, thread count, tile size, layout, with and without
// skipping empty space.
//
// SQUINT_SCENES sets how many scenes are drawn, SQUINT_SEED the first one's seed: a failure prints both.
#include "core/error.h"
#include "core/hash.h"
#include "core/procedural.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "tests/pipeline/machines/draw.h"
#include "tests/truth/reference_cases.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <hwy/detect_targets.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>

namespace squint {
namespace {

std::shared_ptr<const Volume> draw_volume(Draw& draw, Scene& scene) {
    const ProceduralField& field = draw_field(draw, 2);
    Index3 dims{draw.between(8, 33), draw.between(8, 33), draw.between(8, 33)};  // braces: in that order
    if (draw.once_in(16)) dims[static_cast<int>(draw.between(0, 2))] = 1;
    const int bits = draw.one_of({8, 8, 12, 12, 16, 5});
    const Vec3 spacing = draw.once_in(3) ? Vec3(1, 1, 1) : draw.vector(0.3, 2.5);
    scene.volume.procedural = field.name;  // for the message: `noise` is the tests' own
    scene.volume.dims = {dims.x, dims.y, dims.z};
    scene.volume.bits = bits;
    scene.volume.spacing = {spacing.x, spacing.y, spacing.z};
    return std::make_shared<Volume>(make_procedural(field, dims, bits, spacing));
}

/// Every sixth volume is turned, by a quaternion: from a draw of its own, so that all else of a scene stays.
std::shared_ptr<const Volume> turned_by_chance(Draw draw, const std::shared_ptr<const Volume>& volume) {
    if (!draw.once_in(6)) return volume;
    double w = draw.real(-1, 1);
    Vec3 v = draw.vector(-1, 1);
    const double length = std::sqrt(w * w + v.dot(v));
    w /= length, v /= length;
    Volume turned = *volume;
    for (int a = 0; a < 3; ++a) {
        const Vec3 axis(a == 0, a == 1, a == 2);
        turned.turn[static_cast<std::size_t>(a)] = axis + v.cross(v.cross(axis) + axis * w) * 2.0;
    }
    return std::make_shared<const Volume>(turned);
}

void draw_transfer_function(Draw& draw, const Volume& volume, Scene& scene) {
    TransferFunctionSettings& function = scene.transfer_function;
    function = {};
    function.unit_distance = draw.real(0.3, 4);
    function.entries = draw.one_of({0, 0, 0, 2, 3, 17, 256, 1000});
    std::vector<double> values;
    for (std::int64_t i = draw.between(1, 7); i >= 0; --i) {
        values.push_back(std::floor(draw.real(0, volume.largest_representable() + 1.0)));
        if (draw.once_in(4)) values.push_back(values.back());  // a step
    }
    std::sort(values.begin(), values.end());
    const bool clear_start = draw.once_in(2);
    for (std::size_t i = 0; i < values.size(); ++i) {
        double alpha = draw.one_of({0.0, 0.0, 1.0, draw.real(0, 1), draw.real(0, 1), draw.real(0, 0.02)});
        if (i < 2 && clear_start) alpha = 0;
        function.points.push_back(
            {values[i], draw.real(0, 1), draw.one_of({0.0, 1.0, draw.real(0, 1)}), draw.real(0, 1), alpha});
    }
}

void draw_camera(Draw& draw, const Volume& volume, Scene& scene) {
    CameraSettings& camera = scene.camera;
    camera = {};
    const Vec3 high = volume.world_from_voxel(Vec3(volume.dims - Index3(1)));
    camera.projection = draw.any_of<Projection>();
    camera.azimuth = draw.one_of({0.0, 90.0, 45.0, draw.real(0, 360)});
    camera.elevation = draw.one_of({0.0, 90.0, -90.0, draw.real(-90, 90)});
    camera.fov_y = draw.real(5, 120);
    if (draw.once_in(3)) {  // inside the volume, or beside it
        camera.eye = draw.vector(-0.2, 1.2) * high;
        camera.center = draw.vector(0, 1) * high;
    }
    if (draw.once_in(4)) camera.height = draw.real(0.1, 1.5) * std::max({high.x, high.y, high.z});
    if (draw.once_in(5)) scene.clip.low = draw.vector(-0.1, 0.5) * high;
    if (draw.once_in(5)) scene.clip.high = draw.vector(0.5, 1.1) * high;
}

void draw_light(Draw& draw, Scene& scene) {
    scene.lights.clear();
    for (std::int64_t l = draw.between(-1, 3); l > 0; --l) {
        Light light;
        light.headlight = draw.once_in(3);
        light.direction = draw.one_of({draw.vector(-1, 1), Vec3(0, 0, 1), Vec3(-1, 0, 0)});
        if (draw.once_in(4)) light.color = draw.vector(0, 1);
        scene.lights.push_back(light);
    }
    ShadingSettings& shading = scene.shading;
    shading.model = draw.one_of({ShadingModel::phong, ShadingModel::blinn_phong, ShadingModel::blinn_phong,
                                 ShadingModel::cone, ShadingModel::gooch});
    shading.cone_slope = draw.any_of<ConeSlope>(), shading.cool_side = draw.any_of<CoolSide>();
    shading.cool = draw.vector(0, 1), shading.warm = draw.vector(0, 1);
    shading.gradient =
        draw.one_of({GradientRule::central, GradientRule::sobel, GradientRule::analytic,
                     GradientRule::central, GradientRule::central_samples, GradientRule::cubic_spline});
    if (draw.once_in(12)) shading.exaggeration = draw.one_of({1.0, draw.real(0, 7)});
    shading.ka = draw.real(0, 1), shading.kd = draw.real(0, 1), shading.ks = draw.real(0, 1);
    shading.power = draw.any_of<PowerRule>();
    shading.exponent = shading.power == PowerRule::squaring
                           ? std::ldexp(1.0, static_cast<int>(draw.between(0, 7)))
                           : draw.real(1, 200);
    shading.two_sided = draw.once_in(3);
    if (draw.once_in(4)) shading.gradient_floor = draw.one_of({draw.real(0, 4), draw.real(0, 400), 1.0});
}

/// Any format, rounding and overflow rule for a wire, not far from the one it has: the plan refuses some.
std::string any_spec(Draw& draw, Spec spec) {
    Format& f = spec.format;
    f.fraction_bits = static_cast<int>(draw.between(0, std::min(kMostFractionBits, f.fraction_bits + 6)));
    if (draw.once_in(3))
        f.integer_bits =
            static_cast<int>(std::clamp<std::int64_t>(f.integer_bits + draw.between(-1, 4), 0, 24));
    if (draw.once_in(8)) f.is_signed = !f.is_signed;
    if (f.integer_bits + f.fraction_bits < 1) f.fraction_bits = 1;
    spec.rounding = draw.one_of({Rounding::trn, Rounding::trn_zero, Rounding::rnd, Rounding::rnd_conv});
    spec.overflow = draw.once_in(4) ? Overflow::wrap : Overflow::sat;
    return to_string(spec);
}

struct Case {
    Scene scene;
    Plan plan;
};

/// A preset that can hold the scene: `squeeze` takes 12-bit data and steps below two voxels only.
Plan plan_for(const std::shared_ptr<const Volume>& volume, Scene& scene) {
    try {
        return make_plan(scene, volume);
    } catch (const InputError&) {
        scene.precision.preset = "default";
        return make_plan(scene, volume);
    }
}

Plan draw_precision(Draw& draw, const std::shared_ptr<const Volume>& volume, Scene& scene) {
    scene.precision.preset = draw.one_of<const char*>({"default", "default", "squeeze", "eight_bit", "wide"});
    Plan plan = plan_for(volume, scene);
    if (draw.once_in(3)) return plan;
    for (int attempt = 0, wires = static_cast<int>(draw.between(1, 8)); attempt < 6; ++attempt) {
        Scene wired = scene;
        for (int i = 0; i < wires; ++i) {
            const auto wire = static_cast<std::size_t>(draw.between(0, kWires - 1));
            wired.precision.override_[wire] = any_spec(draw, plan.specs[static_cast<Wire>(wire)]);
        }
        try {
            Plan changed = make_plan(wired, volume);
            scene = wired;
            return changed;
        } catch (const InputError&) {
            wires = std::max(1, wires / 2);
        }
    }
    return plan;
}

/// A scene and its plan; throws InputError for the few that are refused (a camera looking along its own up).
Case draw_case(unsigned seed, const std::string& preset) {
    Draw draw(seed);
    Scene scene = built_in_scene();
    scene.image.width = scene.image.height = 24;
    scene.output.fixed = scene.output.samples = scene.output.transparency = true;
    scene.output.depth = draw.once_in(3), scene.output.normals = draw.once_in(3);
    const std::shared_ptr<const Volume> volume =
        turned_by_chance(Draw(seed + 0x70726e), draw_volume(draw, scene));
    draw_transfer_function(draw, *volume, scene);
    draw_camera(draw, *volume, scene);
    draw_light(draw, scene);
    scene.sampling.step = draw.one_of({1.0, 0.5, 0.25, draw.real(0.25, 4), draw.real(0.25, 4)});
    scene.sampling.termination = draw.one_of({1.0 / 1024, 0.0, draw.real(0, 0.999), 0.99});
    scene.sampling.position = draw.any_of<PositionRule>();
    if (draw.once_in(6)) scene.sampling.interpolation = InterpolationRule::nearest;
    if (draw.once_in(6)) scene.sampling.lerp = LerpRule::two_products;
    scene.classification = {};
    ClassificationSettings& method = scene.classification;
    method.method = draw.one_of({Method::pc, Method::pc_mid, draw.any_of<Method>(), draw.any_of<Method>()});
    if (draw.once_in(2)) scene.shading.inside = draw.any_of<InsideRule>();
    if (const auto& rule = scene.shading.inside) {  // a method that has it
        const bool by_parts = method.method == Method::leg || method.method == Method::pips;
        if (rule == InsideRule::adaptive && !by_parts) method.method = Method::pips;
        if (lights_fade(*rule) && !by_parts) method.method = draw.one_of({Method::pi2d, Method::pips});
    }
    if (scene.sampling.interpolation == InterpolationRule::nearest && method.method != Method::pc_mid)
        method.method = Method::pc;  // slab methods are refused there
    method.order = static_cast<int>(method.method == Method::leg ? draw.between(2, 4) : draw.between(1, 5));
    method.table_size = 64;
    method.lookup = draw.any_of<TableLookup>();
    method.opaque_prediction =
        draw.one_of({WallRule::twice, WallRule::twice, WallRule::ends, WallRule::none});
    if (draw.once_in(5)) method.encoding = draw.any_of<AlphaEncoding>();
    method.as_printed = draw.once_in(5);
    if (draw.once_in(6)) scene.compositing.mode = draw.any_of<CompositingMode>();
    scene.compositing.form = draw.any_of<CompositingForm>();
    if (!preset.empty()) {
        scene.precision.preset = preset;
        if (!draw.once_in(4)) {  // what floats have lanes for
            scene.output.depth = scene.output.normals = false;
            scene.compositing.mode = CompositingMode::over;
            if (scene.shading.gradient == GradientRule::central_samples)
                scene.shading.gradient = GradientRule::central;
        }
        return {scene, make_plan(scene, volume)};
    }
    Plan plan = draw_precision(draw, volume, scene);
    return {scene, std::move(plan)};
}

/// What is not every scene's, and runs in lanes all the same: how often it was drawn, and how often it did.
struct Share {
    const char* name;
    bool (*has)(const Plan& plan);
    unsigned drawn = 0, in_lanes = 0;
};
std::vector<Share> shares() {
    return {
        {"mip", [](const Plan& p) { return p.scene.compositing.mode == CompositingMode::mip; }},
        {"minip", [](const Plan& p) { return p.scene.compositing.mode == CompositingMode::minip; }},
        {"average", [](const Plan& p) { return p.scene.compositing.mode == CompositingMode::average; }},
        {"depth", [](const Plan& p) { return p.scene.output.depth && !p.projection_mode; }},
        {"normals", [](const Plan& p) { return p.scene.output.normals && p.lit; }},
        {"gradients from samples", [](const Plan& p) { return p.gradient_from_samples(); }},
        {"light at the middle", [](const Plan& p) { return p.inside.rule == InsideRule::middle; }},
        {"light in pieces", [](const Plan& p) { return p.inside.rule == InsideRule::adaptive; }},
        {"light between two gradients",
         [](const Plan& p) { return lights_fade(p.inside.rule) || lights_at_places(p.inside.rule); }},
        {"light that fades in", [](const Plan& p) { return p.gradient.fades; }},
        {"gooch", [](const Plan& p) { return p.lit && p.shading.model == ShadingModel::gooch; }},
        {"straight colours", [](const Plan& p) { return p.compositing.form == CompositingForm::straight; }},
        {"lerps of two products",
         [](const Plan& p) { return p.interpolation.two_products && !p.interpolation.nearest; }},
        {"pips as printed",
         [](const Plan& p) {
             return p.scene.classification.as_printed && p.scene.classification.method == Method::pips;
         }},
        {"one voxel thick along x", [](const Plan& p) { return p.volume->dims.x == 1; }},
        {"turned", [](const Plan& p) { return p.volume->turned(); }},
        {"turned and clipped", [](const Plan& p) { return p.clip.has_value(); }},
    };
}

RenderOptions draw_options(Draw& draw) {
    const std::vector<std::string> targets = lanes::target_names();
    RenderOptions options;
    options.threads = draw.one_of({1, 2, 7});
    options.tile = static_cast<int>(draw.between(1, 33));
    options.target =
        targets[static_cast<std::size_t>(draw.between(0, static_cast<std::int64_t>(targets.size()) - 1))];
    if (const char* only = std::getenv("SQUINT_TARGET")) options.target = only;
    options.layout = draw.any_of<LayoutRule>();
    options.skip = !draw.once_in(4);
    return options;
}

/// Empty, or the first difference.
std::string first_difference(const Image& expected, const Image& actual) {
    for (const Channel& channel : expected.channels) {
        const Channel* other = actual.find(channel.name);
        if (!other) return "channel " + channel.name + " is missing";
        const std::size_t pixels =
            static_cast<std::size_t>(expected.width) * static_cast<std::size_t>(expected.height);
        for (std::size_t i = 0; i < pixels; ++i) {
            const bool same = channel.is_words() ? channel.words[i] == other->words[i]
                                                 : std::bit_cast<std::uint32_t>(channel.values[i]) ==
                                                       std::bit_cast<std::uint32_t>(other->values[i]);
            if (same) continue;
            std::ostringstream text;
            text << channel.name << " at pixel (" << i % 24 << ", " << i / 24 << "): the model has ";
            if (channel.is_words())
                text << channel.words[i] << ", found " << other->words[i];
            else
                text << channel.values[i] << ", found " << other->values[i];
            return text.str();
        }
    }
    return {};
}

unsigned from_environment(const char* name, unsigned otherwise) {
    const char* text = std::getenv(name);
    return text ? static_cast<unsigned>(std::strtoul(text, nullptr, 10)) : otherwise;
}

/// `preset`: any for an empty one.
void compare_random_scenes(unsigned usual_count, const std::string& preset) {
    const unsigned scenes = from_environment("SQUINT_SCENES", usual_count),
                   first = from_environment("SQUINT_SEED", 1);
    RenderOptions golden;
    golden.threads = 1, golden.path = Path::model, golden.skip = false;
    unsigned drawn = 0, refused = 0, in_lanes = 0, lit_cells = 0, failures = 0;
    Hasher pictures;
    std::vector<Share> kinds = shares();
    for (unsigned seed = first; seed < first + scenes; ++seed) {
        Draw draw(seed + 0x5eed);
        RenderOptions options = draw_options(draw);
        try {
            const Case c = draw_case(seed, preset);
            if (preset == "default" && c.plan.lit) options.layout = LayoutRule::cells;  // lit cells, too
            const Image model = render(c.plan, golden).image;
            const Rendering fast = render(c.plan, options);
            ++drawn;
            pictures.text(picture_hash(model));
            in_lanes += fast.statistics.path == "lanes";
            lit_cells += fast.statistics.why.find("lit cells of") != std::string::npos;
            for (Share& kind : kinds)
                if (kind.has(c.plan)) ++kind.drawn, kind.in_lanes += fast.statistics.path == "lanes";
            const std::string wrong = first_difference(model, fast.image);
            if (wrong.empty()) continue;
            ADD_FAILURE() << wrong << "\nseed " << seed << ", target " << options.target << ", threads "
                          << options.threads << ", tile " << options.tile << ", skip " << options.skip << ", "
                          << fast.statistics.why << '\n'
                          << to_toml(c.scene);
            if (++failures == 3) break;
        } catch (const InputError& error) {
            ++refused;
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "seed " << seed;
        }
    }
    EXPECT_LE(10 * refused, drawn) << "scenes are drawn to be accepted";
    EXPECT_GE(2 * in_lanes, drawn) << "most scenes should run in lanes";
    if (scenes >= 300 && preset.empty())
        for (const Share& kind : kinds) {
            EXPECT_GE(kind.drawn, 2u) << kind.name;
            EXPECT_GE(2 * kind.in_lanes, kind.drawn) << kind.name << ": most should run in lanes";
        }
    const bool any_target = !std::getenv("SQUINT_TARGET") && lanes::find_target("") < HWY_EMU128;
    if (scenes >= 200 && preset == "default" && any_target) {
        EXPECT_GE(20 * lit_cells, scenes);
    }
    // The model's own bits, to be compared between compilers and machines.
    std::printf("pictures %s\n", pictures.hex().c_str());
    testing::Test::RecordProperty("drawn", static_cast<int>(drawn));
    testing::Test::RecordProperty("in_lanes", static_cast<int>(in_lanes));
    testing::Test::RecordProperty("lit_cells", static_cast<int>(lit_cells));
}

TEST(SameBits, RandomScenesHaveTheModelsBitsOnEveryPath) {
    compare_random_scenes(300, "");
}

// Default formats take the fastest kernels, and lit cells.
TEST(SameBits, RandomScenesInDefaultFormatsHaveTheModelsBitsOnEveryPath) {
    compare_random_scenes(200, "default");
}

// The model of float32 lanes is the scalar float.
TEST(SameBits, RandomScenesInFloat32HaveTheModelsBitsOnEveryPath) {
    compare_random_scenes(300, "float32");
}

// Voxels of the first entries alone, in a format that ends before the last entry: the limit of an input, which is the
// last entry elsewhere, would not fit lanes of 32 bits.
TEST(SameBits, FormatsThatEndBeforeTheLastEntryHaveTheModelsBits) {
    const auto volume =
        cases::volume_of({6, 6, 6}, 10, Vec3(1), [](const Index3& p) { return (p.x + p.y * p.z) % 3 == 0; });
    int in_lanes = 0;
    for (const char* input : {"s1.22 wrap", "u1.29", "u2.24", "s3.20", "u4.20 wrap"})
        for (const char* mode : {"over", "minip", "mip", "average"})
            for (const char* method : {"pc", "pips", "leg", "pi2d", "pi1d"}) {
                Scene scene = scene_with(
                    built_in_scene(),
                    {"image.width=9", "image.height=7", "camera.height=7", "classification.table_size=64",
                     "transfer_function.points=[[0,1,0.5,0,0.1],[1,0,1,0.5,0.9],[2,1,1,1,0],[1023,1,0,0,1]]",
                     "transfer_function.unit_distance=1", std::string("compositing.mode=") + mode,
                     std::string("classification.method=") + method,
                     std::string("precision.classification_input=") + input});
                const Plan plan = make_plan(scene, volume);
                RenderOptions golden;
                golden.path = Path::model, golden.skip = false;
                const Rendering fast = render(plan);
                in_lanes += fast.statistics.path == "lanes";
                EXPECT_EQ(first_difference(render(plan, golden).image, fast.image), "")
                    << input << ' ' << mode << ' ' << method << ' ' << fast.statistics.why;
            }
    EXPECT_GT(in_lanes, 50);
}

// A length up to which light fades in that no gradient of the format reaches.
TEST(SameBits, LimitsThatNoGradientReachesHaveTheModelsBits) {
    const auto volume =
        cases::volume_of({7, 7, 7}, 7, Vec3(1), [](const Index3& p) { return (5 * p.x + p.y * p.z) % 16; });
    for (const char* gradient : {"s6.23 trn", "s4.26", "s5.20"})
        for (const double floor : {1.0, 391.5, 60000.0})
            for (const char* model : {"gooch", "blinn_phong"}) {
                const Scene scene = scene_with(
                    built_in_scene(),
                    {"image.width=9", "image.height=7", "camera.height=8", "classification.method=pc",
                     "transfer_function.points=[[0,1,0.5,0,0.1],[8,0,1,0.5,0.5],[127,1,1,1,0.1]]",
                     "transfer_function.unit_distance=1", std::string("shading.model=") + model,
                     fmt::format("shading.gradient_floor={}", floor),
                     std::string("precision.gradient=") + gradient});
                const Plan plan = make_plan(scene, volume);
                RenderOptions golden;
                golden.path = Path::model, golden.skip = false;
                const Rendering fast = render(plan);
                EXPECT_EQ(first_difference(render(plan, golden).image, fast.image), "")
                    << gradient << ' ' << floor << ' ' << model << ' ' << fast.statistics.why;
            }
}

// Doubles run in the model, which leaves out what lanes would: whole plans of doubles, and those with one stage
// rounded, as `--error` draws them.
TEST(SameBits, DoublesAreTheSameWithoutTheEmptySpace) {
    const unsigned scenes = from_environment("SQUINT_SCENES", 60), first = from_environment("SQUINT_SEED", 1);
    std::int64_t samples = 0, visited = 0;
    for (unsigned seed = first; seed < first + scenes; ++seed) try {
            Case c = draw_case(seed, "");
            const std::string_view stage = kStages[seed % kStages.size()];
            set_active(c.plan, seed % 7 == 0 ? std::array<bool, kWires>{} : wires_of(stage));
            RenderOptions whole;
            whole.skip = false;
            const Rendering expected = render(c.plan, whole), found = render(c.plan);
            EXPECT_EQ(first_difference(expected.image, found.image), "") << "seed " << seed << ", " << stage;
            EXPECT_EQ(expected.statistics.samples, found.statistics.samples) << "seed " << seed;
            EXPECT_LE(found.statistics.visited, expected.statistics.visited);
            samples += expected.statistics.visited, visited += found.statistics.visited;
        } catch (const InputError&) {  // refused, as some scenes are
        }
    EXPECT_LT(visited, samples) << "some of it is empty";
}

}  // namespace
}  // namespace squint
