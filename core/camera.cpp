#include "core/camera.h"

#include "core/error.h"
#include "core/portable_math.h"
#include "core/rays-inl.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace squint {
namespace {

constexpr double kPi = 0x1.921fb54442d18p+1;
constexpr double kParallel = 1e-6;  // sine of the angle below which directions count as parallel

struct SinCos {
    double sin, cos;
};

/// Sine and cosine, exact at multiples of 90 degrees: axis-aligned views get axis-aligned rays.
SinCos sin_cos_degrees(double degrees) {
    const double turn = std::fmod(degrees, 360.0);  // exact
    const double quarter = std::floor(turn / 90 + 0.5);
    const double radians = (turn - 90 * quarter) * (kPi / 180);
    const double s = portable::sin(radians), c = portable::cos(radians);
    switch (static_cast<int>(quarter) & 3) {
        case 0:
            return {s, c};
        case 1:
            return {c, -s};
        case 2:
            return {-s, -c};
        default:
            return {-c, s};
    }
}

double length(const Vec3& v) {
    return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
}
Vec3 unit(const Vec3& v) {
    return v / length(v);
}
bool finite(const Vec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
std::string text(const Vec3& v) {
    return fmt::format("[{}, {}, {}]", v.x, v.y, v.z);
}

/// Turns v about the unit vector axis, counter-clockwise seen from its tip (Rodrigues).
Vec3 rotate(const Vec3& v, const Vec3& axis, const SinCos& angle) {
    return v * angle.cos + axis.cross(v) * angle.sin + axis * (axis.dot(v) * (1 - angle.cos));
}

void check(const CameraSettings& settings, int width, int height) {
    const auto number = [](const char* name, double value) {
        if (!std::isfinite(value)) throw InputError(fmt::format("camera.{}: {} is not finite", name, value));
    };
    const auto vector = [](const char* name, const std::optional<Vec3>& v) {
        if (v && !finite(*v)) throw InputError(fmt::format("camera.{}: {} is not finite", name, text(*v)));
    };
    vector("eye", settings.eye);
    vector("center", settings.center);
    vector("up", settings.up);
    number("azimuth", settings.azimuth);
    number("elevation", settings.elevation);
    number("height", settings.height.value_or(1));
    if (settings.up && length(*settings.up) == 0) throw InputError("camera.up: [0, 0, 0] has no direction");
    if (settings.height && !(*settings.height > 0))
        throw InputError(
            fmt::format("camera.height: {}, allowed is above 0 (world units)", *settings.height));
    if (!(settings.fov_y > 0 && settings.fov_y < 180))
        throw InputError(fmt::format("camera.fov_y: {}, allowed is between 0 and 180 degrees, without these",
                                     settings.fov_y));
    if (settings.turntable < 1)
        throw InputError(
            fmt::format("camera.turntable: {} pictures, allowed is 1 or more", settings.turntable));
    if (width < 1 || height < 1)
        throw InputError(fmt::format("image: {} x {} pixels, allowed is 1 x 1 or more", width, height));
}

/// The distance from center to the farthest corner of the volume: every turn stays within that ball.
double framing_radius(const Volume& volume, const Vec3& center) {
    const Vec3 at = volume.grid_from_world(center);
    const Vec3 low = volume.box_low() - at, high = volume.box_high() - at;
    const Vec3 farthest(std::max(std::fabs(low.x), std::fabs(high.x)),
                        std::max(std::fabs(low.y), std::fabs(high.y)),
                        std::max(std::fabs(low.z), std::fabs(high.z)));
    return std::max(length(farthest),
                    volume.smallest_spacing());  // a volume of one voxel has a picture, too
}

HWY_NAMESPACE::RayOf<double> words_of(const Ray& ray) {
    const Vec3 &o = ray.origin, &d = ray.direction;
    return {{o.x, o.y, o.z}, {d.x, d.y, d.z}};
}

}  // namespace

Camera make_camera(const CameraSettings& settings, const Volume& volume, int width, int height, int frame) {
    check(settings, width, height);
    assert(frame >= 0 && frame < settings.turntable);
    Camera camera;
    camera.projection = settings.projection;
    camera.width = width, camera.height = height;

    // Frame the volume: a ball about the center fits the shorter side of the picture.
    const Vec3 middle = volume.world_from_voxel(Vec3(volume.dims - Index3(1)) * 0.5);
    const Vec3 center = settings.center.value_or(middle);
    const double radius = framing_radius(volume, center);
    const double narrow = std::min(1.0, static_cast<double>(width) / height);
    double distance = 2 * radius;
    if (settings.projection == Projection::perspective) {
        const SinCos half = sin_cos_degrees(settings.fov_y / 2);
        camera.half_height = half.sin / half.cos;
        const double tangent = camera.half_height * narrow;
        distance = radius * std::sqrt(1 + tangent * tangent) / tangent;  // radius / sin(half angle)
    } else {
        camera.half_height = settings.height ? *settings.height / 2 : radius / narrow;
    }

    // From the center to the eye.
    Vec3 offset;
    if (settings.eye) {
        offset = *settings.eye - center;
        if (offset == Vec3(0, 0, 0))
            throw InputError(
                fmt::format("camera: eye and center are both {}, they must differ", text(center)));
    } else {
        const SinCos a = sin_cos_degrees(settings.azimuth), e = sin_cos_degrees(settings.elevation);
        offset = Vec3(e.cos * a.sin, -e.cos * a.cos, e.sin) * distance;
    }

    // The axis of the turntable is `up` as given; the picture's up is its part across the view.
    const Vec3 first_view = unit(Vec3(0) - offset);
    Vec3 up(0, 0, 1);
    if (settings.up) {
        up = unit(*settings.up);
    } else if (length(first_view.cross(up)) < kParallel) {
        up = Vec3(0, 1, 0);
    }
    if (length(first_view.cross(up)) < kParallel)
        throw InputError(
            fmt::format("camera: up {} is parallel to the view {} from eye to center, it must not be",
                        text(settings.up.value_or(up)), text(first_view)));
    if (frame > 0) offset = rotate(offset, up, sin_cos_degrees(360.0 * frame / settings.turntable));

    camera.center = center;
    camera.eye = frame == 0 && settings.eye ? *settings.eye : center + offset;
    camera.view = unit(Vec3(0) - offset);
    camera.right = unit(camera.view.cross(up));
    camera.up = camera.right.cross(camera.view);
    if (!finite(camera.eye) || !finite(camera.view) || !finite(camera.right) ||
        !std::isfinite(camera.half_height))
        throw InputError(
            fmt::format("camera: eye {} and center {} are too far apart", text(camera.eye), text(center)));
    return camera;
}

Camera in_grid_space(const Camera& world, const Volume& volume) {
    Camera camera = world;
    for (Vec3* v : {&camera.eye, &camera.center, &camera.view, &camera.right, &camera.up})
        *v = volume.grid_from_world(*v);
    return camera;
}

Ray Camera::ray(int column, int row) const {
    const auto ray = HWY_NAMESPACE::ray_through<double>(*this, column, row);
    return {Vec3(ray.origin[0], ray.origin[1], ray.origin[2]),
            Vec3(ray.direction[0], ray.direction[1], ray.direction[2])};
}

Interval intersect(const Ray& ray, const Vec3& low, const Vec3& high) {
    const auto inside = HWY_NAMESPACE::intersect_box(words_of(ray), low, high);
    return {inside.first, inside.last};
}
Interval intersect(const Ray& ray, const TurnedBox& box) {
    const auto inside = HWY_NAMESPACE::intersect_turned_box(words_of(ray), box);
    return {inside.first, inside.last};
}
Interval common(const Interval& a, const Interval& b) {
    return {std::max(a.first, b.first), std::min(a.last, b.last)};
}

}  // namespace squint
