#include "truth/overlapped_tables.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

namespace squint::preintegration {
namespace {

/// The smallest exponent e with every value below 2^e; values are then rounded to multiples of 2^(e - bits).
int exponent_of(const std::vector<const std::vector<double>*>& arrays) {
    double largest = 0;
    for (const auto* array : arrays)
        largest = std::max(largest, *std::max_element(array->begin(), array->end()));
    int exponent = 0;
    std::frexp(largest, &exponent);
    return exponent;
}

void round_to(std::vector<double>& values, int exponent, int bits) {
    if (bits == 0) return;
    for (double& value : values)
        value = std::ldexp(std::nearbyint(std::ldexp(value, bits - exponent)), exponent - bits);
}

void fill_block(OverlappedTables::Level& level, int start, const PrefixTables& entry) {
    const std::size_t base = static_cast<std::size_t>(start / (level.length / 2)) * (level.length + 1);
    const int end = std::min(start + level.length, entry.size() - 1);
    for (int i = start; i < end; ++i) {
        const std::size_t at = base + i - start;
        level.depth[at + 1] = level.depth[at] + entry.partial_depth(i, 0, 1);
        for (std::size_t k = 0; k < level.moment.size(); ++k) {
            const Vec3 step = entry.partial_moments(i, 0, 1, static_cast<int>(k), level.depth[at]);
            for (int channel = 0; channel < 3; ++channel)
                level.moment[k][channel][at + 1] = level.moment[k][channel][at] + step[channel];
        }
    }
}

/// int c (T - front)^k dT over [lo, hi] of a block, from differences of its prefix sums.
Vec3 about(double front, const std::array<Vec3, kMostMoments>& difference, int k) {
    Vec3 sum(0, 0, 0);
    double binomial = 1;
    for (int low = 0; low <= k; ++low) {
        double factor = binomial;
        for (int i = low; i < k; ++i) factor *= -front;
        sum += difference[low] * factor;
        binomial = binomial * (k - low) / (low + 1);
    }
    return sum;
}

}  // namespace

Moments OverlappedTables::whole_entries(int lo, int hi, bool ascending, int count) const {
    Moments result;
    if (lo == hi) return result;
    const int half = static_cast<int>(std::bit_ceil(static_cast<unsigned>(hi - lo)));
    const Level& l = level[std::bit_width(static_cast<unsigned>(half)) - 1];
    const std::size_t block = lo / half;
    const std::size_t base = block * (l.length + 1) - block * half;
    result.depth = l.depth[base + hi] - l.depth[base + lo];
    std::array<Vec3, kMostMoments> difference;
    for (int k = 0; k < count; ++k)
        for (int channel = 0; channel < 3; ++channel)
            difference[k][channel] = l.moment[k][channel][base + hi] - l.moment[k][channel][base + lo];
    const double front = l.depth[base + (ascending ? lo : hi)];
    for (int k = 0; k < count; ++k)
        result.q[k] = about(front, difference, k) * (ascending || k % 2 == 0 ? 1 : -1);
    return result;
}

Moments OverlappedTables::moments(double front, double back, double length, int count) const {
    assert(front != back && (level.empty() || count <= static_cast<int>(level[0].moment.size())));
    return entry.joined(front, back, length, count, [&](int lo, int hi, bool ascending) {
        return whole_entries(lo, hi, ascending, count);
    });
}

OverlappedTables build_overlapped_tables(const Entries& entries, int count, int mantissa_bits) {
    OverlappedTables tables;
    tables.entry = build_prefix_tables(entries, 1);
    tables.mantissa_bits = mantissa_bits;
    const int size = entries.size();
    for (int half = 1; half < 2 * size; half *= 2) {
        OverlappedTables::Level level;
        level.length = 2 * half;
        const std::size_t blocks = (size + half - 1) / half;
        const std::vector<double> zero(blocks * (level.length + 1), 0);
        level.depth = zero;
        level.moment.assign(count, Channels{zero, zero, zero});
        for (int start = 0; start < size; start += half) fill_block(level, start, tables.entry);
        level.depth_exponent = exponent_of({&level.depth});
        round_to(level.depth, level.depth_exponent, mantissa_bits);
        for (auto& m : level.moment) {
            level.exponent.push_back(exponent_of({&m[0], &m[1], &m[2]}));
            for (auto& channel : m) round_to(channel, level.exponent.back(), mantissa_bits);
        }
        tables.level.push_back(std::move(level));
    }
    return tables;
}

}  // namespace squint::preintegration
