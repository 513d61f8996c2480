// The `real` pipeline converges to the reference as its step shrinks (PC, no early termination): at second
// order where rays start and end in air, at first where they end inside matter.
#include "core/procedural.h"
#include "pipeline/render.h"
#include "tests/truth/reference_cases.h"
#include "truth/reference.h"

#include <gtest/gtest.h>

#include <cmath>

namespace squint {
namespace {

using namespace cases;

constexpr int kSize = 20;
constexpr double kSteps[] = {0.6, 0.15, 0.0375};

Scene real_scene() {
    Scene scene = plain_scene(kSize, kSize);
    scene.precision.preset = "real";
    scene.sampling.termination = 0;
    return scene;
}

/// Root mean square over all pixels and channels of real - reference, at one step.
double error_at(Scene scene, const std::shared_ptr<const Volume>& volume, double step) {
    scene.sampling.step = step;
    const Plan plan = make_plan(scene, volume);
    const Image real = render(plan, {}).image, reference = render_reference(plan);
    double squares = 0;
    for (const char* name : {"R", "G", "B", "A"})
        for (std::size_t i = 0; i < kSize * kSize; ++i) {
            const double error = real.find(name)->values[i] - reference.find(name)->values[i];
            squares += error * error;
        }
    return std::sqrt(squares / (4 * kSize * kSize));
}

/// The slope of log error over log step, by least squares over the three steps.
double order_of(const Scene& scene, const std::shared_ptr<const Volume>& volume) {
    const double coarse = error_at(scene, volume, kSteps[0]), fine = error_at(scene, volume, kSteps[2]);
    EXPECT_GT(fine, 1e-7);                // floats hold no less
    return std::log2(coarse / fine) / 4;  // of three points equally apart the middle one has no say
}

std::shared_ptr<const Volume> ball() {
    return std::make_shared<const Volume>(make_procedural(*find_procedural("sphere"), {17, 17, 17}, 12));
}
Scene ball_scene() {
    Scene scene = real_scene();
    scene.transfer_function.points = {{0, 0.2, 0.9, 0.4, 0}, {4095, 1, 0.3, 0.6, 0.4}};
    return scene;
}

// Slab by slab the errors cancel but for terms of h^2; those of h^3 and of kinks, which meet samples at
// changing phases, move the fitted slope: a quarter is allowed.
TEST(ReferenceConvergence, SecondOrderWhereRaysStartAndEndInAir) {
    EXPECT_NEAR(order_of(ball_scene(), ball()), 2, 0.25);
}

TEST(ReferenceConvergence, SecondOrderWhereLightFalls) {
    // A lit slab takes its front's normal, which runs as smoothly as its colour; where N.L changes sign the
    // light bends without a jump.
    Scene scene = ball_scene();
    scene.lights = {{.direction = Vec3(1, -1, 1)}};
    scene.shading.exponent = 4;
    EXPECT_NEAR(order_of(scene, ball()), 2, 0.25);
}

TEST(ReferenceConvergence, FirstOrderWhereRaysEndInMatter) {
    // Clipped through the middle: the last slab's front stands for matter that ends as densest.
    Scene scene = ball_scene();
    scene.camera.azimuth = 0, scene.camera.elevation = 10;
    scene.clip.high = Vec3(16, 8.1, 16);
    EXPECT_NEAR(order_of(scene, ball()), 1, 0.25);
}

}  // namespace
}  // namespace squint
