// Certificates are never exceeded: pictures drawn at random, the terms that the first derivation missed, and every rule
// of the bound alone.
//
// SQUINT_PICTURES sets how many pictures are drawn, SQUINT_SEED the first one's seed: a failure prints both.
#include "pipeline/machines/certificate.h"
#include "core/error.h"
#include "core/procedural.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "tests/pipeline/machines/draw.h"
#include "tests/plan_of.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace squint {
namespace {

std::shared_ptr<const Volume> draw_volume(Draw& draw, Scene& scene) {
    const ProceduralField& field = draw_field(draw, 1);
    const Index3 dims{draw.between(2, 20), draw.between(2, 20), draw.between(2, 20)};
    const int bits = draw.one_of({8, 8, 12, 5});
    const Vec3 spacing = draw.once_in(2) ? Vec3(1, 1, 1) : Vec3(draw.real(0.4, 2), draw.real(0.4, 2), 1);
    scene.volume.procedural = field.name;
    scene.volume.dims = {dims.x, dims.y, dims.z}, scene.volume.bits = bits;
    scene.volume.spacing = {spacing.x, spacing.y, spacing.z};
    return std::make_shared<Volume>(make_procedural(field, dims, bits, spacing));
}

void draw_function(Draw& draw, const Volume& volume, Scene& scene) {
    TransferFunctionSettings& function = scene.transfer_function;
    function = {};
    function.unit_distance = draw.real(0.3, 4);
    function.entries = draw.one_of({0, 0, 2, 17, 64, 256});
    std::vector<double> values;
    for (std::int64_t i = draw.between(1, 5); i >= 0; --i)
        values.push_back(std::floor(draw.real(0, volume.largest_representable() + 1.0)));
    std::sort(values.begin(), values.end());
    const bool thin = draw.once_in(3);
    for (const double value : values) {
        const double alpha =
            thin ? draw.real(0, 0.03) : draw.one_of({0.0, 0.0, 1.0, draw.real(0, 1), draw.real(0, 0.1)});
        function.points.push_back({value, draw.real(0, 1), draw.one_of({0.0, 1.0}), draw.real(0, 1), alpha});
    }
}

void draw_light(Draw& draw, Scene& scene) {
    for (std::int64_t i = draw.between(1, 2); i > 0; --i) {
        Light& light = scene.lights.emplace_back();
        light.headlight = draw.once_in(2), light.direction = draw.vector(-1, 1);
        if (draw.once_in(3)) light.color = draw.vector(0, 1);
    }
    ShadingSettings& s = scene.shading;
    s = {};
    s.model = draw.one_of(
        {ShadingModel::blinn_phong, ShadingModel::phong, ShadingModel::cone, ShadingModel::gooch});
    s.gradient = draw.any_of<GradientRule>();
    s.ka = draw.real(0, 0.5), s.kd = draw.real(0, 1), s.ks = draw.real(0, 1);
    s.exponent = draw.one_of({1.0, 8.0, 32.0, 256.0});
    s.power = draw.any_of<PowerRule>();
    s.two_sided = draw.once_in(2);
    if (draw.once_in(2)) s.gradient_floor = draw.real(0.5, 20);
    s.inside = draw.any_of<InsideRule>();
}

/// A wire's Spec, a few bits from the one it has: the plan refuses some.
std::string near(Draw& draw, Spec spec) {
    Format& f = spec.format;
    f.fraction_bits =
        std::clamp(f.fraction_bits + static_cast<int>(draw.between(-8, 4)), 1, kMostChosenFractionBits);
    spec.rounding = draw.one_of({Rounding::trn, Rounding::trn_zero, Rounding::rnd, Rounding::rnd_conv});
    return to_string(spec);
}

struct Case {
    Scene scene;
    Plan plan;
};
Case draw_case(unsigned seed, bool lit = false) {
    Draw draw(seed);
    Scene scene = built_in_scene();
    const int size = draw.one_of({8, 11, 16});
    scene.image.width = scene.image.height = size;
    scene.lights.clear();
    const auto volume = draw_volume(draw, scene);
    draw_function(draw, *volume, scene);
    scene.camera = {};
    scene.camera.projection = draw.any_of<Projection>();
    scene.camera.azimuth = draw.one_of({0.0, 90.0, draw.real(0, 360), draw.real(0, 360)});
    scene.camera.elevation = draw.one_of({0.0, draw.real(-90, 90)});
    scene.sampling.step = draw.one_of({1.0, 0.5, draw.real(0.25, 3)});
    scene.sampling.termination = draw.one_of({1.0 / 1024, 0.0, draw.real(0, 0.5)});
    scene.sampling.position = draw.any_of<PositionRule>();
    scene.classification = {};
    scene.classification.opaque_prediction = draw.one_of({WallRule::ends, WallRule::twice, WallRule::twice});
    scene.classification.method =
        draw.once_in(2) ? draw.one_of({Method::pc, Method::pc_mid, Method::pips}) : draw.any_of<Method>();
    const Method method = scene.classification.method;
    if (method == Method::pips && draw.once_in(2))
        scene.classification.order = static_cast<int>(draw.between(2, 5));
    if (method == Method::leg) scene.classification.order = static_cast<int>(draw.between(2, 4));
    scene.classification.table_size = draw.one_of({64, 64, 100});
    scene.classification.lookup = draw.any_of<TableLookup>();
    if (draw.once_in(10)) scene.sampling.interpolation = InterpolationRule::nearest;
    if (draw.once_in(5)) scene.classification.encoding = AlphaEncoding::sqrt_alpha;
    scene.compositing.form = draw.any_of<CompositingForm>();
    if (draw.once_in(6)) scene.compositing.mode = draw.any_of<CompositingMode>();
    scene.precision.preset = draw.one_of<const char*>({"default", "default", "squeeze", "eight_bit", "wide"});
    if (lit) draw_light(draw, scene);
    Plan plan = make_plan(scene, volume);
    if (draw.once_in(3)) return {scene, std::move(plan)};
    for (std::int64_t i = draw.between(1, 10); i > 0; --i) {
        const Wire wire = plan.used_wires[static_cast<std::size_t>(
            draw.between(0, static_cast<std::int64_t>(plan.used_wires.size()) - 1))];
        scene.precision.override_[static_cast<std::size_t>(wire)] = near(draw, plan.specs[wire]);
    }
    return {scene, make_plan(scene, volume)};
}

unsigned from_environment(const char* name, unsigned otherwise) {
    const char* text = std::getenv(name);
    return text ? static_cast<unsigned>(std::strtoul(text, nullptr, 10)) : otherwise;
}

constexpr std::array<const char*, 4> kChannels{"R", "G", "B", "A"};

struct Compared {
    double error = 0, bound = 0;  // LSB8: the greatest of each
    std::string over;             // the pixel that is over its bound
};
/// Both pictures and the certificate.  Pictures are kept in float32, which may move each by 2^-25.
Compared compared(const Plan& plan, const Certificate& certificate) {
    RenderOptions by_model;
    by_model.path = Path::model;
    const Image words = render(plan, by_model).image, real = render(real_plan(plan), by_model).image;
    Compared all;
    for (std::size_t c = 0; c < 4; ++c) {
        const auto &a = words.find(kChannels[c])->values, &b = real.find(kChannels[c])->values;
        const auto& bound = certificate.image.channels[c].values;
        for (std::size_t i = 0; i < a.size(); ++i) {
            const double error = std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i]));
            all.error = std::max(all.error, 255 * error);
            all.bound = std::max(all.bound, 255 * static_cast<double>(bound[i]));
            if (!(error <= static_cast<double>(bound[i]) + 0x1p-24) && all.over.empty())
                all.over =
                    fmt::format("{} of pixel ({}, {}): {} LSB8, bound {}", kChannels[c],
                                i % static_cast<std::size_t>(words.width),
                                i / static_cast<std::size_t>(words.width), 255 * error, 255 * bound[i]);
        }
    }
    return all;
}
Compared compared(const Plan& plan, bool known = false) {
    CertificateOptions options;
    options.channels = true, options.threads = 1, options.known = known;
    return compared(plan, certify(plan, options));
}

