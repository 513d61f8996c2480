#include "core/camera.h"

#include "core/error.h"
#include "core/rays-inl.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace {

using namespace squint;
using testing::HasSubstr;

Volume box(Index3 dims = {11, 21, 31}, Vec3 spacing = {1, 1, 2}, Vec3 origin = {-3, 4, 5}) {
    Volume volume;
    volume.dims = dims, volume.spacing = spacing, volume.origin = origin;
    return volume;
}
Vec3 low_corner(const Volume& v) {
    return v.origin;
}
Vec3 high_corner(const Volume& v) {
    return v.world_from_voxel(Vec3(v.dims - Index3(1)));
}

/// Where a world point falls in the picture: [-1, 1] across the picture's height, before division by the
/// aspect.
struct Place {
    double across, above, depth;
};
Place project(const Camera& camera, const Vec3& point) {
    const Vec3 from_eye = point - camera.eye;
    const double depth = from_eye.dot(camera.view);
    const double size = camera.half_height * (camera.projection == Projection::perspective ? depth : 1);
    return {from_eye.dot(camera.right) / size, from_eye.dot(camera.up) / size, depth};
}

std::string message(const CameraSettings& settings) {
    try {
        (void)make_camera(settings, box(), 8, 8);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(Camera, TheDefaultFramesTheWholeVolumeInEveryPictureOfATurntable) {
    const Volume volume = box();
    for (const auto projection : {Projection::orthographic, Projection::perspective}) {
        for (const auto& [width, height] : {std::pair{100, 100}, std::pair{300, 100}, std::pair{50, 200}}) {
            for (int frame = 0; frame < 12; ++frame) {
                CameraSettings settings;
                settings.projection = projection, settings.turntable = 12;
                const Camera camera = make_camera(settings, volume, width, height, frame);
                for (int corner = 0; corner < 8; ++corner) {
                    const Vec3 low = low_corner(volume), high = high_corner(volume);
                    const Vec3 point(corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y,
                                     corner & 4 ? high.z : low.z);
                    const Place place = project(camera, point);
                    const double slack = 1e-12;  // a dozen roundings of 2^-53 on numbers near one
                    EXPECT_LE(std::fabs(place.above), 1 + slack);
                    EXPECT_LE(std::fabs(place.across), static_cast<double>(width) / height + slack);
                    EXPECT_GT(place.depth, 0) << "behind the eye";
                }
            }
        }
    }
}

TEST(Camera, AzimuthZeroLooksAlongYAndQuarterTurnsAreExact) {
    CameraSettings settings;
    settings.elevation = 0;
    for (const auto& [azimuth, view, right] :
         {std::tuple{0.0, Vec3(0, 1, 0), Vec3(1, 0, 0)}, std::tuple{90.0, Vec3(-1, 0, 0), Vec3(0, 1, 0)},
          std::tuple{180.0, Vec3(0, -1, 0), Vec3(-1, 0, 0)}, std::tuple{-90.0, Vec3(1, 0, 0), Vec3(0, -1, 0)},
          std::tuple{720.0, Vec3(0, 1, 0), Vec3(1, 0, 0)}}) {
        settings.azimuth = azimuth;
        const Camera camera = make_camera(settings, box(), 8, 8);
        EXPECT_EQ(camera.view, view) << azimuth;
        EXPECT_EQ(camera.right, right) << azimuth;
        EXPECT_EQ(camera.up, Vec3(0, 0, 1)) << azimuth;
    }
}

TEST(Camera, ElevationLiftsTheEyeAndFromTheTopUpIsY) {
    CameraSettings settings;
    settings.azimuth = 0, settings.elevation = 30;
    const Camera lifted = make_camera(settings, box(), 8, 8);
    EXPECT_NEAR(-lifted.view.z, 0.5, 1e-15);  // sin 30 degrees to two roundings
    EXPECT_GT(lifted.eye.z, lifted.center.z);

    settings.elevation = 90;
    const Camera top = make_camera(settings, box(), 8, 8);
    EXPECT_EQ(top.view, Vec3(0, 0, -1));
    EXPECT_EQ(top.up, Vec3(0, 1, 0));
    EXPECT_EQ(top.right, Vec3(1, 0, 0));
}

TEST(Camera, TheTurntableIsATurnOfTheAzimuthAndItsFirstPictureIsNotTurned) {
    CameraSettings settings, turned;
    settings.turntable = 7;
    for (int frame = 0; frame < 7; ++frame) {
        turned.azimuth = settings.azimuth + 360.0 * frame / 7;
        const Camera a = make_camera(settings, box(), 8, 8, frame), b = make_camera(turned, box(), 8, 8);
        // Offsets of 60 units through a dozen roundings: 60 * 12 * 2^-53 is below 1e-13.
        EXPECT_LT((a.eye - b.eye).length(), 1e-13) << frame;
        EXPECT_LT((a.view - b.view).length(), 1e-14) << frame;
        if (frame == 0) {
            EXPECT_EQ(a.eye, b.eye);
            EXPECT_EQ(a.view, b.view);
        }
    }
    settings.eye = Vec3(0.1, 0.2, 0.3);
    EXPECT_EQ(make_camera(settings, box(), 8, 8, 0).eye, *settings.eye);
}

TEST(Camera, TheTurntableKeepsTheDistanceToItsAxis) {
    CameraSettings settings;
    settings.eye = Vec3(50, -20, 70), settings.center = Vec3(1, 2, 3), settings.up = Vec3(1, 2, 3);
    settings.turntable = 5;
    const Camera first = make_camera(settings, box(), 8, 8);
    for (int frame = 1; frame < 5; ++frame) {
        const Camera camera = make_camera(settings, box(), 8, 8, frame);
        const Vec3 a = first.eye - first.center, b = camera.eye - camera.center;
        EXPECT_NEAR(a.length(), b.length(), 1e-12);
        EXPECT_NEAR(a.dot(*settings.up), b.dot(*settings.up), 1e-11);
        EXPECT_GT((a - b).length(), 1);
    }
}

TEST(Camera, RowZeroIsTheTopAndRaysGoThroughPixelCentres) {
    CameraSettings settings;
    settings.azimuth = 0, settings.elevation = 0, settings.height = 4;
    const Camera camera = make_camera(settings, box(), 8, 4);
    const Ray corner = camera.ray(0, 0), other = camera.ray(7, 3);
    EXPECT_EQ(corner.origin - camera.eye, Vec3(-3.5, 0, 1.5));  // pixels of one unit
    EXPECT_EQ(other.origin - camera.eye, Vec3(3.5, 0, -1.5));
    EXPECT_EQ(corner.direction, camera.view);

    settings.projection = Projection::perspective, settings.fov_y = 90;
    const Camera wide = make_camera(settings, box(), 1, 2);
    const Vec3 up = wide.ray(0, 0).direction;  // halfway to the top of a tangent of one
    EXPECT_NEAR(up.z / up.y, 0.5, 1e-15);
    EXPECT_EQ(wide.ray(0, 0).origin, wide.eye);
}

TEST(Camera, TheBasisIsUnitAndOrthogonalForRandomCameras) {
    std::mt19937_64 random(7);
    const auto draw = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 * 200 - 100; };
    for (int i = 0; i < 1000; ++i) {
        CameraSettings settings;
        settings.eye = Vec3(draw(), draw(), draw()), settings.up = Vec3(draw(), draw(), draw());
        settings.projection = i % 2 ? Projection::perspective : Projection::orthographic;
        const Camera camera = make_camera(settings, box(), 8, 8);
        // Each component carries a few roundings of 2^-53, magnified where up is near the view (here by less
        // than 1,000).
        for (const Vec3& v : {camera.view, camera.right, camera.up, camera.ray(3, 5).direction})
            EXPECT_NEAR(v.length(), 1, 1e-12);
        EXPECT_NEAR(camera.view.dot(camera.right), 0, 1e-12);
        EXPECT_NEAR(camera.view.dot(camera.up), 0, 1e-12);
        EXPECT_LT((camera.right - camera.view.cross(camera.up)).length(), 1e-12);
    }
}

TEST(Camera, WhatCannotBeACameraIsRefusedByName) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CameraSettings same, parallel, fov, height, endless, turns, no_up;
    same.eye = same.center = Vec3(1, 2, 3);
    EXPECT_THAT(message(same), HasSubstr("eye and center are both [1, 2, 3]"));
    parallel.eye = Vec3(0, 0, 0), parallel.center = Vec3(1, 1, 1), parallel.up = Vec3(-2, -2, -2);
    EXPECT_THAT(message(parallel),
                AllOf(HasSubstr("up [-2, -2, -2]"), HasSubstr("parallel to the view [0.577")));
    for (const double bad : {0.0, -1.0, 180.0, nan}) {
        fov.fov_y = bad;
        EXPECT_THAT(message(fov), HasSubstr("camera.fov_y")) << bad;
    }
    for (const double bad : {0.0, -1.0, nan}) {
        height.height = bad;
        EXPECT_THAT(message(height), HasSubstr("camera.height")) << bad;
    }
    endless.eye = Vec3(0, nan, 0);
    EXPECT_THAT(message(endless), HasSubstr("camera.eye"));
    endless.eye = Vec3(1.7e308, 0, 0), endless.center = Vec3(-1.7e308, 0, 0);
    EXPECT_THAT(message(endless), HasSubstr("too far apart"));
    turns.turntable = 0;
    EXPECT_THAT(message(turns), HasSubstr("camera.turntable"));
    no_up.up = Vec3(0, 0, 0);
    EXPECT_THAT(message(no_up), HasSubstr("camera.up"));
}

