// A word that counts the operations of a stage as hardware: multipliers, dividers, roundings and look-ups, by
// the widths of their operands.  Both outcomes of a comparison are followed (Followed), so that a run counts
// the dearest path; or a run follows the ways of a slab that was computed (branching.h), and counts those.
//
// Widths: a value on a wire has the width of its format.  A sum or a difference has the width of its proven
// range, plus the bits by which the formats of its wires exceed what was proven of them.  A value narrowed by
// a limit or a promise (min, within) has no such spare bits.  The sign counts where a value can be negative.
#pragma once

#include "fixedpoint/cell_table.h"
#include "fixedpoint/words.h"

#include <array>
#include <cstdint>
#include <map>
#include <utility>

namespace squint {

/// Numbers of operations, by widths.
struct Bill {
    using Widths = std::pair<int, int>;          // the greater first; a divider's: quotient, divisor
    std::map<Widths, std::int64_t> multipliers;  // both factors vary
    std::map<Widths, std::int64_t>
        constant_multipliers;                   // one factor, or the divisor, is a constant of the plan
    std::map<Widths, std::int64_t> dividers;    // square roots too, by the width of the root
    std::map<int, std::int64_t> roundings;      // other than trn, by the result's width
    std::int64_t lookups = 0, lookup_bits = 0;  // words read from tables

    std::int64_t multiplier_bits() const { return products(multipliers); }
    std::int64_t constant_multiplier_bits() const { return products(constant_multipliers); }
    std::int64_t divider_bits() const { return products(dividers); }
    std::int64_t rounding_bits() const;
    void merge(const Bill& other);
    static std::int64_t products(const std::map<Widths, std::int64_t>& operations);
    static std::int64_t number(const std::map<Widths, std::int64_t>& operations);
};

struct Tally {
    Range proven;              // all values that it can have
    int spare = 0;             // bits of its wires beyond those that `proven` needs
    bool is_constant = false;  // a constant of the plan

    int width() const;

    static thread_local Bill* bill;                 // where operations are counted; null: nowhere
    static thread_local std::array<int, 64> wires;  // width of every wire's format: what tables hold
    // What any() answers, one after the other, as Branching::ways has it; null: always yes.
    static thread_local const char* ways;
    // What columns of tables hold, for runs that read the same tables again; null: not kept.
    using Columns = std::map<std::pair<const Table*, int>, Range>;
    static thread_local Columns* columns;
};
/// A comparison of tallies.
struct Followed {
    friend constexpr Followed operator&(Followed, Followed) { return {}; }
    friend constexpr Followed operator|(Followed, Followed) { return {}; }
    friend constexpr Followed operator!(Followed) { return {}; }
};
/// Throws std::logic_error where Tally::ways are at their end.
bool any(Followed);
/// A value of `width` bits, proven to lie in `proven`.
Tally tally_of(const Range& proven, int width);

constexpr Tally make_word(WordTag<Tally>, std::int64_t value) {
    return {{value, value}, 0, true};
}
Tally operator+(const Tally& a, const Tally& b);
Tally operator-(const Tally& a, const Tally& b);
Tally operator*(const Tally& a, const Tally& b);
constexpr Followed operator==(const Tally&, const Tally&) {
    return {};
}
constexpr Followed operator<(const Tally&, const Tally&) {
    return {};
}
Tally shift_left(const Tally& x, int bits);
Tally floor_shift(const Tally& x, int bits);
Tally min(const Tally& a, const Tally& b);
Tally max(const Tally& a, const Tally& b);
Tally absolute(const Tally& x);
Tally select(Followed, const Tally& yes, const Tally& no);
Tally gather(const Table& table, const Tally& row, int column);
std::array<Tally, 4> gather_cell(const CellTable& table, const Tally& row, const Tally& column);
Tally blend(const Tally& v0, const Tally& v1, const Tally& weight, int weight_bits);
Tally affine(const Tally& p, const Tally& k, const Tally& v, std::int64_t low, std::int64_t high);
Tally within(const Tally& x, std::int64_t low, std::int64_t high);
Tally bit_length(const Tally& x);
Tally shift_by(const Tally& x, const Tally& bits);
Tally vector_length(const std::array<Tally, 3>& v, int guard);
Tally quantise(const Tally& x, const Rescale& to);
Tally quotient(const Tally& numerator, const Tally& denominator, const Rescale& to);

}  // namespace squint
