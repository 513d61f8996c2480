// Transfer functions of the accuracy study (docs/math.md#b1) and drawn slabs, for the tests of the
// pre-integrated methods.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "pipeline/classification/tables/linear_entries.h"

namespace squint::preintegration::cases {

struct Matter {
    double tau;
    Vec3 color;
};

/// Entries from extinctions given directly: no alpha cap stands between a test and its tau.
inline Entries entries_of(int size, const std::function<Matter(int)>& matter) {
    Entries entries;
    for (int i = 0; i < size; ++i) {
        const auto [tau, color] = matter(i);
        entries.entry.push_back({color, 0, tau, false});
    }
    return entries;
}

inline void make_opaque(Entries& entries, int i, Vec3 color) {
    entries.entry[i] = {color, 1, 8.3, true};
}

inline Vec3 grey(double value) {
    return {value, value, value};
}

/// tau = c = s / last.
inline Entries ramp(int size) {
    return entries_of(size, [=](int i) {
        return Matter{double(i) / (size - 1), grey(double(i) / (size - 1))};
    });
}

/// Tau 0.02 but for one entry of 50 at 127; red 0.2, 1, 0.3 with knots at 126, 127, 128.
inline Entries spike() {
    return entries_of(256, [](int i) {
        return Matter{i == 127 ? 50 : 0.02, grey(i == 127 ? 1 : i < 127 ? 0.2 : 0.3)};
    });
}

inline Entries constant(int size, double tau, double color) {
    return entries_of(size, [=](int) { return Matter{tau, grey(color)}; });
}

/// Random per entry: tau log-uniform in [low, high], colours uniform.
inline Entries noise(int size, double low, double high, unsigned seed) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    return entries_of(size, [&](int) {
        const double tau = low * std::pow(high / low, uniform(generator));
        const double red = uniform(generator), green = uniform(generator);
        return Matter{tau, {red, green, uniform(generator)}};
    });
}

struct Slab {
    double front, back, length;
};

/// Small steps and jumps anywhere (ends on entries or between), lengths 1/4 to 2.
inline std::vector<Slab> slabs(int size, int count, bool on_entries, unsigned seed) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<Slab> result;
    for (int i = 0; i < count; ++i) {
        const double reach = i % 2 ? size - 1 : 5;
        double front = uniform(generator) * (size - 1);
        double back = std::clamp(front + (2 * uniform(generator) - 1) * reach, 0.0, size - 1.0);
        if (on_entries) front = std::round(front), back = std::round(back);
        result.push_back({front, back, 0.25 * (1 << (i / 2 % 4))});
    }
    return result;
}

}  // namespace squint::preintegration::cases
