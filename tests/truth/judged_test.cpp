// What an independent renderer in double found, each fault by its kind: right values that follow from a scene by
// hand, for every member of the kind.
#include "core/error.h"
#include "pipeline/classification/tables/exact_slab.h"
#include "pipeline/machines/model.h"
#include "pipeline/plan/short_slabs.h"
#include "pipeline/render.h"
#include "pipeline/stages/presets.h"
#include "tests/plan_of.h"
#include "tests/truth/reference_cases.h"
#include "truth/reference.h"
#include "truth/slab_check.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace squint {
namespace {

using namespace cases;

constexpr double kLsb8 = 1.0 / 255;

/// Matter of one scalar and one opacity, `voxels` deep along y, seen along y: one pixel.
Scene even_scene(double alpha, const std::string& preset = "default") {
    Scene scene = plain_scene();
    scene.transfer_function.points = {{0, 1, 1, 1, alpha}};
    scene.precision.preset = preset;
    scene.sampling.termination = 0;
    return scene;
}
std::shared_ptr<const Volume> even_volume(std::int64_t voxels, int bits = 8) {
    return volume_of({2, voxels, 2}, bits, Vec3(1), [](const Index3&) { return 128; });
}
std::array<double, 4> middle_pixel(const Plan& plan) {
    const Image image = render(plan).image;
    const auto width = static_cast<std::size_t>(plan.camera.width);
    const std::size_t at = static_cast<std::size_t>(plan.camera.height / 2) * width + width / 2;
    std::array<double, 4> pixel{};
    for (std::size_t c = 0; c < 4; ++c) pixel[c] = image.channels[c].values[at];
    return pixel;
}
std::array<double, 4> pixel_along(Scene scene, const std::shared_ptr<const Volume>& volume,
                                  const Vec3& direction) {
    look(scene, *volume, direction);
    return middle_pixel(make_plan(scene, volume));
}

// ------------------------------------------------------------------------------------------ `real`

// One program, one truth: a traced ray ends where the picture's does, in whatever words the preset has.
TEST(Judged, ATracedRayEndsInThePicturesColour) {
    const auto volume = volume_of({9, 9, 9}, 8, Vec3(1), [](const Index3& p) { return p.dot(p); });
    for (const char* preset : {"default", "squeeze", "wide", "real", "float32"})
        for (const NamedMethod& method : every_method()) {
            Scene scene = plain_scene(7, 7);
            scene.transfer_function.points = {{0, 1, 0.5, 0, 0}, {150, 0.2, 1, 0, 0.4}, {255, 0, 0, 1, 0.9}};
            scene.classification.method = method.method, scene.classification.order = method.order;
            scene.precision.preset = preset;
            const Plan plan = make_plan(scene, volume);
            const Image image = render(plan).image;
            for (const int at : {10, 24, 31}) {
                const RayTrace trace = trace_ray(plan, at % 7, at / 7);
                for (std::size_t c = 0; c < 4; ++c)
                    EXPECT_EQ(static_cast<float>(trace.color[c]),
                              image.channels[c].values[static_cast<std::size_t>(at)])
                        << preset << ' ' << method.name;
            }
        }
}

// A field that rises by less than any word's last bit from sample to sample: a slab of such a span has the
// opacity and the colour of its point, not of the format's last bit.
TEST(Judged, WithoutRoundingASpanBelowEveryFormatKeepsItsOpacity) {
    const auto volume =
        volume_of({3, 65, 3}, 8, Vec3(1), [](const Index3& p) { return p.y == 64 ? 101 : 100; });
    for (const NamedMethod& method : every_method()) {
        Scene scene = plain_scene();
        scene.transfer_function.points = {{0, 1, 0.5, 0, 0}, {99, 0, 0.5, 1, 0.1}, {200, 1, 0, 0.5, 0.5}};
        scene.classification.method = method.method, scene.classification.order = method.order;
        scene.precision.preset = "real", scene.sampling.termination = 0;
        // 64 steps of 1, then one of a millionth: with the cell before the last at a slant of 1e-6.
        for (const double slant : {1e-4, 1e-6, 1e-9, 1e-12}) {
            scene.clip.low = Vec3(0, 63 - 8, 0), scene.clip.high = Vec3(2, 63 + slant, 2);
            scene.sampling.step = 1 + slant / 8;
            look(scene, *volume, Vec3(0, 1, 0));
            const Plan plan = make_plan(scene, volume);
            const std::array<double, 4> real = middle_pixel(plan), exact = reference_pixel(plan, 0, 0);
            for (std::size_t c = 0; c < 4; ++c)
                EXPECT_NEAR(real[c], exact[c], 0.5 * kLsb8) << method.name << ' ' << slant;
        }
    }
}

// ------------------------------------------------------------------- what is judged slab by slab

// A ramp of one level in 200 world units, looked at over half a level in 100 steps and more: an opacity that is
// off by next to nothing in one slab, always to the same side.
TEST(Judged, OpacityConvergesWhereExtinctionBendsWithinAnEntry) {
    const auto volume = volume_of({256, 2, 2}, 8, Vec3(200, 1, 1), [](const Index3& p) { return p.x; });
    for (const double last : {0.19, 0.35})
        for (const NamedMethod& method : every_method())
            for (const char* preset : {"default", "real"})
                for (const double step : {1.0, 0.5, 0.25}) {
                    Scene scene = plain_scene();
                    scene.transfer_function.points = {
                        {0, 1, 0.5, 0.25, 0}, {100, 1, 0.5, 0.25, 0}, {200, 1, 0.5, 0.25, last}};
                    scene.clip.low = Vec3(20000, 0, 0), scene.clip.high = Vec3(20100, 1, 1);
                    scene.sampling.step = step, scene.sampling.termination = 0;
                    scene.precision.preset = preset;
                    scene.classification.method = method.method, scene.classification.order = method.order;
                    scene.camera.eye = Vec3(-20, 0.5, 0.5), scene.camera.center = Vec3(100, 0.5, 0.5);
                    scene.camera.height = 0.9;
                    // Depth 100 x extinction at level 100.5, halved: a triangle's.
                    const double extinction = -std::log1p(-last / 100);
                    const double exact = 1 - std::exp(-100 * extinction / 4);
                    const double found = middle_pixel(make_plan(scene, volume))[3];
                    // Front samples lag half a step behind on a ramp.
                    const bool lags = method.method == Method::pc;
                    EXPECT_NEAR(found, exact, (lags ? 100 * extinction / 4 * step / 100 : 0) + 0.25 * kLsb8)
                        << method.name << ' ' << preset << ' ' << step << ' ' << last;
                }
}

/// Root mean square of real - reference over the foreground, in LSB8.
double error_of(const Scene& scene, const std::shared_ptr<const Volume>& volume, const Image& reference) {
    const Image real = render(make_plan(scene, volume)).image;
    const std::vector<float>& seen = reference.find("A")->values;
    double squares = 0;
    int count = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
        if (!(seen[i] > 0)) continue;
        for (const char* name : {"R", "G", "B", "A"}) {
            const double error = real.find(name)->values[i] - reference.find(name)->values[i];
            squares += error * error, ++count;
        }
    }
    return 255 * std::sqrt(squares / std::max(count, 1));
}

