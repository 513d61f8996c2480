// [transfer_function] becomes the same function whichever way it is given.
#include "core/error.h"
#include "core/srgb.h"
#include "scene/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace squint {
namespace {

TransferFunction function_of(const std::string& section, const std::string& folder = "") {
    return resolve_transfer_function(parse_scene("[transfer_function]\n" + section, "s.toml", folder));
}

TEST(SceneTransferFunction, IsTheSameFromPointsAndFromTwoLists) {
    const TransferFunction one =
        function_of("unit_distance = 2\nentries = 99\npoints = [[0, 0.5, 1, 0, 0], [9, 1, 1, 0.25, 0.5]]\n");
    const TransferFunction two = function_of(
        "unit_distance = 2\nentries = 99\ncolor = [[0, 0.5, 1, 0], [9, 1, 1, 0.25]]\nopacity = [[0, 0], [9, "
        "0.5]]\n");
    EXPECT_EQ(one.color, (std::vector<ColorPoint>{{0, Vec3(0.5, 1, 0)}, {9, Vec3(1, 1, 0.25)}}));
    EXPECT_EQ(one.opacity, (std::vector<OpacityPoint>{{0, 0}, {9, 0.5}}));
    EXPECT_EQ(one.unit_distance, 2);
    EXPECT_EQ(one.entries, 99);
    EXPECT_EQ(one.color, two.color);
    EXPECT_EQ(one.opacity, two.opacity);
}

TEST(SceneTransferFunction, DecodesColoursMeantForADisplay) {
    const TransferFunction decoded =
        function_of("unit_distance = 1\ncolor_space = 'srgb'\npoints = [[0, 0.5, 1, 0, 0.5]]\n");
    EXPECT_EQ(decoded.color[0].color, Vec3(linear_from_srgb(0.5), 1, 0));
    EXPECT_EQ(decoded.opacity[0].alpha, 0.5) << "opacity is never decoded";
}

TEST(SceneTransferFunction, KnowsTheBuiltInScenesAndEveryCtPreset) {
    const TransferFunction phantom = function_of("preset = 'phantom'\n");
    const TransferFunction built_in = resolve_transfer_function(built_in_scene());
    EXPECT_EQ(phantom.color, built_in.color);
    EXPECT_EQ(phantom.opacity, built_in.opacity);
    EXPECT_EQ(phantom.unit_distance, built_in.unit_distance);
    for (const std::string& name : transfer_function_presets())
        EXPECT_FALSE(function_of("preset = '" + name + "'\n").opacity.empty()) << name;
}

TEST(SceneTransferFunction, ReplacesAPresetsUnitDistanceByTheScenes) {
    EXPECT_EQ(function_of("preset = 'ct_bone'\n").unit_distance, 1);
    EXPECT_EQ(function_of("preset = 'ct_bone'\nunit_distance = 3\n").unit_distance, 3);
}

TEST(SceneTransferFunction, ReadsColourMapsBesideTheScene) {
    const std::filesystem::path folder = testing::TempDir();
    std::ofstream(folder / "map.json") << R"({"RGBPoints": [0, 0, 0, 0, 9, 1, 0.5, 0]})";
    const TransferFunction map = function_of("unit_distance = 2\nfile = 'map.json'\n", folder.string());
    EXPECT_EQ(map.color.back().color, Vec3(1, 0.5, 0));
    EXPECT_EQ(map.unit_distance, 2);
    EXPECT_THROW(function_of("unit_distance = 2\nfile = 'none.json'\n", folder.string()), InputError);
}

TEST(SceneTransferFunction, RefusesAPresetThatAProgramMisspelt) {
    Scene scene = built_in_scene();
    scene.transfer_function.points.clear();
    scene.transfer_function.preset = "ct_bnoe";
    try {
        resolve_transfer_function(scene);
        FAIL() << "accepted";
    } catch (const InputError& error) {
        EXPECT_THAT(
            error.what(),
            testing::StartsWith("built-in scene: transfer_function.preset: found \"ct_bnoe\"; allowed: "));
    }
}

}  // namespace
}  // namespace squint
