// The model's 128-bit word, which counts what arrives on each wire.
#pragma once

#include "fixedpoint/audit.h"
#include "fixedpoint/words/word.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace squint {

struct Audited {
    Int128 v = 0;
    friend constexpr Audited operator+(Audited a, Audited b) { return {a.v + b.v}; }
    friend constexpr Audited operator-(Audited a, Audited b) { return {a.v - b.v}; }
    friend constexpr Audited operator*(Audited a, Audited b) { return {a.v * b.v}; }
    friend constexpr bool operator==(Audited a, Audited b) { return a.v == b.v; }
    friend constexpr bool operator<(Audited a, Audited b) { return a.v < b.v; }
};
constexpr Audited make_word(WordTag<Audited>, std::int64_t value) {
    return {value};
}
constexpr Audited shift_left(Audited x, int bits) {
    return {shift_left(x.v, bits)};
}
constexpr Audited floor_shift(Audited x, int bits) {
    return {x.v >> bits};
}
constexpr Audited min(Audited a, Audited b) {
    return b < a ? b : a;
}
constexpr Audited max(Audited a, Audited b) {
    return a < b ? b : a;
}
constexpr Audited absolute(Audited x) {
    return {absolute(x.v)};
}
constexpr Audited select(bool c, Audited yes, Audited no) {
    return c ? yes : no;
}
constexpr double to_double(Audited x) {
    return static_cast<double>(x.v);
}
constexpr std::int64_t to_index(Audited x) {
    return static_cast<std::int64_t>(x.v);
}
inline Audited gather(const Table& t, Audited row, int column) {
    return {gather(t, row.v, column)};
}
constexpr Audited blend(Audited a, Audited b, Audited w, int bits) {
    return {blend(a.v, b.v, w.v, bits)};
}
constexpr Audited affine(Audited p, Audited k, Audited v, std::int64_t, std::int64_t) {
    return {p.v + k.v * v.v};
}
constexpr Audited within(Audited x, std::int64_t, std::int64_t) {
    return x;
}
constexpr Audited bit_length(Audited x) {
    return {bit_length(x.v)};
}
constexpr Audited shift_by(Audited x, Audited bits) {
    return {shift_by(x.v, bits.v)};
}
inline Audited vector_length(const std::array<Audited, 3>& v, int guard) {
    return {vector_length(std::array<Int128, 3>{v[0].v, v[1].v, v[2].v}, guard)};
}

inline Audited record(Int128 rounded, bool inexact, double exact, const Rescale& to) {
    const Int128 raw = limit(rounded, to);
    if (WireStatistics* s = to.statistics) {
        const auto value = static_cast<std::int64_t>(raw);
        ++s->count;
        s->inexact += inexact;
        s->underflowed += inexact && rounded == 0;
        if (raw != rounded) ++(to.wraps ? s->wrapped : s->saturated);
        s->smallest = std::min(s->smallest, value);
        s->largest = std::max(s->largest, value);
        s->ones |= static_cast<std::uint64_t>(absolute(value));
        ++s->magnitude[static_cast<std::size_t>(bit_length(absolute(value)))];
        if (s->trace) s->trace->push_back({to.wire, exact, value});
    }
    return {raw};
}
inline Audited quantise(Audited x, const Rescale& to) {
    const Int128 rounded = round_off(x.v, to);
    return record(rounded, to.shift > 0 && (rounded << to.shift) != x.v,
                  std::ldexp(static_cast<double>(x.v), -to.shift), to);
}
inline Audited quotient(Audited numerator, Audited denominator, const Rescale& to) {
    Rescale unlimited = to;
    unlimited.wraps = false, unlimited.lowest = std::numeric_limits<std::int64_t>::min(),
    unlimited.highest = std::numeric_limits<std::int64_t>::max();
    const Int128 q = quotient(numerator.v, denominator.v, unlimited);
    const Int128 scaled = shift_left(numerator.v, -to.shift);
    return record(q, q * denominator.v != scaled,
                  static_cast<double>(scaled) / static_cast<double>(denominator.v), to);
}

static_assert(Word<Audited>);

}  // namespace squint