double approximation_of(const Plan& plan, const std::string& what) {
    for (const Approximation& a : plan.approximations)
        if (a.of == what) return a.lsb8;
    return 0;
}

struct Field {
    const char* name;
    std::shared_ptr<const Volume> volume;
};
std::vector<Field> fields() {
    const auto smooth = [](const Index3& p) {
        const Vec3 at(p);
        return 2048 + 1000 * std::sin(at.x * 0.5) + 900 * std::sin(at.y * 0.4 + 1) * std::cos(at.z * 0.3);
    };
    const auto plateau = [](const Index3& p) {
        return std::min<std::int64_t>(180, 20 * std::min({p.x, p.y, p.z}) + 3);
    };
    const auto noise = [](const Index3& p) {
        const auto hash = static_cast<std::uint32_t>(p.x * 73856093 ^ p.y * 19349663 ^ p.z * 83492791);
        return (hash * 2654435761u) >> 24;
    };
    return {{"smooth, 12 bits", volume_of({14, 14, 14}, 12, Vec3(1), smooth)},
            {"plateau, 8 bits", volume_of({14, 14, 14}, 8, Vec3(1), plateau)},
            {"noise, 8 bits", volume_of({8, 8, 8}, 8, Vec3(1), noise)}};
}

/// Over steps of 1 to 1/64.  PI2D's cells are linear between their nodes, and the plan states what that costs at most.
void expect_convergence(const std::string& field, const std::string& method, Scene scene,
                        const std::shared_ptr<const Volume>& volume, const Image& reference) {
    double before = 1e9;
    for (double step = 1; step >= 1.0 / 64; step /= 2) {
        scene.sampling.step = step;
        const double floor = approximation_of(make_plan(scene, volume), "cells between their nodes");
        const double error = error_of(scene, volume, reference);
        EXPECT_LE(error, std::max(before, floor) + 0.05) << field << ' ' << method << ", step " << step;
        before = error;
    }
}

