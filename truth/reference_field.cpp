#include "truth/reference_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace squint::reference {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

std::int64_t last_cell(std::int64_t voxels) {
    return std::max<std::int64_t>(voxels - 2, 0);
}

/// A voxel, its index clamped to the volume.
double voxel(const Volume& v, std::int64_t x, std::int64_t y, std::int64_t z) {
    return v.at(std::clamp<std::int64_t>(x, 0, v.dims.x - 1), std::clamp<std::int64_t>(y, 0, v.dims.y - 1),
                std::clamp<std::int64_t>(z, 0, v.dims.z - 1));
}

Index3 unit_along(int axis) {
    return Index3(axis == 0, axis == 1, axis == 2);
}
double central_difference(const Volume& v, const Index3& p, int axis) {
    const Index3 e = unit_along(axis);
    return voxel(v, p.x + e.x, p.y + e.y, p.z + e.z) - voxel(v, p.x - e.x, p.y - e.y, p.z - e.z);
}
/// (-1 0 1) along the axis, (1 2 1) twice across it.
double sobel_difference(const Volume& v, const Index3& p, int axis) {
    const Index3 e = unit_along((axis + 1) % 3), f = unit_along((axis + 2) % 3);
    double sum = 0;
    for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j)
            sum += (2 - std::abs(i)) * (2 - std::abs(j)) *
                   central_difference(v, p + e * std::int64_t{i} + f * std::int64_t{j}, axis);
    return sum;
}

}  // namespace

Cubic Cubic::stretched(double from, double width) const {
    const double curve = c[2] + 3 * c[3] * from;
    return {{at(from), slope(from) * width, curve * width * width, c[3] * width * width * width}};
}

Turns turns_of(const Cubic& p) {
    const double a = 3 * p.c[3], b = p.c[2], c = p.c[1];  // the slope: a r^2 + 2 b r + c
    Turns turns;
    const double square = b * b - a * c;
    if (!(square > 0)) return turns;
    const double larger = -(b + std::copysign(std::sqrt(square), b));  // no cancellation in this root
    double roots[2] = {a != 0 ? larger / a : kNever, larger != 0 ? c / larger : kNever};
    if (roots[0] > roots[1]) std::swap(roots[0], roots[1]);
    for (const double root : roots)
        if (root > 0 && root < 1) turns.at[static_cast<std::size_t>(turns.count++)] = root;
    return turns;
}

Cubic along(const Corners& v, const Passage& passage) {
    // f = (k + kx x) + y (ky + kxy x) + z ((kz + kxz x) + y (kyz + kxyz x)), each of x, y, z linear in r.
    const double x = passage.from.x, y = passage.from.y, z = passage.from.z;
    const Vec3 d = passage.to - passage.from;
    const double kx = v[1] - v[0], kxy = (v[3] - v[2]) - kx, kxz = (v[5] - v[4]) - kx;
    const double kxyz = ((v[7] - v[6]) - (v[5] - v[4])) - kxy;
    const double ky = v[2] - v[0], kz = v[4] - v[0], kyz = (v[6] - v[4]) - ky;
    const double a0 = v[0] + kx * x, a1 = kx * d.x;
    const double b0 = ky + kxy * x, b1 = kxy * d.x;
    const double c0 = kz + kxz * x, c1 = kxz * d.x;
    const double d0 = kyz + kxyz * x, d1 = kxyz * d.x;
    const double p0 = a0 + y * b0, p1 = a1 + y * b1 + d.y * b0, p2 = d.y * b1;
    const double q0 = c0 + y * d0, q1 = c1 + y * d1 + d.y * d0, q2 = d.y * d1;
    return {{p0 + z * q0, p1 + z * q1 + d.z * q0, p2 + z * q2 + d.z * q1, d.z * q2}};
}

