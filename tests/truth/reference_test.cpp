// The reference against closed forms.  Its promise is 1e-10 a channel (ReferenceOptions::tolerance); where a
// test compares two pictures of its making, 2e-10.
#include "truth/reference.h"

#include "core/procedural.h"
#include "pipeline/render.h"
#include "tests/truth/reference_cases.h"
#include "truth/reference_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace squint {
namespace {

using namespace cases;

constexpr double kPromise = 1e-10;

void expect_pixel(const std::array<double, 4>& pixel, double color, double alpha,
                  double tolerance = kPromise) {
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(pixel[c], color, tolerance);
    EXPECT_NEAR(pixel[3], alpha, tolerance);
}

// ------------------------------------------------------------------------------------ unlit matter

TEST(Reference, AConstantBoxIsBeersLawInWorldUnits) {
    const auto volume = volume_of({9, 7, 5}, 8, Vec3(1, 0.5, 3), [](const Index3&) { return 128; });
    for (const Projection projection : {Projection::orthographic, Projection::perspective}) {
        Scene scene = plain_scene(8, 8);
        scene.camera.projection = projection;
        scene.transfer_function.points = {{0, 0.5, 0.5, 0.5, 0.2}};
        scene.transfer_function.unit_distance = 2;
        const Plan plan = make_plan(scene, volume);
        int met = 0;
        for (int row = 0; row < 8; ++row)
            for (int column = 0; column < 8; ++column) {
                const double chord = chord_of(plan, column, row);
                const double alpha = 1 - std::pow(0.8, chord / 2);
                expect_pixel(reference_pixel(plan, column, row), alpha / 2, alpha);
                met += chord > 0;
            }
        EXPECT_GT(met, 16);
    }
}

TEST(Reference, ARampOfExtinctionAndColourHasErrorFunctions) {
    // docs/math.md#c4: tau = c = s / 255 over lengths 1 and 20, both ways.
    std::vector<int> scalars(256);
    for (int i = 0; i < 256; ++i) scalars[static_cast<std::size_t>(i)] = i;
    const auto entry = [](int i) { return matter(i / 255.0, i / 255.0); };
    const auto thin = row_of(scalars, 1 / 255.0), thick = row_of(scalars, 20 / 255.0);
    expect_pixel(along_row(thin, true, entry), 0.249093732179515, 0.393469340287367);
    expect_pixel(along_row(thin, false, entry), 0.275221540992924, 0.393469340287367);
    expect_pixel(along_row(thick, true, entry), 0.280201990576880, 0.999954600070238);
    expect_pixel(along_row(thick, false, entry), 0.946962419007098, 0.999954600070238);
    const double closed = std::sqrt(std::numbers::pi / 2) * std::erf(std::sqrt(0.5)) - std::exp(-0.5);
    expect_pixel(along_row(row_of({0, 255}, 1), true, entry), closed, 1 - std::exp(-0.5));
}

TEST(Reference, OneDeepEntryInsideOneCellIsNotMissed) {
    // docs/math.md#c4: tau 0.02 but for one entry of 50; red 0.2 -> 1 -> 0.3.
    const auto entry = [](int i) { return i == 127 ? matter(50, 1) : matter(0.02, i < 127 ? 0.2 : 0.3); };
    expect_pixel(along_row(row_of({126, 127}, 1), true, entry), 0.341505114452317, 0.999999999986250);
    expect_pixel(along_row(row_of({126, 127}, 1), false, entry), 0.983658694313697, 0.999999999986250);
    expect_pixel(along_row(row_of({100, 150}, 1), true, entry), 0.464652946104846, 0.639260792999411);
    expect_pixel(along_row(row_of({100, 150}, 1), false, entry), 0.472958203535404, 0.639260792999411);
    expect_pixel(along_row(row_of({0, 255}, 1), true, entry), 0.136396553360834, 0.194264698126520);
}

TEST(Reference, DenseMatterShinesFromItsFirstHundredth) {
    // Depth 1000 in one piece: C = integral of (t / 1) tau exp(-tau t), tau = 1000: 1/1000 to within e^-1000.
    const auto entry = [](int i) { return matter(1000, i / 255.0); };
    expect_pixel(along_row(row_of({0, 255}, 1), true, entry), 0.001, 1);
    expect_pixel(along_row(row_of({255, 0}, 1), true, entry), 0.999, 1);
}

TEST(Reference, ACellsDiagonalIsACubic) {
    // One corner of eight: s = 255 r^3 along the diagonal of length sqrt 3; tau = s / 255: depth sqrt 3 / 4.
    const auto volume =
        volume_of({2, 2, 2}, 8, Vec3(1), [](const Index3& p) { return p.x * p.y * p.z * 255; });
    Scene scene = plain_scene();
    look(scene, *volume, Vec3(1, 1, 1));
    Plan plan = make_plan(scene, volume);
    set_entries(plan, [](int i) { return matter(i / 255.0, 1); });
    const double alpha = 1 - std::exp(-std::sqrt(3.0) / 4);
    expect_pixel(reference_pixel(plan, 0, 0), alpha, alpha);

    // Colour s / 255 too: integral of sqrt 3 r^6 exp(-sqrt 3 r^4 / 4), by its power series.
    set_entries(plan, [](int i) { return matter(i / 255.0, i / 255.0); });
    double color = 0, term = std::sqrt(3.0);
    for (int k = 0; k < 30; ++k) color += term / (4 * k + 7), term *= -std::sqrt(3.0) / 4 / (k + 1);
    expect_pixel(reference_pixel(plan, 0, 0), color, alpha);
}

TEST(Reference, ATurningPointInsideACellIsPassedOnBothSides) {
    // s = 252 r (1 - r), at most 63, along a face's diagonal of length sqrt 2; nothing up to entry 31, depth
    // 1 a unit from 32 on, linear between.  s = 31 at r = (1 -+ a) / 2, s = 32 at (1 -+ b) / 2; the ramp's
    // integral is that of 252 r (1 - r) - 31.
    const auto volume =
        volume_of({2, 2, 2}, 8, Vec3(1), [](const Index3& p) { return p.x * (1 - p.y) * 252; });
    Scene scene = plain_scene();
    look(scene, *volume, Vec3(1, 1, 0));
    Plan plan = make_plan(scene, volume);
    set_entries(plan, [](int i) { return matter(i < 32 ? 0 : 1, 1); });
    const double a = std::sqrt(1 - 31 / 63.0), b = std::sqrt(1 - 32 / 63.0);
    const auto ramp = [](double r) { return 126 * r * r - 84 * r * r * r - 31 * r; };
    const double depth = std::sqrt(2) * (b + 2 * (ramp((1 - b) / 2) - ramp((1 - a) / 2)));
    expect_pixel(reference_pixel(plan, 0, 0), 1 - std::exp(-depth), 1 - std::exp(-depth));

    // An opaque entry at the very top, and one just above it.
    set_entries(plan, [](int i) { return i == 63 ? surface(0, 1) : matter(0, 1); });
    expect_pixel(reference_pixel(plan, 0, 0), 1, 1);
    set_entries(plan, [](int i) { return i == 64 ? surface(0, 1) : matter(0, 1); });
    expect_pixel(reference_pixel(plan, 0, 0), 0, 0);
}

TEST(Reference, ABallSeenThroughVoxelCentresIsTheSumOfItsVoxels) {
    // s = max(0, 100 - |p|^2) around the middle voxel: along a row of voxels the field is linear between
    // them.
    const std::int64_t n = 23, middle = 11;
    const double spacing = 0.25, extinction = 0.002;
    const auto volume = volume_of({n, n, n}, 8, Vec3(spacing), [&](const Index3& p) {
        const Index3 d = p - Index3(middle);
        return std::max<std::int64_t>(0, 100 - d.dot(d));
    });
    Scene scene = plain_scene(static_cast<int>(n), static_cast<int>(n));
    look(scene, *volume, Vec3(0, 1, 0));
    scene.camera.height = static_cast<double>(n) * spacing;  // a pixel a voxel
    Plan plan = make_plan(scene, volume);
    set_entries(plan, [&](int i) { return matter(extinction * i, 0.75); });
    for (int row = 0; row < n; row += 2)
        for (int column = 0; column < n; column += 2) {
            double sum = 0;
            for (std::int64_t y = 0; y < n; ++y) sum += volume->at(column, y, n - 1 - row);
            const double alpha = 1 - std::exp(-extinction * spacing * sum);
            expect_pixel(reference_pixel(plan, column, row), 0.75 * alpha, alpha);
        }
}

TEST(Reference, AnisotropicSpacingStretchesTheRay) {
    const auto ramp = [](double spacing) {
        return volume_of({2, 2, 2}, 8, Vec3(1, 2, spacing), [](const Index3& p) { return p.z * 255; });
    };
    for (const double spacing : {0.5, 5.0}) {
        Scene scene = plain_scene();
        const auto volume = ramp(spacing);
        look(scene, *volume, Vec3(0, 0, 1));
        Plan plan = make_plan(scene, volume);
        set_entries(plan, [](int i) { return matter(i / 255.0, 1); });
        const double alpha = 1 - std::exp(-spacing / 2);
        expect_pixel(reference_pixel(plan, 0, 0), alpha, alpha);
    }
}

// Samples at the middles of n equal parts: wrong by O(1 / n^2).
std::array<double, 4> by_many_samples(const Plan& plan, int n) {
    const Volume& v = *plan.volume;
    const Ray ray = plan.camera.ray(0, 0);
    const Interval inside = intersect(ray, v.origin, v.world_from_voxel(Vec3(v.dims - Index3(1))));
    const double length = (inside.last - inside.first) / n;
    Vec3 color{0, 0, 0};
    double depth = 0;
    for (int k = 0; k < n; ++k) {
        const Vec3 p = v.voxel_from_world(ray.origin + ray.direction * (inside.first + (k + 0.5) * length));
        double scalar = 0;
        for (std::int64_t z = 0; z < v.dims.z; ++z)
            for (std::int64_t y = 0; y < v.dims.y; ++y)
                for (std::int64_t x = 0; x < v.dims.x; ++x) {
                    const auto tent = [](double d) { return std::max(0.0, 1 - std::abs(d)); };
                    scalar += v.at(x, y, z) * tent(p.x - static_cast<double>(x)) *
                              tent(p.y - static_cast<double>(y)) * tent(p.z - static_cast<double>(z));
                }
        const double at = plan.entries.coordinate(scalar);
        const auto i = static_cast<std::size_t>(std::min(std::floor(at), plan.entries.size() - 2.0));
        const Entry &a = plan.entries.entry[i], &b = plan.entries.entry[i + 1];
        const double w = at - static_cast<double>(i);
        const double x = (a.extinction * (1 - w) + b.extinction * w) * length;
        color += (a.color * (1 - w) + b.color * w) * (std::exp(-depth) * -std::expm1(-x));
        depth += x;
    }
    return {color.x, color.y, color.z, -std::expm1(-depth)};
}

TEST(Reference, NoiseThroughARoughFunctionIsTheLimitOfManySamples) {
    std::mt19937 generator(7);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int trial = 0; trial < 4; ++trial) {
        const auto volume = volume_of({3, 4, 3}, 6, Vec3(1, 0.7, 1.3),
                                      [&](const Index3&) { return std::floor(64 * uniform(generator)); });
        Scene scene = plain_scene();
        scene.transfer_function.entries = trial % 2 ? 24 : 0;
        look(scene, *volume, Vec3(uniform(generator) - 0.5, uniform(generator) - 0.5, uniform(generator)));
        Plan plan = make_plan(scene, volume);
        set_entries(plan, [&](int) {
            return Entry{Vec3(uniform(generator), uniform(generator), uniform(generator)), 0,
                         uniform(generator), false};
        });
        // Samples are h = 4 / 60000 apart at most.  Where the slope of the integrand jumps by J they err by
        // up to J h^2 / 8: here J < 100, and some hundred jumps of either sign add up as a root: 5.6e-7.
        const auto many = by_many_samples(plan, 60000), pixel = reference_pixel(plan, 0, 0);
        for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(pixel[c], many[c], 5.6e-7) << "trial " << trial;
    }
}

