// The cheapest word lengths that keep an error under a bound: min+1 from below, then max-1, then restarts
// (Cantin, Savaria and Lavoie, "A comparison of automatic word length optimization procedures", ISCAS 2002).
// Knows no scenes: what a vector of lengths costs and how wrong it is, it is told.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

namespace squint::search {

/// Bits of every variable, in the order of Problem::most.
using Lengths = std::vector<int>;

/// What became of one vector.
struct Trial {
    // Where there is no picture with these, all stay infinite.
    double error = kNone;    // what is bounded
    double penalty = kNone;  // by which one bit's worth is told from another's
    double cost = kNone;     // what is made small
    double bits = kNone;     // that counts where costs are equal
    static constexpr double kNone = std::numeric_limits<double>::infinity();
};

/// Why a vector is tried.
enum class Phase { top, alone, raise, lower, back_off };
inline constexpr std::string_view kPhaseNames[] = {"top", "alone", "min+1", "max-1", "back off"};

struct Step {
    Phase phase{};
    int restart = 0;    // 0: the first descent
    int variable = -1;  // that differs from where the search stands; -1: none
};

struct Problem {
    Lengths most;            // of every variable; the least is 0
    std::size_t shaken = 0;  // restarts take bits from so many of the first variables
    double most_error = 0;
    /// Trials of some vectors, in order; may run them side by side.
    std::function<std::vector<Trial>(std::span<const Lengths>, std::span<const Step>)> evaluate;
};

struct Options {
    int restarts = 0;
    std::uint64_t seed = 1;
};

struct Found {
    bool feasible = false;  // false: not even `most` keeps the error under the bound
    Lengths lengths;
    Trial trial;
    Trial top;                  // of `most`
    Lengths alone;              // what each variable needs where all the others have the most
    std::vector<double> costs;  // what each descent ended with: the first, then every restart
};

/// 1. `alone`: by bisection.  2. min+1: from there up, a bit at a time to the variable whose bit takes away
/// the most penalty for its cost, until the bound holds.  3. max-1: down, a bit at a time from the variable
/// whose bit adds the least penalty for what it saves, while the bound holds; in the end no variable can lose
/// a bit.
/// 4. Every restart takes bits from the best vector at random and goes on with 2 and 3, with the worth of
/// bits weighted at random; what beats the best replaces it.  The same trials and the same result whenever
/// evaluate() gives the same.
Found find_lengths(const Problem& problem, const Options& options);

/// From lengths that break the bound up by 2. until it holds, without 3. and 4.: where more is asked than when they
/// were found.  `alone` and `costs` stay empty.
Found raise_lengths(const Problem& problem, const Lengths& from);

/// splitmix64 (Steele, Lea and Flood 2014): the same numbers on every machine.
struct Random {
    std::uint64_t state;
    std::uint64_t next();
    double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }  // in [0, 1)
    int below(int n) { return static_cast<int>(next() % static_cast<std::uint64_t>(n)); }
};

}  // namespace squint::search
