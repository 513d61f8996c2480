// The model's 128-bit word, which notes the way that each branch takes: what a slab of a picture costs follows
// from its ways (tally.h runs them again).
#pragma once

#include "fixedpoint/cell_table.h"
#include "fixedpoint/words/word.h"

#include <array>
#include <string>

namespace squint {

struct Branching {
    Int128 v = 0;
    // Where any() notes its answers, '1' for yes and '0' for no; null: nowhere.
    inline static thread_local std::string* ways = nullptr;
};
/// The answer to a comparison of Branching words.
struct Branch {
    bool holds = false;
    explicit operator bool() const { return holds; }
    friend Branch operator!(Branch a) { return {!a.holds}; }
    friend Branch operator&(Branch a, Branch b) { return {a.holds && b.holds}; }
    friend Branch operator|(Branch a, Branch b) { return {a.holds || b.holds}; }
};
inline bool any(Branch branch) {
    if (Branching::ways) *Branching::ways += branch.holds ? '1' : '0';
    return branch.holds;
}

inline Branching make_word(WordTag<Branching>, std::int64_t value) {
    return {value};
}
inline Branching operator+(Branching a, Branching b) {
    return {a.v + b.v};
}
inline Branching operator-(Branching a, Branching b) {
    return {a.v - b.v};
}
inline Branching operator*(Branching a, Branching b) {
    return {a.v * b.v};
}
inline Branch operator==(Branching a, Branching b) {
    return {a.v == b.v};
}
inline Branch operator<(Branching a, Branching b) {
    return {a.v < b.v};
}
inline Branching select(Branch branch, Branching yes, Branching no) {
    return branch.holds ? yes : no;
}
inline std::int64_t to_index(Branching x) {
    return static_cast<std::int64_t>(x.v);
}
inline Branching shift_left(Branching x, int bits) {
    return {shift_left(x.v, bits)};
}
inline Branching floor_shift(Branching x, int bits) {
    return {floor_shift(x.v, bits)};
}
inline Branching min(Branching a, Branching b) {
    return {min(a.v, b.v)};
}
inline Branching max(Branching a, Branching b) {
    return {max(a.v, b.v)};
}
inline Branching absolute(Branching x) {
    return {absolute(x.v)};
}
inline Branching gather(const Table& table, Branching row, int column) {
    return {gather(table, row.v, column)};
}
inline std::array<Branching, 4> gather_cell(const CellTable& table, Branching row, Branching column) {
    const std::array<Int128, 4> cell = gather_cell(table, row.v, column.v);
    return {{{cell[0]}, {cell[1]}, {cell[2]}, {cell[3]}}};
}
inline Branching blend(Branching v0, Branching v1, Branching weight, int bits) {
    return {blend(v0.v, v1.v, weight.v, bits)};
}
inline Branching affine(Branching p, Branching k, Branching v, std::int64_t low, std::int64_t high) {
    return {affine(p.v, k.v, v.v, low, high)};
}
inline Branching within(Branching x, std::int64_t, std::int64_t) {
    return x;
}
inline Branching bit_length(Branching x) {
    return {bit_length(x.v)};
}
inline Branching shift_by(Branching x, Branching bits) {
    return {shift_by(x.v, bits.v)};
}
inline Branching vector_length(const std::array<Branching, 3>& v, int guard) {
    return {vector_length(std::array<Int128, 3>{v[0].v, v[1].v, v[2].v}, guard)};
}
inline Branching quantise(Branching x, const Rescale& to) {
    return {quantise(x.v, to)};
}
inline Branching quotient(Branching numerator, Branching denominator, const Rescale& to) {
    return {quotient(numerator.v, denominator.v, to)};
}

static_assert(Word<Branching>);

}  // namespace squint