// In `real`, without opaque entries: half the step is at least as near to the reference, from 1 to 1/64.
TEST(Judged, HalfTheStepIsNoFurtherFromTheReference) {
    constexpr int kSize = 9;
    for (const Field& field : fields()) {
        const double top = field.volume->largest_representable();
        Scene scene = plain_scene(kSize, kSize);
        scene.transfer_function.points = {{0, 0.1, 0.9, 0.4, 0},
                                          {0.3 * top, 0.9, 0.2, 0.1, 0.02},
                                          {0.55 * top, 0.2, 0.4, 1, 0.3},
                                          {top, 1, 1, 0.3, 0.1}};
        scene.precision.preset = "real", scene.sampling.termination = 0;
        const Image reference = render_reference(make_plan(scene, field.volume));
        for (const NamedMethod& method : every_method()) {
            scene.classification.method = method.method, scene.classification.order = method.order;
            if (method.method == Method::pi2d_no_attenuation) continue;  // another function: no attenuation
            expect_convergence(field.name, method.name, scene, field.volume, reference);
        }
    }
}

// The same on real data: the translucent scenes of configs/bench, from the side they are looked at.
TEST(Judged, HalfTheStepIsNoFurtherFromTheReferenceOnVolumesOfData) {
    if (!std::getenv("SQUINT_DATA")) GTEST_SKIP() << "SQUINT_DATA names no folder";
    constexpr int kSize = 5;
    for (const char* name : {"aneurism", "bonsai", "chest", "cthead", "engine"}) {
        Scene scene =
            read_scene(SQUINT_SOURCE_DIR "/configs/bench/" + std::string(name) + "_translucent.toml");
        scene = scene_with(scene, {"image.width=5", "image.height=5", "camera.turntable=1",
                                   "shading.model=none", "precision.preset=real", "sampling.termination=0"});
        const auto volume = test::volume_of(scene);
        const Image reference = render_reference(make_plan(scene, volume));
        ASSERT_EQ(reference.width, kSize);
        for (const NamedMethod& method : every_method()) {
            if (method.order != 1 && method.name != "leg 2") continue;  // higher orders: on the fields above
            if (method.method == Method::pi2d_no_attenuation) continue;
            scene.classification.method = method.method, scene.classification.order = method.order;
            expect_convergence(name, method.name, scene, volume, reference);
        }
    }
}

// ---------------------------------------------------------------- slabs shorter than their table's