TEST(Reference, HalvingTheToleranceChangesNothingBeyondIt) {
    const auto volume =
        std::make_shared<const Volume>(make_procedural(*find_procedural("phantom"), {24, 24, 24}, 12));
    for (const bool lit : {false, true}) {
        Scene scene = built_in_scene();
        if (!lit) scene.lights.clear();
        scene.camera = {};
        scene.image.width = scene.image.height = 6;
        const Plan plan = make_plan(scene, volume);
        for (int i = 0; i < 36; i += 5)
            for (const double tolerance : {1e-5, 1e-8, 1e-10}) {
                const auto whole = reference_pixel(plan, i % 6, i / 6, tolerance),
                           half = reference_pixel(plan, i % 6, i / 6, tolerance / 2);
                for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(whole[c], half[c], 1.5 * tolerance);
            }
    }
}

// --------------------------------------------------------------------------------- opaque surfaces

TEST(Reference, ARayEndsExactlyWhereItFirstMeetsAnOpaqueEntry) {
    // Black fog, tau 0.4, and opaque entries of colour at 77 (1) and 100 (0.5): colour runs up to it along
    // the last entry's length h, so C = e^-(tau (t - h)) (1 - e^-(tau h) (1 + tau h)) / (tau h) + e^-(tau t).
    const double tau = 0.4, spacing = 3, h = spacing / 200;
    const auto entry = [&](int i) {
        return i == 77 ? surface(tau, 1) : i == 100 ? surface(tau, 0.5) : matter(tau, 0);
    };
    const auto up_to = [&](double t, double color) {
        const double x = tau * h;
        return color * (std::exp(-tau * (t - h)) * (1 - std::exp(-x) * (1 + x)) / x + std::exp(-tau * t));
    };
    const auto row = row_of({0, 200}, spacing);
    expect_pixel(along_row(row, true, entry), up_to(77 * h, 1), 1);
    expect_pixel(along_row(row, false, entry), up_to(100 * h, 0.5), 1);
}