/// `settings`: of all pictures, whatever was drawn.
void draw_pictures(bool lit, unsigned unless_told = 300, const std::vector<std::string>& settings = {}) {
    const unsigned pictures = from_environment("SQUINT_PICTURES", unless_told),
                   first = from_environment("SQUINT_SEED", 1);
    unsigned drawn = 0, failures = 0, tight = 0;
    for (unsigned seed = first; drawn < pictures && failures < 3; ++seed) {
        try {
            Case c = draw_case(seed, lit);
            if (!settings.empty()) {
                const auto volume = c.plan.volume;
                c.scene = scene_with(c.scene, settings);
                c.plan = make_plan(c.scene, volume);
            }
            const Compared all = compared(c.plan, seed % 2 == 0);
            ++drawn;
            tight += all.error > 0 && all.bound < 20 * all.error;
            if (all.over.empty()) continue;
            ++failures;
            ADD_FAILURE() << all.over << "\nseed " << seed << '\n' << to_toml(c.scene);
        } catch (const InputError&) {
        }
    }
    // A light's bound is loose where a gradient may vanish.
    EXPECT_GE((lit ? 8 : 2) * tight, drawn) << "a bound of everything would hold too";
    std::printf("seeds from %u: %u pictures, %u with a bound below 20 times the greatest error\n", first,
                drawn, tight);
}