// A table for one length keeps the self-attenuation of a full slab: the most that this costs is a step of colour where
// the two attenuations weigh alike, and no other colours cost more.
TEST(Judged, AShorterSlabErrsByWhatIsSaidAndAStepOfColourByAllOfIt) {
    constexpr int kEntries = 257;
    for (const double depth : {0.1, 1.0, 4.0, 16.0})
        for (const double longest : {1.0, 0.25}) {
            double worst = 0;
            for (int step = 8; step < kEntries; step += 8) {
                Entries entries;
                for (int i = 0; i < kEntries; ++i) entries.entry.push_back(matter(depth, i >= step));
                const auto full = preintegration::exact_slab(entries, 0, kEntries - 1, 1);
                for (int part = 1; part < 64; ++part) {
                    const double length = longest * part / 64;
                    const auto own = preintegration::exact_slab(entries, 0, kEntries - 1, length);
                    worst = std::max(worst, std::abs(full.color.x / full.alpha * own.alpha - own.color.x));
                }
            }
            const double said = shorter_slab_error(depth, longest);
            EXPECT_LE(worst, said * 1.0001) << depth << ' ' << longest;
            EXPECT_GE(worst, said * 0.9) << depth << ' ' << longest;  // steps stand 1/32 of a slab apart
        }
}

// One slab a ray, shorter than its table's, at steps up to 50: its opacity is exact and its colour off by no more than
// the plan says, which warns where that is much.  Methods without self-attenuation are held against tables for the
// slab's own length.
TEST(Judged, ShortSlabsOfTablesForOneLengthErrByNoMoreThanThePlanSays) {
    const auto volume = volume_of({2, 9, 2}, 8, Vec3(1),
                                  [](const Index3& p) { return std::min<std::int64_t>(255, 32 * p.y); });
    double most = 0;
    int warned = 0;
    for (const double step : {1.0, 1.5, 5.0, 50.0})
        for (const double end : {0.25, 0.5, 1.25, 4.0})
            for (const Method method :
                 {Method::pi2d, Method::pi2d_no_attenuation, Method::pi1d, Method::pi1d_engel}) {
                if (end >= step) continue;
                Scene scene = plain_scene();
                scene.transfer_function.points = {
                    {0, 0, 1, 0.2, 0.05}, {40, 0, 1, 0.2, 0.4}, {44, 1, 0, 0.6, 0.5}, {255, 1, 0, 0.6, 0.9}};
                scene.precision.preset = "real", scene.sampling.termination = 0, scene.sampling.step = step;
                scene.classification.method = method, scene.classification.table_size = 256;
                scene.clip.low = Vec3(0, 1, 0), scene.clip.high = Vec3(1, 1 + end, 1);
                look(scene, *volume, Vec3(0, 1, 0));
                const Plan plan = make_plan(scene, volume);
                const std::array<double, 4> found = middle_pixel(plan), exact = reference_pixel(plan, 0, 0);
                scene.sampling.step = end;  // a full slab
                const bool attenuates = method == Method::pi2d || method == Method::pi1d;
                const std::array<double, 4> own = attenuates ? exact : middle_pixel(make_plan(scene, volume));
                const double said = approximation_of(plan, kShorterSlabs);
                EXPECT_NEAR(found[3], exact[3], 0.01 * kLsb8) << name_of(method) << ' ' << step << ' ' << end;
                double off = 0;
                for (std::size_t c = 0; c < 3; ++c) off = std::max(off, 255 * std::abs(found[c] - own[c]));
                EXPECT_LE(off, said + 0.01) << name_of(method) << ' ' << step << ' ' << end;
                if (method == Method::pi2d) most = std::max(most, off / said);
                const bool warns =
                    std::any_of(plan.warnings.begin(), plan.warnings.end(),
                                [](const std::string& w) { return w.starts_with("short slabs: pi"); });
                EXPECT_EQ(warns, said > 4) << said;
                warned += warns;
            }
    EXPECT_GT(most, 0.2) << "the figure is far from what is met";
    EXPECT_GT(warned, 0);
    // Methods that ask for no length say nothing.
    Scene scene = plain_scene();
    for (const Method method : {Method::pc, Method::pips, Method::leg}) {
        scene.classification.method = method, scene.sampling.step = 50;
        EXPECT_EQ(approximation_of(make_plan(scene, volume), kShorterSlabs), 0);
    }
}

