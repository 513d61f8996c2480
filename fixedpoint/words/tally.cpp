#include "fixedpoint/words/tally.h"

#include <algorithm>
#include <functional>
#include <stdexcept>

namespace squint {

thread_local Bill* Tally::bill = nullptr;
thread_local std::array<int, 64> Tally::wires{};
thread_local const char* Tally::ways = nullptr;
thread_local Tally::Columns* Tally::columns = nullptr;

bool any(Followed) {
    if (!Tally::ways) return true;
    if (*Tally::ways == 0) throw std::logic_error("a tally takes another way than the slab it follows");
    return *Tally::ways++ == '1';
}

// ------------------------------------------------------------------------------------------- bills

std::int64_t Bill::products(const std::map<Widths, std::int64_t>& operations) {
    std::int64_t sum = 0;
    for (const auto& [widths, count] : operations) sum += count * widths.first * widths.second;
    return sum;
}
std::int64_t Bill::number(const std::map<Widths, std::int64_t>& operations) {
    std::int64_t sum = 0;
    for (const auto& [widths, count] : operations) sum += count;
    return sum;
}
std::int64_t Bill::rounding_bits() const {
    std::int64_t sum = 0;
    for (const auto& [width, count] : roundings) sum += count * width;
    return sum;
}
void Bill::merge(const Bill& other) {
    const auto add = [](auto& to, const auto& from) {
        for (const auto& [widths, count] : from) to[widths] += count;
    };
    add(multipliers, other.multipliers), add(constant_multipliers, other.constant_multipliers);
    add(dividers, other.dividers), add(roundings, other.roundings);
    lookups += other.lookups, lookup_bits += other.lookup_bits;
}

// ------------------------------------------------------------------------------------------ widths

namespace {

int bits_of(const Range& x) {
    return x.low < 0 ? signed_bits(x) : static_cast<int>(bit_length(x.high));
}
Tally with_width(const Range& proven, int width, bool is_constant = false) {
    return {proven, std::max(width - bits_of(proven), 0), is_constant};
}
int most_spare(const Tally& a, const Tally& b) {
    return std::max(a.spare, b.spare);
}
bool both_constant(const Tally& a, const Tally& b) {
    return a.is_constant && b.is_constant;
}
// Free: shifts and signs.
bool is_power_of_two(const Tally& x) {
    const Int128 size = absolute(x.proven.low);
    return (size & (size - 1)) == 0;
}
void note_product(const Tally& a, const Tally& b) {
    if (!Tally::bill || both_constant(a, b)) return;
    if ((a.is_constant && is_power_of_two(a)) || (b.is_constant && is_power_of_two(b))) return;
    const Bill::Widths widths = std::minmax({a.width(), b.width()}, std::greater<>());
    ++(a.is_constant || b.is_constant ? Tally::bill->constant_multipliers : Tally::bill->multipliers)[widths];
}
void note_rounding(const Rescale& to) {
    if (Tally::bill && to.rounding != Rounding::trn) ++Tally::bill->roundings[to.width];
}
void note_lookup(int width) {
    if (!Tally::bill) return;
    ++Tally::bill->lookups, Tally::bill->lookup_bits += width;
}
Range column_range(const Table& table, const Range& row, int column) {
    if (!Tally::columns) return gather(table, row, column);
    const auto [at, is_new] = Tally::columns->try_emplace({&table, column});
    if (is_new) at->second = gather(table, row, column);
    return at->second;
}
// A word of a table is as wide as its wire's format.
Tally looked_up(const Range& proven, int wire) {
    const Tally word = with_width(proven, wire >= 0 ? Tally::wires[static_cast<std::size_t>(wire)] : 0);
    note_lookup(word.width());
    return word;
}

}  // namespace

int Tally::width() const {
    return bits_of(proven) + spare;
}
Tally tally_of(const Range& proven, int width) {
    return with_width(proven, width);
}

// -------------------------------------------------------------------------------------- operations

Tally operator+(const Tally& a, const Tally& b) {
    return {a.proven + b.proven, most_spare(a, b), both_constant(a, b)};
}
Tally operator-(const Tally& a, const Tally& b) {
    return {a.proven - b.proven, most_spare(a, b), both_constant(a, b)};
}
Tally operator*(const Tally& a, const Tally& b) {
    note_product(a, b);
    return {a.proven * b.proven, a.spare + b.spare, both_constant(a, b)};
}
Tally shift_left(const Tally& x, int bits) {
    return {shift_left(x.proven, bits), x.spare, x.is_constant};
}
Tally floor_shift(const Tally& x, int bits) {
    return {floor_shift(x.proven, bits), x.spare, x.is_constant};
}
Tally min(const Tally& a, const Tally& b) {
    const Range proven = min(a.proven, b.proven);
    if (!a.is_constant && !b.is_constant) return {proven, most_spare(a, b), false};
    return with_width(proven, std::min(a.width(), b.width()), both_constant(a, b));
}
Tally max(const Tally& a, const Tally& b) {
    return {max(a.proven, b.proven), most_spare(a, b), both_constant(a, b)};
}
Tally absolute(const Tally& x) {
    return {absolute(x.proven), x.spare, x.is_constant};
}
Tally select(Followed, const Tally& yes, const Tally& no) {
    // As wide as the wider one: the spare bits of each belong to its own range.
    return with_width(select(Perhaps{}, yes.proven, no.proven), std::max(yes.width(), no.width()));
}
Tally gather(const Table& table, const Tally& row, int column) {
    return looked_up(column_range(table, row.proven, column), table.wire_of(column));
}
std::array<Tally, 4> gather_cell(const CellTable& table, const Tally& row, const Tally& column) {
    const std::array<Range, 4> cell = gather_cell(table, row.proven, column.proven);
    return {looked_up(cell[0], table.wire_of(0)), looked_up(cell[1], table.wire_of(1)),
            looked_up(cell[2], table.wire_of(2)), looked_up(cell[3], table.wire_of(3))};
}
Tally blend(const Tally& v0, const Tally& v1, const Tally& weight, int weight_bits) {
    note_product(v1 - v0, weight);
    return {blend(v0.proven, v1.proven, weight.proven, weight_bits), most_spare(v0, v1), false};
}
Tally affine(const Tally& p, const Tally& k, const Tally& v, std::int64_t low, std::int64_t high) {
    note_product(k, v);
    return {affine(p.proven, k.proven, v.proven, low, high), p.spare, false};
}
Tally within(const Tally& x, std::int64_t low, std::int64_t high) {
    return {within(x.proven, low, high), 0, x.is_constant};
}
Tally bit_length(const Tally& x) {
    return {bit_length(x.proven), 0, x.is_constant};
}
Tally shift_by(const Tally& x, const Tally& bits) {
    return {shift_by(x.proven, bits.proven), x.spare, both_constant(x, bits)};
}
Tally vector_length(const std::array<Tally, 3>& v, int guard) {
    for (const Tally& x : v) note_product(x, x);
    const Tally length{vector_length(std::array{v[0].proven, v[1].proven, v[2].proven}, guard), 0, false};
    if (Tally::bill) ++Tally::bill->dividers[{length.width(), length.width()}];
    return length;
}
Tally quantise(const Tally& x, const Rescale& to) {
    if (!x.is_constant && to.shift > 0) note_rounding(to);
    return with_width(quantise(x.proven, to), to.width, x.is_constant);
}
Tally quotient(const Tally& numerator, const Tally& denominator, const Rescale& to) {
    const bool is_constant = both_constant(numerator, denominator);
    if (Tally::bill && !is_constant) {
        const bool apart = denominator.is_constant;
        if (!apart || !is_power_of_two(denominator))
            ++(apart ? Tally::bill->constant_multipliers
                     : Tally::bill->dividers)[{to.width, denominator.width()}];
        note_rounding(to);
    }
    return with_width(quotient(numerator.proven, denominator.proven, to), to.width, is_constant);
}

}  // namespace squint
