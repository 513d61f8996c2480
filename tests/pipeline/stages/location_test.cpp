// Stage 1's hard cases: rays along faces and edges, long rays, chords that are and are not whole steps, and
// locations at the end of what a format holds.
#include "pipeline/plan/plan.h"

#include "core/procedural.h"
#include "fixedpoint/words.h"
#include "pipeline/render.h"
#include "pipeline/stages/location-inl.h"
#include "pipeline/stages/ray_setup-inl.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;
using Word = std::int64_t;

/// A location stage for a volume of `voxels` a side, as the plan builds it.
LocationStage stage_of(int integer_bits, int location_fraction, int direction_fraction, std::int64_t voxels,
                       Rounding rounding = Rounding::rnd_conv) {
    LocationStage s;
    s.location = {{integer_bits, location_fraction, false}, rounding, Overflow::sat};
    s.direction = {{1, direction_fraction, true}, rounding, Overflow::sat};
    s.location_fraction = location_fraction, s.direction_fraction = direction_fraction;
    s.common_fraction = std::max(location_fraction, direction_fraction);
    s.to_location = Rescale(s.common_fraction, s.location);
    s.to_weight = Rescale(location_fraction, Spec{{1, location_fraction, false}});
    for (std::size_t a = 0; a < 3; ++a)
        s.limit[a] = (voxels - 1) << location_fraction, s.last_cell[a] = std::max<Word>(voxels - 2, 0);
    return s;
}

RayWords<Word> ray_of(const LocationStage& s, const Vec3& first, const Vec3& step, Word last_index = -1) {
    RayWords<Word> ray{};
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        ray.first[a] = quantise_real(first[axis], s.location);
        ray.step[a] = quantise_real(step[axis], s.direction);
    }
    ray.last_index = last_index;
    return ray;
}

double real_location(const LocationStage& s, const RayWords<Word>& ray, Word k, int axis) {
    return to_real(locate(s, ray, k, axis), s.location.format);
}

std::shared_ptr<const Volume> cube(std::int64_t voxels) {
    return std::make_shared<Volume>(
        make_procedural(*find_procedural("ramp"), Index3(voxels, voxels, voxels), 8));
}

/// An orthographic view of a cube of 64 cells a side, one step a cell unless told.
Scene cube_scene(const Vec3& from, double step = 1) {
    Scene scene = built_in_scene();
    scene.transfer_function = {};
    scene.transfer_function.points = {{0, 1, 1, 1, 0.5}};
    scene.transfer_function.unit_distance = 1;
    scene.lights.clear();
    scene.camera.center = Vec3(32, 32, 32);
    scene.camera.eye = Vec3(32, 32, 32) + from * 100;
    scene.camera.height = 64;
    scene.image.width = scene.image.height = 8;
    scene.sampling.step = step;
    return scene;
}

// C1.1
TEST(SampleLocation, QuarterStepsAlongAnAxisNeverDrift) {
    const LocationStage s = stage_of(11, 12, 12, 2048);
    const auto ray = ray_of(s, Vec3(7, 9, 0), Vec3(0, 0, 0.25));
    for (Word k = 0; k <= 8188; ++k) {
        ASSERT_EQ(real_location(s, ray, k, 2), static_cast<double>(k) / 4);
        ASSERT_EQ(locate(s, ray, k, 0), 7 << 12);
    }
}

// C1.2: V is rounded once, by half a last bit at most, and every sample carries k times that error.
TEST(SampleLocation, DriftIsAtMostHalfALastBitOfTheDirectionAStep) {
    std::mt19937_64 random(1);
    const auto component = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
    for (const int fraction : {12, 16, 20, 24}) {
        const LocationStage s = stage_of(12, 24, fraction, 4096);
        double most = 0;
        for (int i = 0; i < 400; ++i) {
            Vec3 v = Vec3(std::abs(component()), std::abs(component()), std::abs(component()) + 0.01);
            v = v.normalized() * 0.25;
            const auto ray = ray_of(s, Vec3(1, 1, 1), v);
            for (int axis = 0; axis < 3; ++axis)
                most = std::max(most, std::abs(real_location(s, ray, 8192, axis) - (1 + 8192 * v[axis])));
        }
        // Half a last bit of the direction 8192 times, half a last bit of the location once.
        EXPECT_LE(most, 8192 * std::ldexp(1.0, -fraction - 1) + 0x1p-25) << fraction;
        EXPECT_GE(most, 0.9 * 8192 * std::ldexp(1.0, -fraction - 1)) << fraction;  // the bound is met
    }
}

