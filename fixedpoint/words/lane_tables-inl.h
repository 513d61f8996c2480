// How lanes read tables: rows, nodes and packed pairs of neighbours, at one address a lane.
#if defined(SQUINT_FIXEDPOINT_WORDS_LANE_TABLES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_FIXEDPOINT_WORDS_LANE_TABLES_INL_H
#undef SQUINT_FIXEDPOINT_WORDS_LANE_TABLES_INL_H
#else
#define SQUINT_FIXEDPOINT_WORDS_LANE_TABLES_INL_H
#endif

#include "fixedpoint/cell_table.h"
#include "fixedpoint/split_lerp.h"
#include "fixedpoint/words/lanes-inl.h"

#include <cassert>
#include <cstring>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// The numbers of lanes one by one, for addresses: 0 or more, so that unsigned words widen at no cost.
class LaneNumbers {
  public:
    HWY_INLINE explicit LaneNumbers(hn::Vec<hn::ScalableTag<std::int32_t>> numbers) {
        const hn::ScalableTag<std::uint32_t> d;
        hn::Store(hn::BitCast(d, numbers), d, at_);
    }
    HWY_INLINE std::size_t operator[](int lane) const { return at_[lane]; }

  private:
    alignas(64) std::uint32_t at_[HWY_LANES(std::uint32_t)];
};

template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> gather(const Table& table, Lanes<std::int32_t, K> row, int column) {
    const hn::ScalableTag<std::int32_t> d;
    const auto index = hn::Add(hn::Mul(row.v, hn::Set(d, table.columns())), hn::Set(d, column));
    return {hn::GatherIndex(d, table.narrow(), index)};
}
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> gather(const Table& table, Lanes<std::int64_t, K> row, int column) {
    const hn::ScalableTag<std::int64_t> d;
    const Lanes<std::int64_t, K> index = row * make_word(WordTag<Lanes<std::int64_t, K>>{}, table.columns()) +
                                         make_word(WordTag<Lanes<std::int64_t, K>>{}, column);
    if (const std::int32_t* narrow = table.narrow()) {
        const hn::Rebind<std::int32_t, decltype(d)> half;
        const hn::RebindToUnsigned<decltype(half)> low;
        const auto at = hn::TruncateTo(low, hn::BitCast(hn::RebindToUnsigned<decltype(d)>(), index.v));
        return {hn::PromoteTo(d, hn::GatherIndex(half, narrow, hn::BitCast(half, at)))};
    }
    return {hn::GatherIndex(d, table.wide(), index.v)};
}

/// Loads eight bytes at address(lane), a pointer to two words, and parts the first words from the second: half
/// of what two gathers cost, or less.
template <class Address>
HWY_INLINE std::array<hn::Vec<hn::ScalableTag<std::int32_t>>, 2> load_pairs(Address&& address) {
    const hn::ScalableTag<std::int32_t> d;
#if HWY_TARGET == HWY_SCALAR
    const std::int32_t* words = address(0);
    return {hn::Set(d, words[0]), hn::Set(d, words[1])};
#else
    constexpr int kBlocks = static_cast<int>(HWY_LANES(std::int32_t)) / 4;
    const hn::ScalableTag<std::int64_t> d64;
    const auto two = [&](int lane) HWY_ATTR {  // `lane` and the second after it
        const hn::Full64<std::int32_t> pair;
        return hn::Combine(hn::Full128<std::int32_t>(), hn::LoadU(pair, address(lane + 2)),
                           hn::LoadU(pair, address(lane)));
    };
    const auto block = [&](int j) HWY_ATTR {  // for lanes j and j + 2 of each four
        if constexpr (kBlocks == 1) {
            return two(j);
        } else if constexpr (kBlocks == 2) {
            return hn::Combine(d, two(4 + j), two(j));
        } else {
            const hn::Half<decltype(d)> half;
            return hn::Combine(d, hn::Combine(half, two(12 + j), two(8 + j)),
                               hn::Combine(half, two(4 + j), two(j)));
        }
    };
    const auto even = block(0), odd = block(1);
    const auto low = hn::BitCast(d64, hn::InterleaveLower(d, even, odd)),
               high = hn::BitCast(d64, hn::InterleaveUpper(d, even, odd));
    return {hn::BitCast(d, hn::InterleaveLower(d64, low, high)),
            hn::BitCast(d, hn::InterleaveUpper(d64, low, high))};
#endif
}
/// Rows `row` and `row + 1` of a table of one column.
template <KnownRescales K>
HWY_INLINE std::array<Lanes<std::int32_t, K>, 2> load_pair_of_rows(const Table& table,
                                                                   Lanes<std::int32_t, K> row) {
    assert(table.columns() == 1);
    const LaneNumbers at(row.v);
    const std::int32_t* words = table.narrow();
    const auto pairs = load_pairs([&](int lane) { return words + at[lane]; });
    return {Lanes<std::int32_t, K>{pairs[0]}, Lanes<std::int32_t, K>{pairs[1]}};
}