TEST(Camera, AVolumeOfOneVoxelStillHasACamera) {
    const Camera camera = make_camera({}, box({1, 1, 1}), 8, 8);
    EXPECT_GT(camera.half_height, 0);
    EXPECT_GT((camera.eye - camera.center).length(), 0);
}

// The defaults of two projections, as bits: a CPU whose set-up differs is caught here.
TEST(Camera, EveryMachineGetsTheseBits) {
    std::uint64_t hash = 0xcbf29ce484222325u;
    const auto add = [&](const Vec3& v) {
        for (int axis = 0; axis < 3; ++axis)
            hash = (hash ^ std::bit_cast<std::uint64_t>(v[axis])) * 0x100000001b3u;
    };
    for (const auto projection : {Projection::orthographic, Projection::perspective}) {
        for (int frame = 0; frame < 36; ++frame) {
            CameraSettings settings;
            settings.projection = projection, settings.turntable = 36;
            const Camera camera = make_camera(settings, box(), 64, 48, frame);
            for (int pixel = 0; pixel < 48; ++pixel)
                add(camera.ray(pixel, pixel).origin), add(camera.ray(pixel, pixel).direction);
        }
    }
    EXPECT_EQ(hash, 0xacc2e12bf7f056e9u);
}

constexpr double kFar = std::numeric_limits<double>::infinity();
const Vec3 kLow(0, 0, 0), kHigh(2, 3, 4);

