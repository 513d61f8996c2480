#include "pipeline/classification/tables/prefix_tables.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace squint::preintegration {
namespace {

// Gauss-Legendre, 6 points on [0, 1]: exact for degree 11, and c T^(k-1) tau has degree 2k <= 10 inside an
// entry.
constexpr std::array<double, 6> kNode = {0.03376524289842399, 0.16939530676686775, 0.38069040695840155,
                                         0.61930959304159845, 0.83060469323313225, 0.96623475710157601};
constexpr std::array<double, 6> kWeight = {0.08566224618958517, 0.18038078652406930, 0.23395696728634552,
                                           0.23395696728634552, 0.18038078652406930, 0.08566224618958517};

double power(double base, int exponent) {
    double result = 1;
    for (int k = 0; k < exponent; ++k) result *= base;
    return result;
}

}  // namespace

void Moments::append(const Moments& behind, int count) {
    for (int k = 0; k < count; ++k) {
        double binomial = 1;
        for (int low = 0; low <= k; ++low) {
            q[k] += behind.q[low] * (binomial * power(depth, k - low));
            binomial = binomial * (k - low) / (low + 1);
        }
    }
    depth += behind.depth;
}

void Moments::stretch(double rate, int count) {
    depth *= rate;
    double factor = rate;
    for (int k = 0; k < count; ++k, factor *= rate) q[k] *= factor;
}

PrefixTables::Place PrefixTables::place(double s) const {
    if (size() == 1) return {0, 0};
    s = std::clamp(s, 0.0, static_cast<double>(size() - 1));
    const int entry = std::min(static_cast<int>(s), size() - 2);
    return {entry, s - entry};
}

Vec3 PrefixTables::piece_color(int k, int i) const {
    const double step = power(depth[i + 1], k) - power(depth[i], k);
    Vec3 result;
    for (int channel = 0; channel < 3; ++channel) {
        const auto& x = moment[k - 1][channel];
        const auto& c = color[channel];
        result[channel] = step > 0 ? (x[i + 1] - x[i]) / step : (c[i] + c[i + 1]) / 2;
    }
    return result;
}

double PrefixTables::partial_depth(int i, double u0, double u1) const {
    if (size() == 1) return 0;
    if (between == Between::piecewise) return (u1 - u0) * (depth[i + 1] - depth[i]);
    return (u1 - u0) * (extinction[i] + (u0 + u1) / 2 * (extinction[i + 1] - extinction[i]));
}

Vec3 PrefixTables::partial_moments(int i, double u0, double u1, int exponent, double offset) const {
    Vec3 sum{0, 0, 0};
    if (size() == 1) return sum;
    const Vec3 c0{color[0][i], color[1][i], color[2][i]};
    const Vec3 c1{color[0][i + 1], color[1][i + 1], color[2][i + 1]};
    const Vec3 flat = between == Between::piecewise ? piece_color(1, i) : c0;
    for (std::size_t k = 0; k < kNode.size(); ++k) {
        const double u = u0 + (u1 - u0) * kNode[k];
        const double t = offset + partial_depth(i, u0, u);
        const bool exact = between == Between::exact;
        const double tau =
            exact ? extinction[i] + u * (extinction[i + 1] - extinction[i]) : depth[i + 1] - depth[i];
        const Vec3 c = exact ? c0 + (c1 - c0) * u : flat;
        sum += c * (kWeight[k] * (u1 - u0) * tau * power(t, exponent));
    }
    return sum;
}

double PrefixTables::depth_at(double s) const {
    const auto [i, u] = place(s);
    return depth[i] + partial_depth(i, 0, u);
}

Vec3 PrefixTables::moment_at(int k, double s) const {
    const auto [i, u] = place(s);
    const auto& x = moment[k - 1];
    const Vec3 base{x[0][i], x[1][i], x[2][i]};
    if (u == 0) return base;
    if (between == Between::exact) return base + partial_moments(i, 0, u, k - 1, depth[i]) * k;
    return base + piece_color(k, i) * (power(depth_at(s), k) - power(depth[i], k));
}

double PrefixTables::depth_between(double front, double back) const {
    const auto [i, u] = place(front);
    const auto [j, v] = place(back);
    if (i == j) return partial_depth(i, u, v);
    return depth[j] - depth[i] + partial_depth(j, 0, v) - partial_depth(i, 0, u);
}

Vec3 PrefixTables::moment_between(double front, double back) const {
    const auto [i, u] = place(front);
    const auto [j, v] = place(back);
    if (i == j) return partial_moments(i, u, v, 0, 0);
    return moment_at(1, back) - moment_at(1, front);
}

