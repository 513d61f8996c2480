// A volume one voxel thick along an axis is one spacing thick there, half to each side, the field constant across:
// the picture of two equal slices at the ends of the same box.
#include "core/volume_data.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "tests/truth/reference_cases.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace squint {
namespace {

using namespace cases;

/// `slices` equal ones across `axis`, 9 and 7 voxels along the others, centred at the origin of that axis.
std::shared_ptr<const Volume> slices_of(int axis, int slices) {
    const int across = (axis + 1) % 3, along = (axis + 2) % 3;
    Index3 dims(slices);
    dims[across] = 9, dims[along] = 7;
    Volume v = *volume_of(dims, 12, Vec3(1, 0.5, 2), [&](const Index3& p) {
        return 100 + 37 * ((p[across] * 5 + p[along] * 11) % 101);
    });
    v.origin[axis] = -0.5 * v.spacing[axis] * (slices - 1);
    const std::size_t bytes = static_cast<std::size_t>(v.voxels()) * v.scalar_bytes();
    const std::shared_ptr<void> padded = allocate_voxels(bytes, v.name);
    std::memcpy(padded.get(), v.data.get(), bytes);
    v.data = padded;
    return std::make_shared<const Volume>(v);
}

Scene scene_of(CompositingMode mode, Method method, Projection projection, bool lit) {
    Scene scene = plain_scene(24, 20);
    scene.transfer_function.points = {
        {0, 1, 0.5, 0.25, 0}, {2000, 0.25, 1, 0.5, 0.4}, {4095, 0, 0.5, 1, 0.8}};
    scene.compositing.mode = mode, scene.classification.method = method;
    scene.camera.projection = projection;
    scene.sampling.step = 0.7;
    if (lit) scene.lights = {{.headlight = true}};
    return scene;
}

TEST(ThinVolume, ModelAndLanesShowWhatTwoEqualSlicesShow) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto thin = slices_of(axis, 1), thick = slices_of(axis, 2);
        ASSERT_EQ(thin->box_low(), thick->box_low());
        ASSERT_EQ(thin->box_high(), thick->box_high());
        for (const CompositingMode mode :
             {CompositingMode::over, CompositingMode::mip, CompositingMode::minip, CompositingMode::average})
            for (const Method method : {Method::pc, Method::pc_mid, Method::pips, Method::pi2d})
                for (const Projection projection : {Projection::orthographic, Projection::perspective}) {
                    if (mode != CompositingMode::over && method != Method::pc) continue;
                    const Scene scene = scene_of(mode, method, projection, axis == 1);
                    const std::string expected = picture_hash(render(make_plan(scene, thick)).image);
                    for (const Path path : {Path::model, Path::lanes}) {
                        RenderOptions options;
                        options.path = path;
                        const Rendering rendering = render(make_plan(scene, thin), options);
                        EXPECT_EQ(picture_hash(rendering.image), expected)
                            << axis << ' ' << name_of(mode) << ' ' << name_of(method) << ' '
                            << name_of(projection);
                        EXPECT_GT(rendering.statistics.rays, 50);
                    }
                }
    }
}

TEST(ThinVolume, TheReferenceShowsWhatTwoEqualSlicesShow) {
    for (int axis = 0; axis < 3; ++axis)
        for (const CompositingMode mode :
             {CompositingMode::over, CompositingMode::mip, CompositingMode::average}) {
            const Scene scene = scene_of(mode, Method::pc, Projection::orthographic, false);
            const Plan thin = make_plan(scene, slices_of(axis, 1)),
                       thick = make_plan(scene, slices_of(axis, 2));
            int seen = 0;
            for (int row = 0; row < 20; row += 3)
                for (int column = 0; column < 24; column += 3) {
                    const auto one = reference_pixel(thin, column, row),
                               two = reference_pixel(thick, column, row);
                    for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(one[c], two[c], 2e-10) << axis;
                    seen += one[3] > 0;
                }
            EXPECT_GT(seen, 5);
        }
}

TEST(ThinVolume, ASliceSeenFromItsFrontIsOneSpacingOfMatter) {
    const auto slice = volume_of({9, 7, 1}, 8, Vec3(1, 1, 3), [](const Index3&) { return 128; });
    Scene scene = plain_scene(9, 9);
    look(scene, *slice, Vec3(0, 0, 1));
    EXPECT_NEAR(reference_pixel(make_plan(scene, slice), 4, 4)[3], 1 - std::pow(0.5, 3), 1e-10);
    scene.precision.preset = "real";
    EXPECT_NEAR(render(make_plan(scene, slice)).image.find("A")->values[40], 1 - std::pow(0.5, 3), 1e-6);

    const auto voxel = volume_of({1, 1, 1}, 8, Vec3(2, 2, 2), [](const Index3&) { return 128; });
    look(scene, *voxel, Vec3(1, 0, 0));
    EXPECT_NEAR(reference_pixel(make_plan(scene, voxel), 4, 4)[3], 1 - std::pow(0.5, 2), 1e-10);
    EXPECT_NEAR(render(make_plan(scene, voxel)).image.find("A")->values[40], 1 - std::pow(0.5, 2), 1e-6);
}

}  // namespace
}  // namespace squint
