#include "pipeline/classification/tables/fade_table.h"

#include "core/parallel.h"
#include "core/portable_math.h"

#include <algorithm>
#include <cmath>

namespace squint::preintegration {
namespace {

constexpr int kAfresh = 64;       // nodes up to which slabs are put together from their stretches
constexpr double kSpent = 40;     // depth behind which nothing is seen
constexpr double kDeepest = 0.5;  // of a stretch, for one quadrature

/// int w^k c m dw, [k][channel], the depth and the transparency.
struct Powers {
    std::array<std::array<double, 4>, kFades> of{};
    double depth = 0, through = 1;

    /// Adds one that begins `at` further on, seen through what is there.
    void append(const Powers& next, double at) {
        const std::array<double, 4> a{1, at, at * at, at * at * at};
        for (std::size_t c = 0; c < 4; ++c) {
            const double h0 = next.of[0][c], h1 = next.of[1][c], h2 = next.of[2][c], h3 = next.of[3][c];
            of[0][c] += through * h0;
            of[1][c] += through * (h1 + a[1] * h0);
            of[2][c] += through * (h2 + 2 * a[1] * h1 + a[2] * h0);
            of[3][c] += through * (h3 + 3 * a[1] * h2 + 3 * a[2] * h1 + a[3] * h0);
        }
        depth += next.depth, through *= next.through;
    }
    FadeMoments fades(double width) const {
        FadeMoments b;
        for (std::size_t c = 0; c < 4; ++c) {
            const double m0 = of[0][c], m1 = of[1][c] / width, m2 = of[2][c] / (width * width),
                         m3 = of[3][c] / (width * width * width);
            b[0][c] = m0 - 3 * m1 + 3 * m2 - m3, b[1][c] = 3 * (m1 - 2 * m2 + m3);
            b[2][c] = 3 * (m2 - m3), b[3][c] = m3;
            for (auto& moment : b) moment[c] = std::max(moment[c], 0.0);
        }
        return b;
    }
};

/// From one coordinate to another inside one entry, `path` long: w runs from 0 to 1.
void add_stretch(const Entries& entries, double from, double to, double path, double start, double width,
                 Powers& sum) {
    // Gauss and Legendre, six points: a depth of 1/2 errs by 1e-14.
    constexpr std::array<double, 3> kPlace{0.2386191860831969, 0.6612093864662645, 0.9324695142031521},
        kWeight{0.4679139345726910, 0.3607615730481386, 0.1713244923791704};
    const double t0 = extinction_at(entries, from) * path, t1 = extinction_at(entries, to) * path;
    const Vec3 c0 = color_at(entries, from), c1 = color_at(entries, to);
    const int pieces = std::clamp(static_cast<int>(std::ceil(std::max(t0, t1) / kDeepest)), 1, 1 << 20);
    const double h = 1.0 / pieces;
    for (int piece = 0; piece < pieces; ++piece) {
        if (piece * h * (t0 + piece * h * (t1 - t0) / 2) > kSpent) break;
        for (std::size_t i = 0; i < 6; ++i) {
            const double x = (i < 3 ? -1 : 1) * kPlace[i % 3], v = (piece + (1 + x) / 2) * h;
            const double light = h / 2 * kWeight[i % 3] * (t0 + v * (t1 - t0)) * sum.through *
                                 portable::exp(-v * (t0 + v * (t1 - t0) / 2));
            const Vec3 c = c0 + (c1 - c0) * v;
            double part = light;
            for (std::size_t k = 0; k < kFades; ++k, part *= start + v * width) {
                for (int channel = 0; channel < 3; ++channel)
                    sum.of[k][static_cast<std::size_t>(channel)] += part * c[channel];
                sum.of[k][3] += part;
            }
        }
    }
    sum.depth += (t0 + t1) / 2, sum.through *= portable::exp(-(t0 + t1) / 2);
}

/// From one coordinate to another, `path` long in all: w runs from 0 to 1.
Powers powers_between(const Entries& entries, double from, double to, double path) {
    Powers sum;
    const double span = to - from;
    if (span == 0) {
        add_stretch(entries, from, to, path, 0, 1, sum);
        return sum;
    }
    for (double here = from; here != to;) {
        const double entry = span > 0 ? std::floor(here) + 1 : std::ceil(here) - 1;
        const double next = span > 0 ? std::min(entry, to) : std::max(entry, to);
        const double width = (next - here) / span;
        add_stretch(entries, here, next, path * width, (here - from) / span, width, sum);
        here = next;
    }
    return sum;
}

/// A diagonal of slabs that lead from node f to f + m, or with `down` from f + m to f.
class Diagonal {
  public:
    Diagonal(const Entries& entries, int size, double length, int m, bool down)
        : size_(size),
          m_(m),
          down_(down),
          stretch_(static_cast<std::size_t>(size - 1)),
          depth_(static_cast<std::size_t>(size)) {
        const auto coordinate = [&](int node) {
            return static_cast<double>(std::int64_t{node} * (entries.size() - 1)) / (size - 1);
        };
        for (int i = 0; i + 1 < size; ++i) {
            const double low = coordinate(i), high = coordinate(i + 1);
            stretch_[static_cast<std::size_t>(down ? size - 2 - i : i)] =
                down ? powers_between(entries, high, low, length / m)
                     : powers_between(entries, low, high, length / m);
        }
        for (std::size_t i = 0; i < stretch_.size(); ++i) depth_[i + 1] = depth_[i] + stretch_[i].depth;
    }
    /// Calls put(front, back, moments) for each.
    template <class Put>
    void solve(Put&& put) const {
        const auto stretch = [&](int i) -> const Powers& { return stretch_[static_cast<std::size_t>(i)]; };
        const auto depth = [&](int i) { return depth_[static_cast<std::size_t>(i)]; };
        Powers slab;
        for (int f = size_ - 1 - m_; f >= 0; --f) {
            Powers here;
            if (m_ <= kAfresh || f == size_ - 1 - m_) {
                for (int i = 0; i < m_ && here.through > 1e-18; ++i) here.append(stretch(f + i), i);
            } else {
                // The last slab less its last stretch, behind this one's first.
                Powers last = slab;
                last.through = portable::exp(depth(f + 1) - depth(f + m_));
                Powers less;
                less.through = last.through;
                less.append(stretch(f + m_), m_ - 1);
                for (std::size_t k = 0; k < kFades; ++k)
                    for (std::size_t c = 0; c < 4; ++c) last.of[k][c] -= less.of[k][c];
                here.append(stretch(f), 0);
                here.append(last, 1);
            }
            slab = here;
            const int front = down_ ? size_ - 1 - f : f, back = down_ ? front - m_ : front + m_;
            put(front, back, slab.fades(m_));
        }
    }