double PrefixTables::coordinate_at(double target) const {
    const auto above = std::lower_bound(depth.begin(), depth.end(), target);
    if (above == depth.begin()) return 0;
    if (above == depth.end()) return size() - 1;
    const int i = static_cast<int>(above - depth.begin()) - 1;
    const double t = target - depth[i];
    if (between == Between::piecewise) return i + t / (depth[i + 1] - depth[i]);
    // Solves tau_0 u + (tau_1 - tau_0) u^2 / 2 = t in the form that does not cancel.
    const double tau = extinction[i], slope = extinction[i + 1] - tau;
    const double root = std::sqrt(std::max(tau * tau + 2 * slope * t, 0.0));
    return i + std::min(2 * t / (tau + root), 1.0);
}

Moments PrefixTables::inside_one_entry(int i, double u0, double u1, double rate, int count) const {
    Moments result;
    result.depth = rate * partial_depth(i, u0, u1);
    for (int k = 0; k < count; ++k) result.q[k] = partial_moments(i, u0, u1, k, 0) * power(rate, k + 1);
    return result;
}

Moments PrefixTables::moments(double front, double back, double length, int count) const {
    assert(front != back && count <= orders());
    const double rate = length / (back - front);
    const auto [i, u] = place(front);
    const auto [j, v] = place(back);
    if (i == j) return inside_one_entry(i, u, v, rate, count);

    // int c (T - T_f)^k dT = sum_j binomial(k, j) (-T_f)^(k-j) dX_(j+1) / (j+1)
    Moments result;
    result.depth = rate * depth_between(front, back);
    const double front_depth = depth_at(front);
    std::array<Vec3, kMostMoments> p;
    for (int k = 0; k < count; ++k) p[k] = (moment_at(k + 1, back) - moment_at(k + 1, front)) / (k + 1);
    for (int k = 0; k < count; ++k) {
        double binomial = 1;
        for (int low = 0; low <= k; ++low) {
            result.q[k] += p[low] * (binomial * power(-front_depth, k - low) * power(rate, k + 1));
            binomial = binomial * (k - low) / (low + 1);
        }
    }
    return result;
}

namespace {

/// Steps of T, X_1 and X_2 over one entry with linear tau and c, in closed form, so that the tables of
/// PIPS(1) and LEG(2) build fast.
struct Step {
    double tau0, tau1, depth, square;  // square = int t^2 du, t the depth from the entry's start

    Step(double t0, double t1)
        : tau0(t0),
          tau1(t1),
          depth((t0 + t1) / 2),
          square(t0 * t0 / 3 + t0 * (t1 - t0) / 4 + (t1 - t0) * (t1 - t0) / 20) {}

    double first(double c0, double c1) const { return colored_depth(c0, tau0, c1, tau1); }
    /// 2 int c T dT with T = before + t; int u t dt by parts.
    double second(double c0, double c1, double before) const {
        return 2 * before * first(c0, c1) + c1 * depth * depth - (c1 - c0) * square;
    }
};

}  // namespace

PrefixTables build_prefix_tables(const Entries& entries, int orders, Between between) {
    assert(1 <= orders && orders <= kMostMoments);
    const int size = entries.size();
    PrefixTables tables;
    tables.depth.resize(size);
    tables.extinction.resize(size);
    for (auto& channel : tables.color) channel.resize(size);
    tables.moment.resize(orders);
    for (auto& x : tables.moment)
        for (auto& channel : x) channel.resize(size);
    for (int i = 0; i < size; ++i) {
        tables.extinction[i] = entries.entry[i].extinction;
        for (int channel = 0; channel < 3; ++channel)
            tables.color[channel][i] = entries.entry[i].color[channel];
    }
    double depth = 0;
    Vec3 x1(0, 0, 0), x2(0, 0, 0);
    for (int i = 0; i + 1 < size; ++i) {
        const Step step(tables.extinction[i], tables.extinction[i + 1]);
        for (int channel = 0; channel < 3; ++channel) {
            const double c0 = tables.color[channel][i], c1 = tables.color[channel][i + 1];
            tables.moment[0][channel][i + 1] = x1[channel] += step.first(c0, c1);
            if (orders >= 2) tables.moment[1][channel][i + 1] = x2[channel] += step.second(c0, c1, depth);
        }
        tables.depth[i + 1] = depth += step.depth;
    }
    for (int k = 3; k <= orders; ++k) {
        for (int i = 0; i + 1 < size; ++i) {
            const Vec3 step = tables.partial_moments(i, 0, 1, k - 1, tables.depth[i]) * k;
            for (int channel = 0; channel < 3; ++channel) {
                auto& x = tables.moment[k - 1][channel];
                x[i + 1] = x[i] + step[channel];
            }
        }
    }
    tables.between = between;
    return tables;
}

}  // namespace squint::preintegration