/// What a split lerp adds to `high`, the whole part of v0: quantised to the limits of `to`.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> limited_sum(Lanes<std::int32_t, K> high, Lanes<std::int32_t, K> rest,
                                              const Rescale& to) {
    if constexpr (K == KnownRescales::halves_up) return high + rest;
    Rescale limits = to;
    limits.shift = 0;
    return quantise(high + rest, limits);
}
/// lerp_nodes of pi2d-inl.h.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> lerp_nodes(Lanes<std::int32_t, K> v0, Lanes<std::int32_t, K> v1,
                                             Lanes<std::int32_t, K> weight, int weight_bits,
                                             const Rescale& to) {
    if (!splits_lerp(to, weight_bits)) return quantise(blend(v0, v1, weight, weight_bits), to);
    const int coarser = to.shift - weight_bits, low = to.shift / 2;
    const auto rise = v1 - v0;
    const auto added = shift_left(fraction_bits(v0, coarser), weight_bits) +
                       weight * fraction_bits(rise, low) +
                       make_word(WordTag<Lanes<std::int32_t, K>>{}, to.bias);
    const auto rest = floor_shift(rise, low) * weight + floor_shift(added, low);
    return limited_sum(floor_shift(v0, coarser), floor_shift(rest, to.shift - low), to);
}
/// lerp_row of entries-inl.h.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> lerp_row(const Table& table, Lanes<std::int32_t, K> row,
                                           Lanes<std::int32_t, K> weight, int weight_bits,
                                           const Rescale& to) {
    const auto [near, far] = load_pair_of_rows(table, row);
    if (!splits_lerp(to, weight_bits)) return quantise(blend(near, far, weight, weight_bits), to);
    const int coarser = to.shift - weight_bits;
    const auto rest = shift_left(fraction_bits(near, coarser), weight_bits) + weight * (far - near) +
                      make_word(WordTag<Lanes<std::int32_t, K>>{}, to.bias);
    return limited_sum(floor_shift(near, coarser), floor_shift(rest, to.shift), to);
}

/// The lower and the upper halves of 32-bit words, unsigned.
template <KnownRescales K, class V>
HWY_INLINE std::array<Lanes<std::int32_t, K>, 2> halves_of(V both) {
    const hn::ScalableTag<std::int32_t> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    return {Lanes<std::int32_t, K>{hn::And(both, hn::Set(d, 0xffff))},
            Lanes<std::int32_t, K>{hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(du, both)))}};
}

