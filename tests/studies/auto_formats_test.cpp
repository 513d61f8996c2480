// The preset `auto`: formats that follow a budget, which pictures keep to.
#include "studies/search/auto_formats.h"
#include "core/compare.h"
#include "core/error.h"
#include "pipeline/machines/certificate.h"
#include "pipeline/machines/scene_bound.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "scene/presets.h"
#include "tests/plan_of.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace squint::search {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Chosen {
    Scene scene;
    std::shared_ptr<const Volume> volume;
    AutoFormats formats;
};
Chosen chosen(std::vector<std::string> overrides, int threads = 1) {
    overrides.insert(overrides.begin(),
                     {"volume.dims=16", "image.width=12", "image.height=10", "camera.height=16",
                      "classification.method=pc", "lights=[]", "precision.preset=auto"});
    Chosen c{scene_with(built_in_scene(), overrides), {}, {}};
    c.volume = test::volume_of(c.scene);
    AutoSettings settings;
    settings.threads = threads;
    c.formats = choose_formats(c.scene, c.volume, settings);
    return c;
}
/// The greatest difference from the picture that nothing rounds, LSB8.
double measured(const Chosen& c, int frame = 0) {
    const Plan plan = make_plan(c.scene, c.volume, frame);
    double most = 0;
    for (const Difference& d :
         compare_colors(render(plan, {}).image, render(real_plan(plan, frame), {}).image).all)
        most = std::max(most, 255 * d.largest);
    return most;
}

TEST(AutoFormats, KeepEveryPictureWithinTheBudget) {
    for (const char* budget : {"0.2", "0.5", "4"})
        for (const char* lights : {"lights=[]", "lights=[{headlight=true}]"}) {
            const Chosen c = chosen({std::string("precision.budget=") + budget, "camera.turntable=3", lights,
                                     "shading.gradient_floor=200"});
            SCOPED_TRACE(std::string(budget) + ' ' + lights);
            ASSERT_TRUE(c.formats.within);
            EXPECT_THAT(c.formats.warnings, IsEmpty());
            EXPECT_EQ(c.formats.one_in, 1);
            for (int frame = 0; frame < 3; ++frame) {
                const Certificate certificate = certify(make_plan(c.scene, c.volume, frame));
                EXPECT_LE(certificate.most_decided, std::stod(budget));
                EXPECT_EQ(c.formats.undecided, 0);
                EXPECT_LE(measured(c, frame), c.formats.bound);
            }
            EXPECT_GT(c.formats.bound, std::stod(budget) / 3) << "no more bits than asked for";
        }
}

// The same formats by every processor and compiler: nothing on the way to them is wider than a double, or the
// system's own function.
TEST(AutoFormats, AreTheseOnEveryMachine) {
    const auto formats_of = [](const Chosen& c) {
        const Plan plan = make_plan(c.scene, c.volume);
        std::string text;
        for (const Wire wire : plan.used_wires) text += to_string(plan.specs[wire].format) + ' ';
        return text;
    };
    EXPECT_EQ(
        formats_of(chosen({})),
        "u4.14 s1.17 u1.13 u1.7 u12.1 u12.2 u12.2 u12.1 u1.11 u1.15 u10.10 u4.12 u1.10 u1.15 u1.14 u1.15 "
        "u1.13 ");
}

TEST(AutoFormats, OfEveryViewKeepTheSceneBoundWithinTheBudget) {
    const std::vector<std::string> lit{"lights=[{headlight=true}]", "shading.gradient_floor=16"};
    for (const auto& [budget, light] :
         std::vector<std::pair<std::string, std::vector<std::string>>>{{"2", {}}, {"8", {}}, {"6", lit}}) {
        std::vector<std::string> overrides{"precision.budget=" + budget, "precision.guarantee=scene"};
        overrides.insert(overrides.end(), light.begin(), light.end());
        const Chosen c = chosen(overrides);
        SCOPED_TRACE(budget);
        ASSERT_TRUE(c.formats.within);
        EXPECT_THAT(c.formats.notes,
                    ::testing::Contains(HasSubstr("no pixel of any view errs by more than")));
        const SceneBound bound = bound_scene(make_plan(c.scene, c.volume));
        EXPECT_LE(bound.most, std::stod(budget));
        EXPECT_GT(c.formats.bound, std::stod(budget) / 4) << "no more bits than asked for";
        EXPECT_LE(measured(c), bound.most);
    }
}

// A ray of 4096 samples: fewer of them are certified.
TEST(AutoFormats, OfLongRaysAreChosenFromFewerOfThem) {
    const Chosen c = chosen({"volume.procedural=constant", "volume.dims=[3, 4096, 3]", "camera.height=2",
                             "camera.azimuth=0", "camera.elevation=0", "image.width=40", "image.height=40",
                             "transfer_function.points=[[0,1,1,1,5e-5],[255,1,1,1,5e-5]]",
                             "transfer_function.unit_distance=1", "sampling.termination=0"});
    EXPECT_TRUE(c.formats.within);
    EXPECT_GT(c.formats.one_in, 1);
    EXPECT_LE(c.formats.rays, 3000 / 64);
    EXPECT_GT(c.formats.rays, 0);
}