NearestParts nearest_along(const Corners& corners, const Passage& passage) {
    const Vec3 way = passage.to - passage.from;
    std::array<double, 5> cut{0, 1, 1, 1, 1};
    for (int a = 0; a < 3; ++a) {
        const double r = (0.5 - passage.from[a]) / way[a];
        if (r > 0 && r < 1) cut[static_cast<std::size_t>(a) + 1] = r;
    }
    std::sort(cut.begin(), cut.end());
    NearestParts parts;
    for (std::size_t i = 0; i < 4; ++i) {
        if (!(cut[i] < cut[i + 1])) continue;
        NearestPart& part = parts.part[static_cast<std::size_t>(parts.count++)];
        part.passage = passage;
        part.passage.from = passage.from + way * cut[i];
        part.passage.to = passage.from + way * cut[i + 1];
        part.passage.first = passage.first + passage.length * cut[i];
        part.passage.length = passage.length * (cut[i + 1] - cut[i]);
        const Vec3 middle = passage.from + way * ((cut[i] + cut[i + 1]) / 2);
        part.scalar = corners[static_cast<std::size_t>((middle.x >= 0.5) + 2 * (middle.y >= 0.5) +
                                                       4 * (middle.z >= 0.5))];
    }
    return parts;
}

Corners corners_of(const Volume& volume, const Index3& cell) {
    const std::int64_t x1 = std::min(cell.x + 1, volume.dims.x - 1),
                       y1 = std::min(cell.y + 1, volume.dims.y - 1),
                       z1 = std::min(cell.z + 1, volume.dims.z - 1);
    const auto v = [&](std::int64_t x, std::int64_t y, std::int64_t z) -> double {
        return volume.at(x, y, z);
    };
    return {v(cell.x, cell.y, cell.z), v(x1, cell.y, cell.z), v(cell.x, y1, cell.z), v(x1, y1, cell.z),
            v(cell.x, cell.y, z1),     v(x1, cell.y, z1),     v(cell.x, y1, z1),     v(x1, y1, z1)};
}

namespace {

/// difference(voxel, axis): what stands at a cell's corner, `times` the gradient.
template <class F>
std::array<Cubic, 3> interpolated(const Volume& volume, const Passage& passage, double times,
                                  const F& difference) {
    std::array<Cubic, 3> gradient;
    for (int axis = 0; axis < 3; ++axis) {
        const double per_spacing = volume.smallest_spacing() / (volume.spacing[axis] * times);
        Corners corners;
        for (int i = 0; i < 8; ++i)
            corners[static_cast<std::size_t>(i)] =
                difference(passage.cell + Index3(i & 1, i >> 1 & 1, i >> 2), axis) * per_spacing;
        gradient[static_cast<std::size_t>(axis)] = along(corners, passage);
    }
    return gradient;
}

/// The mean of the 5^3 voxels about one; about one beyond the volume, of its outermost's.
double box_mean(const Volume& volume, const Index3& p) {
    const auto inside = [&](std::int64_t i, int axis) {
        return std::clamp<std::int64_t>(i, 0, volume.dims[axis] - 1);
    };
    const Index3 middle(inside(p.x, 0), inside(p.y, 1), inside(p.z, 2));
    double sum = 0;
    for (int z = -2; z <= 2; ++z)
        for (int y = -2; y <= 2; ++y)
            for (int x = -2; x <= 2; ++x) sum += voxel(volume, middle.x + x, middle.y + y, middle.z + z);
    return sum / 125;
}

/// The weights of four points for Hermite's cubic between the middle two, whose slopes are half the differences of
/// their neighbours; and for its slope.
struct SplineWeights {
    std::array<double, 4> value, slope;
};
SplineWeights spline_weights(double t) {
    const auto joined = [](double from, double to, double slope_from, double slope_to) {
        return std::array<double, 4>{-slope_from / 2, from - slope_to / 2, to + slope_from / 2, slope_to / 2};
    };
    const double u = 1 - t;
    return {joined((1 + 2 * t) * u * u, t * t * (3 - 2 * t), t * u * u, -t * t * u),
            joined(-6 * t * u, 6 * t * u, u * (1 - 3 * t), t * (3 * t - 2))};
}

}  // namespace

