// Intervals: bounds of a stage's exact results, and so the width of its words (pipeline/plan/ranges.cpp).
#pragma once

#include "fixedpoint/words/word.h"

#include <algorithm>
#include <array>
#include <map>

namespace squint {

/// How wide the numbers of a stage get, in bits.
struct WordNeeds {
    int wide_bits = 0;     // the widest number of a Wide<W>, sign included
    int operand_bits = 0;  // the widest factor of a product, sign included
    int result_bits = 0;   // the widest exact result, sign included
    int lane_bits = 0;     // as result_bits, but results on the way to a smaller one may wrap
    void merge(const WordNeeds& other) {
        operand_bits = std::max(operand_bits, other.operand_bits);
        result_bits = std::max(result_bits, other.result_bits);
        lane_bits = std::max(lane_bits, other.lane_bits);
        wide_bits = std::max(wide_bits, other.wide_bits);
    }
};

/// All values that an expression can take, lowest and highest.  Operations note their widths in `needs`.
struct Range {
    Int128 low = 0, high = 0;
    static thread_local WordNeeds needs;
    static thread_local std::uint64_t limited;  // bit w: wire w can saturate or wrap
    static thread_local std::uint64_t used;     // bit w: a value passes wire w or is read from its table
    static thread_local std::map<int, Range>* of_wires;  // gets the values on each wire, before limits
};
inline void note_wire(WordTag<Range>, int wire) {
    if (wire >= 0) Range::used |= std::uint64_t{1} << wire;
}
/// A comparison of ranges: both outcomes are followed.
struct Perhaps {
    friend constexpr Perhaps operator&(Perhaps, Perhaps) { return {}; }
    friend constexpr Perhaps operator|(Perhaps, Perhaps) { return {}; }
    friend constexpr Perhaps operator!(Perhaps) { return {}; }
};
constexpr bool any(Perhaps) {
    return true;
}
int signed_bits(Range x);
Range noted(Range result);
Range operator+(Range a, Range b);
Range operator-(Range a, Range b);
Range operator*(Range a, Range b);
constexpr Perhaps operator==(Range, Range) {
    return {};
}
constexpr Perhaps operator<(Range, Range) {
    return {};
}
constexpr Range make_word(WordTag<Range>, std::int64_t value) {
    return {value, value};
}
Range shift_left(Range x, int bits);
Range floor_shift(Range x, int bits);
Range min(Range a, Range b);
Range max(Range a, Range b);
Range absolute(Range x);
Range select(Perhaps, Range yes, Range no);
Range gather(const Table& table, Range row, int column);
Range blend(Range v0, Range v1, Range weight, int weight_bits);
Range affine(Range p, Range k, Range v, std::int64_t low, std::int64_t high);
Range within(Range x, std::int64_t low, std::int64_t high);
Range bit_length(Range x);
Range shift_by(Range x, Range bits);
Range vector_length(const std::array<Range, 3>& v, int guard);
Range quantise(Range x, const Rescale& to);
Range quotient(Range numerator, Range denominator, const Rescale& to);

struct WideRange {
    Range range;
};
template <>
struct WideOf<Range> {
    using Type = WideRange;
};
constexpr bool any_positive(const WideRange&) {
    return true;
}
WideRange widen(Range x);
WideRange wide_sum(Range high, int bits, Range low);
WideRange wide_product(Range a, Range b);
WideRange operator-(WideRange a, WideRange b);
WideRange shift_left(WideRange x, int bits);
WideRange absolute(WideRange x);
WideRange max(WideRange a, WideRange b);
Range quotient(WideRange numerator, WideRange denominator, const Rescale& to);

static_assert(Word<Range>);

}  // namespace squint
