// Interval arithmetic: it proves how wide the exact results of a stage are.
#include "fixedpoint/words/range.h"

#include "fixedpoint/split_quotient.h"

namespace squint {

thread_local WordNeeds Range::needs;
thread_local std::uint64_t Range::limited = 0;
thread_local std::uint64_t Range::used = 0;
thread_local std::map<int, Range>* Range::of_wires = nullptr;

namespace {

constexpr Int128 kFar = Int128{1} << 126;  // stands for all that is wider than 127 bits
Int128 cap(Int128 x) {
    return x > kFar ? kFar : x < -kFar ? -kFar : x;
}

int bits_of(Int128 x) {  // sign bit included
    const Int128 magnitude = x < 0 ? -(x + 1) : x;
    return static_cast<int>(bit_length(magnitude)) + 1;
}
Int128 product(Int128 a, Int128 b) {
    Int128 result;
    if (__builtin_mul_overflow(a, b, &result)) return (a < 0) == (b < 0) ? kFar : -kFar;
    return cap(result);
}
void note_operands(Range a, Range b) {
    Range::needs.operand_bits = std::max({Range::needs.operand_bits, signed_bits(a), signed_bits(b)});
}
Range spanning(std::initializer_list<Int128> values) {
    return {std::min(values), std::max(values)};
}

}  // namespace

int signed_bits(Range x) {
    return std::max(bits_of(x.low), bits_of(x.high));
}

Range noted(Range result) {
    result = {cap(result.low), cap(result.high)};
    Range::needs.result_bits = std::max(Range::needs.result_bits, signed_bits(result));
    Range::needs.lane_bits = std::max(Range::needs.lane_bits, signed_bits(result));
    return result;
}
namespace {
// A result on the way to a smaller one: lanes may let it wrap, because the smaller one comes out right.
void noted_in_passing(Int128 low, Int128 high) {
    Range::needs.result_bits = std::max(Range::needs.result_bits, signed_bits({cap(low), cap(high)}));
}
}  // namespace
Range operator+(Range a, Range b) {
    return noted({a.low + b.low, a.high + b.high});
}
Range operator-(Range a, Range b) {
    return noted({a.low - b.high, a.high - b.low});
}
Range operator*(Range a, Range b) {
    note_operands(a, b);
    return noted(spanning(
        {product(a.low, b.low), product(a.low, b.high), product(a.high, b.low), product(a.high, b.high)}));
}
Range shift_left(Range x, int bits) {
    const Int128 factor = Int128{1} << bits;
    return noted({product(x.low, factor), product(x.high, factor)});
}
Range floor_shift(Range x, int bits) {
    return {x.low >> bits, x.high >> bits};
}
namespace {
// A limit that no value comes near is a word all the same: lanes must hold it to compare with it.
void note_limits(Range a, Range b) {
    for (const Range& x : {a, b})
        if (x.low == x.high) noted(x);
}
}  // namespace
Range min(Range a, Range b) {
    note_limits(a, b);
    return {std::min(a.low, b.low), std::min(a.high, b.high)};
}
Range max(Range a, Range b) {
    note_limits(a, b);
    return {std::max(a.low, b.low), std::max(a.high, b.high)};
}
Range absolute(Range x) {
    const Int128 high = std::max(x.high, -x.low);
    return noted({x.low > 0 ? x.low : x.high < 0 ? -x.high : 0, high});
}
Range select(Perhaps, Range yes, Range no) {
    return {std::min(yes.low, no.low), std::max(yes.high, no.high)};
}
namespace {
template <class T>
Range range_of_column(const T* word, int rows, int columns) {
    T low = *word, high = *word;
    for (int row = 1; row < rows; ++row) {
        word += columns;
        low = std::min(low, *word), high = std::max(high, *word);
    }
    return {low, high};
}
}  // namespace
Range gather(const Table& table, Range, int column) {
    note_wire(WordTag<Range>{}, table.wire_of(column));
    const auto of = [&](const auto* words) {
        return range_of_column(words + column, table.rows(), table.columns());
    };
    return noted(table.narrow() ? of(table.narrow()) : of(table.wide()));
}
Range blend(Range v0, Range v1, Range weight, int weight_bits) {
    const Range difference = v1 - v0;
    note_operands(difference, weight);
    noted_in_passing(2 * product(difference.low, weight.high), 2 * product(difference.high, weight.high));
    const Range hull{std::min(v0.low, v1.low), std::max(v0.high, v1.high)};
    return shift_left(hull, weight_bits);
}
Range affine(Range p, Range k, Range v, std::int64_t low, std::int64_t high) {
    note_operands(k, v);
    noted_in_passing(p.low + product(k.high, v.low), p.high + product(k.high, v.high));
    return noted({low, high});
}
Range within(Range x, std::int64_t low, std::int64_t high) {
    return {std::max<Int128>(x.low, low), std::min<Int128>(x.high, high)};
}
Range bit_length(Range x) {
    return {bit_length(std::max<Int128>(x.low, 0)), bit_length(x.high)};
}
Range shift_by(Range x, Range bits) {
    const auto at = [](Int128 value, Int128 by) {
        return by >= 0 ? product(value, Int128{1} << std::min<Int128>(by, 120))
                       : value >> std::min<Int128>(-by, 120);
    };
    // The callers know that the result is smaller, and say so with within().
    const Range all =
        spanning({at(x.low, bits.low), at(x.low, bits.high), at(x.high, bits.low), at(x.high, bits.high)});
    noted_in_passing(all.low, all.high);
    return {cap(all.low), cap(all.high)};
}
Range vector_length(const std::array<Range, 3>& v, int guard) {
    Int128 squares = 0;
    for (const Range& x : v) note_operands(x, x), squares += product(x.high, x.high);
    squares <<= 2 * guard;
    noted_in_passing(0, squares);
    return noted({0, static_cast<Int128>(std::sqrt(static_cast<double>(squares))) + 1});
}
namespace {
void note_range(int wire, Range values) {
    if (!Range::of_wires || wire < 0) return;
    const auto [found, first] = Range::of_wires->try_emplace(wire, values);
    if (!first) found->second = select({}, found->second, values);
}
// What a wire carries of rounded values.
Range arrived(Range rounded, const Rescale& to) {
    note_range(to.wire, rounded);
    if (rounded.low >= to.lowest && rounded.high <= to.highest) return rounded;
    if (to.wire >= 0) Range::limited |= std::uint64_t{1} << to.wire;
    if (to.wraps) return {to.lowest, to.highest};
    return {limit(rounded.low, to), limit(rounded.high, to)};
}
}  // namespace
Range quantise(Range x, const Rescale& to) {
    note_wire(WordTag<Range>{}, to.wire);
    Range rounded = x;
    if (to.shift <= 0) {
        rounded = shift_left(x, -to.shift);
    } else {
        noted({x.low - to.bias, x.high + to.bias + to.to_even + to.to_zero});
        rounded = {round_off(x.low, to), round_off(x.high, to)};
    }
    return arrived(rounded, to);
}
Range quotient(Range numerator, Range denominator, const Rescale& to) {
    note_wire(WordTag<Range>{}, to.wire);
    const Int128 factor = Int128{1} << -to.shift;
    const Int128 scaled_high = product(std::max<Int128>(numerator.high, 0), factor);
    const Int128 scaled_low = product(std::max<Int128>(numerator.low, 0), factor);
    const Int128 smallest = std::max<Int128>(denominator.low, 1),
                 largest = std::max<Int128>(denominator.high, 1);
    noted_in_passing(0, scaled_high);
    noted({0, 4 * largest});
    // Lanes estimate in floating point: results of 22 bits in 32-bit lanes, of 48 in 64-bit ones.  They
    // saturate only.
    const int lanes = to.wraps || to.width > 48 ? 65 : to.width > 22 ? 33 : 0;
    Range::needs.lane_bits = std::max(Range::needs.lane_bits, lanes);
    return arrived({scaled_low / largest, scaled_high / smallest + 1}, to);
}

namespace {
WideRange noted_as_wide(Int128 low, Int128 high) {
    const Range result{cap(low), cap(high)};
    Range::needs.result_bits = std::max(Range::needs.result_bits, signed_bits(result));
    Range::needs.wide_bits = std::max(Range::needs.wide_bits, signed_bits(result));
    return {result};
}
}  // namespace
WideRange widen(Range x) {
    return {x};
}
WideRange wide_sum(Range high, int bits, Range low) {
    const Int128 factor = Int128{1} << bits;
    return noted_as_wide(product(high.low, factor) + low.low, product(high.high, factor) + low.high);
}
WideRange wide_product(Range a, Range b) {
    note_operands(a, b);
    const Range all = spanning(
        {product(a.low, b.low), product(a.low, b.high), product(a.high, b.low), product(a.high, b.high)});
    return noted_as_wide(all.low, all.high);
}
WideRange operator-(WideRange a, WideRange b) {
    return noted_as_wide(a.range.low - b.range.high, a.range.high - b.range.low);
}
WideRange shift_left(WideRange x, int bits) {
    const Int128 factor = Int128{1} << bits;
    return noted_as_wide(product(x.range.low, factor), product(x.range.high, factor));
}
WideRange absolute(WideRange x) {
    const auto& [low, high] = x.range;
    return noted_as_wide(low > 0 ? low : high < 0 ? -high : 0, std::max(high, -low));
}
WideRange max(WideRange a, WideRange b) {
    return {max(a.range, b.range)};
}
Range quotient(WideRange numerator, WideRange denominator, const Rescale& to) {
    const int lanes_before = Range::needs.lane_bits;
    const Range q = quotient(numerator.range, denominator.range, to);
    Range::needs.lane_bits = std::max(lanes_before, to.wraps || to.width > 31 ? 65 : 0);
    noted_as_wide(0, product(std::max<Int128>(denominator.range.high, 1),
                             Int128{1} << bits_beside_denominator(to.width)));
    return q;
}

}  // namespace squint