std::array<Cubic, 3> gradient_along(const Volume& volume, GradientRule rule, const Passage& passage) {
    switch (rule) {
        case GradientRule::analytic:
            return interpolated(volume, passage, 1, [&](Index3 p, int axis) {
                // The edge through this corner has one value at both its ends.
                p[axis] = passage.cell[axis];
                const Index3 ahead = p + unit_along(axis);
                return voxel(volume, ahead.x, ahead.y, ahead.z) - voxel(volume, p.x, p.y, p.z);
            });
        case GradientRule::sobel:
            return interpolated(volume, passage, 32,
                                [&](const Index3& p, int axis) { return sobel_difference(volume, p, axis); });
        default:
            return interpolated(volume, passage, 2, [&](const Index3& p, int axis) {
                return central_difference(volume, p, axis);
            });
    }
}

std::array<Cubic, 3> mean_gradient_along(const Volume& volume, const Passage& passage) {
    return interpolated(volume, passage, 2, [&](const Index3& p, int axis) {
        const Index3 e = unit_along(axis);
        return box_mean(volume, p + e) - box_mean(volume, p - e);
    });
}

SplineGradient::SplineGradient(const Volume& volume, const Passage& passage) : passage_(passage) {
    for (int axis = 0; axis < 3; ++axis)
        per_spacing_[axis] = volume.smallest_spacing() / volume.spacing[axis];
    const Index3& cell = passage.cell;
    for (int i = 0; i < 64; ++i)
        voxel_[static_cast<std::size_t>(i)] =
            voxel(volume, cell.x + (i & 3) - 1, cell.y + (i >> 2 & 3) - 1, cell.z + (i >> 4) - 1);
}

Vec3 SplineGradient::at(double r) const {
    const Vec3 place = passage_.from + (passage_.to - passage_.from) * r;
    const std::array<SplineWeights, 3> weights{spline_weights(place.x), spline_weights(place.y),
                                               spline_weights(place.z)};
    Vec3 gradient{0, 0, 0};
    for (std::size_t i = 0; i < 64; ++i) {
        const std::array<std::size_t, 3> at{i & 3, i >> 2 & 3, i >> 4};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            double product = voxel_[i];
            for (std::size_t a = 0; a < 3; ++a)
                product *= (a == axis ? weights[a].slope : weights[a].value)[at[a]];
            gradient[static_cast<int>(axis)] += product;
        }
    }
    return gradient * per_spacing_;
}

Blocks::Blocks(const Volume& volume, const std::function<bool(double, double)>& visible) {
    constexpr std::int64_t kSide = 1 << kShift;
    for (int a = 0; a < 3; ++a) count_[a] = (last_cell(volume.dims[a]) >> kShift) + 1;
    visible_.resize(static_cast<std::size_t>(count_.x * count_.y * count_.z));
    const auto past = [&](std::int64_t block, int axis) {
        return std::min((block + 1) * kSide + 1, volume.dims[axis]);  // neighbouring cells share voxels
    };
    std::size_t at = 0;
    for (std::int64_t bz = 0; bz < count_.z; ++bz)
        for (std::int64_t by = 0; by < count_.y; ++by)
            for (std::int64_t bx = 0; bx < count_.x; ++bx) {
                std::uint32_t least = std::numeric_limits<std::uint32_t>::max(), greatest = 0;
                for (std::int64_t z = bz * kSide; z < past(bz, 2); ++z)
                    for (std::int64_t y = by * kSide; y < past(by, 1); ++y)
                        for (std::int64_t x = bx * kSide; x < past(bx, 0); ++x) {
                            const std::uint32_t v = volume.at(x, y, z);
                            least = std::min(least, v), greatest = std::max(greatest, v);
                        }
                visible_[at++] = visible(least, greatest);
            }
}