TEST(Reference, AFieldThatOnlyTouchesAnOpaqueEntryMeetsIt) {
    const auto entry = [](int i) { return i == 77 ? surface(0, 0.5) : matter(0, 0.5); };
    expect_pixel(along_row(row_of({0, 77, 0}, 1), true, entry), 0.5, 1);
    expect_pixel(along_row(row_of({200, 77, 200}, 1), true, entry), 0.5, 1);
    expect_pixel(along_row(row_of({0, 77, 77, 0}, 1), false, entry), 0.5, 1);
    expect_pixel(along_row(row_of({0, 76, 76, 0}, 1), false, entry), 0, 0);
}

TEST(Reference, BetweenTwoOpaqueEntriesARayEndsAtOnce) {
    // It starts at 77 1/2 (a plain voxel between two, by entries two levels apart), halfway in colour too.
    const auto row = row_of({155, 155, 0}, 1);
    Scene scene = plain_scene();
    scene.transfer_function.entries = 256;
    look(scene, *row, Vec3(1, 0, 0));
    Plan plan = make_plan(scene, row);
    plan.entries.scalars_per_entry = 2;
    set_entries(plan, [](int i) {
        return i == 77 ? surface(1, 0.2) : i == 78 ? surface(1, 0.6) : matter(1, 0);
    });
    expect_pixel(reference_pixel(plan, 0, 0), 0.4, 1);
    set_entries(plan, [](int i) { return i == 78 ? surface(0, 0.6) : matter(0, 0); });
    expect_pixel(reference_pixel(plan, 0, 0), 0, 0);
}

