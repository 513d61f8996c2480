#include "core/transfer_presets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace squint {
namespace {

TEST(TransferPresets, EveryPresetIsValidAndTransparentInAir) {
    const auto names = transfer_preset_names();
    for (const char* name : {"ct_bone", "ct_skin", "ct_muscle", "ct_lung", "ct_vessels"})
        EXPECT_THAT(names, testing::Contains(name));
    for (const std::string& name : names) {
        TransferFunction function;
        ASSERT_TRUE(find_transfer_preset(name, function)) << name;
        EXPECT_NO_THROW(check(function)) << name;
        EXPECT_EQ(function.alpha_at(-1000), 0) << name << " shows the air around a patient";
        EXPECT_EQ(function.unit_distance, 1) << name;
        EXPECT_EQ(function.name, name);
    }
    TransferFunction untouched;
    untouched.name = "mine";
    EXPECT_FALSE(find_transfer_preset("ct_nothing", untouched));
    EXPECT_EQ(untouched.name, "mine");
}

TEST(TransferPresets, ShowWhatTheyAreNamedAfterMoreThanTheRest) {
    struct Case {
        const char* preset;
        double shown, hidden;  // HU
    };
    for (const Case& c : {Case{"ct_bone", 1200, 50}, Case{"ct_bone_surface", 400, 200},
                          Case{"ct_skin", 0, -600}, Case{"ct_muscle", 50, -100}, Case{"ct_lung", -600, 0},
                          Case{"ct_vessels", 350, 1000}, Case{"ct_overview", 1000, 0}}) {
        TransferFunction function;
        ASSERT_TRUE(find_transfer_preset(c.preset, function));
        EXPECT_GT(function.alpha_at(c.shown), 2 * function.alpha_at(c.hidden)) << c.preset;
    }
}

}  // namespace
}  // namespace squint