TEST(Certificate, IsExceededByNoPixelOfPicturesDrawnAtRandom) {
    draw_pictures(false);
}
TEST(LitCertificate, IsExceededByNoPixelOfPicturesDrawnAtRandom) {
    draw_pictures(true);
}
TEST(LitCertificate, OfExaggeratedNormalsIsExceededByNoPixelOfPicturesDrawnAtRandom) {
    draw_pictures(true, 60, {"shading.exaggeration=1.3"});
}
TEST(LitCertificate, OfLightThatFadesByTablesIsExceededByNoPixelOfPicturesDrawnAtRandom) {
    for (const char* rule : {"linear", "nlpi"})
        for (const char* method : {"pi2d", "pi2d_no_attenuation"})
            draw_pictures(
                true, 15,
                {std::string("classification.method=") + method, std::string("shading.inside=") + rule});
}

// Words whose inputs have few bits take more slabs for too short to have places than the doubles do.
TEST(LitCertificate, KnowsThatPlacesWithoutRoundingHaveInputsOfTheirOwn) {
    const Compared all = compared(draw_case(415809, true).plan);
    EXPECT_EQ(all.over, "");
    EXPECT_GT(all.error, 10) << "or the case is none any more";
}

// A point that its row makes transparent, between nodes that are not: words do not light it.
TEST(LitCertificate, KnowsThatATransparentSlabIsNotLitByItsTables) {
    const Case c = draw_case(2082, true);
    const Scene scene = scene_with(c.scene, {"classification.method=pi2d", "shading.inside=linear"});
    const Compared all = compared(make_plan(scene, c.plan.volume));
    EXPECT_EQ(all.over, "");
    EXPECT_GT(all.error, 5) << "or the case is none any more";
}

// Where a wall may be missed, and nothing dims a slab's colours: brighter than any entry.
TEST(Certificate, KnowsThatColoursWhichNothingDimsPassTheCurves) {
    const Case c = draw_case(3261);
    ASSERT_EQ(c.scene.classification.method, Method::pi2d_no_attenuation);
    const Compared all = compared(c.plan);
    EXPECT_EQ(all.over, "");
    EXPECT_GT(all.error, 230) << "or the case is none any more";
}

/// A scene of configs/, unlit and by PC, with its own volume.
Plan plan_of(const std::string& file, std::vector<std::string> overrides) {
    overrides.insert(overrides.begin(), {"lights=[]", "classification.method=pc"});
    const Scene scene = read_scene(std::string(SQUINT_SOURCE_DIR) + "/configs/" + file, overrides);
    return test::plan_of(scene);
}

// What the first derivation missed (two of three; the third is PIPS's rows).  A ray's last slab, a part of a step long,
// ends in a wall or not by an error of the sample, and nearly all of the pixel hangs on it.
TEST(Certificate, KnowsThatALastSlabMayReachAWall) {
    const Plan plan =
        plan_of("hard/five_walls.toml", {"camera.azimuth=97.3", "camera.elevation=-32.1286",
                                         "precision.sample=u8.8", "precision.classification_input=u8.8"});
    CertificateOptions options;
    options.channels = true;
    const Certificate c = certify(plan, options);
    const Compared all = compared(plan, c);
    EXPECT_EQ(all.over, "");
    EXPECT_GT(all.error, 50) << "or the case is none any more";
    EXPECT_GT(c.undecided[static_cast<std::size_t>(Doubt::wall)], 0);
    EXPECT_LT(c.most_decided, all.error) << "the rays that it decides are not those";
}
// A length within half a last bit of a step is one: the words take a table's rows, which are straight.
TEST(Certificate, KnowsThatALastSlabMayBecomeAFullOne) {
    double most = 0;
    for (const char* azimuth : {"10", "100", "190", "280"}) {
        const Plan plan =
            plan_of("hard/noise.toml", {std::string("camera.azimuth=") + azimuth, "camera.elevation=20",
                                        "precision.length=u1.4", "image.width=48", "image.height=48"});
        const Compared all = compared(plan);
        EXPECT_EQ(all.over, "") << azimuth;
        most = std::max(most, all.error);
    }
    EXPECT_GT(most, 5) << "or the case is none any more";
}