// C1.2: forming P0 + kV exactly is never worse than adding V in the location's own bits.
TEST(SampleLocation, OneMultiplicationIsNeverWorseThanAddingAgainAndAgain) {
    std::mt19937_64 random(2);
    const LocationStage exact = stage_of(11, 12, 24, 2048), added = stage_of(11, 12, 12, 2048);
    for (int i = 0; i < 200; ++i) {
        const double v = static_cast<double>(random() >> 11) * 0x1p-54;  // up to half a voxel
        const auto multiplied = ray_of(exact, Vec3(3, 3, 3), Vec3(v, v, v));
        const auto accumulated = ray_of(added, Vec3(3, 3, 3), Vec3(v, v, v));
        for (Word k = 0; k < 4000; k += 37) {
            const double truth = 3 + static_cast<double>(k) * v;
            // Both end in one rounding to 2^-12: half a last bit may stand either way.
            ASSERT_LE(std::abs(real_location(exact, multiplied, k, 0) - truth),
                      std::abs(real_location(added, accumulated, k, 0) - truth) + 0x1p-12);
        }
    }
}

TEST(SampleLocation, AddingAgainAndAgainIsPZeroPlusKVOfTheSameBits) {
    const LocationStage s = stage_of(11, 12, 12, 2048);
    const auto ray = ray_of(s, Vec3(1.3, 0.7, 2.9), Vec3(0.1, 0.21, 0.34));
    for (std::size_t a = 0; a < 3; ++a) {
        Word sum = ray.first[a];
        for (Word k = 0; k < 3000; ++k, sum += ray.step[a])
            ASSERT_EQ(locate(s, ray, k, static_cast<int>(a)), sum);
    }
}

// C1.3
TEST(SampleLocation, TheFarFaceIsTheLastCellWithAWeightOfOne) {
    const LocationStage s = stage_of(6, 12, 12, 64);
    const auto near = cell_position<Word>(s, {0, 0, 0});
    const auto far = cell_position<Word>(s, {63 << 12, 63 << 12, 63 << 12});
    for (std::size_t a = 0; a < 3; ++a) {
        EXPECT_EQ(near.cell[a], 0);
        EXPECT_EQ(near.weight[a], 0);
        EXPECT_EQ(far.cell[a], 62);
        EXPECT_EQ(far.weight[a], 1 << 12);
    }
}

TEST(SampleLocation, RaysInAFaceAreSampledNotLost) {
    // Eight columns of pixels 64/7 apart: the outermost stand in the faces x = 0 and x = 64 to the last bit.
    Scene scene = cube_scene(Vec3(0, -1, 0));
    scene.camera.height = 64.0 * 8 / 7;
    const Plan plan = make_plan(scene, cube(65));
    const Image image = render(plan).image;
    for (const int column : {0, 7})
        for (int row = 0; row < 8; ++row) {
            const RaySetup ray = plan.set_up(column, row);
            EXPECT_TRUE(ray.first.x == 0 || ray.first.x == 64) << ray.first.x;
            EXPECT_EQ(ray.slabs, 64);
            EXPECT_GT(image.find("A")->values[static_cast<std::size_t>(row * 8 + column)], 0.9f);
        }
}

// C1.4
TEST(SampleLocation, ARayThroughAnEdgeOrACornerAloneMissesTheVolume) {
    const Vec3 low(0, 0, 0), high(63, 63, 63);
    for (const Vec3& corner : {Vec3(0, 0, 0), Vec3(63, 63, 0)}) {
        const Ray diagonal{corner - Vec3(10, -10, 0), Vec3(1, -1, 0).normalized()};
        const Interval inside = intersect(diagonal, low, high);
        EXPECT_TRUE(inside.empty() || inside.last - inside.first < 1e-9);
    }
    const Ray exact{Vec3(-1, 1, 5), Vec3(1, -1, 0)};  // no rounding anywhere: the edge x = y = 0
    EXPECT_TRUE(intersect(exact, low, high).empty());
}

// C1.5
TEST(SampleLocation, ADirectionComponentOfZeroDividesNothing) {
    const Vec3 low(0, 0, 0), high(63, 63, 63);
    for (const double zero : {0.0, -0.0}) {
        const Interval inside = intersect(Ray{Vec3(5, 5, -10), Vec3(zero, zero, 1)}, low, high);
        EXPECT_EQ(inside.first, 10);
        EXPECT_EQ(inside.last, 73);
        EXPECT_TRUE(intersect(Ray{Vec3(-5, 5, -10), Vec3(zero, zero, 1)}, low, high).empty());
        EXPECT_TRUE(intersect(Ray{Vec3(5, 64, -10), Vec3(zero, zero, 1)}, low, high).empty());
    }
}