// ------------------------------------------------------------------------------------------- light

/// A field a x + b y + c z, far from whose faces every estimator gives its exact gradient.
std::shared_ptr<const Volume> slope(const Vec3& spacing) {
    return volume_of({8, 8, 8}, 10, spacing,
                     [](const Index3& p) { return 100 + 20 * p.x + 30 * p.y + 40 * p.z; });
}

TEST(Reference, LightFallsOnTheWorldSpaceNormal) {
    const Vec3 spacing(1, 2, 0.5);
    const auto volume = slope(spacing);
    const Vec3 gradient = Vec3(20, 30, 40) / spacing;
    const Vec3 normal = gradient * (-1 / gradient.length());
    const Vec3 view = Vec3(1, 2, 3).normalized();
    for (const ShadingModel model : {ShadingModel::phong, ShadingModel::blinn_phong})
        for (const GradientRule rule : {GradientRule::central, GradientRule::central_samples,
                                        GradientRule::analytic, GradientRule::sobel})
            for (const bool two_sided : {false, true}) {
                Scene scene = plain_scene();
                scene.transfer_function.points = {{0, 0.5, 0.5, 0.5, 0.2}};
                scene.clip.low = spacing, scene.clip.high = spacing * 6;
                scene.lights = {{.direction = Vec3(-1, -0.5, -2), .color = Vec3(0.5, 0.25, 1)},
                                {.direction = Vec3(2, 1, 1), .color = Vec3(0.25, 0.5, 0.5)}};
                scene.shading = {.model = model,
                                 .gradient = rule,
                                 .ka = 0.1,
                                 .kd = 0.5,
                                 .ks = 0.4,
                                 .exponent = 8,
                                 .two_sided = two_sided};
                look(scene, *volume, view);
                const Plan plan = make_plan(scene, volume);

                Vec3 diffuse(0), specular(0);
                for (const Light& light : scene.lights) {
                    const Vec3 l = light.direction.normalized();
                    const Vec3 half = (l - view).normalized();
                    double facing = normal.dot(l);
                    double shine = normal.dot(half);
                    if (model == ShadingModel::phong)
                        shine = (normal * (2 * facing) - l).dot(-view) * (facing > 0 || two_sided);
                    if (two_sided) facing = std::abs(facing);
                    if (two_sided && model == ShadingModel::blinn_phong) shine = std::abs(shine);
                    diffuse += light.color * std::max(0.0, facing);
                    specular += light.color * std::pow(std::max(0.0, shine), 8);
                }
                const auto pixel = reference_pixel(plan, 0, 0);
                EXPECT_GT(pixel[3], 0.1);
                for (int c = 0; c < 3; ++c)
                    EXPECT_NEAR(
                        pixel[static_cast<std::size_t>(c)],
                        pixel[3] * (0.5 * (0.1 + 0.5 * std::min(1.0, diffuse[c])) + 0.4 * specular[c]),
                        kPromise);
            }
}