TEST(HardCertificate, IsExceededByNoPixelOfTheHardCases) {
    unsigned pictures = 0;
    for (const auto& file : std::filesystem::directory_iterator(SQUINT_SOURCE_DIR "/configs/hard")) {
        if (file.path().extension() != ".toml") continue;
        for (int view = 0; view < 4; ++view) {
            const std::string name = "hard/" + file.path().filename().string();
            const Plan plan =
                plan_of(name, {fmt::format("camera.azimuth={}", 29 + 97 * view),
                               fmt::format("camera.elevation={}", 35 * view - 50), "image.width=32",
                               "image.height=32", "camera.turntable=1",
                               view % 2 ? "compositing.form=w_carry" : "compositing.form=auto"});
            EXPECT_EQ(compared(plan).over, "") << name << ", view " << view;
            ++pictures;
        }
    }
    EXPECT_GE(pictures, 60u);
}

// C of w_carry errs by the variation of colours along a ray, not by the slabs: thick fog that words of 15 bits hold.
TEST(Certificate, OfCarriedRemaindersDoesNotGrowWithTheSlabs) {
    const auto of = [](const char* form, const char* step) {
        const Plan plan =
            plan_of("hard/fog.toml",
                    {std::string("compositing.form=") + form, std::string("sampling.step=") + step,
                     "sampling.termination=0", "precision.contribution=u1.15", "precision.transparency=u1.15",
                     "image.width=8", "image.height=8",
                     "transfer_function.points=[[0, 0.7, 0.5, 0.3, 0.0041], [255, 0.7, 0.5, 0.3, 0.0041]]"});
        EXPECT_EQ(compared(plan).over, "");
        return certify(plan).greatest[static_cast<int>(Wire::contribution)];
    };
    EXPECT_GT(of("w", "0.25"), 2 * of("w", "1")) << "four times the slabs";
    EXPECT_LT(of("w_carry", "0.25"), 1.5 * of("w_carry", "1"));
    EXPECT_LT(of("w_carry", "0.25"), of("w", "0.25") / 4);
}

// What roundings took is less than what they may take, and still no less than what they did.
TEST(Certificate, OfKnownRoundingsIsTighterInFog) {
    const Plan plan = plan_of("hard/fog.toml", {"image.width=16", "image.height=16", "compositing.form=w"});
    const Compared any = compared(plan), known = compared(plan, true);
    EXPECT_EQ(known.over, "");
    EXPECT_LT(known.bound, 0.9 * any.bound);
}

TEST(Certificate, RefusesWhatItDoesNotBoundInOneLine) {
    const auto refusal = [](const std::vector<std::string>& overrides) -> std::string {
        const Scene scene = scene_with(built_in_scene(), overrides);
        const Plan plan = test::plan_of(scene);
        try {
            certify(plan);
        } catch (const InputError& error) {
            return error.what();
        }
        return "nothing was refused";
    };
    using ::testing::HasSubstr;
    const std::string dark = "lights=[]", pc = "classification.method=pc", small = "volume.dims=8";
    EXPECT_THAT(refusal({small, dark, "classification.method=pips", "classification.opaque_prediction=none",
                         "transfer_function.points=[[0, 1, 1, 1, 0], [255, 1, 1, 1, 1]]"}),
                HasSubstr("allowed: ends, twice"));
    EXPECT_THAT(refusal({small, "classification.method=pips", "shading.inside=adaptive",
                         "precision.slab_alpha=u1.12"}),
                HasSubstr("15 or more fraction bits"));
    EXPECT_THAT(refusal({small, dark, "classification.method=pips", "classification.as_printed=true"}),
                HasSubstr("as_printed"));
    EXPECT_THAT(refusal({small, dark, pc, "precision.preset=real"}), HasSubstr("real rounds nothing"));
}