  private:
    int size_, m_;
    bool down_;
    std::vector<Powers> stretch_;  // in the order of the way
    std::vector<double> depth_;    // up to each node
};

}  // namespace

std::array<double, 4> first_moment(const FadeMoments& b) {
    std::array<double, 4> first;
    for (std::size_t c = 0; c < 4; ++c) first[c] = (b[1][c] + 2 * b[2][c]) / 3 + b[3][c];
    return first;
}

FadeMoments fade_moments(const Entries& entries, double front, double back, double length) {
    return powers_between(entries, front, back, length).fades(1);
}

std::vector<std::vector<double>> build_fades(const Entries& entries, int size, double length, bool linear) {
    const auto side = static_cast<std::size_t>(size);
    std::vector<std::vector<double>> tables(linear ? 1 : kFades - 1, std::vector<double>(side * side * 4));
    const auto put = [&](int front, int back, const FadeMoments& moments) {
        const std::size_t cell =
            (static_cast<std::size_t>(front) * side + static_cast<std::size_t>(back)) * 4;
        const std::array<double, 4> first = first_moment(moments);
        for (std::size_t c = 0; c < 4; ++c) {
            if (linear) {
                tables[0][cell + c] = first[c];
                continue;
            }
            for (std::size_t k = 1; k < kFades; ++k) tables[k - 1][cell + c] = moments[k][c];
        }
    };
    for (int j = 0; j < size; ++j) {
        const double s = static_cast<double>(std::int64_t{j} * (entries.size() - 1)) / (size - 1);
        put(j, j, fade_moments(entries, s, s, length));
    }
    in_parallel(size - 1, [&](int i) {
        for (const bool down : {false, true}) Diagonal(entries, size, length, i + 1, down).solve(put);
    });
    return tables;
}

}  // namespace squint::preintegration
