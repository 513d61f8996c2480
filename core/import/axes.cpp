#include "core/import/axes.h"

#include "core/error.h"

#include <fmt/format.h>

#include <cmath>

namespace squint {
namespace {

/// The off-axis part of a direction that counts as rounding: under a tenth of a voxel at 8,192 voxels.
constexpr double kObliqueTolerance = 1e-5;
/// The cosine of an angle that counts as a right one: under a tenth of a voxel at 512 voxels.
constexpr double kShearTolerance = 2e-4;
constexpr double kDegrees = 57.29577951308232;

std::string text(const Vec3& v) {
    return fmt::format("({},{},{})", v.x, v.y, v.z);
}

void check_steps(const StoredVolume& stored) {
    for (int axis = 0; axis < 3; ++axis) {
        const Vec3& v = stored.steps[static_cast<std::size_t>(axis)];
        if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z) || v == Vec3(0))
            throw InputError(
                fmt::format("{}: space direction of axis {} is {}, but must be finite and not zero",
                            stored.where, axis, text(v)));
    }
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < a; ++b) {
            const Vec3 u = stored.steps[static_cast<std::size_t>(b)].normalized(),
                       v = stored.steps[static_cast<std::size_t>(a)].normalized();
            const double cosine = u.dot(v);
            if (std::abs(cosine) > kShearTolerance)
                throw InputError(fmt::format(
                    "{}: axes {} and {} meet at {:.4g} degrees, their space directions are {} and {}, "
                    "but only right angles are allowed",
                    stored.where, b, a, std::acos(std::clamp(cosine, -1.0, 1.0)) * kDegrees,
                    text(stored.steps[static_cast<std::size_t>(b)]),
                    text(stored.steps[static_cast<std::size_t>(a)])));
        }
}

/// The file's axis for each world axis: three times, the free pair that agrees most.
void choose_order(StoredVolume& stored) {
    std::array<bool, 3> axis_taken{}, world_taken{};
    for (int round = 0; round < 3; ++round) {
        std::size_t best_axis = 0, best_world = 0;
        double best = -1;
        for (std::size_t axis = 0; axis < 3; ++axis)
            for (std::size_t world = 0; world < 3; ++world) {
                if (axis_taken[axis] || world_taken[world]) continue;
                const double agrees = std::abs(stored.steps[axis].normalized()[static_cast<int>(world)]);
                if (agrees > best) best = agrees, best_axis = axis, best_world = world;
            }
        axis_taken[best_axis] = world_taken[best_world] = true;
        stored.axis[best_world] = static_cast<int>(best_axis);
        stored.flipped[best_world] = stored.steps[best_axis][static_cast<int>(best_world)] < 0;
    }
}

bool along_world_axes(const StoredVolume& stored) {
    for (int world = 0; world < 3; ++world) {
        const Vec3& v = stored.steps[static_cast<std::size_t>(stored.axis[static_cast<std::size_t>(world)])];
        for (int i = 0; i < 3; ++i)
            if (i != world && std::abs(v[i]) > kObliqueTolerance * std::abs(v[world])) return false;
    }
    return true;
}

/// The directions in their new order, right-handed and at exact right angles.
void take_turn(StoredVolume& stored) {
    const auto direction = [&](std::size_t world) {
        const Vec3 v = stored.steps[static_cast<std::size_t>(stored.axis[world])].normalized();
        return stored.flipped[world] ? Vec3(0) - v : v;
    };
    if (direction(0).cross(direction(1)).dot(direction(2)) < 0) stored.flipped[2] = !stored.flipped[2];
    const Vec3 x = direction(0), z = x.cross(direction(1)).normalized();
    stored.turn = {x, z.cross(x), z};
}

}  // namespace

void take_axes(StoredVolume& stored) {
    check_steps(stored);
    choose_order(stored);
    stored.turn = kNoTurn;
    const bool aligned = along_world_axes(stored);
    if (!aligned) take_turn(stored);
    Vec3 first = stored.first_voxel;  // in the grid's own space
    if (!aligned)
        for (std::size_t world = 0; world < 3; ++world)
            first[static_cast<int>(world)] = stored.turn[world].dot(stored.first_voxel);
    for (int world = 0; world < 3; ++world) {
        const auto w = static_cast<std::size_t>(world);
        const Vec3& step = stored.steps[static_cast<std::size_t>(stored.axis[w])];
        stored.spacing[world] = aligned ? std::abs(step[world]) : step.length();
        stored.origin[world] = first[world];
        if (stored.flipped[w])
            stored.origin[world] -=
                stored.spacing[world] * static_cast<double>(stored.dims[stored.axis[w]] - 1);
    }
}

void turn_to_lps(StoredVolume& stored) {
    if (stored.space == kLps) return;
    const bool left = stored.space.starts_with("left-"), right = stored.space.starts_with("right-"),
               front = stored.space.find("-anterior-superior") != std::string::npos;
    if ((!left && !right) || !front)
        throw InputError(
            fmt::format("{}: volume.space is lps, but the file's axes are {}; allowed: "
                        "right-anterior-superior, left-anterior-superior and {}",
                        stored.where, stored.space.empty() ? "not named" : stored.space, kLps));
    const auto turned = [&](const Vec3& v) { return Vec3(left ? v.x : 0 - v.x, 0 - v.y, v.z); };
    for (Vec3& step : stored.steps) step = turned(step);
    stored.first_voxel = turned(stored.first_voxel);
    take_axes(stored);
    stored.space = kLps;
}

}  // namespace squint
