// LEG(n), n = 1 to 4: pre-integration by Legendre moments: the tables of PIPS(n), weighted without poles.
// With the slab's depth t in [0, x], y = 2t/x - 1, c(t) = sum_j (2j+1) L_j P_j(y), L_j = (1/x) int c P_j dt:
//
//   C = int c e^-t dt = sum_j (2j+1) (-1)^j L_j W_j(x),    W_j = x e^(-x/2) i_j(x/2),
// i_j: modified spherical Bessel functions (int P_j(y) e^(-zy) dy = 2 (-1)^j i_j(z)).  Weights are at most x
// and 1.  n = 1 is PIPS(1).  Slabs deeper than x0 are cut into equally deep pieces; deep entries get
// sub-entries.
#pragma once

#include "pipeline/classification/tables/disjoint_tables.h"
#include "pipeline/classification/tables/power_series.h"

#include <optional>

namespace squint::preintegration {

inline constexpr int kMostLegendre = 4;

/// W_j(x) = x e^(-x/2) i_j(x/2), x >= 0, j < kMostLegendre; relative error below 1e-14.  W_0 = 1 - e^-x.
double legendre_weight(int j, double x);

/// The depth at which slabs are cut: 0.125, 1.5, 1.5, 2.5.  Up to 0.125, 1.7, 1.7 and 5.2 the profiles of
/// docs/math.md#b2 stay within half an LSB8; noise asks less of order 4 (docs/measurements/slab-accuracy.md).
double legendre_split_depth(int order);

/// C of a slab from its moments; depth > 0.  It neither clamps nor cuts.
Vec3 legendre_color(const Moments& moments, int order);

struct LegendreSeries {
    Entries entries;
    OpaquePrediction prediction;
    ColorRange range;
    int order = 2;
    double split_depth = 1.5;                // x0
    int per_entry = 1;                       // sub-entries of an entry in the tables below
    PrefixTables tables;                     // of the subdivided entries
    std::optional<DisjointTables> disjoint;  // used in place of differences of prefixes
    std::string reason;                      // which tables and why, in one line

    /// Any length and any depth.  Stops behind an opacity of 1 - 2^-10: what is left, at most 2^-10 of the
    /// deepest colour, gets the colour of the last piece.
    SlabValue slab(double front, double back, double length) const;

  private:
    Moments moments(double front, double back, double length) const;
    SlabValue one_piece(double front, double back, double length) const;
    SlabValue in_pieces(double front, double back, double length, double depth) const;
};

/// Takes sub-entries where an entry, spanned by a slab of `length`, is deeper than 1 (4; 8 beyond 8),
/// disjoint tables where raw prefixes lose 1/16 LSB8.  split_depth 0: legendre_split_depth(order).
LegendreSeries build_legendre_series(const Entries& entries, int order, double length,
                                     double split_depth = 0);

}  // namespace squint::preintegration
