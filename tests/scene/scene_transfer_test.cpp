// [transfer_function] becomes the same function whichever way it is given.
#include "core/error.h"
#include "core/srgb.h"
#include "scene/scene.h"
#include "tests/own_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace squint {
namespace {

Volume volume_of_values(double least, double greatest) {
    Volume volume;
    volume.smallest = 10, volume.largest = 110;
    volume.value_scale = (greatest - least) / 100, volume.value_offset = least - 10 * volume.value_scale;
    return volume;
}

TransferFunction function_of(const std::string& section, const std::string& folder = "",
                             const Volume& volume = {}) {
    return resolve_transfer_function(parse_scene("[transfer_function]\n" + section, "s.toml", folder),
                                     volume);
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
    const TransferFunction built_in = resolve_transfer_function(built_in_scene(), {});
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
    const test::OwnFolder folder;
    std::ofstream(folder / "map.json") << R"({"RGBPoints": [0, 0, 0, 0, 9, 1, 0.5, 0]})";
    const TransferFunction map = function_of("unit_distance = 2\nfile = 'map.json'\n", folder.string());
    EXPECT_EQ(map.color.back().color, Vec3(1, 0.5, 0));
    EXPECT_EQ(map.unit_distance, 2);
    EXPECT_THROW(function_of("unit_distance = 2\nfile = 'none.json'\n", folder.string()), InputError);
}

TEST(SceneTransferFunction, IsStretchedToARangeOrToTheData) {
    const std::string lists =
        "unit_distance = 1\ncolor = [[0, 1, 0, 0], [1, 0, 0, 1]]\n"
        "opacity = [[0.25, 0], [0.75, 1]]\n";
    const TransferFunction two = function_of(lists + "range = [-100, 300]\n");
    EXPECT_EQ(two.color, (std::vector<ColorPoint>{{-100, Vec3(1, 0, 0)}, {300, Vec3(0, 0, 1)}}));
    EXPECT_EQ(two.opacity, (std::vector<OpacityPoint>{{0, 0}, {200, 1}})) << "both lists move as one";

    const TransferFunction data = function_of(lists + "range = 'data'\n", "", volume_of_values(-1000, 1200));
    EXPECT_EQ(data.color.front().value, -1000);
    EXPECT_EQ(data.color.back().value, 1200);
    const TransferFunction falling =
        function_of(lists + "range = 'data'\n", "", volume_of_values(1200, -1000));
    EXPECT_EQ(falling.color.front().value, -1000) << "values that fall where scalars rise";
    EXPECT_EQ(function_of(lists + "range = []\n").color.back().value, 1);
}

TEST(SceneTransferFunction, RefusesARangeThatNothingCanBeStretchedTo) {
    const std::string points = "unit_distance = 1\npoints = [[0, 1, 1, 1, 0], [1, 1, 1, 1, 1]]\n";
    const auto refusal = [](const std::string& text, const Volume& volume = {}) {
        try {
            function_of(text, "", volume);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("accepted");
    };
    for (const char* wrong : {"[1, 1]", "[2, 1]", "[1]", "[1, 2, 3]", "'date'", "5", "[nan, 1]", "[0, inf]"})
        EXPECT_THAT(refusal(points + "range = " + wrong),
                    testing::HasSubstr("transfer_function.range: found"))
            << wrong;
    EXPECT_THAT(refusal(points + "range = 'data'", volume_of_values(7, 7)),
                testing::HasSubstr("range: every voxel is 7; allowed: two numbers"));
    EXPECT_THAT(refusal("unit_distance = 1\npoints = [[3, 1, 1, 1, 0]]\nrange = [0, 1]"),
                testing::HasSubstr("range: all points stand at 3; allowed: points at two values or more"));
}

TEST(SceneTransferFunction, RefusesAPresetThatAProgramMisspelt) {
    Scene scene = built_in_scene();
    scene.transfer_function.points.clear();
    scene.transfer_function.preset = "ct_bnoe";
    try {
        resolve_transfer_function(scene, {});
        FAIL() << "accepted";
    } catch (const InputError& error) {
        EXPECT_THAT(
            error.what(),
            testing::StartsWith("built-in scene: transfer_function.preset: found \"ct_bnoe\"; allowed: "));
    }
}

}  // namespace
}  // namespace squint
