// Facts of a stage: what is promised to a compiler is what was asked of the plan, line by line.
#include "pipeline/stages/facts.h"

#include "core/procedural.h"
#include "pipeline/plan/plan.h"
#include "pipeline/stages/default_facts.h"
#include "scene/scene.h"
#include "tests/plan_of.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace squint {
namespace {

using testing::HasSubstr;

struct Stage {
    int kind = 3, bits = 4, other = 4;
    bool idle = false;
    Rescale to;
};
Rescale dropping(int shift) {
    Rescale to;
    to.shift = shift, to.limits = false;
    return to;
}
/// All of them hold.
Stage good_stage() {
    Stage s;
    s.to = dropping(15);
    return s;
}
using All = Facts<Stage, Is<&Stage::kind, 3>, AtMost<&Stage::bits, 4>, Same<&Stage::bits, &Stage::other>,
                  DropsBits<&Stage::to, 15>, Rounds<&Stage::to, Rounding::trn>>;

TEST(Facts, HoldOfAStageThatHasThemAll) {
    EXPECT_TRUE(All::hold(good_stage()));
    EXPECT_EQ(All::missing(good_stage()), "");
}

TEST(Facts, EachIsAskedAndTheFirstMissingOneIsNamed) {
    const auto missing_with = [](auto&& change) {
        Stage s = good_stage();
        change(s);
        EXPECT_FALSE(All::hold(s));
        return All::missing(s);
    };
    EXPECT_THAT(missing_with([](Stage& s) { s.kind = 2; }), HasSubstr("kind"));
    EXPECT_THAT(missing_with([](Stage& s) { s.bits = s.other = 5; }), HasSubstr("bits is too large"));
    EXPECT_THAT(missing_with([](Stage& s) { s.other = 3; }), HasSubstr("bits differs from other"));
    EXPECT_THAT(missing_with([](Stage& s) { s.to.shift = 14; }), HasSubstr("other than 15 bits"));
    EXPECT_THAT(missing_with([](Stage& s) { s.to.limits = true; }), HasSubstr("to meets its limits"));
    EXPECT_THAT(missing_with([](Stage& s) { s.to.rounding = Rounding::rnd; }), HasSubstr("rounds otherwise"));
    EXPECT_THAT(missing_with([](Stage& s) { s.kind = 2, s.to.shift = 14; }), HasSubstr("kind"));
}

TEST(Facts, ARescaleThatPassesNumbersOnHasNeitherShiftNorLimits) {
    using Idle = Facts<Stage, DoesNothing<&Stage::to>>;
    Stage s;
    s.to = dropping(0);
    EXPECT_TRUE(Idle::hold(s));
    s.to.limits = true;
    EXPECT_FALSE(Idle::hold(s));
    s.to = dropping(1);
    EXPECT_FALSE(Idle::hold(s));
}

TEST(Facts, LimitsDoNotMatterWhereNothingFlows) {
    using Unless = Facts<Stage, DropsBitsUnless<&Stage::to, &Stage::idle>>;
    Stage s = good_stage();
    s.to.limits = true;
    EXPECT_FALSE(Unless::hold(s));
    s.idle = true;
    EXPECT_TRUE(Unless::hold(s));
    s.to.shift = 0;  // promised, too
    EXPECT_FALSE(Unless::hold(s));
}

TEST(Facts, LimitsDoNotMatterBeforeAClampWithinThem) {
    using Clamped = Facts<Stage, DropsBitsBeforeClamp<&Stage::to, &Stage::bits>>;
    Stage s = good_stage();
    s.to.limits = true, s.to.lowest = -16, s.to.highest = 16;
    EXPECT_TRUE(Clamped::hold(s));
    s.to.highest = 15;
    EXPECT_FALSE(Clamped::hold(s));
    s.to.highest = 16, s.to.wraps = true;
    EXPECT_FALSE(Clamped::hold(s));
    s.to.wraps = false, s.to.lowest = 1;
    EXPECT_FALSE(Clamped::hold(s));
}

TEST(Facts, ACopyThatIsAssumedStaysTheStageItIs) {
    Stage s = good_stage();
    All::assume(s);
    EXPECT_TRUE(All::hold(s));
    EXPECT_EQ(s.to.shift, 15);
    EXPECT_EQ(s.kind, 3);
}

#ifndef NDEBUG
TEST(Facts, AssumingWhatDoesNotHoldEndsADebugBuild) {
    Stage s = good_stage();
    s.kind = 2;
    EXPECT_DEATH(All::assume(s), "hold");
}
#endif

Plan plan_with(std::vector<std::string> settings) {
    settings.insert(settings.end(),
                    {"volume.dims=16", "image.width=64", "image.height=64", "classification.method=pc"});
    const Scene scene = scene_with(built_in_scene(), settings);
    return test::plan_of(scene);
}

TEST(Facts, TheDefaultsHoldOfTheBuiltInScene) {
    const Plan plan = plan_with({});
    EXPECT_EQ(DefaultGradient::missing(plan.gradient), "");
    EXPECT_EQ(DefaultShading::missing(plan.shading), "");
    // A lit colour may meet its limit.
    const Plan unlit = plan_with({"shading.model=none"});
    EXPECT_EQ(DefaultCompositing::missing(unlit.compositing), "");
    EXPECT_EQ(UnitCompositing::missing(unlit.compositing), "");
}

TEST(Facts, AFormOfCompositingIsMissedByItsName) {
    const Plan plan = plan_with({"compositing.form=w_carry"});
    EXPECT_THAT(DefaultCompositing::missing(plan.compositing), HasSubstr("form"));
}

}  // namespace
}  // namespace squint