// --------------------------------------------------------------------- extinction between entries

TEST(Judged, ExtinctionIsLinearBetweenEntriesForEveryMethod) {
    Scene scene = plain_scene();
    scene.transfer_function.points = {{0, 1, 0.5, 0.25, 0}, {255, 1, 0.5, 0.25, 0.9}};
    scene.transfer_function.entries = 2, scene.sampling.termination = 0;
    for (const int steps : {1, 3})
        for (const char* preset : {"default", "wide", "real", "float32"})
            for (const NamedMethod& method : every_method()) {
                scene.classification.method = method.method, scene.classification.order = method.order;
                scene.precision.preset = preset;
                // Kye's and PI2D's tables hold opacities, and the field is one point: classified as such.
                EXPECT_NEAR(pixel_along(scene, even_volume(steps + 1), Vec3(0, 1, 0))[3],
                            1 - std::pow(0.1, 128.0 / 255 * steps), 0.25 * kLsb8)
                    << method.name << ' ' << preset;
            }
}

// ------------------------------------------------------------------------------ ends of projections

// Planes of 10 and 200 at the ends of 100s, along every axis, both ways, at whole and odd steps: an extreme is
// seen wherever it lies.
TEST(Judged, ProjectionsSeeBothEndsOfARay) {
    for (int axis = 0; axis < 3; ++axis)
        for (const bool ahead : {false, true})
            for (const double step : {1.0, 0.5, 0.3, 0.7, 3.0, 20.0}) {
                const auto volume = volume_of({9, 9, 9}, 8, Vec3(1), [&](const Index3& p) {
                    return p[axis] == 8 ? 200 : p[axis] == 0 ? 10 : 100;
                });
                Scene scene = plain_scene();
                scene.transfer_function.points = {{0, 0, 0, 0, 1}, {255, 1, 1, 1, 1}};
                scene.sampling.step = step;
                Vec3 direction(0, 0, 0);
                direction[axis] = ahead ? 1 : -1;
                scene.compositing.mode = CompositingMode::mip;
                EXPECT_NEAR(pixel_along(scene, volume, direction)[0], 200.0 / 255, 0.002) << axis << step;
                scene.compositing.mode = CompositingMode::minip;
                EXPECT_NEAR(pixel_along(scene, volume, direction)[0], 10.0 / 255, 0.002) << axis << step;
                scene.compositing.mode = CompositingMode::mip;
                look(scene, *volume, direction);
                EXPECT_NEAR(reference_pixel(make_plan(scene, volume), 0, 0)[0], 200.0 / 255, 1e-9);
            }
}

// A trapezoid is exact for what is linear, whatever the step and however short the last slab.
TEST(Judged, AverageOfARampIsItsMiddle) {
    const auto volume = volume_of({9, 9, 9}, 8, Vec3(1), [](const Index3& p) { return 30 * p.y; });
    for (const char* preset : {"default", "wide", "real"})
        for (const double step : {1.0, 0.5, 0.3, 0.7, 3.0, 20.0})
            for (const double end : {8.0, 3.0, 0.25}) {
                Scene scene = plain_scene();
                scene.transfer_function.points = {{0, 0, 0, 0, 1}, {255, 1, 1, 1, 1}};
                scene.compositing.mode = CompositingMode::average;
                scene.sampling.step = step, scene.precision.preset = preset;
                scene.clip.low = Vec3(0, 0, 0), scene.clip.high = Vec3(8, end, 8);
                // A last slab's length is rounded to 2^-9 of a step, of 30 levels a voxel.
                EXPECT_NEAR(pixel_along(scene, volume, Vec3(0, 1, 0))[0], 30 * end / 2 / 255, 0.001)
                    << preset << ' ' << step << ' ' << end;
            }
}

// ------------------------------------------------------------------------------------------ labels