TEST(Intersect, ARayThroughTheBoxHasItsChord) {
    const Interval inside = intersect({Vec3(-5, 1, 1), Vec3(1, 0, 0)}, kLow, kHigh);
    EXPECT_EQ(inside.first, 5);
    EXPECT_EQ(inside.last, 7);
    const Interval back = intersect({Vec3(7, 1, 1), Vec3(-1, -0.0, 0)}, kLow, kHigh);
    EXPECT_EQ(back.first, 5);
    EXPECT_EQ(back.last, 7);
}

TEST(Intersect, NothingLiesBehindTheEye) {
    const Interval inside = intersect({Vec3(0.5, 1, 1), Vec3(1, 0, 0)}, kLow, kHigh);
    EXPECT_EQ(inside.first, 0);
    EXPECT_EQ(inside.last, 1.5);
    EXPECT_TRUE(intersect({Vec3(3, 1, 1), Vec3(1, 0, 0)}, kLow, kHigh).empty());
    EXPECT_TRUE(intersect({Vec3(2, 1, 1), Vec3(1, 0, 0)}, kLow, kHigh).empty())
        << "on the far face, looking out";
}

TEST(Intersect, ARayInAFaceIsInsideAndOneBesideItMisses) {
    for (const double zero : {0.0, -0.0}) {
        for (const double y : {0.0, 3.0}) {
            const Interval inside = intersect({Vec3(-1, y, 4), Vec3(1, zero, zero)}, kLow, kHigh);
            EXPECT_EQ(inside.last - inside.first, 2) << y;
        }
        EXPECT_TRUE(intersect({Vec3(-1, std::nextafter(3, 4), 4), Vec3(1, zero, zero)}, kLow, kHigh).empty());
        EXPECT_TRUE(
            intersect({Vec3(-1, std::nextafter(0, -1), 4), Vec3(1, zero, zero)}, kLow, kHigh).empty());
    }
}