TEST(Reference, ThePowerRulesAreTheirFormulas) {
    const auto volume = slope(Vec3(1));
    const Vec3 normal = Vec3(-20, -30, -40).normalized();
    Scene scene = plain_scene();
    scene.clip.low = Vec3(1), scene.clip.high = Vec3(6);
    look(scene, *volume, Vec3(1, 2, 2));
    scene.lights = {{.headlight = true}};
    const double dot = normal.dot(-Vec3(1, 2, 2).normalized());  // N.H, and N.L
    struct Rule {
        PowerRule rule;
        double exponent, power;
    };
    for (const Rule& r :
         {Rule{PowerRule::squaring, 64, std::pow(dot, 64)}, Rule{PowerRule::table, 19.5, std::pow(dot, 19.5)},
          Rule{PowerRule::parabola, 20, 1 - 10.5 * (1 - dot)}}) {
        scene.shading = {.ka = 0, .kd = 0.25, .ks = 0.5, .exponent = r.exponent, .power = r.rule};
        const auto pixel = reference_pixel(make_plan(scene, volume), 0, 0);
        EXPECT_NEAR(pixel[0], pixel[3] * (0.25 * dot + 0.5 * r.power), kPromise);
    }
}

TEST(Reference, AConeHasTheSlopeOfItsEnergyOrThePapers) {
    const auto volume = slope(Vec3(1));
    Scene scene = plain_scene();
    scene.clip.low = Vec3(1), scene.clip.high = Vec3(6);
    look(scene, *volume, Vec3(1, 2, 2));
    scene.lights = {{.headlight = true}};
    const double dot = Vec3(20, 30, 40).normalized().dot(Vec3(1, 2, 2).normalized());  // N.H, and N.L
    scene.shading = {.model = ShadingModel::cone, .ka = 0, .kd = 0.25, .ks = 0.5, .exponent = 13};
    auto pixel = reference_pixel(make_plan(scene, volume), 0, 0);
    EXPECT_NEAR(pixel[0], pixel[3] * (0.25 * dot + 0.5 * (1 - 7 * (1 - dot))), kPromise);
    scene.shading.cone_slope = ConeSlope::paper;
    pixel = reference_pixel(make_plan(scene, volume), 0, 0);
    EXPECT_NEAR(pixel[0], pixel[3] * (0.25 * dot + 0.5 * (1 - 13 * (1 - dot))), kPromise);
}

