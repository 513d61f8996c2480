#include "pipeline/machines/lanes/screen_mask.h"

#include "core/parallel.h"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace squint::lanes {
namespace {

struct Bounds {
    double low, high;
};

// The range of a quotient by depths above zero.
Bounds over(const Bounds& x, const Bounds& depth) {
    return {x.low / (x.low < 0 ? depth.low : depth.high), x.high / (x.high < 0 ? depth.high : depth.low)};
}

// Marks the rectangles of boxes of one size, given by half their sides in grid space.
class Marker {
  public:
    Marker(const Camera& camera, const Vec3& half, ScreenMask& mask)
        : camera_(camera),
          right_(camera.right, half),
          up_(camera.up, half),
          view_(camera.view, half),
          mask_(mask) {}

    // Returns false for a box that reaches behind the eye.
    bool mark(const Vec3& middle) const {
        const Vec3 from_eye = middle - camera_.eye;
        Bounds across = right_.of(from_eye), above = up_.of(from_eye);
        if (camera_.projection == Projection::perspective) {
            const Bounds depth = view_.of(from_eye);
            if (depth.low < 1e-6 * depth.high || !(depth.low > 0)) return false;
            across = over(across, depth), above = over(above, depth);
        }
        // Solves ray_through (core/rays-inl.h) for column and row; a hundredth of a pixel for roundings.
        constexpr double kMore = 0.01;
        const double pixels = camera_.height / (2 * camera_.half_height);
        const double column = 0.5 * (camera_.width - 1), row = 0.5 * (camera_.height - 1);
        mask_.mark(column + across.low * pixels - kMore, row - above.high * pixels - kMore,
                   column + across.high * pixels + kMore, row - above.low * pixels + kMore);
        return true;
    }

  private:
    // The range of x . axis for x in a box about its middle.
    struct Along {
        Vec3 axis;
        double reach;
        Along(const Vec3& direction, const Vec3& half)
            : axis(direction),
              reach(std::abs(axis.x) * half.x + std::abs(axis.y) * half.y + std::abs(axis.z) * half.z) {}
        Bounds of(const Vec3& middle) const {
            const double at = middle.dot(axis);
            return {at - reach, at + reach};
        }
    };
    const Camera& camera_;
    Along right_, up_, view_;
    ScreenMask& mask_;
};

// Through which faces rays may enter a box [low, high] along an axis, as VisibleSurface::Block says it.
unsigned entered(const Camera& camera, int axis, double low, double high) {
    constexpr unsigned kBefore = 1, kBehind = 2;
    const bool parallel = camera.projection == Projection::orthographic;
    const double towards = camera.view[axis], eye = camera.eye[axis];
    const unsigned faces = parallel ? (towards > 0 ? kBefore : 0) | (towards < 0 ? kBehind : 0)
                                    : (eye > low ? kBehind : 0) | (eye < high ? kBefore : 0);
    return faces << 2 * axis;
}

}  // namespace

ScreenMask::ScreenMask(int width, int height)
    : columns_(static_cast<std::size_t>((width + kSide - 1) / kSide)),
      rows_(static_cast<std::size_t>((height + kSide - 1) / kSide)),
      marks_(columns_ * rows_, 0) {}

void ScreenMask::mark(double left, double top, double right, double bottom) {
    const auto packet = [](double pixel, std::size_t packets) {
        const double last = static_cast<double>(packets) - 1;
        return static_cast<std::size_t>(std::clamp(pixel / kSide, 0.0, last));
    };
    if (right < 0 || bottom < 0 || left >= static_cast<double>(columns_ * kSide) ||
        top >= static_cast<double>(rows_ * kSide))
        return;
    const std::size_t first = packet(left, columns_), last = packet(right, columns_);
    for (std::size_t row = packet(top, rows_); row <= packet(bottom, rows_); ++row)
        for (std::size_t column = first; column <= last; ++column)
            std::atomic_ref(marks_[row * columns_ + column]).store(1, std::memory_order_relaxed);
}

