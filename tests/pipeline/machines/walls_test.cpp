// Walls between samples: slabs that are looked at twice (classification.opaque_prediction).
#include "core/error.h"
#include "pipeline/machines/lanes/near_walls.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "pipeline/slab-inl.h"
#include "tests/truth/reference_cases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace squint {
namespace {

using namespace cases;

constexpr std::array kMethods{
    Method::pi2d, Method::pi2d_no_attenuation, Method::pi1d, Method::pi1d_engel, Method::pips, Method::leg};

/// A plate one voxel thick at x = 3, seen along x with samples at x = 0, 2, 4, 6: the field is a wall at 200 and
/// from 199 on, and no line between two samples knows of it.
std::shared_ptr<const Volume> plate() {
    return volume_of({8, 6, 6}, 8, Vec3(1), [](const Index3& p) { return p.x == 3 ? 220 : 10; });
}
Scene plate_scene(Method method, WallRule rule) {
    Scene scene = plain_scene(3, 3);
    scene.transfer_function.points = {
        {0, 0.75, 0.5, 0.25, 0}, {199, 0.75, 0.5, 0.25, 0}, {200, 0.75, 0.5, 0.25, 1}};
    scene.camera.height = 2;
    scene.sampling.step = 2;
    scene.classification.method = method;
    scene.classification.opaque_prediction = rule;
    look(scene, *plate(), Vec3(1, 0, 0));
    return scene;
}
std::array<float, 4> middle_of(const Image& image) {
    const std::size_t at = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) / 2;
    return {image.channels[0].values[at], image.channels[1].values[at], image.channels[2].values[at],
            image.channels[3].values[at]};
}
Rendering on_path(const Plan& plan, Path path) {
    RenderOptions options;
    options.path = path;
    return render(plan, options);
}

TEST(Walls, AWallBetweenTwoSamplesIsFoundByASecondLookAlone) {
    const auto volume = plate();
    for (const Method method : kMethods)
        for (const Path path : {Path::model, Path::lanes}) {
            const Rendering missed = on_path(make_plan(plate_scene(method, WallRule::ends), volume), path);
            EXPECT_EQ(middle_of(missed.image), (std::array<float, 4>{0, 0, 0, 0})) << name_of(method);
            EXPECT_EQ(missed.statistics.refined.looked_twice, 0);
            const Plan plan = make_plan(plate_scene(method, WallRule::twice), volume);
            const Rendering found = on_path(plan, path);
            const std::array<float, 4> pixel = middle_of(found.image);
            const std::array<double, 4> truth = reference_pixel(plan, 1, 1);
            // Two roundings of a colour of 15 bits, and those of its table.  Without attenuation the little matter
            // in front of the wall throws no shadow on itself.
            for (std::size_t c = 0; c < 3 && method != Method::pi2d_no_attenuation; ++c)
                EXPECT_NEAR(pixel[c], truth[c], 4 * 0x1p-15) << name_of(method);
            EXPECT_EQ(pixel[3], 1.0F);
            EXPECT_GE(found.statistics.refined.looked_twice, 9);  // once a ray
        }
}

TEST(Walls, NoneIsLookedForWhereNoVoxelReachesOne) {
    const auto volume = plate();
    Scene scene = plate_scene(Method::pips, WallRule::twice);
    for (const double wall : {220.0, 221.0}) {  // the plate has 220
        scene.transfer_function.points[1][0] = wall - 1, scene.transfer_function.points[2][0] = wall;
        EXPECT_EQ(make_plan(scene, volume).walls.looks_twice, wall == 220);
    }
}

TEST(Walls, ALitWallIsLitByTheGradientOfItsPiece) {
    const auto volume = plate();
    for (const Method method : {Method::pips, Method::pi1d, Method::pi2d, Method::leg}) {
        Scene scene = plate_scene(method, WallRule::twice);
        scene.lights = {{.headlight = true}};
        scene.shading = {.ka = 0.25, .kd = 0.5, .ks = 0};
        const Plan plan = make_plan(scene, volume);
        const std::array<float, 4> pixel = middle_of(on_path(plan, Path::model).image);
        // The wall stands in front of the plate's middle and faces the light: ka + kd of its colour.
        EXPECT_EQ(pixel[3], 1.0F);
        EXPECT_NEAR(pixel[0], 0.75 * 0.75, 8 * 0x1p-15) << name_of(method);
        EXPECT_NEAR(pixel[2], 0.25 * 0.75, 8 * 0x1p-15) << name_of(method);
    }
}