TEST(Reference, GoochGoesFromCoolToWarmAndNoFartherThanTheOpacity) {
    const auto volume = slope(Vec3(1));
    Scene scene = plain_scene();
    scene.clip.low = Vec3(1), scene.clip.high = Vec3(6);
    scene.transfer_function.points = {{0, 0.5, 0.25, 1, 0.2}};
    look(scene, *volume, Vec3(1, 2, 2));
    scene.lights = {{.headlight = true}};
    const double dot = Vec3(20, 30, 40).normalized().dot(Vec3(1, 2, 2).normalized());
    scene.shading.model = ShadingModel::gooch, scene.shading.kd = 0.5;
    const Vec3 color(0.5, 0.25, 1), cool = color * 0.1 + Vec3(0, 0, 0.55),
                                    warm = color * 0.3 + Vec3(0.3, 0.3, 0);
    for (const CoolSide side : {CoolSide::shadow, CoolSide::light}) {
        scene.shading.cool_side = side;
        const double to_warm = (side == CoolSide::shadow ? 1 + dot : 1 - dot) / 2;
        const auto pixel = reference_pixel(make_plan(scene, volume), 0, 0);
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(pixel[static_cast<std::size_t>(c)],
                        pixel[3] * (warm[c] * to_warm + cool[c] * (1 - to_warm)), kPromise);
    }
    scene.shading.cool = scene.shading.warm = Vec3(1), scene.shading.kd = 1;
    const auto pixel = reference_pixel(make_plan(scene, volume), 0, 0);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(pixel[c], pixel[3], kPromise);
}

TEST(Reference, AFlatFieldGetsAmbientLightOnly) {
    const auto volume = volume_of({4, 4, 4}, 8, Vec3(1), [](const Index3&) { return 9; });
    for (const ShadingModel model : {ShadingModel::phong, ShadingModel::blinn_phong}) {
        Scene scene = plain_scene();
        scene.lights = {{.direction = Vec3(0.3, 1, 0.1)}};
        scene.shading.model = model, scene.shading.ka = 0.25;
        look(scene, *volume, Vec3(0.1, 1, 0.2));
        const auto pixel = reference_pixel(make_plan(scene, volume), 0, 0);
        EXPECT_NEAR(pixel[0], 0.25 * pixel[3], kPromise);
    }
}

