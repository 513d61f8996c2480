// PIPS(n): pre-integration by a power series of order n over one-dimensional prefix tables (Lee & Shin 2013,
// equations 17 to 25).
//   K = sum_k (-1)^(k-1) q_(k-1) / (k-1)!  /  sum_k (-1)^(k-1) x^k / k!,  k = 1 .. n;   C = K (1 - e^-x)
// n = 1: K = dX_1 / dT, exact in alpha, is the mean colour weighted by tau: it does not tell front from back.
// Even orders divide by zero at x = 2 (n = 2) and x = 2.79 (n = 4); beyond their trusted depth all orders are
// worse than order 1 (docs/math.md#b2).
#pragma once

#include "pipeline/classification/tables/opaque_prediction.h"
#include "pipeline/classification/tables/prefix_tables.h"

#include <string>

namespace squint::preintegration {

/// What a builder decided about a method, in one line for `squint plan`.
struct Verdict {
    enum class Action { use, redirect, refuse } action = Action::use;
    std::string reason;
};

/// The depth up to which order n is better than order 1: infinite for 1, then 1, 2, 1.5, 3.  2 and 4: half
/// the way to their poles; 3 and 5: where the worst profile of docs/math.md#b2 crosses order 1.
double trusted_depth(int order);

/// The smallest optical depth at which order n divides by zero: 2 for 2, 2.79 for 4; infinite for odd orders.
double pole(int order);

/// The smallest and largest colour of the entries in each channel: K lies between them.
struct ColorRange {
    Vec3 low, high;
    Vec3 clamp(const Vec3& color) const;
};
ColorRange color_range(const Entries& entries);

/// `refuse` where the raw prefixes lose half an LSB8 to cancellation; `redirect` where slabs of `length` can
/// be deeper than the trusted depth (those take order 1); else `use`.
Verdict judge_power_series(const Entries& entries, int order, double length);

struct PowerSeries {
    Entries entries;
    OpaquePrediction prediction;
    ColorRange range;
    PrefixTables tables;
    int order = 1;

    /// Any length.  Slabs deeper than trusted_depth(order) take order 1; front == back is one point,
    /// classified as PC does.
    SlabValue slab(double front, double back, double length) const;
};

PowerSeries build_power_series(const Entries& entries, int order, Between between = Between::exact);

/// The series itself, from the moments of a slab in any tables: colour K, before the factor 1 - e^-x.
/// Neither redirects nor clamps.
Vec3 power_series_color(const Moments& moments, int order);

}  // namespace squint::preintegration