// C1.6
TEST(SampleLocation, AReversedRayOfWholeStepsTakesTheSameSamplesBackwards) {
    const Plan there = make_plan(cube_scene(Vec3(0, -1, 0)), cube(65));
    const Plan back = make_plan(cube_scene(Vec3(0, 1, 0)), cube(65));
    for (int row = 0; row < 8; ++row)
        for (int column = 0; column < 8; ++column) {
            const RaySetup a = there.set_up(column, row), b = back.set_up(7 - column, row);
            ASSERT_EQ(a.slabs, 64);
            ASSERT_EQ(b.slabs, 64);
            const auto first = [](const Plan& plan, const RaySetup& ray) {
                return ray_of(plan.location, ray.first, ray.step);
            };
            const auto forwards = first(there, a), backwards = first(back, b);
            for (Word k = 0; k <= 64; ++k)
                for (int axis = 0; axis < 3; ++axis)
                    ASSERT_EQ(locate(there.location, forwards, k, axis),
                              locate(back.location, backwards, 64 - k, axis));
        }
}

// C1.7
TEST(SampleLocation, AWholeChordHasWholeSlabsAndOneShorterHasAShortOne) {
    for (const Vec3& from : {Vec3(0, -1, 0), Vec3(0, 1, 0), Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0, 0, -1)}) {
        const Plan plan = make_plan(cube_scene(from, 0.25), cube(65));
        const RaySetup ray = plan.set_up(3, 3);
        EXPECT_EQ(ray.slabs, 256);
        EXPECT_EQ(ray.last_length, 1);
    }
    Scene scene = cube_scene(Vec3(0, -1, 0), 0.25);
    scene.clip.high = Vec3(64, 64 - 0x1p-12, 64);
    const RaySetup ray = make_plan(scene, cube(65)).set_up(3, 3);
    EXPECT_EQ(ray.slabs, 256);
    EXPECT_EQ(ray.last_length, 1 - 4 * 0x1p-12);
}

// C1.8
TEST(SampleLocation, NeighbouringRaysOfAWideViewDifferInElevenBits) {
    Scene scene = cube_scene(Vec3(0, -1, 0));
    scene.camera.projection = Projection::perspective;
    scene.camera.fov_y = 60;
    scene.image.width = 1, scene.image.height = 1024;
    const auto distinct = [&](int fraction) {
        const Plan plan = make_plan(scene, cube(65));
        std::set<std::array<Word, 3>> seen;
        for (int row = 0; row < 1024; ++row) {
            const Ray ray = plan.camera.ray(0, row);
            const Spec spec{{1, fraction, true}, Rounding::rnd_conv, Overflow::sat};
            seen.insert({quantise_real(ray.direction.x, spec), quantise_real(ray.direction.y, spec),
                         quantise_real(ray.direction.z, spec)});
        }
        return seen.size();
    };
    EXPECT_EQ(distinct(11), 1024u);
    EXPECT_LT(distinct(9), 1024u);  // neighbours fall together: 2^-9 is 0.11 degrees, and rays are 0.06 apart
}

// C1.9
TEST(SampleLocation, TheLastOf2048SlicesIsReachedAndNothingWrapsBehindIt) {
    const LocationStage s = stage_of(11, 12, 12, 2048);
    const auto ray = ray_of(s, Vec3(0, 0, 2046.5), Vec3(0, 0, 0.25));
    EXPECT_EQ(real_location(s, ray, 2, 2), 2047);
    for (Word k = 2; k < 40; ++k) {  // 2048.0 is no 11.F number: the face is kept
        ASSERT_EQ(real_location(s, ray, k, 2), 2047);
        const auto position = cell_position<Word>(s, {0, 0, locate(s, ray, k, 2)});
        ASSERT_EQ(position.cell[2], 2046);
        ASSERT_EQ(position.weight[2], 1 << 12);
    }
    const auto outwards = ray_of(s, Vec3(0, 0, 0.5), Vec3(0, 0, -0.25));
    for (Word k = 2; k < 40; ++k) ASSERT_EQ(locate(s, outwards, k, 2), 0);
}