// The gradient of slope() is (20, 15, 80) levels a unit at this spacing, and a unit is two smallest spacings.
TEST(Reference, LightFadesInUpToTheFloorOfGradients) {
    const Vec3 spacing(1, 2, 0.5);
    const auto volume = slope(spacing);
    const double length = Vec3(20, 15, 80).length() / 2;
    Scene scene = plain_scene();
    scene.clip.low = spacing, scene.clip.high = spacing * 6;
    scene.lights = {{.direction = Vec3(-20, -15, -80)}};
    scene.shading = {.ka = 0.25, .kd = 0.5, .ks = 0.125, .exponent = 1};
    for (const GradientRule rule : {GradientRule::central, GradientRule::central_samples,
                                    GradientRule::analytic, GradientRule::sobel}) {
        scene.shading.gradient = rule;
        look(scene, *volume, Vec3(20, 15, 80));  // N, L and H agree
        for (const double floor : {0.0, length / 2, length * (1 - 1e-12), 2 * length, 8 * length}) {
            scene.shading.gradient_floor = floor;
            const auto pixel = reference_pixel(make_plan(scene, volume), 0, 0);
            const double certain = floor > length ? length / floor : 1;
            EXPECT_NEAR(pixel[0], pixel[3] * (0.25 + certain * 0.625), kPromise) << floor;
        }
    }
}

TEST(Reference, AGradientOfARoundingIsNone) {
    const auto volume = slope(Vec3(1));  // scalars 100 to 730
    Scene scene = plain_scene();
    scene.lights = {{.direction = Vec3(0, 0, 1)}};
    scene.shading = {.ka = 0.25, .kd = 0.5, .ks = 0.125};
    const Plan plan = make_plan(scene, volume);
    const reference::RayLight light(scene, *volume, plan.camera, Vec3(0, 0, -1));
    EXPECT_EQ(light(Vec3(0, 0, -630 * 0x1.01p-40)).diffuse.x, 0.75);
    for (const double length : {0.0, 1e-13, 630 * 0x0.ffp-40}) {
        EXPECT_EQ(light(Vec3(0, 0, -length)).diffuse.x, 0.25);
        EXPECT_EQ(light(Vec3(0, 0, -length)).specular.x, 0);
    }
}

TEST(Reference, AtAFaceTheDifferenceIsTakenToTheVoxelItself) {
    // Along x the field bends at its first voxel alone: half the slope there, all of it from the next on.
    const auto volume = volume_of({5, 2, 2}, 8, Vec3(1), [](const Index3& p) { return 40 * p.x + 60 * p.y; });
    Scene scene = plain_scene();
    scene.lights = {{.direction = Vec3(-1, 0, 0)}};
    scene.shading = {.ka = 0, .kd = 1, .ks = 0};
    scene.clip.high = Vec3(1e-6, 1, 1);
    look(scene, *volume, Vec3(1, 0, 0));
    auto pixel = reference_pixel(make_plan(scene, volume), 0, 0);
    // Central differences: (40 / 2, 60 / 2): N.L = 20 / sqrt(20^2 + 30^2), to the clip's 1e-6.
    EXPECT_NEAR(pixel[0] / pixel[3], 20 / std::sqrt(400.0 + 900), 1e-6);
    scene.shading.gradient = GradientRule::analytic;
    pixel = reference_pixel(make_plan(scene, volume), 0, 0);
    EXPECT_NEAR(pixel[0] / pixel[3], 40 / std::sqrt(1600.0 + 3600), 1e-6);
}

// ------------------------------------------------------------------------------ modes and pictures

