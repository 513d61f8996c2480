// A volume whose axes are turned against the world's: its voxels stay where they lie, and nothing that a picture says
// depends on the axes.
#include "core/compare.h"
#include "pipeline/render.h"
#include "tests/truth/reference_cases.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace squint {
namespace {

using namespace cases;

/// Images of x, y and z under a turn about an axis (Rodrigues).
std::array<Vec3, 3> turn_about(const Vec3& through, double degrees) {
    const Vec3 axis = through.normalized();
    const double c = std::cos(degrees * std::numbers::pi / 180),
                 s = std::sin(degrees * std::numbers::pi / 180);
    std::array<Vec3, 3> turn;
    for (int a = 0; a < 3; ++a) {
        const Vec3 v(a == 0, a == 1, a == 2);
        turn[static_cast<std::size_t>(a)] = v * c + axis.cross(v) * s + axis * (axis.dot(v) * (1 - c));
    }
    return turn;
}

std::shared_ptr<const Volume> turned(const std::shared_ptr<const Volume>& volume,
                                     const std::array<Vec3, 3>& turn) {
    Volume v = *volume;
    v.turn = turn;
    return std::make_shared<const Volume>(v);
}

std::shared_ptr<const Volume> lumps() {
    Volume v = *volume_of({19, 15, 11}, 12, Vec3(1, 0.75, 1.5), [](const Index3& p) {
        return 2047 +
               1000 * std::sin(0.7 * static_cast<double>(p.x)) * std::cos(0.5 * static_cast<double>(p.y)) +
               900 * std::sin(0.6 * static_cast<double>(p.z + p.x));
    });
    v.origin = Vec3(-7, 3, 2);
    return std::make_shared<const Volume>(v);
}

Scene lit_scene(int side) {
    Scene scene = plain_scene(side, side);
    scene.transfer_function.points = {
        {1200, 1, 0.5, 0.25, 0}, {2500, 0.25, 1, 0.5, 0.3}, {4095, 0, 0.5, 1, 0.9}};
    scene.lights = {{.direction = Vec3(0.3, -0.9, 0.4)}, {.headlight = true, .color = Vec3(0.2, 0.4, 0.3)}};
    scene.shading.exponent = 8;
    scene.sampling.step = 0.7;
    return scene;
}

/// One camera for both: given in full, in the space of the volume as it lies unturned, then turned with it.
void aim(Scene& scene, const Volume& volume, const Volume& as_turned, Projection projection) {
    const Vec3 middle = volume.grid_from_voxel(Vec3(volume.dims - Index3(1)) * 0.5);
    scene.camera.projection = projection;
    scene.camera.center = as_turned.world_from_grid(middle);
    scene.camera.eye = as_turned.world_from_grid(middle + Vec3(17, -31, 12));
    scene.camera.up = as_turned.world_from_grid(Vec3(0.1, 0.2, 1));
    scene.camera.height = 22;
    for (Light& light : scene.lights)
        if (!light.headlight) light.direction = as_turned.world_from_grid(light.direction);
}

// Doubles lose 2^-40 at most in a turn and what is computed from it; floats hold numbers near 1 to 2^-24 and distances
// below 64 to 2^-19.
constexpr double kFloats = 0x1p-24 + 0x1p-38, kDistances = 0x1p-18;

TEST(TurnedVolume, WithItsCameraAndItsLightsItIsTheSamePicture) {
    const auto plain = lumps();
    for (const auto& turn :
         {turn_about(Vec3(1, 2, 3), 40), turn_about(Vec3(0, 0, 1), 0.01), turn_about(Vec3(-3, 1, 1), 115)})
        for (const Projection projection : {Projection::orthographic, Projection::perspective})
            for (const CompositingMode mode :
                 {CompositingMode::over, CompositingMode::mip, CompositingMode::average}) {
                Scene scene = lit_scene(20);
                scene.precision.preset = "real";
                scene.compositing.mode = mode;
                scene.output.normals = scene.output.depth = true;
                Scene other = scene;
                const auto there = turned(plain, turn);
                aim(scene, *plain, *plain, projection), aim(other, *plain, *there, projection);
                const Image a = render(make_plan(scene, plain)).image,
                            b = render(make_plan(other, there)).image;
                double seen = 0;
                for (std::size_t i = 0; i < a.channels[0].values.size(); ++i) {
                    const auto at = [&](const Image& image, const char* name) -> double {
                        return image.find(name)->values[i];
                    };
                    for (const char* name : {"R", "G", "B", "A"})
                        EXPECT_NEAR(at(a, name), at(b, name), kFloats);
                    seen = std::max(seen, at(a, "A"));
                    if (mode != CompositingMode::over) continue;
                    for (const char* name : {"Z", "Z.mean"})
                        EXPECT_NEAR(at(a, name), at(b, name), kDistances);
                    const Vec3 n = there->world_from_grid(Vec3(at(a, "N.x"), at(a, "N.y"), at(a, "N.z")));
                    EXPECT_NEAR(n.x, at(b, "N.x"), 2 * kFloats);
                    EXPECT_NEAR(n.y, at(b, "N.y"), 2 * kFloats);
                    EXPECT_NEAR(n.z, at(b, "N.z"), 2 * kFloats);
                }
                EXPECT_GT(seen, 0.5) << name_of(mode);
            }
}

TEST(TurnedVolume, WithItsCameraAndItsLightsTheReferenceIsTheSame) {
    const auto plain = lumps(), there = turned(plain, turn_about(Vec3(1, 2, 3), 40));
    for (const Projection projection : {Projection::orthographic, Projection::perspective}) {
        Scene scene = lit_scene(6), other = scene;
        aim(scene, *plain, *plain, projection), aim(other, *plain, *there, projection);
        const Plan a = make_plan(scene, plain), b = make_plan(other, there);
        for (int i = 0; i < 36; ++i) {
            const auto one = reference_pixel(a, i % 6, i / 6), two = reference_pixel(b, i % 6, i / 6);
            // Each is within its tolerance of 1e-10 of the integral.
            for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(one[c], two[c], 2e-10);
        }
    }
}

// ------------------------------------------------------------------- the same field on two grids

/// Levels of a field in the world on a grid of cubes about the origin, whose axes lie along `turn`.
std::shared_ptr<const Volume> sampled(const std::function<double(const Vec3&)>& field,
                                      const std::array<Vec3, 3>& turn, int voxels, double spacing) {
    const double first = -0.5 * spacing * (voxels - 1);
    Volume grid;
    grid.turn = turn, grid.spacing = Vec3(spacing), grid.origin = Vec3(first);
    Volume v = *volume_of(Index3(voxels), 16, Vec3(spacing), [&](const Index3& p) {
        return std::floor(65535 * field(grid.world_from_voxel(Vec3(p))) + 0.5);
    });
    v.turn = turn, v.origin = Vec3(first);
    return std::make_shared<const Volume>(v);
}

double field_at(const Vec3& p) {
    return 0.5 + 0.2 * std::sin(0.45 * p.x + 1) * std::sin(0.4 * p.y) +
           0.25 * std::cos(0.5 * p.z + 0.2 * p.x);
}

/// A cube of the world that both grids cover, cut out by the clip box, drawn from either grid.
double psnr_of_two_grids(double spacing, bool lit) {
    const double side = 20;  // of the cube; a grid of twice as much holds it, however it is turned
    const int voxels = static_cast<int>(2 * side / spacing) + 1;
    Scene scene = lit_scene(64);
    scene.transfer_function.points = {
        {20000, 1, 0.5, 0.25, 0}, {40000, 0.25, 1, 0.5, 0.2}, {60000, 0, 0.5, 1, 0.5}};
    if (!lit) scene.lights.clear();
    scene.clip.low = Vec3(-side / 2), scene.clip.high = Vec3(side / 2);
    scene.camera.height = 2 * side;
    scene.sampling.step = 0.5 / spacing;
    scene.precision.preset = "real";
    const auto picture = [&](const std::array<Vec3, 3>& turn) {
        return render(make_plan(scene, sampled(field_at, turn, voxels, spacing))).image;
    };
    const Comparison comparison = compare(picture(turn_about(Vec3(1, 2, 3), 40)), picture(kNoTurn));
    return *comparison.channel("G", true).psnr;
}

TEST(TurnedVolume, TheSameFieldOnATurnedGridIsTheSamePicture) {
    for (const bool lit : {false, true}) {
        const double coarse = psnr_of_two_grids(1, lit), fine = psnr_of_two_grids(0.5, lit);
        RecordProperty(lit ? "lit_psnr" : "unlit_psnr", std::to_string(coarse));
        EXPECT_GT(coarse, lit ? 55 : 59);
        // Trilinear interpolation and central differences err by the square of the spacing: 12 dB a halving.
        EXPECT_NEAR(fine - coarse, 12, 2) << coarse << ' ' << fine;
    }
}

// ------------------------------------------------------------------------------- the clip box

TEST(TurnedVolume, ARayIsRenderedWhereItIsInTheVolumeAndInTheClipBox) {
    const auto volume = turned(lumps(), turn_about(Vec3(1, 2, 3), 40));
    const Vec3 middle = volume->world_from_voxel(Vec3(volume->dims - Index3(1)) * 0.5);
    for (int corners = 1; corners < 4; ++corners)
        for (const Projection projection : {Projection::orthographic, Projection::perspective}) {
            Scene scene = lit_scene(16);
            scene.camera.projection = projection;
            if (corners & 1) scene.clip.low = middle - Vec3(4, 5, 3);
            if (corners & 2) scene.clip.high = middle + Vec3(3, 2, 6);
            const Plan plan = make_plan(scene, volume);
            const Camera world = make_camera(scene.camera, *volume, 16, 16);
            int cut = 0;
            for (int i = 0; i < 256; ++i) {
                const RaySetup ray = plan.set_up(i % 16, i / 16);
                const Ray along = world.ray(i % 16, i / 16);
                constexpr double kApart = 1.0 / 64;
                double inside = 0;
                for (double t = 0; t < 150; t += kApart) {
                    const Vec3 p = along.origin + along.direction * t, voxel = volume->voxel_from_world(p);
                    bool in_both = true;
                    for (int a = 0; a < 3; ++a)
                        in_both = in_both && voxel[a] >= 0 &&
                                  voxel[a] <= static_cast<double>(volume->dims[a] - 1) &&
                                  (!scene.clip.low || p[a] >= (*scene.clip.low)[a]) &&
                                  (!scene.clip.high || p[a] <= (*scene.clip.high)[a]);
                    if (in_both && inside == 0) {
                        EXPECT_NEAR(t, ray.entry_distance, kApart);
                    }
                    inside += in_both ? kApart : 0;
                }
                const double chord = ray.slabs == 0 ? 0 : (ray.slabs - 1 + ray.last_length) * plan.step_world;
                EXPECT_NEAR(chord, inside, 2 * kApart);
                cut += chord > 0;
            }
            EXPECT_GT(cut, 20);
        }
}

TEST(TurnedVolume, AClipBoxBesideItSaysSo) {
    const auto volume = turned(lumps(), turn_about(Vec3(0, 0, 1), 30));
    Scene scene = lit_scene(4);
    scene.clip.low = Vec3(500, 500, 500);
    const Plan plan = make_plan(scene, volume);
    EXPECT_THAT(plan.warnings, testing::Contains(testing::HasSubstr("the box kept lies beside the volume")));
    RenderOptions options;
    options.path = Path::model;
    EXPECT_EQ(render(plan, options).statistics.rays, 0);
}

TEST(TurnedVolume, TheCameraFramesItWhole) {
    const auto volume = turned(lumps(), turn_about(Vec3(1, 2, 3), 40));
    for (const Projection projection : {Projection::orthographic, Projection::perspective}) {
        CameraSettings settings;
        settings.projection = projection;
        const Camera camera = make_camera(settings, *volume, 40, 30);
        const double up = camera.half_height, across = up * 40 / 30;
        for (int corner = 0; corner < 8; ++corner) {
            Vec3 voxel;
            for (int a = 0; a < 3; ++a)
                voxel[a] = corner >> a & 1 ? static_cast<double>(volume->dims[a] - 1) : 0;
            const Vec3 p = volume->world_from_voxel(voxel) - camera.eye;
            const double scale = projection == Projection::perspective ? p.dot(camera.view) : 1;
            EXPECT_GT(p.dot(camera.view), 0);
            EXPECT_LE(std::abs(p.dot(camera.right)), across * scale);
            EXPECT_LE(std::abs(p.dot(camera.up)), up * scale);
        }
    }
}

}  // namespace
}  // namespace squint
