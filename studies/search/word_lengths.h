// The cheapest word lengths whose error stays within a bound: min+1 from below, then max-1, then restarts
// (Cantin, Savaria and Lavoie, "A comparison of automatic word length optimization procedures", ISCAS 2002).
// Knows nothing of scenes: the caller says what a vector of lengths costs and how large its error is.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

namespace squint::search {

/// The bits of every variable, in the order of Problem::most.
using Lengths = std::vector<int>;

/// The outcome of one vector.
struct Trial {
    // All stay infinite where these lengths give no picture.
    double error = kNone;    // has the bound
    double penalty = kNone;  // compares the worth of bits
    double cost = kNone;     // is minimised
    double bits = kNone;     // decides between equal costs
    static constexpr double kNone = std::numeric_limits<double>::infinity();
};

/// Why a vector is tried.
enum class Phase { top, alone, raise, lower, back_off };
inline constexpr std::string_view kPhaseNames[] = {"top", "alone", "min+1", "max-1", "back off"};

struct Step {
    Phase phase{};
    int restart = 0;    // 0: the first descent
    int variable = -1;  // the variable changed from the current vector; -1: none
};

struct Problem {
    Lengths most;            // of every variable; the least length is 0
    std::size_t shaken = 0;  // restarts take bits from the first so many variables
    double most_error = 0;
    /// Tries some vectors, in order; may run them in parallel.
    std::function<std::vector<Trial>(std::span<const Lengths>, std::span<const Step>)> evaluate;
};

struct Options {
    int restarts = 0;
    std::uint64_t seed = 1;
};

struct Found {
    bool feasible = false;  // false: even `most` breaks the bound
    Lengths lengths;
    Trial trial;
    Trial top;                  // the trial of `most`
    Lengths alone;              // what each variable needs while all others have the most
    std::vector<double> costs;  // at the end of the first descent and of each restart
};

/// 1. `alone`: by bisection.  2. min+1: from there upwards, one bit at a time, to the variable
/// whose bit reduces the penalty most for its cost, until the bound holds.  3. max-1:
/// downwards, one bit at a time, from the variable whose bit adds the least penalty for what it
/// saves, while the bound holds; at the end no variable can lose a bit.  4. Each restart takes
/// random bits from the best vector and repeats 2 and 3 with randomly weighted worths; a better
/// vector replaces the best.  The same results of evaluate() give the same trials and the same
/// result.
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
