#include "pipeline/machines/lanes/screen_mask.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace squint::lanes {
namespace {

// A box in grid space, by its middle and half its sides.
struct GridBox {
    Vec3 middle, half;
};

struct Bounds {
    double low, high;
};

// The range of x . axis for x in the box minus `from`.
Bounds along(const GridBox& box, const Vec3& from, const Vec3& axis) {
    const double middle = (box.middle - from).dot(axis);
    const double reach =
        std::abs(axis.x) * box.half.x + std::abs(axis.y) * box.half.y + std::abs(axis.z) * box.half.z;
    return {middle - reach, middle + reach};
}
// The range of a quotient by depths above zero.
Bounds over(const Bounds& x, const Bounds& depth) {
    return {x.low / (x.low < 0 ? depth.low : depth.high), x.high / (x.high < 0 ? depth.high : depth.low)};
}

// Marks a box's rectangle on the screen; returns false for a box that reaches behind the eye.
bool mark_box(const Camera& camera, const GridBox& box, ScreenMask& mask) {
    Bounds across = along(box, camera.eye, camera.right), above = along(box, camera.eye, camera.up);
    if (camera.projection == Projection::perspective) {
        const Bounds depth = along(box, camera.eye, camera.view);
        if (depth.low < 1e-6 * depth.high || !(depth.low > 0)) return false;
        across = over(across, depth), above = over(above, depth);
    }
    // Solves ray_through (core/rays-inl.h) for column and row; a hundredth of a pixel for roundings.
    constexpr double kMore = 0.01;
    const double pixels = camera.height / (2 * camera.half_height);
    const double middle_column = 0.5 * (camera.width - 1), middle_row = 0.5 * (camera.height - 1);
    mask.mark(middle_column + across.low * pixels - kMore, middle_row - above.high * pixels - kMore,
              middle_column + across.high * pixels + kMore, middle_row - above.low * pixels + kMore);
    return true;
}

// Whether a visible block has six visible neighbours.
bool is_inside(const EmptySpace& empty, std::int64_t x, std::int64_t y, std::int64_t z) {
    const Index3 &low = empty.box.low, &n = empty.box.blocks;
    if (x == low.x || y == low.y || z == low.z || x == low.x + n.x - 1 || y == low.y + n.y - 1 ||
        z == low.z + n.z - 1)
        return false;
    return empty.at(x - 1, y, z) == 0 && empty.at(x + 1, y, z) == 0 && empty.at(x, y - 1, z) == 0 &&
           empty.at(x, y + 1, z) == 0 && empty.at(x, y, z - 1) == 0 && empty.at(x, y, z + 1) == 0;
}

}  // namespace

ScreenMask::ScreenMask(int width, int height)
    : columns_(static_cast<std::size_t>((width + kSide - 1) / kSide)),
      rows_(static_cast<std::size_t>((height + kSide - 1) / kSide)),
      marks_(columns_ * rows_, 0) {}

void ScreenMask::mark(double left, double top, double right, double bottom) {
    const auto packet = [](double pixel, std::size_t packets) {
        const double last = static_cast<double>(packets) - 1;
        return static_cast<std::size_t>(std::clamp(std::floor(pixel / kSide), 0.0, last));
    };
    if (right < 0 || bottom < 0 || left >= static_cast<double>(columns_ * kSide) ||
        top >= static_cast<double>(rows_ * kSide))
        return;
    const std::size_t first = packet(left, columns_), last = packet(right, columns_);
    for (std::size_t row = packet(top, rows_); row <= packet(bottom, rows_); ++row)
        for (std::size_t column = first; column <= last; ++column)
            std::atomic_ref(marks_[row * columns_ + column]).store(1, std::memory_order_relaxed);
}

ScreenMask visible_packets(const Plan& plan, const EmptySpace& empty) {
    ScreenMask mask(plan.camera.width, plan.camera.height);
    const Volume& volume = *plan.volume;
    const Index3 &low = empty.box.low, &n = empty.box.blocks;
    // A sample is off its ray by its rounding, the sum of V's roundings and, for floats, their own errors.
    const double off =
        std::ldexp(1.0, -plan.location.location_fraction) + plan.location.drift() +
        static_cast<double>(std::max({volume.dims.x, volume.dims.y, volume.dims.z})) * 0x1p-20 + 0x1p-10;
    Vec3 half;
    for (int a = 0; a < 3; ++a)  // the only voxel of an axis is one spacing thick
        half[a] = volume.spacing[a] * (0.5 * kBlock + off + (volume.dims[a] == 1 ? 0.5 : 0));
    std::atomic<bool> all{false};
    tbb::parallel_for(std::int64_t{0}, n.z, [&](std::int64_t k) {
        for (std::int64_t j = 0; j < n.y && !all; ++j)
            for (std::int64_t i = 0; i < n.x; ++i) {
                const Index3 at(low.x + i, low.y + j, low.z + k);
                if (empty.at(at.x, at.y, at.z) != 0 || is_inside(empty, at.x, at.y, at.z)) continue;
                const Vec3 middle = volume.grid_from_voxel(
                    (Vec3(static_cast<double>(at.x), static_cast<double>(at.y), static_cast<double>(at.z)) +
                     Vec3(0.5)) *
                    static_cast<double>(kBlock));
                if (!mark_box(plan.camera, {middle, half}, mask)) all = true;
            }
    });
    return all ? ScreenMask() : mask;
}

}  // namespace squint::lanes
