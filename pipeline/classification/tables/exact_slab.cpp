#include "pipeline/classification/tables/exact_slab.h"

#include "core/portable_math.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace squint::preintegration {
namespace {

// Gauss-Legendre, 8 points on [-1, 1]: the positive half (Abramowitz & Stegun, table 25.4).
constexpr std::array<double, 4> kNode = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                         0.9602898564975363};
constexpr std::array<double, 4> kWeight = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                           0.1012285362903763};

constexpr double kSpentDepth = 50;  // e^-50 = 2e-22: what lies behind adds less than rounding does

/// The part of a slab between two neighbouring entries: everything is linear over `length` world units.
struct Stretch {
    double tau0, tau1;
    Vec3 color0, color1;
    double length;

    double depth(double u) const { return length * u * (tau0 + u * (tau1 - tau0) / 2); }
    Vec3 emission(double u) const {
        return (color0 + (color1 - color0) * u) * ((tau0 + u * (tau1 - tau0)) * length);
    }
};

/// The light of that part which reaches its front, with `behind` optical depth in front of it.
Vec3 light(const Stretch& stretch, double behind) {
    const double deepest = std::max(stretch.tau0, stretch.tau1) * stretch.length;
    const int pieces = std::max(1, static_cast<int>(std::ceil(2 * std::min(deepest, 1e6))));
    Vec3 sum{0, 0, 0};
    for (int piece = 0; piece < pieces && behind + stretch.depth(double(piece) / pieces) < kSpentDepth;
         ++piece) {
        for (int k = 0; k < 8; ++k) {
            const double y = k < 4 ? kNode[k] : -kNode[k - 4];
            const double u = (piece + 0.5 + y / 2) / pieces;
            const double weight = kWeight[k % 4] / (2 * pieces);
            sum += stretch.emission(u) * (weight * portable::exp(-behind - stretch.depth(u)));
        }
    }
    return sum;
}

}  // namespace

SlabValue exact_slab(const Entries& entries, double front, double back, double length) {
    front = clamped_coordinate(entries, front);
    back = clamped_coordinate(entries, back);
    if (front == back || opaque_at(entries, front)) return point_slab(entries, front, length);

    // Walk from entry to entry until the back or the first wall.
    const double direction = back > front ? 1 : -1;
    const double rate = length / std::abs(back - front);
    Vec3 color{0, 0, 0};
    double depth = 0;
    for (double here = front; here != back;) {
        const double entry = direction > 0 ? std::floor(here) + 1 : std::ceil(here) - 1;
        const double next = direction > 0 ? std::min(entry, back) : std::max(entry, back);
        const Stretch stretch{extinction_at(entries, here), extinction_at(entries, next),
                              color_at(entries, here), color_at(entries, next), rate * std::abs(next - here)};
        color += light(stretch, depth);
        depth += stretch.depth(1);
        if (opaque_at(entries, next)) return {color + color_at(entries, next) * portable::exp(-depth), 1};
        here = next;
    }
    return {color, -portable::expm1(-depth)};
}

}  // namespace squint::preintegration