/// Loads sixteen bytes at an address for each lane and transposes them into four vectors: word w of lane i
/// becomes lane i of vector w.  This is one load a lane where gathers take four.
template <class Load>
HWY_INLINE std::array<hn::Vec<hn::ScalableTag<std::int32_t>>, 4> transposed_blocks(Load&& load) {
    const hn::ScalableTag<std::int32_t> d;
#if HWY_TARGET == HWY_SCALAR
    std::int32_t words[4];
    load(0, words);
    return {hn::Set(d, words[0]), hn::Set(d, words[1]), hn::Set(d, words[2]), hn::Set(d, words[3])};
#else
    constexpr int kBlocks = static_cast<int>(HWY_LANES(std::int32_t)) / 4;
    const auto block = [&](int j) {  // for lanes j, 4 + j, 8 + j, 12 + j
        if constexpr (kBlocks == 1) {
            return load(j);
        } else if constexpr (kBlocks == 2) {
            return hn::Combine(d, load(4 + j), load(j));
        } else {
            const hn::Half<decltype(d)> half;
            return hn::Combine(d, hn::Combine(half, load(12 + j), load(8 + j)),
                               hn::Combine(half, load(4 + j), load(j)));
        }
    };
    const auto a = block(0), b = block(1), c = block(2), e = block(3);
    const hn::ScalableTag<std::int64_t> d64;
    const auto wide = [&](auto v) { return hn::BitCast(d64, v); };
    const auto ab = wide(hn::InterleaveLower(d, a, b)), ce = wide(hn::InterleaveLower(d, c, e));
    const auto ab_upper = wide(hn::InterleaveUpper(d, a, b)), ce_upper = wide(hn::InterleaveUpper(d, c, e));
    const auto words = [&](auto v) { return hn::BitCast(d, v); };
    return {words(hn::InterleaveLower(d64, ab, ce)), words(hn::InterleaveUpper(d64, ab, ce)),
            words(hn::InterleaveLower(d64, ab_upper, ce_upper)),
            words(hn::InterleaveUpper(d64, ab_upper, ce_upper))};
#endif
}
/// The same for sixteen bytes at address(lane), a pointer.
template <class Address>
HWY_INLINE auto load_quads(Address&& address) {
#if HWY_TARGET == HWY_SCALAR
    return transposed_blocks([&](int lane, std::int32_t* words) { std::memcpy(words, address(lane), 16); });
#else
    const hn::Full128<std::int32_t> d;
    return transposed_blocks(
        [&](int lane) { return hn::LoadU(d, reinterpret_cast<const std::int32_t*>(address(lane))); });
#endif
}
/// The same for eight bytes at address(lane), each widened to 16 bits.
template <class Address>
HWY_INLINE auto load_widened_quads(Address&& address) {
#if HWY_TARGET == HWY_SCALAR
    return transposed_blocks([&](int lane, std::int32_t* words) {
        const std::uint8_t* from = address(lane);
        for (int w = 0; w < 4; ++w) words[w] = from[2 * w] | from[2 * w + 1] << 16;
    });
#else
    const hn::Full128<std::uint16_t> d;
    const hn::Full64<std::uint8_t> bytes;
    return transposed_blocks([&](int lane) {
        return hn::BitCast(hn::Full128<std::int32_t>(), hn::PromoteTo(d, hn::LoadU(bytes, address(lane))));
    });
#endif
}
/// Two neighbouring nodes of four unsigned 16-bit words each, at base + 8 position bytes.
template <KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<std::int32_t, K>, 4>, 2> load_neighbours(
    const void* base, Lanes<std::int32_t, K> position) {
    const LaneNumbers at(position.v);
    const auto* bytes = static_cast<const std::uint8_t*>(base);
    const auto words = load_quads([&](int lane) { return bytes + 8 * at[lane]; });
    const auto first = halves_of<K>(words[0]), second = halves_of<K>(words[1]),
               third = halves_of<K>(words[2]), fourth = halves_of<K>(words[3]);
    return {{{first[0], first[1], second[0], second[1]}, {third[0], third[1], fourth[0], fourth[1]}}};
}
/// The middle two of four 16-bit words that come as two pairs.
template <class V>
HWY_INLINE V inner_pair(V lower, V upper) {
    const hn::ScalableTag<std::int32_t> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    return hn::Or(hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(du, lower))), hn::ShiftLeft<16>(upper));
}
/// Turns pairs of unsigned 16-bit words into the signed ones that blend_pairs multiplies: subtracts 2^15 from
/// each, unless all are below that.
template <bool kBelow15Bits>
HWY_INLINE auto signed_pairs(hn::Vec<hn::ScalableTag<std::int32_t>> pairs) {
    if constexpr (kBelow15Bits) return pairs;
    return hn::Xor(pairs, hn::Set(hn::ScalableTag<std::int32_t>(), static_cast<std::int32_t>(0x80008000)));
}
/// Packs 1 - w into the low half and w into the high half; at most 14 fraction bits.
HWY_INLINE auto pair_weights(hn::Vec<hn::ScalableTag<std::int32_t>> weight, int weight_bits) {
    const hn::ScalableTag<std::int32_t> d;
    return hn::Or(hn::Sub(hn::Set(d, 1 << weight_bits), weight), hn::ShiftLeft<16>(weight));
}
/// Blends packed signed pairs (the low half has weight 1 - w), adds `offset` and quantises.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> blend_pairs(hn::Vec<hn::ScalableTag<std::int32_t>> pairs,
                                              hn::Vec<hn::ScalableTag<std::int32_t>> weights,
                                              std::int32_t offset, const Rescale& to) {
    const hn::ScalableTag<std::int32_t> d;
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_SSE4
    // There Highway's operation is one instruction for both products and their sum; elsewhere `unused` takes
    // one of the products.
    const hn::ScalableTag<std::int16_t> d16;
    auto unused = hn::Zero(d);
    const auto sum = [&](std::int32_t start) {
        return hn::ReorderWidenMulAccumulate(d, hn::BitCast(d16, pairs), hn::BitCast(d16, weights),
                                             hn::Set(d, start), unused);
    };
#else
    const auto low = [](auto v) { return hn::ShiftRight<16>(hn::ShiftLeft<16>(v)); };
    const auto high = [](auto v) { return hn::ShiftRight<16>(v); };
    const auto both = hn::Add(hn::Mul(low(pairs), low(weights)), hn::Mul(high(pairs), high(weights)));
    const auto sum = [&](std::int32_t start) { return hn::Add(both, hn::Set(d, start)); };
#endif
    if constexpr (K == KnownRescales::halves_up)
        return {shift_right_same(sum(offset + static_cast<std::int32_t>(to.bias)), to.shift)};
    return quantise(Lanes<std::int32_t, K>{sum(offset)}, to);
}
/// Rows `row` and `row + 1` of a table of two columns.
template <KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<std::int32_t, K>, 2>, 2> load_two_by_two(const Table& table,
                                                                                Lanes<std::int32_t, K> row) {
    assert(table.columns() == 2);
    using L = Lanes<std::int32_t, K>;
    const LaneNumbers at(row.v);
    const std::int32_t* words = table.narrow();
    const auto both = load_quads([&](int lane) { return words + 2 * at[lane]; });
    return {{{L{both[0]}, L{both[1]}}, {L{both[2]}, L{both[3]}}}};
}
/// Rows `row` and `row + 1` of a table with four columns.
template <KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<std::int32_t, K>, 4>, 2> load_two_rows(const std::int32_t* rows,
                                                                              Lanes<std::int32_t, K> row) {
    using L = Lanes<std::int32_t, K>;
    const LaneNumbers byte(hn::ShiftLeft<4>(row.v));
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(rows);
    const auto a = load_quads([&](int lane) { return bytes + byte[lane]; });
    const auto b = load_quads([&](int lane) { return bytes + byte[lane] + 16; });
    return {{{L{a[0]}, L{a[1]}, L{a[2]}, L{a[3]}}, {L{b[0]}, L{b[1]}, L{b[2]}, L{b[3]}}}};
}
/// Interpolates between rows `row` and `row + 1` of four columns: paired rows (Table::paired), weights of at
/// most 14 bits.
template <KnownRescales K>
HWY_INLINE std::array<Lanes<std::int32_t, K>, 4> lerp_paired_rows(const std::int32_t* paired,
                                                                  Lanes<std::int32_t, K> row,
                                                                  Lanes<std::int32_t, K> weight,
                                                                  int weight_bits, const Rescale& to_color,
                                                                  const Rescale& to_alpha) {
    const LaneNumbers byte(hn::ShiftLeft<4>(row.v));
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(paired);
    const auto pairs = load_quads([&](int lane) { return bytes + byte[lane]; });
    const auto weights = pair_weights(weight.v, weight_bits);
    const std::int32_t offset = 1 << (weight_bits + 15);
    return {blend_pairs<K>(pairs[0], weights, offset, to_color),
            blend_pairs<K>(pairs[1], weights, offset, to_color),
            blend_pairs<K>(pairs[2], weights, offset, to_color),
            blend_pairs<K>(pairs[3], weights, offset, to_alpha)};
}
/// A node of four 16-bit words is two 32-bit words, or one of 64 bits; the first channel is lowest.
template <KnownRescales K>
HWY_INLINE std::array<Lanes<std::int32_t, K>, 4> gather_cell(const CellTable& table,
                                                             Lanes<std::int32_t, K> row,
                                                             Lanes<std::int32_t, K> column) {
    const hn::ScalableTag<std::int32_t> d;
    using L = Lanes<std::int32_t, K>;
    const auto cell = hn::Add(hn::Mul(row.v, hn::Set(d, table.size())), column.v);
    if (table.is_narrow()) {
        const auto* words = reinterpret_cast<const std::int32_t*>(table.narrow_words());
        const auto low = hn::GatherIndex(d, words, hn::Add(cell, cell));
        const auto high = hn::GatherIndex(d, words, hn::Add(hn::Add(cell, cell), hn::Set(d, 1)));
        const auto first = halves_of<K>(low), second = halves_of<K>(high);
        return {first[0], first[1], second[0], second[1]};
    }
    const auto* words = reinterpret_cast<const std::int32_t*>(table.wide_words());
    const auto first = hn::ShiftLeft<2>(cell);
    const auto at = [&](int c) { return L{hn::GatherIndex(d, words, hn::Add(first, hn::Set(d, c)))}; };
    return {at(0), at(1), at(2), at(3)};
}
template <KnownRescales K>
HWY_INLINE std::array<Lanes<std::int64_t, K>, 4> gather_cell(const CellTable& table,
                                                             Lanes<std::int64_t, K> row,
                                                             Lanes<std::int64_t, K> column) {
    const hn::ScalableTag<std::int64_t> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    using L = Lanes<std::int64_t, K>;
    const auto cell = (row * make_word(WordTag<L>{}, table.size()) + column).v;
    if (table.is_narrow()) {
        const auto all = hn::BitCast(
            du, hn::GatherIndex(d, reinterpret_cast<const std::int64_t*>(table.narrow_words()), cell));
        const auto mask = hn::Set(du, 0xffff);
        const auto part = [&](auto v) { return L{hn::BitCast(d, hn::And(v, mask))}; };
        return {part(all), part(hn::ShiftRight<16>(all)), part(hn::ShiftRight<32>(all)),
                part(hn::ShiftRight<48>(all))};
    }
    const auto* words = reinterpret_cast<const std::int64_t*>(table.wide_words());
    const auto first = hn::ShiftLeft<1>(cell);
    const auto low = hn::BitCast(du, hn::GatherIndex(d, words, first));
    const auto high = hn::BitCast(du, hn::GatherIndex(d, words, hn::Add(first, hn::Set(d, 1))));
    const auto mask = hn::Set(du, 0xffffffff);
    const auto part = [&](auto v) { return L{hn::BitCast(d, hn::And(v, mask))}; };
    return {part(low), part(hn::ShiftRight<32>(low)), part(high), part(hn::ShiftRight<32>(high))};
}

template <class T, KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<T, K>, 4>, 2> gather_two_cells(const CellTable& table, Lanes<T, K> row,
                                                                      Lanes<T, K> column) {
    if constexpr (sizeof(T) == 4)
        if (table.is_narrow())
            return load_neighbours(table.narrow_words(),
                                   row * make_word(WordTag<Lanes<T, K>>{}, table.size()) + column);
    if constexpr (sizeof(T) == 4)
        return load_two_rows(reinterpret_cast<const std::int32_t*>(table.wide_words()),
                             row * make_word(WordTag<Lanes<T, K>>{}, table.size()) + column);
    return {gather_cell(table, row, column),
            gather_cell(table, row, column + make_word(WordTag<Lanes<T, K>>{}, 1))};
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
