#include "pipeline/classification/tables/legendre.h"

#include "core/portable_math.h"
#include "pipeline/classification/tables/pieces.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <sstream>

namespace squint::preintegration {
namespace {

constexpr double kSpent = 1.0 / 1024;

/// e^-z i_j(z) by the power series, all terms positive.
double scaled_bessel_series(int j, double z) {
    double first = portable::exp(-z);
    for (int i = 1; i <= j; ++i) first *= z / (2 * i + 1);
    double sum = 0, term = first;
    for (int k = 1; term > sum * 1e-17; ++k) {
        sum += term;
        term *= z * z / 2 / (k * (2.0 * (j + k) + 1));
    }
    return sum;
}

/// e^-z i_j(z) by recurrence from i_0 and i_1, for z large enough that it does not cancel.
double scaled_bessel_recurrence(int j, double z) {
    const double twice = portable::exp(-2 * z);
    double before = (1 - twice) / (2 * z);
    double here = (1 + twice) / (2 * z) - before / z;
    if (j == 0) return before;
    for (int i = 1; i < j; ++i) {
        const double next = before - (2 * i + 1) / z * here;
        before = here;
        here = next;
    }
    return here;
}

}  // namespace

double legendre_weight(int j, double x) {
    if (x <= 0) return 0;
    if (j == 0) return -portable::expm1(-x);
    const double z = x / 2;
    return x * (z < 12 ? scaled_bessel_series(j, z) : scaled_bessel_recurrence(j, z));
}

double legendre_split_depth(int order) {
    constexpr std::array<double, kMostLegendre> kDepth = {0.125, 1.5, 1.5, 2.5};
    return kDepth[order - 1];
}

Vec3 legendre_color(const Moments& moments, int order) {
    const double x = moments.depth;
    std::array<Vec3, kMostLegendre> mean;  // (1/x) int c (t/x)^k dt
    double scale = x;
    for (int k = 0; k < order; ++k, scale *= x) mean[k] = moments.q[k] / scale;
    Vec3 color = mean[0] * legendre_weight(0, x);
    if (order > 1) color -= (mean[1] * 2 - mean[0]) * (3 * legendre_weight(1, x));
    if (order > 2) color += (mean[2] * 6 - mean[1] * 6 + mean[0]) * (5 * legendre_weight(2, x));
    if (order > 3)
        color -= (mean[3] * 20 - mean[2] * 30 + mean[1] * 12 - mean[0]) * (7 * legendre_weight(3, x));
    return color;
}

Moments LegendreSeries::moments(double front, double back, double length) const {
    return disjoint ? disjoint->moments(front, back, length, order)
                    : tables.moments(front, back, length, order);
}

SlabValue LegendreSeries::one_piece(double front, double back, double length) const {
    const Moments m = moments(front, back, length);
    if (m.depth <= 0) return {};
    const double alpha = -portable::expm1(-m.depth);
    // The powers of a nearly transparent slab underflow; its colour is the mean.
    const Vec3 color = m.depth < 1e-30 ? m.q[0] : legendre_color(m, order);
    return {range.clamp(color / alpha) * alpha, alpha};
}

SlabValue LegendreSeries::in_pieces(double front, double back, double length, double depth) const {
    const int pieces = static_cast<int>(std::ceil(std::min(depth / split_depth, 1e9)));
    const double rate = length / std::abs(back - front);
    const double start = tables.depth_at(front), end = tables.depth_at(back);
    const double share = -portable::expm1(-depth / pieces);
    double here = front;
    return composited(pieces, depth, kSpent, [&](int piece) {
        const double target = start + (end - start) * (static_cast<double>(piece) / pieces);
        const double next = piece == pieces ? back : tables.coordinate_at(target);
        // A piece thinner than a rounding of its coordinate is a point of that depth.
        SlabValue value = next == here ? SlabValue{color_at(entries, here / per_entry) * share, share}
                                       : one_piece(here, next, rate * std::abs(next - here));
        here = next;
        return value;
    });
}

SlabValue LegendreSeries::slab(double front, double back, double length) const {
    const RealCutSlab cut = cut_at_opaque(entries, prediction, front, back, length);
    if (cut.wall && cut.length == 0) return {cut.wall_color, 1};
    if (cut.front == cut.back) return point_slab(entries, cut.front, cut.length);
    const double fine_front = cut.front * per_entry, fine_back = cut.back * per_entry;
    const double depth = cut.length / (fine_back - fine_front) * tables.depth_between(fine_front, fine_back);
    return cut.over_wall(depth <= split_depth ? one_piece(fine_front, fine_back, cut.length)
                                              : in_pieces(fine_front, fine_back, cut.length, depth));
}

LegendreSeries build_legendre_series(const Entries& entries, int order, double length, double split_depth) {
    assert(1 <= order && order <= kMostLegendre);
    const double deepest = deepest_entry(entries, length);
    LegendreSeries series{.entries = entries,
                          .prediction = predict_opaque(entries),
                          .range = color_range(entries),
                          .order = order,
                          .split_depth = split_depth > 0 ? split_depth : legendre_split_depth(order),
                          .per_entry = deepest <= 1   ? 1
                                       : deepest <= 8 ? 4
                                                      : 8,
                          .tables = {},
                          .disjoint = {},
                          .reason = {}};
    const Entries fine = series.per_entry == 1 ? entries : subdivided(entries, series.per_entry);
    series.tables = build_prefix_tables(fine, order);
    const double scale = length * series.tables.total_depth();
    const double lost = order == 1 ? 0 : std::ldexp(std::pow(scale, order), -53) * 255;
    if (lost > 1.0 / 16) series.disjoint = build_disjoint_tables(fine, order);
    std::ostringstream reason;
    reason << "LEG(" << order << "): " << series.per_entry << " per entry (the deepest entry is " << deepest
           << " deep), " << (series.disjoint ? "disjoint tables" : "prefix tables")
           << " (prefixes would lose " << lost << " LSB8)";
    series.reason = reason.str();
    return series;
}

}  // namespace squint::preintegration