TEST(Judged, NearestLabelsAreNeverBetweenTwo) {
    const auto volume = volume_of(
        {7, 7, 7}, 8, Vec3(1), [](const Index3& p) { return (p.x / 2 + p.y / 3 + p.z / 2) % 2 ? 200 : 10; });
    Scene scene = plain_scene(9, 9);
    scene.sampling.interpolation = InterpolationRule::nearest;
    scene.transfer_function.points = {
        {10, 1, 0, 0, 0.5}, {11, 0, 1, 0, 0.9}, {100, 0, 1, 0, 1}, {199, 0, 1, 0, 0.9}, {200, 0, 0, 1, 0.25}};
    for (const NamedMethod& method : every_method()) {
        scene.classification.method = method.method, scene.classification.order = method.order;
        if (method.method != Method::pc) {
            EXPECT_THAT([&] { make_plan(scene, volume); },
                        testing::ThrowsMessage<InputError>(testing::HasSubstr("nearest")))
                << method.name;
            continue;
        }
        const Plan plan = make_plan(scene, volume);
        for (const Image& image : {render(plan).image, render_reference(plan)})
            for (const float green : image.find("G")->values) EXPECT_EQ(green, 0);
    }
    // A plane of voxels half a voxel to either side of a jump: exact by hand.
    scene.image.width = scene.image.height = 1;
    scene.classification.method = Method::pc, scene.precision.preset = "real";
    const auto jump = volume_of({3, 3, 3}, 8, Vec3(1), [](const Index3& p) { return p.y == 0 ? 200 : 10; });
    look(scene, *jump, Vec3(0, 1, 0));
    const std::array<double, 4> pixel = reference_pixel(make_plan(scene, jump), 0, 0);
    const double blue = 1 - std::pow(0.75, 0.5);
    EXPECT_NEAR(pixel[2], blue, 1e-9);
    EXPECT_NEAR(pixel[0], (1 - blue) * (1 - std::pow(0.5, 1.5)), 1e-9);
}

// ----------------------------------------------------------------------- formats follow the scene

TEST(Judged, FaintFogIsNeitherLostNorDoubled) {
    for (const auto& [alpha, voxels] : {std::pair{1.5e-5, 512}, {4.5e-5, 1024}, {5e-5, 4096}, {3e-4, 700}})
        for (const NamedMethod& method : every_method()) {
            Scene scene = even_scene(alpha);
            scene.classification.method = method.method, scene.classification.order = method.order;
            EXPECT_NEAR(pixel_along(scene, even_volume(voxels), Vec3(0, 1, 0))[3],
                        1 - std::pow(1 - alpha, voxels - 1), 0.5 * kLsb8)
                << method.name << ' ' << alpha;
        }
    // Formats that stay as they are told say what they lose.
    Scene scene = even_scene(5e-5, "squeeze");
    look(scene, *even_volume(2000), Vec3(0, 1, 0));
    EXPECT_THAT(make_plan(scene, even_volume(2000)).warnings, testing::Contains(testing::HasSubstr("faint")));
    // Matter that can be seen asks for nothing.
    scene = even_scene(0.05);
    EXPECT_EQ(make_plan(scene, even_volume(64)).specs[Wire::slab_alpha].format.fraction_bits, 15);
}

TEST(Judged, ShortSlabsOfDenseMatterHaveTheirLength) {
    for (const double end : {0.0009, 0.01, 0.3})
        for (const double step : {1.0, 5.0, 50.0})
            for (const double alpha : {0.3, 0.99975586}) {
                Scene scene = even_scene(alpha);
                scene.sampling.step = step;
                scene.clip.low = Vec3(0, 2, 0), scene.clip.high = Vec3(1, 2 + end, 1);
                EXPECT_NEAR(pixel_along(scene, even_volume(9), Vec3(0, 1, 0))[3],
                            1 - std::pow(1 - alpha, end), 0.5 * kLsb8)
                    << end << ' ' << step << ' ' << alpha;
            }
}

