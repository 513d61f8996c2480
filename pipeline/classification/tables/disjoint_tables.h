// Moments that do not cancel: a disjoint sparse table over the entries (docs/math.md#b36).
// Level l cuts the entries into blocks of 2^(l+1) with their middle m at odd multiples of 2^l.  For every
// entry i of a block it holds the depth |T_i - T_m| and the moments int c |T - T_m|^k dT between i and m:
// sums of positive terms.  A slab between entries lo and hi lies on both sides of the middle m = (hi >> l) <<
// l of level l, the top bit of lo ^ hi: subtractions stay within the slab's own depth.
#pragma once

#include "pipeline/classification/tables/prefix_tables.h"

namespace squint::preintegration {

enum class Storage { float64, float32 };

struct DisjointTables {
    struct Level {
        std::vector<double> depth;     // |T_i - T_m|
        std::vector<Channels> moment;  // moment[k][channel][i], k = 0 ... count - 1
    };
    std::vector<Level> level;
    PrefixTables entry;  // T, tau, c and X_1, for the fractions of entries at both ends

    int orders() const { return level.empty() ? kMostMoments : static_cast<int>(level[0].moment.size()); }

    /// Like PrefixTables::moments, with errors of the slab's own size: 2^-53 (or 2^-24) 2^k x^(k + 1).
    Moments moments(double front, double back, double length, int count) const;

  private:
    Moments whole_entries(int lo, int hi, bool ascending, int count) const;
};

/// With float32 `storage` stored values are rounded to float.  Values: size * log2(size) * (1 + 3 count).
DisjointTables build_disjoint_tables(const Entries& entries, int count, Storage storage = Storage::float64);

}  // namespace squint::preintegration
