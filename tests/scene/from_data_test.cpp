// What a scene made from data alone shows: a function by the histogram, and a camera that what it shows fills.
#include "scene/from_data.h"
#include "core/volume_data.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <memory>

namespace squint {
namespace {

constexpr std::int64_t kSide = 48;

Volume volume_of(const std::function<double(const Vec3&)>& level) {
    Volume v;
    v.dims = Index3(kSide), v.name = "test", v.spacing = Vec3(0.5, 1, 2), v.origin = Vec3(-100, 20, 3);
    const std::shared_ptr<void> voxels = allocate_voxels(static_cast<std::size_t>(v.voxels()), v.name);
    auto* next = static_cast<std::uint8_t*>(voxels.get());
    for (std::int64_t z = 0; z < kSide; ++z)
        for (std::int64_t y = 0; y < kSide; ++y)
            for (std::int64_t x = 0; x < kSide; ++x)
                *next++ = static_cast<std::uint8_t>(level(Vec3(Index3(x, y, z))));
    v.data = voxels;
    measure(v);
    return v;
}
/// 0 to 4 about a level, alike for equal places.
double noise(const Vec3& p) {
    return std::fmod(p.x * 7 + p.y * 13 + p.z * 29, 5);
}
/// A dense ball in a soft one, in air.
double balls(const Vec3& p) {
    const double r = (p - Vec3(24)).length();
    return noise(p) + (r < 6 ? 200 : r < 15 ? 90 : 10);
}

TransferFunction function_of(const Volume& volume, Scene scene = scene_of_data("")) {
    std::vector<std::string> notes;
    complete_from_data(scene, volume, notes);
    EXPECT_EQ(notes.size(), 1u);
    return resolve_transfer_function(scene, volume);
}

TEST(FromData, AirIsClearSoftMatterIsFaintAndDenseMatterIsDense) {
    const TransferFunction function = function_of(volume_of(balls));
    for (int level = 10; level <= 14; ++level) EXPECT_EQ(function.alpha_at(level), 0);
    for (int level = 90; level <= 94; ++level) EXPECT_GE(function.alpha_at(level), 0.05) << level;
    for (int level = 90; level <= 94; ++level) EXPECT_LE(function.alpha_at(level), 0.15) << level;
    for (int level = 200; level <= 204; ++level) EXPECT_GE(function.alpha_at(level), 0.3) << level;
    EXPECT_EQ(function.alpha_at(204), 0.9);
}

TEST(FromData, WhatFillsTheBoxIsBackgroundToo) {
    // Resin about a shell, as lobsters are scanned: half of all voxels.
    const TransferFunction function = function_of(volume_of([](const Vec3& p) {
        const double r = (p - Vec3(24)).length();
        return noise(p) + (r < 10 ? 200 : r < 13 ? 110 : r < 26 ? 25 : 0);
    }));
    for (int level = 0; level <= 29; ++level) EXPECT_EQ(function.alpha_at(level), 0) << level;
    EXPECT_GT(function.alpha_at(112), 0);
}

TEST(FromData, MasksAndEvenVolumesHaveAFunction) {
    const TransferFunction mask = function_of(volume_of([](const Vec3& p) { return p.x < 9 ? 1.0 : 0.0; }));
    EXPECT_EQ(mask.alpha_at(0), 0);
    EXPECT_GE(mask.alpha_at(1), 0.5);
    for (const double level : {0.0, 7.0, 255.0}) {
        Scene scene = scene_of_data("");
        const Volume even = volume_of([&](const Vec3&) { return level; });
        function_of(even);
        std::vector<std::string> notes;
        complete_from_data(scene, even, notes);
        EXPECT_NO_THROW(frame_data(scene, even)) << level;
    }
}

/// A ball of radius 6 world units about (20, 30, 40) of a larger box.
Volume small_ball() {
    const Volume grid = volume_of([](const Vec3&) { return 0; });
    return volume_of([&](const Vec3& p) {
        return (grid.grid_from_voxel(p) - grid.grid_from_voxel(Vec3(20, 30, 33))).length() < 6 ? 200 : 0;
    });
}

TEST(FromData, WhatIsSeenFillsThePicture) {
    const Vec3 middle = small_ball().grid_from_voxel(Vec3(20, 30, 33));
    for (const bool turned : {false, true})
        for (const int turntable : {1, 8})
            for (const int width : {40, 20}) {
                Volume volume = small_ball();
                if (turned) volume.turn = {Vec3(0.6, 0.8, 0), Vec3(-0.8, 0.6, 0), Vec3(0, 0, 1)};
                Scene scene = scene_of_data("");
                scene.image.width = width, scene.image.height = 30, scene.camera.turntable = turntable;
                std::vector<std::string> notes;
                complete_from_data(scene, volume, notes);
                frame_data(scene, volume);
                ASSERT_TRUE(scene.camera.center && scene.camera.height);
                // The voxels' steps of up to 2 leave the ball's edge open by one at either side.
                const double narrow = std::min(1.0, width / 30.0);
                EXPECT_GT(*scene.camera.height * narrow, 12 - 2);
                EXPECT_LT(*scene.camera.height * narrow, 1.1 * (12 + 2));
                EXPECT_LT((*scene.camera.center - volume.world_from_grid(middle)).length(), 1);
            }
}

TEST(FromData, SpecksDoNotMoveTheCamera) {
    Scene clean = scene_of_data(""), noisy = clean;
    std::vector<std::string> notes;
    const Volume ball = volume_of(balls);
    complete_from_data(clean, ball, notes);
    noisy.transfer_function = clean.transfer_function;
    frame_data(clean, ball);
    // Three of 14,000 voxels that are seen: less than a five-thousandth.
    frame_data(noisy, volume_of([](const Vec3& p) {
                   return p == Vec3(0, 0, 0) || p == Vec3(47, 47, 47) || p == Vec3(0, 47, 47) ? 90 : balls(p);
               }));
    EXPECT_NEAR(*noisy.camera.height, *clean.camera.height, 0.05 * *clean.camera.height);
}

}  // namespace
}  // namespace squint
