// One-dimensional prefix tables of a transfer function: entries -> T, X_1 ... X_n at every entry, in double.
//   T(s)   = int_0^s tau ds             (trapezoid: exact for linear tau)
//   X_k(s) = int_0^s c d(T^k)           (exact for linear tau and c)
// Lee & Shin, equations 15 to 25, without the half-entry shift of their rectangles.  s is in entries, tau per
// world unit: a slab's optical depth is x = r (T(b) - T(f)) with the rate r = length / (back - front), in
// world units per entry.
#pragma once

#include "pipeline/classification/tables/linear_entries.h"

#include <cmath>

namespace squint::preintegration {

inline constexpr int kMostMoments = 5;

/// How T and X_k run between two entries.  `exact`: tau and c are linear, as everywhere.  `piecewise`: T is
/// linear and the colour of an entry constant, X_k(s) = X_k[i] + piece_color (T(s)^k - T_i^k): what one lerp
/// and one product of a stage can compute.
enum class Between { exact, piecewise };

/// Moments of one slab about its front, in its own optical depth t: the depth x, and q[k] = int c t^k dt over
/// t in [0, x].
struct Moments {
    double depth = 0;
    std::array<Vec3, kMostMoments> q;

    Moments() { q.fill(Vec3(0, 0, 0)); }

    /// Appends the slab `behind`, `count` moments: sums of positive terms.
    void append(const Moments& behind, int count);
    /// The same slab with its depths times `rate`.
    void stretch(double rate, int count);
};

/// int c tau du over an entry along which both are linear: the step of X_1.
inline double colored_depth(double c0, double tau0, double c1, double tau1) {
    return (2 * c0 * tau0 + 2 * c1 * tau1 + c0 * tau1 + c1 * tau0) / 6;
}

struct PrefixTables {
    std::vector<double> depth;       // T[i]; T[0] = 0
    std::vector<double> extinction;  // tau[i]
    Channels color;                  // c[channel][i]
    std::vector<Channels> moment;    // moment[k - 1][channel][i] = X_k[i]; X_k[0] = 0
    Between between = Between::exact;

    int size() const { return static_cast<int>(depth.size()); }
    int orders() const { return static_cast<int>(moment.size()); }
    double total_depth() const { return depth.back(); }

    double depth_at(double s) const;
    Vec3 moment_at(int k, double s) const;

    /// T(b) - T(f) and X_1(b) - X_1(f), as sums of whole entries and two fractions: nothing cancels inside
    /// one entry.
    double depth_between(double front, double back) const;
    Vec3 moment_between(double front, double back) const;

    /// The first coordinate at which T reaches `depth`, 0 <= depth <= total_depth().
    double coordinate_at(double depth) const;

    /// Moments q[0 .. count-1] of the slab, front != back.  Inside one entry they are integrated.  Across
    /// entries q[k >= 1] is the difference of raw prefixes (equations 23, 24, with the signs of
    /// docs/math.md): it loses about 2^-53 (r T)^(k + 1).
    Moments moments(double front, double back, double length, int count) const;

    /// The constant colour for X_k between entries i and i + 1: (X_k[i+1] - X_k[i]) / (T[i+1]^k - T[i]^k);
    /// where nothing absorbs, the mean of both colours.
    Vec3 piece_color(int k, int i) const;

    /// Over the fractions [u0, u1] of entry i, without prefixes: int tau, and int c (offset + T(u) -
    /// T(u0))^exponent dT.
    double partial_depth(int i, double u0, double u1) const;
    Vec3 partial_moments(int i, double u0, double u1, int exponent, double offset) const;

    /// The entry at or below s (at most size() - 2), and s as a fraction of it, in [0, 1].
    struct Place {
        int entry;
        double fraction;
    };
    Place place(double s) const;

    /// Moments of the fractions u0 -> u1 of entry i at a signed rate: integrated, without prefixes.
    Moments inside_one_entry(int i, double u0, double u1, double rate, int count) const;

    /// Moments of a slab, front != back.  The fractions of entries at its ends are integrated; between them
    /// whole(lo, hi, ascending) gives the moments from entry lo to entry hi, or back, at a rate of one.
    template <class Whole>
    Moments joined(double front, double back, double length, int count, const Whole& whole) const {
        const double rate = length / (back - front);
        const auto [i, u] = place(front);
        const auto [j, v] = place(back);
        if (i == j) return inside_one_entry(i, u, v, rate, count);
        const bool ascending = front < back;
        Moments result = inside_one_entry(i, u, ascending ? 1 : 0, rate, count);
        Moments whole_part = ascending ? whole(i + 1, j, true) : whole(j + 1, i, false);
        whole_part.stretch(std::abs(rate), count);
        result.append(whole_part, count);
        result.append(inside_one_entry(j, ascending ? 0 : 1, v, rate, count), count);
        return result;
    }
};

/// `orders` is the number of X_k, 1 to kMostMoments; all arrays have entries.size() values.
PrefixTables build_prefix_tables(const Entries& entries, int orders, Between between = Between::exact);

}  // namespace squint::preintegration