// Each rule of the bound, halved, is exceeded by a picture in which its wire alone is coarse and all others are wide.
struct Rule {
    Wire wire;
    std::string name;                   // empty: the wire's
    std::vector<std::string> settings;  // of all its pictures
    bool lit = false;                   // as the wires of gradients and light are
};
std::string name_of(const Rule& rule) {
    return rule.name.empty() ? std::string(info(rule.wire).name) : rule.name;
}
class EveryRule : public ::testing::TestWithParam<Rule> {};
TEST_P(EveryRule, HalvedIsExceededByAPictureOfItsOwn) {
    const Wire wire = GetParam().wire;
    const std::string name = name_of(GetParam());
    const bool lit = GetParam().lit || info(wire).stage == "gradient" || info(wire).stage == "shading";
    double best = 0;
    for (unsigned seed = 1; seed <= 400; ++seed) {
        Draw draw(seed + 7777);
        try {
            const Case c = draw_case(seed, lit);
            Scene scene = scene_with(c.scene, GetParam().settings);
            scene.precision = {};
            scene.precision.preset = "wide";
            scene.sampling.termination = 0;
            scene.classification.encoding = AlphaEncoding::alpha;
            Plan plan = make_plan(scene, c.plan.volume);
            if (std::find(plan.used_wires.begin(), plan.used_wires.end(), wire) == plan.used_wires.end())
                continue;
            scene.precision.override_[static_cast<std::size_t>(wire)] = draw_coarse(draw, plan.specs[wire]);
            plan = make_plan(scene, c.plan.volume);
            CertificateOptions options;
            options.channels = true, options.threads = 1;
            const Image whole = certify(plan, options).image;
            options.payer = static_cast<int>(wire);
            const Image share = certify(plan, options).image;
            RenderOptions by_model;
            by_model.path = Path::model;
            const Image words = render(plan, by_model).image, real = render(real_plan(plan), by_model).image;
            for (std::size_t ch = 0; ch < 4; ++ch)
                for (std::size_t i = 0; i < words.channels[ch].values.size(); ++i) {
                    const double error = std::abs(static_cast<double>(words.channels[ch].values[i]) -
                                                  static_cast<double>(real.channels[ch].values[i]));
                    const double half = static_cast<double>(share.channels[ch].values[i]) / 2;
                    if (half < 0x1p-20) continue;
                    best = std::max(
                        best, (error - static_cast<double>(whole.channels[ch].values[i]) + half) / half);
                }
        } catch (const InputError&) {
        }
        if (best > 0.05) break;
    }
    std::printf("%s %g\n", name.c_str(), best);
    EXPECT_GT(best, 0.05) << "the rule for " << name << " could be halved, and nothing here would tell";
}
std::vector<Rule> rules() {
    std::vector<Rule> all;
    for (const Wire wire : {Wire::location,     Wire::direction,
                            Wire::weight,       Wire::length,
                            Wire::lerp_x,       Wire::lerp_y,
                            Wire::sample,       Wire::classification_input,
                            Wire::table_alpha,  Wire::table_extinction,
                            Wire::slab_depth,   Wire::slab_ratio,
                            Wire::slab_alpha,   Wire::slab_color,
                            Wire::contribution, Wire::color,
                            Wire::transparency, Wire::gradient,
                            Wire::spacing,      Wire::normal,
                            Wire::confidence,   Wire::light,
                            Wire::dot,          Wire::power,
                            Wire::material,     Wire::intensity,
                            Wire::lit_color})
        all.push_back({wire, "", {}});
    // One colour, a third of a last bit beside a word, whatever bits it has.
    all.push_back({Wire::table_color,
                   "",
                   {"classification.method=pc", "compositing.mode=over",
                    "transfer_function.points=[[0,0.333333333,0.666666667,0.333333333,0.9],"
                    "[255,0.333333333,0.666666667,0.333333333,0.9]]"}});
    // One level, not two of which half a bit each seldom meet.
    all.push_back({Wire::gradient_lerp, "", {"shading.gradient=analytic", "shading.inside=front"}});
    // Those of series of higher orders are by constants that no picture meets.
    for (const char* method : {"pc", "pi2d", "pi2d_no_attenuation", "pi1d", "pi1d_engel", "pips"})
        all.push_back({Wire::classification_input,
                       std::string("ends_of_") + method,
                       {std::string("classification.method=") + method, "compositing.mode=over",
                        "classification.order=1"}});
    all.push_back({Wire::location, "nearest_voxels", {"sampling.interpolation=nearest"}});
    all.push_back({Wire::gradient, "gradients_that_fade", {"shading.gradient_floor=5"}});
    all.push_back({Wire::exaggeration,
                   "",
                   {"shading.exaggeration=1.3", "shading.inside=front", "shading.model=phong", "shading.ka=0",
                    "shading.kd=1", "shading.ks=0", "lights=[{headlight=true}]", "camera.azimuth=0",
                    "camera.elevation=0", "classification.method=pc"}});
    const std::vector<std::string> by_tables{"classification.method=pi2d", "compositing.mode=over",
                                             "shading.inside=nlpi"};
    all.push_back({Wire::slab_color, "parts_of_light", by_tables, true});
    all.push_back({Wire::classification_input, "ends_of_parts_of_light", by_tables, true});
    all.push_back({Wire::color, "straight_form", {"compositing.form=straight"}});
    return all;
}
INSTANTIATE_TEST_SUITE_P(Certificate, EveryRule, ::testing::ValuesIn(rules()),
                         [](const auto& rule) { return name_of(rule.param); });

}  // namespace
}  // namespace squint