TEST(Judged, NarrowHighlightsKeepTheirPower) {
    const auto volume = volume_of({10, 10, 10}, 8, Vec3(1), [](const Index3& p) { return 28 * p.x; });
    for (const double exponent : {32.0, 256.0, 1024.0, 4096.0}) {
        Scene scene = plain_scene();
        scene.transfer_function.points = {{0, 1, 1, 1, 0.3}};
        scene.sampling.termination = 0;
        scene.shading.ka = scene.shading.kd = 0, scene.shading.ks = 1, scene.shading.exponent = exponent;
        scene.lights = {{.direction = Vec3(-1, 0.02, 0)}};
        look(scene, *volume, Vec3(1, 0, 0));
        const std::array<double, 4> pixel = middle_pixel(make_plan(scene, volume));
        const double highlight = std::pow(std::cos(std::atan(0.02) / 2), exponent);
        EXPECT_NEAR(pixel[0], highlight * pixel[3], (exponent <= 64 ? 0.3 : 0.6) * kLsb8) << exponent;
    }
}

TEST(Judged, FewEntriesStillTellLevelsApart) {
    // Two entries for 256 levels: level 3 of matter that is nothing at 0.
    for (const NamedMethod& method : every_method()) {
        Scene scene = plain_scene();
        scene.transfer_function.points = {{0, 1, 1, 1, 0}, {255, 1, 1, 1, 0.9}};
        scene.transfer_function.entries = 2, scene.sampling.termination = 0;
        scene.classification.method = method.method, scene.classification.order = method.order;
        const auto volume = volume_of({2, 65, 2}, 8, Vec3(1), [](const Index3&) { return 3; });
        EXPECT_NEAR(pixel_along(scene, volume, Vec3(0, 1, 0))[3], 1 - std::pow(0.1, 3.0 / 255 * 64),
                    0.5 * kLsb8)
            << method.name;
    }
}

// Data of 12 bits that spans its range keeps 8 fraction bits in its gradient (decision 0017): the plan says what that
// may cost, and it costs no more, where neighbouring voxels differ by a level and more.
TEST(Judged, WeakGradientsThatFormatsDoNotHoldAreSaid) {
    const auto lit = [](int bits, const char* gradient) {
        const double top = std::ldexp(1.0, bits) - 1;
        const auto volume = volume_of({9, 9, 9}, bits, Vec3(1), [&](const Index3& p) {
            const auto level = p.x / 2 + (p.y * p.z) % 2;
            return p == Index3(8, 8, 8) ? top : static_cast<double>(level);
        });
        Scene scene = plain_scene(7, 7);
        scene.transfer_function.points = {{0, 1, 1, 1, 0.9}};
        scene.sampling.termination = 0;
        scene.lights = {{.direction = Vec3(-1, 0.4, 0.2)}};
        scene.clip.high = Vec3(6, 6, 6);
        look(scene, *volume, Vec3(1, 0.1, 0.05));
        if (gradient)
            for (const Wire wire : {Wire::gradient, Wire::gradient_lerp})
                scene.precision.override_[static_cast<std::size_t>(wire)] = gradient;
        return make_plan(scene, volume);
    };
    const auto says = testing::Contains(testing::HasSubstr("weak gradients"));
    const Plan plan = lit(12, nullptr);
    EXPECT_THAT(plan.warnings, says);
    EXPECT_THAT(lit(8, nullptr).warnings, testing::Not(says));
    EXPECT_THAT(lit(12, "s12.12").warnings, testing::Not(says));
    Plan exact = plan;
    set_active(exact, {});
    const Image words = render(plan).image, real = render(exact).image;
    double worst = 0;
    for (const char* name : {"R", "G", "B"})
        for (std::size_t i = 0; i < 49; ++i)
            worst =
                std::max(worst, 255.0 * std::abs(words.find(name)->values[i] - real.find(name)->values[i]));
    EXPECT_GT(worst, 0.05) << "nothing was lost: nothing was tested";
    EXPECT_LT(worst, 5.9 + 0.5);
}

// -------------------------------------------------------------------------------- light above one