TEST(AutoFormats, DoNotDependOnThreads) {
    const Chosen one = chosen({}, 1), three = chosen({}, 3);
    EXPECT_EQ(one.scene.precision.override_, three.scene.precision.override_);
}

TEST(AutoFormats, AreSettingsOfTheSceneThatAnotherCommandReads) {
    const Chosen c = chosen({});
    EXPECT_TRUE(has_all_formats(c.scene.precision));
    Scene again = parse_scene(to_toml(c.scene), "again", "");
    EXPECT_EQ(again.precision.preset, "auto");
    EXPECT_EQ(choose_formats(again, c.volume).rays, 0) << "there is nothing left to choose";
    EXPECT_EQ(make_plan(again, c.volume).specs, make_plan(c.scene, c.volume).specs);
}

TEST(AutoFormats, TakeTerminationIntoTheBudgetUnlessTheSceneSetsIt) {
    const Chosen own = chosen({"sampling.termination=0.0009765625"}), none = chosen({});
    EXPECT_EQ(own.scene.sampling.termination, 0x1p-10);
    EXPECT_EQ(none.scene.sampling.termination, 0x1p-12);
    EXPECT_THAT(none.formats.notes, ::testing::Contains(HasSubstr("2^-12")));
    EXPECT_EQ(own.formats.notes.size() + 1, none.formats.notes.size());
}

TEST(AutoFormats, LeaveWiresThatTheSceneSets) {
    const Chosen c = chosen({"precision.sample=u12.9 trn", "precision.budget=2"});
    EXPECT_EQ(c.scene.precision.override_[static_cast<std::size_t>(Wire::sample)], "u12.9 trn");
}

TEST(AutoFormats, WarnWithTheFigureAndTheWireThatBinds) {
    const Chosen c = chosen({"precision.transparency=u1.4", "precision.budget=0.1"});
    EXPECT_FALSE(c.formats.within);
    ASSERT_EQ(c.formats.warnings.size(), 1u);
    EXPECT_THAT(c.formats.warnings[0],
                HasSubstr("precision.budget: found 0.1, but the nearest formats have a bound of"));
    EXPECT_THAT(c.formats.warnings[0], HasSubstr("of which transparency makes"));
    EXPECT_LE(measured(c), c.formats.bound);
}

TEST(AutoFormats, RefuseWhatHasNoCertificateInOneLine) {
    const auto refusal = [](const std::vector<std::string>& overrides) -> std::string {
        try {
            chosen(overrides);
        } catch (const InputError& error) {
            return error.what();
        }
        return "nothing was refused";
    };
    EXPECT_THAT(
        refusal({"precision.guarantee=scene", "classification.method=leg"}),
        HasSubstr("--set precision.preset: found \"auto\", but classification.method leg has no scene "
                  "bound"));
    EXPECT_THAT(refusal({"classification.method=pips", "classification.as_printed=true"}),
                HasSubstr("--set precision.preset: found \"auto\", but classification.as_printed"));
    EXPECT_THAT(refusal({"precision.budget=0"}), HasSubstr("precision.budget"));
    EXPECT_THROW(make_plan(scene_with(built_in_scene(), {"precision.preset=auto"}), chosen({}).volume),
                 InputError)
        << "unless its formats were chosen";
}

TEST(AutoFormats, LeaveOtherPresetsAlone) {
    const Chosen c = chosen({"precision.preset=default"});
    EXPECT_FALSE(has_all_formats(c.scene.precision));
    EXPECT_EQ(c.scene.sampling.termination, 0x1p-10);
    EXPECT_THAT(c.formats.notes, IsEmpty());
}

// Where `default` has rules of its own, or would need one: a fog that 15 bits lose, a narrow highlight.
TEST(AutoFormats, HoldFaintFogAndNarrowHighlightsByTheBudgetAlone) {
    const Chosen fog = chosen({"volume.procedural=constant", "sampling.step=0.25",
                               "transfer_function.points=[[0,1,1,1,0.001],[4095,1,1,1,0.001]]",
                               "transfer_function.unit_distance=1"});
    EXPECT_TRUE(fog.formats.within);
    EXPECT_LE(measured(fog), 0.5);
    const Chosen highlight = chosen(
        {"volume.procedural=ramp", "lights=[{headlight=true}]", "shading.exponent=1024",
         "transfer_function.points=[[0,1,1,1,0.1],[4095,1,1,1,0.1]]", "transfer_function.unit_distance=1"});
    EXPECT_TRUE(highlight.formats.within);
    EXPECT_LE(measured(highlight), 0.5);
}

}  // namespace
}  // namespace squint::search
