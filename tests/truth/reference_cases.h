// Small volumes and plans whose integrals are known, for the tests of the reference.
#pragma once

#include "core/volume_data.h"
#include "truth/reference.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace squint::cases {

inline std::shared_ptr<const Volume> volume_of(Index3 dims, int bits, const Vec3& spacing,
                                               const std::function<double(const Index3&)>& scalar) {
    Volume v;
    v.dims = dims, v.spacing = spacing, v.type = ScalarType::u16, v.scalar_bits = bits, v.name = "test";
    const auto voxels = std::make_shared<std::vector<std::uint16_t>>();
    for (std::int64_t z = 0; z < dims.z; ++z)
        for (std::int64_t y = 0; y < dims.y; ++y)
            for (std::int64_t x = 0; x < dims.x; ++x)
                voxels->push_back(static_cast<std::uint16_t>(scalar(Index3(x, y, z))));
    v.data = std::shared_ptr<const void>(voxels, voxels->data());
    measure(v);
    return std::make_shared<const Volume>(v);
}

/// A row of scalars along x, two voxels thick, so that a ray along x sees a piecewise linear field.
inline std::shared_ptr<const Volume> row_of(const std::vector<int>& scalars, double spacing, int bits = 8) {
    return volume_of({static_cast<std::int64_t>(scalars.size()), 2, 2}, bits, Vec3(spacing, 1, 1),
                     [&](const Index3& p) { return scalars[static_cast<std::size_t>(p.x)]; });
}

/// White matter of alpha 1/2 a unit, unlit; tests change what they are about.
inline Scene plain_scene(int width = 1, int height = 1) {
    Scene scene;
    scene.transfer_function.points = {{0, 1, 1, 1, 0.5}};
    scene.transfer_function.unit_distance = 1;
    scene.image.width = width, scene.image.height = height;
    return scene;
}

/// Looks along a direction at the volume's middle.
inline void look(Scene& scene, const Volume& v, const Vec3& direction) {
    const Vec3 middle = v.world_from_voxel(Vec3(v.dims - Index3(1)) * 0.5);
    const Vec3 size = v.spacing * Vec3(v.dims);
    scene.camera.center = middle;
    scene.camera.eye = middle - direction.normalized() * (2 * size.length());
}

/// Entries given directly: no alpha and no cap stand between a test and its extinctions.
inline void set_entries(Plan& plan, const std::function<Entry(int)>& entry) {
    for (int i = 0; i < plan.entries.size(); ++i) plan.entries.entry[static_cast<std::size_t>(i)] = entry(i);
}
inline Entry matter(double extinction, double grey) {
    return {Vec3(grey), 0, extinction, false};
}
inline Entry surface(double extinction, double grey) {
    return {Vec3(grey), 1, extinction, true};
}

/// One ray along +x or -x through the middle of a row.
inline std::array<double, 4> along_row(const std::shared_ptr<const Volume>& row, bool ascending,
                                       const std::function<Entry(int)>& entry) {
    Scene scene = plain_scene();
    look(scene, *row, Vec3(ascending ? 1 : -1, 0, 0));
    Plan plan = make_plan(scene, row);
    set_entries(plan, entry);
    return reference_pixel(plan, 0, 0);
}

/// Length of a pixel's ray in the volume's box, by its six planes.
inline double chord_of(const Plan& plan, int column, int row) {
    const Volume& v = *plan.volume;
    const Ray ray = plan.camera.ray(column, row);
    const Vec3 low = v.origin, high = v.world_from_voxel(Vec3(v.dims - Index3(1)));
    double first = 0, last = 1e300;
    for (int a = 0; a < 3; ++a) {
        const double one = (low[a] - ray.origin[a]) / ray.direction[a],
                     other = (high[a] - ray.origin[a]) / ray.direction[a];
        first = std::max(first, std::min(one, other)), last = std::min(last, std::max(one, other));
    }
    return std::max(0.0, last - first);
}

}  // namespace squint::cases
