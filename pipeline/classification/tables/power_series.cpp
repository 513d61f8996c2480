#include "pipeline/classification/tables/power_series.h"

#include "core/portable_math.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <sstream>

namespace squint::preintegration {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHalfLsb8 = 0.5 / 255;

double largest_extinction(const Entries& entries) {
    double largest = 0;
    for (const Entry& entry : entries.entry) largest = std::max(largest, entry.extinction);
    return largest;
}

double total_depth(const Entries& entries) {
    double total = 0;
    for (int i = 0; i + 1 < entries.size(); ++i)
        total += (entries.entry[i].extinction + entries.entry[i + 1].extinction) / 2;
    return total;
}

}  // namespace

double trusted_depth(int order) {
    constexpr std::array<double, kMostMoments> kTrusted = {kInfinity, 1, 2, 1.5, 3};
    return kTrusted[order - 1];
}

double pole(int order) {
    // 1 - x/2 and 1 - x/2 + x^2/6 - x^3/24: the only real roots.
    if (order == 2) return 2;
    if (order == 4) return 2.785293563405282;
    return kInfinity;
}

Vec3 ColorRange::clamp(const Vec3& color) const {
    return {std::clamp(color.x, low.x, high.x), std::clamp(color.y, low.y, high.y),
            std::clamp(color.z, low.z, high.z)};
}

ColorRange color_range(const Entries& entries) {
    ColorRange range{entries.entry[0].color, entries.entry[0].color};
    for (const Entry& entry : entries.entry) {
        for (int channel = 0; channel < 3; ++channel) {
            range.low[channel] = std::min(range.low[channel], entry.color[channel]);
            range.high[channel] = std::max(range.high[channel], entry.color[channel]);
        }
    }
    return range;
}

Verdict judge_power_series(const Entries& entries, int order, double length) {
    if (order == 1) return {};
    // Slabs one entry long at the far end of the table: (r T)^n with r = length, and a relative error of
    // 2^-53 in each prefix.
    const double scale = length * total_depth(entries);
    const double lost = std::ldexp(std::pow(scale, order), -53);
    std::ostringstream reason;
    if (lost > kHalfLsb8) {
        reason << "PIPS(" << order << ") refused: raw prefixes reach an optical depth of " << scale
               << " and their differences lose " << lost * 255
               << " LSB8; take PIPS(1), or tables that do not cancel";
        return {Verdict::Action::refuse, reason.str()};
    }
    const double deepest = length * largest_extinction(entries);
    if (deepest <= trusted_depth(order)) return {};
    reason << "PIPS(" << order << ") redirected: slabs reach an optical depth of " << deepest << "; ";
    if (pole(order) < kInfinity)
        reason << "its denominator is zero at an optical depth of " << pole(order);
    else
        reason << "its colour tends to the back's";
    reason << ", so slabs deeper than " << trusted_depth(order) << " take PIPS(1)";
    return {Verdict::Action::redirect, reason.str()};
}

Vec3 power_series_color(const Moments& moments, int order) {
    Vec3 numerator{0, 0, 0};
    double denominator = 0;
    double factorial = 1;  // (k - 1)!, with the series' sign
    double power = moments.depth;
    for (int k = 1; k <= order; ++k) {
        numerator += moments.q[k - 1] / factorial;
        denominator += power / (factorial * k);
        factorial *= -k;
        power *= moments.depth;
    }
    return numerator / denominator;
}

SlabValue PowerSeries::slab(double front, double back, double length) const {
    const RealCutSlab cut = cut_at_opaque(entries, prediction, front, back, length);
    if (cut.wall && cut.length == 0) return {cut.wall_color, 1};
    if (cut.front == cut.back) return point_slab(entries, cut.front, cut.length);
    const Moments moments = tables.moments(cut.front, cut.back, cut.length, order);
    if (moments.depth <= 0) return cut.over_wall({});
    const double alpha = -portable::expm1(-moments.depth);
    const Vec3 color = power_series_color(moments, moments.depth <= trusted_depth(order) ? order : 1);
    return cut.over_wall({range.clamp(color) * alpha, alpha});
}

PowerSeries build_power_series(const Entries& entries, int order, Between between) {
    assert(1 <= order && order <= kMostMoments);
    return {entries, predict_opaque(entries), color_range(entries),
            build_prefix_tables(entries, order, between), order};
}

}  // namespace squint::preintegration
