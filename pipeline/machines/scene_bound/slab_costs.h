// What a slab may add to the error of a pixel, by the values that its sample may have.
//
// With v the most that all behind a slab can add at T = 1, the slab and what lies behind it add at most
//
//     v' = max over the inputs i that it may have of  a_i + (1 - alpha_i) v,      h(v) = v' - v = max of a_i - alpha_i v
//
// where a_i is what the slab's own opacity and colour are off by.  h is convex in v: kept at a few v (kKnots),
// it is at most straight between them.
//
// A slab of PIPS(1) is a mean along the straight way y from its front input to its back one: of extinction tau, x, and of
// colour weighted by it, K.  With G what lies behind, alpha = 1 - exp(-x), b = alpha / x and D what a move of the ends changes,
//
//     D (alpha (K - G)) = mean of  (exp(-x) (c - G) + (b - exp(-x)) (c - K)) D tau + b tau D c,    exp(-x) <= b <= 1,
//
// so without opaque entries, and with e the most that either end is off by,
//
//     |alpha' (K' - G) - alpha (K - G)|  <=  mean of  |tau'(y)| e + tau |c'(y)| e + what rows take at y
//     alpha'                             >=  mean of  alpha(tau(y)) - what rows take of it at y
//
// (x D K = int (c - K) D tau + int tau D c; 1 - exp(-x) is concave).  Both are means over one way, so a_i - alpha_i v is at most
// its greatest over all inputs on it: the same h, of all values that a cell and those a step away hold.
//
// What rows and words take is counted at the words' own inputs, where (alpha', K') stand for (alpha, K):
//
//     alpha' (K' - G) - alpha (K - G) = (alpha' - alpha)(K' - G) + alpha (K' - K):
//
// an error of the opacity once, with whatever colour, and one of the colour by the depth x >= alpha without rounding.  T and X
// rise at known rates, exactly straight between rows (T's bend apart), so a short way is off by no more than a long one: by the
// rates' own errors, and in colour by what rows cannot tell.  With Q_r, S_r a way's parts of depth in row r by straight rises
// and by tau, x = sum S, k_r its colour there, c_r the row's, and any colour c,
//
//     x (K' - K) = sum S_r (c_r - k_r) + sum (Q_r x / sum Q - S_r)(c_r - c).
//
// With tau_0, tau_1 and colours a, b at the row's ends, c_r is (2 tau_1 + tau_0) / (3 (tau_0 + tau_1)) of the way from a to b:
// |c_r - k_r| is at most the longer way from there to an end.  Q_r = S_r but in the two rows where the way ends, where they
// differ by at most an eighth of a row times what tau changes by; the second sum is at most twice that, times half of what c
// changes by along the way.
#pragma once

#include "pipeline/machines/certificate/function.h"
#include "pipeline/machines/scene_bound/light_errors.h"
#include "pipeline/plan/plan.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <variant>
#include <vector>

namespace squint {

/// PIPS(1) of the plan, where its slabs have two ends; a projection classifies points.
inline const PowerSeriesOfOrder1* pips_of(const Plan& plan) {
    return plan.projection_mode ? nullptr : std::get_if<PowerSeriesOfOrder1>(&plan.method);
}

inline constexpr std::array<double, 7> kKnots{0, 1.0 / 512, 1.0 / 128, 1.0 / 48, 1.0 / 16, 0.25, 1};

/// h at every knot; then a, where the slab is its ray's last and may be short.
struct Costs {
    std::array<float, kKnots.size() + 1> at{};