TEST(Walls, WhereNothingIsOpaqueNothingIsLookedAtTwice) {
    Scene scene = plate_scene(Method::pips, WallRule::twice);
    for (auto& point : scene.transfer_function.points) point[4] = std::min(point[4], 0.5);
    const auto volume = plate();
    EXPECT_FALSE(make_plan(scene, volume).walls.looks_twice);
    Scene points = plate_scene(Method::pc, WallRule::twice);
    EXPECT_FALSE(make_plan(points, volume).walls.looks_twice);
    Scene printed = plate_scene(Method::pips, WallRule::twice);
    printed.classification.as_printed = true;
    EXPECT_FALSE(make_plan(printed, volume).walls.looks_twice);
}

/// Whether any scalar from one level to another is on an opaque entry, or between two of them.
bool holds_wall(const Entries& entries, int least, int greatest) {
    const auto last = static_cast<double>(entries.size() - 1);
    const double low = std::min(entries.coordinate(least), last),
                 high = std::min(entries.coordinate(greatest), last);
    for (int i = 0; i < entries.size(); ++i) {
        const bool here = entries.entry[static_cast<std::size_t>(i)].opaque;
        if (here && low <= i && i <= high) return true;
        if (here && i < last && entries.entry[static_cast<std::size_t>(i) + 1].opaque && low < i + 1 &&
            high > i)
            return true;
    }
    return false;
}

TEST(Walls, ACellHoldsOneWhereItsCornersReachAnOpaqueEntry) {
    std::mt19937 random(5);
    const auto volume =
        volume_of({13, 9, 10}, 8, Vec3(1), [&](const Index3&) { return static_cast<int>(random() % 256); });
    for (const int size : {256, 64, 511}) {
        Scene scene = plain_scene();
        scene.transfer_function.points = {{0, 1, 1, 1, 0},    {60, 1, 1, 1, 1},  {64, 1, 1, 1, 1},
                                          {65, 1, 1, 1, 0.5}, {200, 1, 1, 1, 1}, {204, 1, 1, 1, 0}};
        scene.transfer_function.entries = size;
        scene.classification.method = Method::pips;
        const Plan plan = make_plan(scene, volume);
        ASSERT_TRUE(plan.walls.looks_twice);
        for (int least = 0; least < 256; least += 3)
            for (int greatest = least; greatest < 256; greatest += 5)
                ASSERT_EQ(plan.walls.between(least, greatest), holds_wall(plan.entries, least, greatest))
                    << size << ' ' << least << ' ' << greatest;
        // The lanes' bits are the model's.
        const HWY_NAMESPACE::FromVolume voxels{*volume};
        const auto near = lanes::near_walls(*volume, lanes::all_blocks_of(*volume), plan.walls);
        for (std::int64_t z = 0; z < 9; ++z)
            for (std::int64_t y = 0; y < 8; ++y)
                for (std::int64_t x = 0; x < 12; ++x)
                    ASSERT_EQ(near->at(x, y, z),
                              voxels.nears_wall(plan.walls, std::array<std::int64_t, 3>{x, y, z}) == 1);
    }
}

TEST(Walls, LanesFirstAskForWallsAboutTwoCellsAlongEachAxis) {
    // A few voxels of wall: at corners, in the middle, on both sides of a block of cells.
    const auto volume = volume_of({70, 9, 10}, 8, Vec3(1), [](const Index3& p) {
        for (const Index3& wall : {Index3(0, 0, 0), Index3(5, 4, 4), Index3(12, 7, 3), Index3(68, 8, 9)})
            if (p.x == wall.x && p.y == wall.y && p.z == wall.z) return 220;
        return 10;
    });
    const Plan plan = make_plan(plate_scene(Method::pips, WallRule::twice), volume);
    const auto near = lanes::near_walls(*volume, lanes::all_blocks_of(*volume), plan.walls);
    const auto holds = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
        return x >= 0 && y >= 0 && z >= 0 && x < 69 && y < 8 && z < 9 && near->at(x, y, z);
    };
    int without = 0;
    for (std::int64_t z = 0; z < 9; ++z)
        for (std::int64_t y = 0; y < 8; ++y)
            for (std::int64_t x = 0; x < 69; ++x) {
                bool about = false;
                for (int i = 0; i < 64; ++i)
                    about |= holds(x / 2 * 2 - 1 + i % 4, y / 2 * 2 - 1 + i / 4 % 4, z / 2 * 2 - 1 + i / 16);
                ASSERT_EQ(near->about_at(x, y, z), about) << x << ' ' << y << ' ' << z;
                without += !about;
            }
    EXPECT_GT(without, 4000);  // of 4968
}

}  // namespace
}  // namespace squint
