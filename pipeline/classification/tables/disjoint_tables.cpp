#include "pipeline/classification/tables/disjoint_tables.h"

#include <bit>
#include <cassert>

namespace squint::preintegration {
namespace {

/// The part of a slab that ends at the middle, seen from its other end: t = depth - u.  Cancellation is
/// bounded by its own `depth`.
Moments towards_middle(const Moments& about_middle, int count) {
    Moments result;
    result.depth = about_middle.depth;
    for (int k = 0; k < count; ++k) {
        double term = 1;  // binomial(k, low) (-1)^low
        for (int low = 0; low <= k; ++low) {
            double scale = term;
            for (int i = low; i < k; ++i) scale *= result.depth;
            result.q[k] += about_middle.q[low] * scale;
            term = -term * (k - low) / (low + 1);
        }
    }
    return result;
}

Moments at(const DisjointTables::Level& level, int i, int count) {
    Moments result;
    result.depth = level.depth[i];
    for (int k = 0; k < count; ++k)
        result.q[k] = {level.moment[k][0][i], level.moment[k][1][i], level.moment[k][2][i]};
    return result;
}

/// Fills an entry's value from its neighbour nearer to the middle; `step` is the moment of entry i over the
/// entry between them.
struct LevelBuilder {
    DisjointTables::Level& level;
    const PrefixTables& tables;
    int count;

    void extend(int from, int to) {
        const bool up = to > from;
        const int piece = up ? from : to;
        level.depth[to] = level.depth[from] + tables.partial_depth(piece, 0, 1);
        for (int k = 0; k < count; ++k) {
            const double offset = level.depth[from];
            // Downwards T - T_m is negative, and so is dT.
            const Vec3 step = up           ? tables.partial_moments(piece, 0, 1, k, offset)
                              : k % 2 == 0 ? -tables.partial_moments(piece, 1, 0, k, -offset)
                                           : tables.partial_moments(piece, 1, 0, k, -offset);
            for (int channel = 0; channel < 3; ++channel)
                level.moment[k][channel][to] = level.moment[k][channel][from] + step[channel];
        }
    }
};

void round_to_float(std::vector<double>& values) {
    for (double& value : values) value = static_cast<float>(value);
}

}  // namespace

Moments DisjointTables::whole_entries(int lo, int hi, bool ascending, int count) const {
    if (lo == hi) return {};
    const int l = std::bit_width(static_cast<unsigned>(lo ^ hi)) - 1;
    const int middle = hi >> l << l;
    Moments low = at(level[l], lo, count), high = middle == hi ? Moments() : at(level[l], hi, count);
    Moments near = towards_middle(ascending ? low : high, count);
    near.append(ascending ? high : low, count);
    return near;
}

Moments DisjointTables::moments(double front, double back, double length, int count) const {
    assert(front != back && count <= orders());
    return entry.joined(front, back, length, count, [&](int lo, int hi, bool ascending) {
        return whole_entries(lo, hi, ascending, count);
    });
}

DisjointTables build_disjoint_tables(const Entries& entries, int count, Storage storage) {
    const int size = entries.size();
    DisjointTables tables;
    tables.entry = build_prefix_tables(entries, 1);
    for (int l = 0; (1 << l) < size; ++l) {
        DisjointTables::Level level;
        level.depth.assign(size, 0);
        const std::vector<double> zero(size, 0);
        level.moment.assign(count, Channels{zero, zero, zero});
        LevelBuilder builder{level, tables.entry, count};
        for (int middle = 1 << l; middle < size; middle += 2 << l) {
            for (int i = middle; i > middle - (1 << l); --i) builder.extend(i, i - 1);
            for (int i = middle; i + 1 < std::min(middle + (1 << l), size); ++i) builder.extend(i, i + 1);
        }
        if (storage == Storage::float32) {
            round_to_float(level.depth);
            for (auto& moment : level.moment)
                for (auto& channel : moment) round_to_float(channel);
        }
        tables.level.push_back(std::move(level));
    }
    return tables;
}

}  // namespace squint::preintegration