TEST(Judged, LightAboveOneIsSaidAndBelowItColoursStayUnderTheirOpacity) {
    const auto volume = volume_of({9, 9, 9}, 8, Vec3(1), [](const Index3& p) { return 28 * p.x; });
    for (const char* preset : {"default", "squeeze", "eight_bit", "wide", "real"}) {
        Scene scene = plain_scene(5, 5);
        scene.precision.preset = preset;
        scene.lights.assign(8, {.direction = Vec3(-1, 0, 0)});
        look(scene, *volume, Vec3(1, 0, 0));
        scene.shading.ka = 0.5, scene.shading.kd = 0.6, scene.shading.ks = 0.9;
        EXPECT_THAT(make_plan(scene, volume).warnings, testing::Contains(testing::HasSubstr("ka + kd + ks")));
        scene.shading.ka = 0.2, scene.shading.kd = 0.5, scene.shading.ks = 0.3;
        const Plan plan = make_plan(scene, volume);
        EXPECT_THAT(plan.warnings, testing::Not(testing::Contains(testing::HasSubstr("ka + kd + ks"))));
        const Image image = render(plan).image;
        for (const char* name : {"R", "G", "B"})
            for (std::size_t i = 0; i < image.find("A")->values.size(); ++i)
                // A lit colour's wires round once a slab: a last bit of theirs at each of eight.
                EXPECT_LE(image.find(name)->values[i],
                          image.find("A")->values[i] +
                              8 * std::ldexp(1.0, -plan.specs[Wire::lit_color].format.fraction_bits))
                    << preset;
    }
}

// ---------------------------------------------------------------------- formats without a one

// Every wire from no fraction bits on, in every form: a picture of finite numbers, or one line.
TEST(Judged, EveryWireOfFewBitsEndsInAPictureOrALine) {
    const auto volume =
        volume_of({5, 5, 5}, 4, Vec3(1), [](const Index3& p) { return (p.x + p.y * p.z) % 16; });
    int pictures = 0, refused = 0;
    for (const std::string preset : {"default", "eight_bit"})
        for (int form = 0; form < static_cast<int>(std::size(EnumNames<CompositingForm>::names)); ++form)
            for (int w = 0; w < kWires; ++w)
                for (int fraction = 0; fraction < 3; ++fraction)
                    for (const int integer : {0, 1, 4}) {
                        if (integer + fraction == 0) continue;
                        Scene scene = plain_scene(3, 3);
                        scene.precision.preset = preset;
                        scene.compositing.form = static_cast<CompositingForm>(form);
                        scene.transfer_function.points = {
                            {0, 1, 0, 0, 0}, {9, 0, 1, 0, 0.4}, {15, 1, 1, 1, 1}};
                        scene.lights = {{.direction = Vec3(1, 1, 1)}};
                        // Another method each time.
                        const std::vector<NamedMethod> methods = every_method();
                        const NamedMethod& method =
                            methods[static_cast<std::size_t>(form + w + fraction) % methods.size()];
                        scene.classification.method = method.method,
                        scene.classification.order = method.order;
                        scene.classification.table_size = 64;
                        const Spec old = [&] {
                            WireSpecs specs;
                            preset_specs(preset, {}, specs);
                            return specs.spec[static_cast<std::size_t>(w)];
                        }();
                        scene.precision.override_[static_cast<std::size_t>(w)] =
                            to_string(Format{integer, fraction, old.format.is_signed});
                        try {
                            const Image image = render(make_plan(scene, volume)).image;
                            ++pictures;
                            for (const Channel& channel : image.channels)
                                for (const float value : channel.values)
                                    ASSERT_TRUE(std::isfinite(value))
                                        << kWireInfo[static_cast<std::size_t>(w)].name << ' ' << integer
                                        << '.' << fraction << " form " << form << ' ' << method.name;
                        } catch (const InputError& error) {
                            ++refused;
                            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
                        }
                    }
    EXPECT_GT(pictures, 1000);
    EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace squint
