// Moments in fixed-point words that cancel little: overlapped level tables (docs/math.md#b36).  Level l has
// blocks of L = 2^l entries every L / 2.  Block b holds prefix sums from its own start s_b = b L / 2:
//
//   D[i] = T_i - T_sb,    M_k[i] = int c (T - T_sb)^k dT,    i = s_b ... s_b + L
//
// at index b (L + 1) + i - s_b of the level.  A slab of n whole entries takes the level with L / 4 < n <= L /
// 2: its block lo / (L / 2) holds both ends.  Each level and moment has one power-of-two scale, so that words
// are plain integers: value = word 2^(exponent - mantissa_bits).
#pragma once

#include "pipeline/classification/tables/prefix_tables.h"

namespace squint::preintegration {

struct OverlappedTables {
    struct Level {
        int length = 0;             // L, in entries
        int depth_exponent = 0;     // every depth of the level is below 2^depth_exponent
        std::vector<int> exponent;  // the same for moment k
        std::vector<double> depth;
        std::vector<Channels> moment;  // moment[k][channel][...], k = 0 ... count - 1
    };
    std::vector<Level> level;  // level[j].length = 2^(j + 1)
    PrefixTables entry;        // for the fractions of entries at both ends
    int mantissa_bits = 0;     // 0: unrounded, in double

    /// Like PrefixTables::moments, with errors of 2^-mantissa_bits of the block's scale: (4 x)^(k + 1) for
    /// even matter.
    Moments moments(double front, double back, double length, int count) const;

  private:
    Moments whole_entries(int lo, int hi, bool ascending, int count) const;
};

/// `mantissa_bits` from 1 to 52 rounds every stored value to a word of that many bits, all of them used; 0
/// keeps doubles.  Memory: 2 size log2(size) (1 + 3 count) values.
OverlappedTables build_overlapped_tables(const Entries& entries, int count, int mantissa_bits = 0);

}  // namespace squint::preintegration