VisibleSurface::VisibleSurface(const EmptySpace& empty)
    : box(empty.box), layers(static_cast<std::size_t>(empty.box.blocks.z)) {
    const Index3 n = box.blocks;
    in_parallel(n.z, [&](std::int64_t z) {
        const auto hidden = [&](std::int64_t x, std::int64_t y, std::int64_t layer) -> unsigned {
            const bool beyond = x < 0 || y < 0 || layer < 0 || x == n.x || y == n.y || layer == n.z;
            return beyond || !empty.visible(box.low.x + x, box.low.y + y, box.low.z + layer);
        };
        for (std::int64_t y = 0; y < n.y; ++y)
            for (std::int64_t x = 0; x < n.x; ++x) {
                if (hidden(x, y, z)) continue;
                const unsigned open = hidden(x - 1, y, z) | hidden(x + 1, y, z) << 1 |
                                      hidden(x, y - 1, z) << 2 | hidden(x, y + 1, z) << 3 |
                                      hidden(x, y, z - 1) << 4 | hidden(x, y, z + 1) << 5;
                if (open == 0) continue;
                Block block;
                block.x = static_cast<std::uint32_t>(x);
                block.y = static_cast<std::uint32_t>(y) & 0x3ffffff, block.open = open & 0x3f;
                layers[static_cast<std::size_t>(z)].push_back(block);
            }
    });
}

std::int64_t VisibleSurface::bytes() const {
    std::size_t bytes = 0;
    for (const auto& layer : layers) bytes += sizeof(std::vector<Block>) + layer.capacity() * sizeof(Block);
    return static_cast<std::int64_t>(bytes);
}

// Why blocks may be left out whose neighbours on the side of the rays are visible: a line that meets such a box,
// widened by what samples are off, leaves it backwards through one of these faces, into that neighbour's widened
// box.  So it goes back, block by block, until one is open where it came in; and that one is marked.
ScreenMask visible_packets(const Plan& plan, const VisibleSurface& surface) {
    ScreenMask mask(plan.camera.width, plan.camera.height);
    const Volume& volume = *plan.volume;
    const Index3 &low = surface.box.low, &n = surface.box.blocks;
    // A sample is off its ray by its rounding, the sum of V's roundings and, for floats, their own errors.
    const double off =
        std::ldexp(1.0, -plan.location.location_fraction) + plan.location.drift() +
        static_cast<double>(std::max({volume.dims.x, volume.dims.y, volume.dims.z})) * 0x1p-20 + 0x1p-10;
    Vec3 half;
    for (int a = 0; a < 3; ++a)  // the only voxel of an axis is one spacing thick
        half[a] = volume.spacing[a] * (0.5 * kBlock + off + (volume.dims[a] == 1 ? 0.5 : 0));
    // Along each axis: the blocks' middles, and where rays enter them.
    std::vector<double> middle[3];
    std::vector<unsigned> faces[3];
    bool eye_is_inside = plan.camera.projection == Projection::perspective;
    for (int a = 0; a < 3; ++a) {
        for (std::int64_t i = 0; i < n[a]; ++i) {
            const double at = (static_cast<double>(low[a] + i) + 0.5) * kBlock;
            middle[a].push_back(volume.grid_from_voxel(Vec3(at))[a]);
            faces[a].push_back(
                entered(plan.camera, a, middle[a].back() - half[a], middle[a].back() + half[a]));
        }
        const double eye = plan.camera.eye[a];
        eye_is_inside =
            eye_is_inside && eye > middle[a].front() - half[a] && eye < middle[a].back() + half[a];
    }
    if (eye_is_inside) return {};  // where rays begin nothing need be open
    const Marker marker(plan.camera, half, mask);
    std::atomic<bool> all{false};
    in_parallel(surface.layers.size(), [&](std::size_t z) {
        for (const VisibleSurface::Block& block : surface.layers[z]) {
            if ((block.open & (faces[0][block.x] | faces[1][block.y] | faces[2][z])) == 0) continue;
            if (!marker.mark(Vec3(middle[0][block.x], middle[1][block.y], middle[2][z]))) all = true;
        }
    });
    return all ? ScreenMask() : mask;
}

}  // namespace squint::lanes