    float last() const { return at.back(); }
    void take(const Costs& other) {
        for (std::size_t i = 0; i < at.size(); ++i) at[i] = at[i] < other.at[i] ? other.at[i] : at[i];
    }
    /// h(v), v >= 0: it falls, and v beyond 1 counts as 1.
    double more(double v) const {
        v = std::min(v, 1.0);
        std::size_t k = 1;
        while (k + 1 < kKnots.size() && kKnots[k] < v) ++k;
        const double way = (v - kKnots[k - 1]) / (kKnots[k] - kKnots[k - 1]);
        return static_cast<double>(at[k - 1]) * (1 - way) + static_cast<double>(at[k]) * way;
    }
};

/// Inputs between two places of the function, closer than rows of its table.
struct InputBin {
    double steep = 0, table = 0, wall = 0;  // a = steep e + table, + wall where e > 0
    double opacity = 0, seen = 0;           // the least that a word there can have, and the most
    double last_steep = 0, last_table = 0, last_wall = 0, last_seen = 0;
    bool visible = false;  // a word there may have an opacity above zero
    Shares of_table, of_last_table;
    /// Errors of an opacity count with colours up to `brightest`.
    void count_with(double brightest) {
        for (double* cost : {&steep, &table, &wall, &last_steep, &last_table, &last_wall}) *cost *= brightest;
        of_table = of_table.scaled(brightest), of_last_table = of_last_table.scaled(brightest);
    }
    bool costs() const { return steep > 0 || table > 0 || wall > 0 || last_table > 0 || last_wall > 0; }
};

/// h at -v of every knot but zero; then the most that a ray's last slab can be seen.
struct LitCosts {
    std::array<float, kKnots.size()> at{};

    void take(const LitCosts& other) {
        for (std::size_t i = 0; i < at.size(); ++i) at[i] = at[i] < other.at[i] ? other.at[i] : at[i];
    }
};

/// The costs of post-classification, whose slabs are one input, and of PIPS(1), whose slabs are a way between two.
class SlabCosts {
  public:
    /// `reach`: the most that an input is off by, in entries.
    SlabCosts(const Plan& plan, const SampleErrors& errors, const LightErrors& light, double reach);

    /// Of a slab whose sample lies in a cell of these values, or would without rounding.
    Costs of(const CellValues& cell) const;
    /// Whether any slab with a sample near such a cell can cost anything.
    bool may_cost(const CellValues& cell) const;
    /// Whether a word whose sample lies in such a cell can be seen.
    bool visible(const CellValues& cell) const;

    /// A bin that decides: what it costs at v, and how opaque it is.
    struct Decided {
        double cost = 0, opacity = 0;
        Shares shares;
        int bin = -1;
    };
    Decided decided(const CellValues& cell, double v, bool last) const;

    int bins() const { return static_cast<int>(bin_.size()); }
    double entry_of(int bin) const { return bin / per_entry_; }

  private:
    template <class T>
    using Greatest = std::vector<std::vector<std::vector<T>>>;
    struct Bins {
        int first = 0, last = 0;
    };
    /// The bins of a cell's values; `reached`: and of what an error leads to from there.
    Bins bins_of(const CellValues& cell, bool reached) const;
    const InputBin* flat_bin(const CellValues& cell) const;
    InputBin bin_at(const Plan& plan, const Function& function, double from, double to) const;
    void add_ways(const Plan& plan, const PowerSeriesOfOrder1& pips, const Function& function, double from,
                  double to, InputBin& bin) const;
    static Costs costs_of(const InputBin& bin, double error);
    static LitCosts lit_costs_of(const InputBin& bin, double error);
    double light_of(const CellValues& cell) const { return light_.lit ? light_.of(cell) : 0; }
    bool cost_nothing(const Bins& bins) const {
        return costing_[static_cast<std::size_t>(bins.last) + 1] ==
               costing_[static_cast<std::size_t>(bins.first)];
    }

    SampleErrors errors_;
    LightErrors light_;
    double reach_ = 0, per_entry_ = 1;
    double steepest_row_ = 0;             // the most that extinction changes in a row of T
    std::vector<InputBin> bin_, flat_;    // flat_: of whole entries, for cells that hold nothing else
    std::vector<int> costing_, visible_;  // how many bins before this one
    // The greatest costs of 2^l bins from each on, for each error: none, above none, then doubling up to reach_.
    std::vector<double> error_;
    Greatest<Costs> table_;
    Greatest<LitCosts> lit_table_;  // of lit scenes
};

}  // namespace squint