// C1.10
TEST(SampleLocation, AStepLongerThanTheVolumeIsOneSlab) {
    const Plan plan = make_plan(cube_scene(Vec3(0, -1, 0), 1000), cube(65));
    const RaySetup ray = plan.set_up(3, 3);
    EXPECT_EQ(ray.slabs, 1);
    EXPECT_EQ(ray.last_length, 64.0 / 1000);
    EXPECT_EQ(ray.last_index, 1);
}

TEST(SampleLocation, CellAndWeightGiveTheLocationBack) {
    const LocationStage s = stage_of(4, 6, 6, 12);
    for (Word location = 0; location <= s.limit[0]; ++location) {
        const auto position = cell_position<Word>(s, {location, location, location});
        ASSERT_EQ((position.cell[0] << 6) + position.weight[0], location);
        ASSERT_LE(position.weight[0], 64);
        ASSERT_LE(position.cell[0], 10);
    }
}

/// A view of a box of uneven sides and spacings in any formats.
Plan random_plan(std::mt19937_64& random) {
    const auto between = [&](int low, int high) {
        return low + static_cast<int>(random() % static_cast<std::uint64_t>(high - low + 1));
    };
    const auto real = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    Scene scene = cube_scene(Vec3(real(-1, 1), real(-1, 1), real(-1, 1) + 0.01), real(0.05, 3));
    scene.camera.projection = static_cast<Projection>(random() % 2);
    scene.camera.height.reset();
    scene.image.width = scene.image.height = 4;
    scene.sampling.position = static_cast<PositionRule>(random() % 2);
    const auto wire = [&](Wire w, const Format& format) {
        const Spec spec{format, static_cast<Rounding>(random() % 4), Overflow::sat};
        scene.precision.override_[static_cast<std::size_t>(w)] = to_string(spec);
    };
    wire(Wire::location, {between(6, 8), between(0, 24), false});
    wire(Wire::direction, {between(2, 3), between(4, 24), true});
    const Index3 dims(between(2, 64), between(2, 64), between(2, 64));
    const Vec3 spacing(real(0.4, 2), real(0.4, 2), real(0.4, 2));
    return make_plan(scene,
                     std::make_shared<Volume>(make_procedural(*find_procedural("ramp"), dims, 8, spacing)));
}

// What the plan counts on: P0 + kV stays in its bounds, and the intervals hold what comes of it.
TEST(SampleLocation, IntervalsHoldEveryLocationCellAndWeight) {
    std::mt19937_64 random(3);
    for (int i = 0; i < 400; ++i) {
        const Plan plan = random_plan(random);
        const LocationStage& s = plan.location;
        for (int row = 0; row < 4; ++row)
            for (int column = 0; column < 4; ++column) {
                const RaySetup setup = plan.set_up(column, row);
                const RayWords<Word> ray = ray_words<Word>(plan, setup);
                RayWords<Range> rays{};
                for (std::size_t a = 0; a < 3; ++a) {
                    rays.first[a] = rays.last[a] = {0, s.limit[a]};
                    rays.step[a] = {s.direction.format.smallest(), s.direction.format.largest()};
                }
                const Range samples{0, setup.last_index};
                rays.last_index = samples;
                std::array<Range, 3> locations;
                for (int a = 0; a < 3; ++a)
                    locations[static_cast<std::size_t>(a)] = locate(s, rays, samples, a);
                const CellPosition<Range> positions = cell_position(s, locations);
                for (Word k = 0; k < setup.last_index; ++k) {
                    std::array<Word, 3> location;
                    for (std::size_t a = 0; a < 3; ++a) {
                        const Int128 exact =
                            (Int128{ray.first[a]} << (s.common_fraction - s.location_fraction)) +
                            (Int128{k * ray.step[a]} << (s.common_fraction - s.direction_fraction));
                        ASSERT_TRUE(s.low[a] <= exact && exact <= s.high[a])
                            << to_string(s.location) << ", " << to_string(s.direction) << ", sample " << k
                            << " of " << setup.slabs;
                        location[a] = locate(s, ray, k, static_cast<int>(a));
                        ASSERT_TRUE(locations[a].low <= location[a] && location[a] <= locations[a].high);
                    }
                    const CellPosition<Word> position = cell_position(s, location);
                    for (std::size_t a = 0; a < 3; ++a) {
                        ASSERT_TRUE(positions.cell[a].low <= position.cell[a] &&
                                    position.cell[a] <= positions.cell[a].high);
                        ASSERT_TRUE(positions.weight[a].low <= position.weight[a] &&
                                    position.weight[a] <= positions.weight[a].high);
                    }
                }
            }
    }
}

}  // namespace
}  // namespace squint