TEST(Reference, ModesTakeTheFieldsOwnExtremesAndMean) {
    // s = 255 (x (1 - y)) along a diagonal of the cell's face: 255 r (1 - r) has its greatest, 63.75, inside.
    const auto volume =
        volume_of({2, 2, 2}, 8, Vec3(1), [](const Index3& p) { return p.x * (1 - p.y) * 255; });
    Scene scene = plain_scene();
    look(scene, *volume, Vec3(1, 1, 0));
    struct Mode {
        CompositingMode mode;
        double scalar;
    };
    for (const Mode& m : {Mode{CompositingMode::mip, 63.75}, Mode{CompositingMode::minip, 0},
                          Mode{CompositingMode::average, 42.5}}) {
        scene.compositing.mode = m.mode;
        scene.transfer_function.unit_distance = 3;
        Plan plan = make_plan(scene, volume);
        set_entries(plan, [](int i) { return matter(i / 255.0, i / 255.0); });
        const double alpha = 1 - std::exp(-m.scalar / 255 * 3);
        expect_pixel(reference_pixel(plan, 0, 0), m.scalar / 255 * alpha, alpha);
    }
}

TEST(Reference, APictureHoldsItsPixelsWhateverIsSkippedAndHoweverManyThreads) {
    // Ten-voxel empty blocks around two lumps; clipped; seen from outside and from within.
    const auto volume = volume_of({21, 17, 14}, 8, Vec3(1, 1.5, 0.8), [](const Index3& p) {
        const Index3 a = p - Index3(4, 5, 6), b = p - Index3(15, 12, 9);
        return std::max<std::int64_t>({0, 200 - 25 * a.dot(a), 120 - 9 * b.dot(b)});
    });
    Scene scene = plain_scene(37, 21);
    scene.camera.projection = Projection::perspective;
    scene.lights = {{.direction = Vec3(1, -1, 2)}};
    scene.transfer_function.points = {{20, 1, 0, 0, 0}, {90, 0, 1, 0, 0.4}, {200, 0, 0, 1, 1}};
    scene.clip.low = Vec3(2.3, 0, 1), scene.clip.high = Vec3(19, 20.1, 11);
    for (const bool within : {false, true}) {
        if (within) scene.camera.eye = Vec3(10, 12, 5), scene.camera.fov_y = 90;
        const Plan plan = make_plan(scene, volume);
        const Image one = render_reference(plan, {.threads = 1}),
                    two = render_reference(plan, {.threads = 2});
        int seen = 0;
        for (int row = 0; row < 21; ++row)
            for (int column = 0; column < 37; ++column) {
                const auto pixel = reference_pixel(plan, column, row);
                const auto at = static_cast<std::size_t>(row * 37 + column);
                for (std::size_t c = 0; c < 4; ++c) {
                    EXPECT_NEAR(one.channels[c].values[at], pixel[c], 1e-7);  // half a float's last bit, 6e-8
                    EXPECT_EQ(one.channels[c].values[at], two.channels[c].values[at]);
                }
                seen += pixel[3] > 0.01;
            }
        EXPECT_GT(seen, 20);
    }
}

TEST(Reference, ThinVolumesAndRaysAlongCellFacesWork) {
    for (const Index3& dims : {Index3(1, 5, 5), Index3(5, 1, 5), Index3(5, 5, 1), Index3(5, 5, 5)}) {
        const auto volume = volume_of(dims, 8, Vec3(1), [](const Index3&) { return 7; });
        for (int axis = 0; axis < 3; ++axis) {
            Scene scene = plain_scene(5, 5);
            Vec3 direction(0);
            direction[axis] = 1;
            look(scene, *volume, direction);
            scene.camera.height = 5;  // a pixel a voxel
            // One voxel is one spacing thick: half to each side (docs/conventions.md#space-and-rays).
            const double length = dims[axis] == 1 ? 1 : static_cast<double>(dims[axis] - 1);
            const auto pixel = reference_pixel(make_plan(scene, volume), 2, 2);
            EXPECT_NEAR(pixel[3], 1 - std::pow(0.5, length), kPromise);
        }
    }
}

TEST(Reference, StopsWhenCancelled) {
    const auto volume = slope(Vec3(1));
    const Plan plan = make_plan(plain_scene(64, 64), volume);
    const std::atomic<bool> cancelled{true};
    EXPECT_THROW(render_reference(plan, {.cancelled = &cancelled}), Cancelled);
}

}  // namespace
}  // namespace squint