TEST(Intersect, AChordOfZeroIsEmpty) {
    const double diagonal = std::sqrt(0.5);
    EXPECT_TRUE(intersect({Vec3(-1, 1, 2), Vec3(diagonal, -diagonal, 0)}, kLow, kHigh).empty())
        << "touches an edge";
    EXPECT_TRUE(intersect({Vec3(-1, 1, 1), Vec3(1, 0, 0)}, Vec3(1, 0, 0), Vec3(1, 3, 4)).empty())
        << "a flat box";
    EXPECT_FALSE(intersect({Vec3(1, -1, 1), Vec3(0, 1, 0)}, Vec3(1, 0, 0), Vec3(1, 3, 4)).empty())
        << "along a flat box";
}

TEST(Intersect, TheMiddleOfEveryChordLiesInTheBox) {
    std::mt19937_64 random(11);
    const auto draw = [&](double size) {
        return (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5) * size;
    };
    int hits = 0;
    for (int i = 0; i < 100000; ++i) {
        const Vec3 origin(draw(10), draw(10), draw(10)), towards(draw(4) + 1, draw(4) + 1, draw(4) + 1);
        const Ray ray{origin, (towards - origin).normalized()};
        const Interval inside = intersect(ray, kLow, kHigh);
        ASSERT_LT(inside.last, kFar);
        if (inside.empty()) continue;
        ++hits;
        const Vec3 middle = origin + ray.direction * ((inside.first + inside.last) / 2);
        const double slack = 1e-14;  // distances below 16 with a rounding of 2^-50 each
        for (int axis = 0; axis < 3; ++axis) {
            ASSERT_GE(middle[axis], kLow[axis] - slack) << "ray " << i << " of seed 11";
            ASSERT_LE(middle[axis], kHigh[axis] + slack) << "ray " << i << " of seed 11";
        }
        // The ends lie on faces, or at the eye.
        const auto on_face = [&](double t) {
            const Vec3 p = origin + ray.direction * t;
            double nearest = kFar;
            for (int axis = 0; axis < 3; ++axis)
                nearest =
                    std::min({nearest, std::fabs(p[axis] - kLow[axis]), std::fabs(p[axis] - kHigh[axis])});
            return nearest <= slack;
        };
        ASSERT_TRUE(inside.first == 0 || on_face(inside.first)) << "ray " << i << " of seed 11";
        ASSERT_TRUE(on_face(inside.last)) << "ray " << i << " of seed 11";
    }
    EXPECT_GT(hits, 20000);
}

TEST(Divisor, GivesTheQuotient) {
    std::mt19937_64 random(3);
    const auto any = [&] {
        const double mantissa = static_cast<double>(random() >> 11) * 0x1p-53 - 0.5;
        return std::ldexp(mantissa, static_cast<int>(random() % 2100) - 1050);
    };
    for (int i = 0; i < 100'000; ++i) {
        // Powers of two, beyond those whose inverse is a double too, and others.
        const double x = any(), by = i % 2 ? std::ldexp(1.0, i % 2098 - 1074) : std::abs(any());
        if (by == 0) continue;
        const double expected = x / by, found = x / HWY_NAMESPACE::Divisor(by);
        ASSERT_EQ(std::bit_cast<std::uint64_t>(expected), std::bit_cast<std::uint64_t>(found))
            << x << " / " << by;
    }
}

}  // namespace