CellWalk::CellWalk(const Volume& volume, const Ray& ray, const Interval& inside, const Blocks* blocks)
    : blocks_(blocks),
      origin_(volume.voxel_from_grid(ray.origin)),
      rate_(ray.direction / volume.spacing),
      here_(inside.first),
      end_(inside.last) {
    for (int a = 0; a < 3; ++a) {
        last_cell_[a] = last_cell(volume.dims[a]);
        if (volume.is_thin(a)) origin_[a] = rate_[a] = 0;  // the field is constant along it
        const double at = origin_[a] + rate_[a] * here_;
        // On a plane between two cells the ray belongs to the cell that it enters.
        const double cell = rate_[a] < 0 ? std::ceil(at) - 1 : std::floor(at);
        cell_[a] = static_cast<std::int64_t>(std::clamp(cell, 0.0, static_cast<double>(last_cell_[a])));
        local_[a] = std::clamp(at - static_cast<double>(cell_[a]), 0.0, 1.0);
        aim(a);
    }
}

/// Where the ray leaves its cell along an axis.
void CellWalk::aim(int axis) {
    const auto a = static_cast<std::size_t>(axis);
    const double plane = static_cast<double>(cell_[axis] + (rate_[axis] > 0));
    crossing_[a] = rate_[axis] == 0 ? kNever : (plane - origin_[axis]) / rate_[axis];
}

void CellWalk::step_over(int axis) {
    const std::int64_t neighbour = cell_[axis] + (rate_[axis] > 0 ? 1 : -1);
    if (neighbour < 0 || neighbour > last_cell_[axis]) {  // only the box's own face is left
        crossing_[static_cast<std::size_t>(axis)] = kNever;
        return;
    }
    cell_[axis] = neighbour;
    local_[axis] = rate_[axis] > 0 ? 0 : 1;
    aim(axis);
}

/// Moves to where the ray leaves the block of its cell.
void CellWalk::leave_block() {
    constexpr std::int64_t kMask = (std::int64_t{1} << Blocks::kShift) - 1;
    double exit = kNever;
    int through = 0;
    Index3 low, high;
    for (int a = 0; a < 3; ++a) {
        low[a] = cell_[a] & ~kMask, high[a] = std::min(cell_[a] | kMask, last_cell_[a]);
        if (rate_[a] == 0) continue;
        const double plane = static_cast<double>(rate_[a] > 0 ? high[a] + 1 : low[a]);
        const double t = (plane - origin_[a]) / rate_[a];
        if (t < exit) exit = t, through = a;
    }
    here_ = std::max(here_, exit);
    if (here_ >= end_) return;
    for (int a = 0; a < 3; ++a) {
        const double at = origin_[a] + rate_[a] * here_;
        const double cell = rate_[a] < 0 ? std::ceil(at) - 1 : std::floor(at);
        cell_[a] = a == through && rate_[a] != 0
                       ? (rate_[a] > 0 ? high[a] : low[a])
                       : static_cast<std::int64_t>(
                             std::clamp(cell, static_cast<double>(low[a]), static_cast<double>(high[a])));
        local_[a] = std::clamp(at - static_cast<double>(cell_[a]), 0.0, 1.0);
        aim(a);
    }
    const std::int64_t before = cell_[through];
    step_over(through);
    if (cell_[through] == before) here_ = end_;
}

bool CellWalk::next(Passage& passage) {
    while (here_ < end_) {
        if (blocks_ && !blocks_->visible(cell_)) {
            leave_block();
            continue;
        }
        const double last = std::min({crossing_[0], crossing_[1], crossing_[2], end_});
        passage.cell = cell_, passage.from = local_;
        passage.first = here_, passage.length = last - here_;
        for (int a = 0; a < 3; ++a) {
            if (crossing_[static_cast<std::size_t>(a)] <= last) {
                passage.to[a] = rate_[a] > 0 ? 1 : 0;
                step_over(a);
            } else {
                const double at = origin_[a] + rate_[a] * last - static_cast<double>(passage.cell[a]);
                passage.to[a] = local_[a] = rate_[a] == 0 ? local_[a] : std::clamp(at, 0.0, 1.0);
            }
        }
        here_ = std::max(here_, last);
        if (passage.length > 0) return true;
    }
    return false;
}

}  // namespace squint::reference
