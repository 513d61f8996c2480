// Stage 4, PIPS(n), n = 2 to 5, and LEG(n), n = 2 to 4: pre-integration by moments of the colour over a
// slab's own optical depth (Lee & Shin 2013, equations 22 to 25; docs/classification.md). Inputs at both ends
// (I.F) -> straight colour K (1.F), opacity (1.F).
//
// With y = t / x the share of the slab's depth x in front of a point, both methods are one sum over Legendre
// moments,
//
//     K = sum_j g_j(x) (2j+1 and signs within g) L_j,    L_j = int_0^1 c P_j(2y - 1) dy,   g_0 = 1
//
// and differ only in the weights g_j, a table over x: those of LEG are bounded at every depth, those of PIPS
// up to its trusted depth.  A slab seen from the other side changes the sign of odd L_j.
//
// Moments come from overlapped level tables (docs/math.md#b36): blocks of 2^(l+1) entries every 2^l, with
// prefix sums from the block's own start in units of its own depth.  So every word lies in [0, 1], and for
// even matter a slab's difference cancels two bits at most.  The units cancel in L_j.  Inside an entry
// extinction and colour are constant.
#pragma once

#include "pipeline/classification/prefix.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <string>

namespace squint {

inline constexpr int kMostMomentOrder = 5;
inline constexpr int kPieces = 4;  // pieces of a deep slab, for LEG
inline constexpr int kInverseBits = 24;

using MomentSquare = std::array<std::array<std::int64_t, kMostMomentOrder>, kMostMomentOrder>;
/// P_j(2y - 1) = sum_k kShiftedLegendre[j][k] y^k.
inline constexpr MomentSquare kShiftedLegendre{
    {{1, 0, 0, 0, 0}, {-1, 2, 0, 0, 0}, {1, -6, 6, 0, 0}, {-1, 12, -30, 20, 0}, {1, -20, 90, -140, 70}}};
/// The moment k for which L_k is zero is sum_i kSmooth[k][i] 2^-24 times moment i, i < k.
inline constexpr MomentSquare kSmooth = [] {
    MomentSquare smooth{};
    for (std::size_t k = 1; k < smooth.size(); ++k)
        for (std::size_t i = 0; i < k; ++i) {
            const std::int64_t twice =
                -(kShiftedLegendre[k][i] << (kInverseBits + 1)) / kShiftedLegendre[k][k];
            smooth[k][i] = (twice + 1) >> 1;
        }
    return smooth;
}();

struct MomentSeries {
    static constexpr bool kPremultiplied = false;
    static constexpr bool kNeedsBack = true;
    static bool serves(const ClassificationSettings& settings) {
        return settings.method == Method::leg ||
               (settings.method == Method::pips && settings.order_or_least() != 1);
    }
    /// Builds PIPS(2 to 5) or LEG(2 to 4).  Throws InputError for other orders.
    static MomentSeries build(const ClassificationInputs& inputs);

    PrefixLookup prefix;
    Table levels;   // one column: the level's first row
    Table moments;  // depth, then moment k of channel c in column 1 + 3 k + c
    Table weights;  // g_1 ... g_(order - 1) over the depth
    int order = 2;
    int sub_entry_bits = 0;  // 2^bits sub-entries an entry
    int word_fraction = 28;
    int weight_fraction = 18;
    int row_bits = 10;  // rows of `weights` are 2^-row_bits apart
    int depth_fraction = 0;
    bool splits = false;     // cut slabs deeper than `limit` (LEG), or give them order 1 (PIPS)
    std::int64_t limit = 0;  // raw, of slab_depth
    std::array<std::int64_t, 3> lowest{}, highest{};       // of the entries' colours
    std::array<std::int64_t, kMostMomentOrder> inverse{};  // 2^24 / (k + 1)
    Rescale to_part;                                       // within a sub-entry
    Rescale to_product;                                    // of two words
    Rescale to_mean;                                       // of powers
    Rescale to_share;                                      // a word over another
    Rescale to_weight;                                     // between rows
    Rescale to_ratio;
    Rescale to_cut;    // where a deep slab is cut, in T
    Rescale to_piece;  // a piece's share of the light
    Rescale to_whole;  // pieces' light over their opacity
    std::string note;
    Approximation rows_of_color;                               // constant in a sub-entry
    std::shared_ptr<const preintegration::ExactSeries> exact;  // used without rounding: no rows

    template <class V>
    void visit(V&& v) {
        prefix.visit(v), v(levels), v(moments), v(weights);
        for (Rescale* r : {&to_part, &to_product, &to_mean, &to_share, &to_weight, &to_ratio, &to_cut,
                           &to_piece, &to_whole})
            v(*r);
    }
    void describe(ClassificationReport& report) const;
};
/// The depth in a block, raw, from which words of `fraction` bits hold its moment k to 2^-10.
constexpr std::int64_t resolved_depth(int fraction, std::size_t k) {
    return std::int64_t{1} << (fraction - std::max(0, fraction - 10) / (static_cast<int>(k) + 1));
}

}  // namespace squint
