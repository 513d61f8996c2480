// The word of the fast path: as many samples side by side as a vector register holds.  All vector types and
// target code live here; compiled once per SIMD target (Highway's foreach_target).  Only + - * / sqrt that
// IEEE 754 rounds exactly are used in floating point, and every quotient and root is corrected in integers:
// the same bits as the model's on every CPU.
//
//   Lanes<int32_t>   products and sums of 32 bits
//   Lanes<int64_t>   factors of 32 bits, products and sums of 64
#if defined(SQUINT_FIXEDPOINT_LANES_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_FIXEDPOINT_LANES_H
#undef SQUINT_FIXEDPOINT_LANES_H
#else
#define SQUINT_FIXEDPOINT_LANES_H
#endif

#include "fixedpoint/cell_table.h"
#include "fixedpoint/unrolled.h"
#include "fixedpoint/words.h"

#include <hwy/highway.h>

#include <algorithm>
#include <cstring>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// K: what is known of every Rescale the word meets when its kernel is compiled (fixedpoint/quantise.h).
template <class T, KnownRescales K = KnownRescales::nothing>
struct Lanes {
    using Element = T;
    using D = hn::ScalableTag<T>;
    using V = hn::Vec<D>;
    static constexpr KnownRescales kKnown = K;
    V v;
    static constexpr std::size_t count() { return HWY_LANES(T); }
};
template <class T>
struct LaneMask {
    using M = hn::Mask<hn::ScalableTag<T>>;
    M m;
};

/// words.h's constant, compiled for the target.
template <class W>
HWY_INLINE W constant(std::int64_t value) {
    return make_word(WordTag<W>{}, value);
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> make_word(WordTag<Lanes<T, K>>, std::int64_t value) {
    return {hn::Set(hn::ScalableTag<T>(), static_cast<T>(value))};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> operator+(Lanes<T, K> a, Lanes<T, K> b) {
    return {hn::Add(a.v, b.v)};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> operator-(Lanes<T, K> a, Lanes<T, K> b) {
    return {hn::Sub(a.v, b.v)};
}
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> operator*(Lanes<std::int32_t, K> a, Lanes<std::int32_t, K> b) {
    return {hn::Mul(a.v, b.v)};
}
/// Factors of 32 bits each, sign included.
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> operator*(Lanes<std::int64_t, K> a, Lanes<std::int64_t, K> b) {
    const hn::ScalableTag<std::int32_t> d32;
    return {hn::MulEven(hn::BitCast(d32, a.v), hn::BitCast(d32, b.v))};
}
template <class T, KnownRescales K>
HWY_INLINE LaneMask<T> operator==(Lanes<T, K> a, Lanes<T, K> b) {
    return {hn::Eq(a.v, b.v)};
}
template <class T, KnownRescales K>
HWY_INLINE LaneMask<T> operator<(Lanes<T, K> a, Lanes<T, K> b) {
    return {hn::Lt(a.v, b.v)};
}
template <class T>
HWY_INLINE LaneMask<T> operator&(LaneMask<T> a, LaneMask<T> b) {
    return {hn::And(a.m, b.m)};
}
template <class T>
HWY_INLINE LaneMask<T> operator|(LaneMask<T> a, LaneMask<T> b) {
    return {hn::Or(a.m, b.m)};
}
template <class T>
HWY_INLINE LaneMask<T> operator!(LaneMask<T> a) {
    return {hn::Not(a.m)};
}
template <class T>
HWY_INLINE bool any(LaneMask<T> a) {
    return !hn::AllFalse(hn::ScalableTag<T>(), a.m);
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> select(LaneMask<T> c, Lanes<T, K> yes, Lanes<T, K> no) {
    return {hn::IfThenElse(c.m, yes.v, no.v)};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> min(Lanes<T, K> a, Lanes<T, K> b) {
    return {hn::Min(a.v, b.v)};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> max(Lanes<T, K> a, Lanes<T, K> b) {
    return {hn::Max(a.v, b.v)};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> clamp(Lanes<T, K> x, Lanes<T, K> low, Lanes<T, K> high) {
    return min(max(x, low), high);
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> absolute(Lanes<T, K> x) {
    return {hn::Max(x.v, hn::Sub(hn::Zero(hn::ScalableTag<T>()), x.v))};
}
/// One count for all lanes.  x86 shifts by a vector of counts in one instruction where it has one for the
/// type, and by one count in two.
template <class V>
HWY_INLINE V shift_left_same(V v, int bits) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
    using T = hn::TFromV<V>;
    return hn::Shl(v, hn::Set(hn::DFromV<V>(), static_cast<T>(bits)));
#else
    return hn::ShiftLeftSame(v, bits);
#endif
}
template <class V>
HWY_INLINE V shift_right_same(V v, int bits) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
    using T = hn::TFromV<V>;
    if constexpr (sizeof(T) == 4 || HWY_TARGET <= HWY_AVX3)
        return hn::Shr(v, hn::Set(hn::DFromV<V>(), static_cast<T>(bits)));
#endif
    return hn::ShiftRightSame(v, bits);
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> shift_left(Lanes<T, K> x, int bits) {
    return {shift_left_same(x.v, bits)};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> floor_shift(Lanes<T, K> x, int bits) {
    return {shift_right_same(x.v, bits)};
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> blend(Lanes<T, K> v0, Lanes<T, K> v1, Lanes<T, K> weight, int weight_bits) {
    return shift_left(v0, weight_bits) + weight * (v1 - v0);
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> affine(Lanes<T, K> p, Lanes<T, K> k, Lanes<T, K> v, std::int64_t, std::int64_t) {
    return p + k * v;
}
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> within(Lanes<T, K> x, std::int64_t, std::int64_t) {
    return x;
}

/// A format's limit as lanes can hold it: one beyond them is never met, for results fit the lanes.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> limit_in_lanes(std::int64_t limit) {
    return make_word(WordTag<Lanes<T, K>>{}, std::clamp<std::int64_t>(limit, std::numeric_limits<T>::min(),
                                                                      std::numeric_limits<T>::max()));
}

/// quantise.h's formula.  What K does not tell is asked of `to`, in every vector.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> quantise(Lanes<T, K> x, const Rescale& to) {
    const hn::ScalableTag<T> d;
    const auto biased = [&] { return hn::Add(x.v, hn::Set(d, static_cast<T>(to.bias))); };
    if constexpr (K == KnownRescales::halves_up) return {shift_right_same(biased(), to.shift)};
    if constexpr (K == KnownRescales::halves_to_even) {
        if (to.shift > 0) {
#if HWY_TARGET <= HWY_AVX3
            // Halves up; what was a half loses the last bit: one instruction less where masks are cheap.
            const auto sum = hn::Add(x.v, hn::Set(d, static_cast<T>(to.bias + to.to_even)));
            const auto rest = hn::Set(d, static_cast<T>((T{1} << to.shift) - 1));
            const auto half = hn::Eq(hn::And(sum, rest), hn::Zero(d));
            const auto up = shift_right_same(sum, to.shift);
            x.v = hn::IfThenElse(half, hn::AndNot(hn::Set(d, static_cast<T>(to.to_even)), up), up);
#else
            x.v = shift_right_same(hn::Add(biased(), hn::And(shift_right_same(x.v, to.shift),
                                                             hn::Set(d, static_cast<T>(to.to_even)))),
                                   to.shift);
#endif
        }
        return to.limits ? clamp(x, limit_in_lanes<T, K>(to.lowest), limit_in_lanes<T, K>(to.highest)) : x;
    }
    if (to.shift <= 0) {
        x = shift_left(x, -to.shift);
    } else if (to.shift >= static_cast<int>(8 * sizeof(T))) {
        // Truncation alone: the sign is left.  A bias as wide would have asked for wider lanes.
        x = floor_shift(x, static_cast<int>(8 * sizeof(T)) - 1);
    } else {
        auto sum = biased();
        if (to.to_even) sum = hn::Add(sum, hn::And(shift_right_same(x.v, to.shift), hn::Set(d, T{1})));
        if (to.to_zero)
            sum = hn::Add(
                sum, hn::IfThenElseZero(hn::Lt(x.v, hn::Zero(d)), hn::Set(d, static_cast<T>(to.to_zero))));
        x.v = shift_right_same(sum, to.shift);
    }
    if (!to.limits) return x;
    if (!to.wraps) return clamp(x, limit_in_lanes<T, K>(to.lowest), limit_in_lanes<T, K>(to.highest));
    const int unused = static_cast<int>(8 * sizeof(T)) - to.width;
    if (unused <= 0) return x;
    if (to.is_signed) return floor_shift(shift_left(x, unused), unused);
    return {hn::And(x.v, hn::Set(d, static_cast<T>((std::int64_t{1} << to.width) - 1)))};
}

// ------------------------------------------------------------------------------------------------ tables

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

/// The two halves of 32-bit words, unsigned.
template <KnownRescales K, class V>
HWY_INLINE std::array<Lanes<std::int32_t, K>, 2> halves_of(V both) {
    const hn::ScalableTag<std::int32_t> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    return {Lanes<std::int32_t, K>{hn::And(both, hn::Set(d, 0xffff))},
            Lanes<std::int32_t, K>{hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(du, both)))}};
}

/// Sixteen bytes at each lane's own address, as four vectors: word w of lane i's bytes is lane i of vector w.
/// One load a lane where a gather takes four.  Address: from a lane's number to a pointer.
template <class Load>
HWY_INLINE std::array<hn::Vec<hn::ScalableTag<std::int32_t>>, 4> transposed_blocks(Load&& load) {
    const hn::ScalableTag<std::int32_t> d;
#if HWY_TARGET == HWY_SCALAR
    std::int32_t words[4];
    load(0, words);
    return {hn::Set(d, words[0]), hn::Set(d, words[1]), hn::Set(d, words[2]), hn::Set(d, words[3])};
#else
    constexpr int kBlocks = static_cast<int>(HWY_LANES(std::int32_t)) / 4;
    const auto block = [&](int j) {  // of lanes j, 4 + j, 8 + j, 12 + j
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
/// Sixteen bytes at address(lane).
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
/// Eight bytes at address(lane), each widened to 16 bits.
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
/// Two neighbours of four unsigned 16-bit words each at base + 8 position bytes.
template <KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<std::int32_t, K>, 4>, 2> load_neighbours(
    const void* base, Lanes<std::int32_t, K> position) {
    const hn::ScalableTag<std::int32_t> d;
    alignas(64) std::int32_t at[HWY_LANES(std::int32_t)];
    hn::Store(position.v, d, at);
    const auto* bytes = static_cast<const std::uint8_t*>(base);
    const auto words = load_quads([&](int lane) { return bytes + std::int64_t{8} * at[lane]; });
    const auto first = halves_of<K>(words[0]), second = halves_of<K>(words[1]),
               third = halves_of<K>(words[2]), fourth = halves_of<K>(words[3]);
    return {{{first[0], first[1], second[0], second[1]}, {third[0], third[1], fourth[0], fourth[1]}}};
}
/// Pairs of unsigned 16-bit words as the signed ones that blend_pairs multiplies: less 2^15 each, unless all
/// are below that.
template <bool kBelow15Bits>
HWY_INLINE auto signed_pairs(hn::Vec<hn::ScalableTag<std::int32_t>> pairs) {
    if constexpr (kBelow15Bits) return pairs;
    return hn::Xor(pairs, hn::Set(hn::ScalableTag<std::int32_t>(), static_cast<std::int32_t>(0x80008000)));
}
/// 1 - w in the low half, w in the high one; at most 14 bits of fraction.
HWY_INLINE auto pair_weights(hn::Vec<hn::ScalableTag<std::int32_t>> weight, int weight_bits) {
    const hn::ScalableTag<std::int32_t> d;
    return hn::Or(hn::Sub(hn::Set(d, 1 << weight_bits), weight), hn::ShiftLeft<16>(weight));
}
/// Blends of packed signed pairs (low half: weight 0) plus `offset`, quantised.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> blend_pairs(hn::Vec<hn::ScalableTag<std::int32_t>> pairs,
                                              hn::Vec<hn::ScalableTag<std::int32_t>> weights,
                                              std::int32_t offset, const Rescale& to) {
    const hn::ScalableTag<std::int32_t> d;
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR
    // Highway's operation is x86's pairwise one here: one instruction for both products and their sum.
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
/// Rows `row` and `row + 1` of four words each.
template <KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<std::int32_t, K>, 4>, 2> load_two_rows(const std::int32_t* rows,
                                                                              Lanes<std::int32_t, K> row) {
    const hn::ScalableTag<std::int32_t> d;
    using L = Lanes<std::int32_t, K>;
    alignas(64) std::int32_t at[HWY_LANES(std::int32_t)];
    hn::Store(row.v, d, at);
    const auto a = load_quads([&](int lane) { return rows + std::int64_t{4} * at[lane]; });
    const auto b = load_quads([&](int lane) { return rows + std::int64_t{4} * at[lane] + 4; });
    return {{{L{a[0]}, L{a[1]}, L{a[2]}, L{a[3]}}, {L{b[0]}, L{b[1]}, L{b[2]}, L{b[3]}}}};
}
template <class T, KnownRescales K>
HWY_INLINE std::array<Lanes<T, K>, 4> lerp_rows(const Table& table, Lanes<T, K> row, Lanes<T, K> weight,
                                                int weight_bits, const Rescale& to_color,
                                                const Rescale& to_alpha) {
    using L = Lanes<T, K>;
    if constexpr (sizeof(T) == 4)
        if (const std::int32_t* paired = table.paired(); paired && weight_bits <= 14) {
            const hn::ScalableTag<T> d;
            alignas(64) T at[HWY_LANES(T)];
            hn::Store(row.v, d, at);
            const auto pairs = load_quads([&](int lane) { return paired + std::int64_t{4} * at[lane]; });
            const auto weights = pair_weights(weight.v, weight_bits);
            const std::int32_t offset = 1 << (weight_bits + 15);
            return {blend_pairs<K>(pairs[0], weights, offset, to_color),
                    blend_pairs<K>(pairs[1], weights, offset, to_color),
                    blend_pairs<K>(pairs[2], weights, offset, to_color),
                    blend_pairs<K>(pairs[3], weights, offset, to_alpha)};
        }
    const L next = row + make_word(WordTag<L>{}, 1);
    const auto between = [&](int c) {
        return quantise(blend(gather(table, row, c), gather(table, next, c), weight, weight_bits),
                        c < 3 ? to_color : to_alpha);
    };
    return {between(0), between(1), between(2), between(3)};
}

/// Cells of 16-bit words are two 32-bit words, or one of 64 bits, with the first channel lowest.
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
    return {gather_cell(table, row, column),
            gather_cell(table, row, column + make_word(WordTag<Lanes<T, K>>{}, 1))};
}

// ------------------------------------------------------------------------------------------------ quotients
// and roots

namespace lanes_detail {
template <class T>
using FloatOf = std::conditional_t<sizeof(T) == 4, float, double>;
template <class T, KnownRescales K>
HWY_INLINE auto to_floats(Lanes<T, K> x) {
    return hn::ConvertTo(hn::ScalableTag<FloatOf<T>>(), x.v);
}
}  // namespace lanes_detail

/// Bits of x >= 0: the exponent of x with every bit below a set one cleared, which no rounding carries into
/// the next power.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> bit_length(Lanes<T, K> x) {
    const hn::ScalableTag<T> d;
    constexpr int kMantissa = sizeof(T) == 4 ? 23 : 52;
    constexpr int kBias = sizeof(T) == 4 ? 126 : 1022;
    const Lanes<T, K> leading{hn::AndNot(hn::ShiftRight<1>(x.v), x.v)};
    const auto exponent = hn::ShiftRight<kMantissa>(hn::BitCast(d, lanes_detail::to_floats(leading)));
    return {
        hn::IfThenZeroElse(hn::Eq(x.v, hn::Zero(d)), hn::Sub(exponent, hn::Set(d, static_cast<T>(kBias))))};
}
/// x 2^bits, floor; x >= 0.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> shift_by(Lanes<T, K> x, Lanes<T, K> bits) {
    using U = std::make_unsigned_t<T>;
    const hn::ScalableTag<U> du;
    const hn::ScalableTag<T> d;
    const auto zero = hn::Zero(d);
    const auto left = hn::BitCast(du, hn::Max(bits.v, zero)),
               right = hn::BitCast(du, hn::Max(hn::Sub(zero, bits.v), zero));
    return {hn::BitCast(d, hn::Shr(hn::Shl(hn::BitCast(du, x.v), left), right))};
}
/// See words.h: the root in double precision has the right floor.
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> vector_length(const std::array<Lanes<std::int64_t, K>, 3>& v, int guard) {
    const hn::ScalableTag<std::int64_t> d;
    const auto squares = shift_left(v[0] * v[0] + v[1] * v[1] + v[2] * v[2], 2 * guard);
    return {hn::ConvertTo(d, hn::Sqrt(lanes_detail::to_floats(squares)))};
}
/// The sum of squares fills 32 bits, unsigned; its root is taken in doubles, half the lanes at a time.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> vector_length(const std::array<Lanes<std::int32_t, K>, 3>& v, int guard) {
    const hn::ScalableTag<std::int32_t> d;
    const auto squares = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).v;
    const double factor = power_of_two<double>(2 * guard);
#if HWY_TARGET == HWY_SCALAR
    const auto sum = static_cast<std::uint32_t>(hn::GetLane(squares));
    return {hn::Set(d, static_cast<std::int32_t>(std::sqrt(factor * static_cast<double>(sum))))};
#else
    const hn::Half<decltype(d)> half;
    const hn::ScalableTag<double> wide;
    const auto root = [&](auto part) {
        // Unsigned to double: the sign's weight is put right.
        const auto x = hn::PromoteTo(wide, part);
        const auto sum = hn::Add(x, hn::IfThenElseZero(hn::Lt(x, hn::Zero(wide)), hn::Set(wide, 0x1p32)));
        return hn::DemoteTo(half, hn::Sqrt(hn::Mul(sum, hn::Set(wide, factor))));
    };
    return {hn::Combine(d, root(hn::UpperHalf(half, squares)), root(hn::LowerHalf(half, squares)))};
#endif
}

/// The lowest bits of a product, whatever its factors: all 32 or 64 of them.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> low_product(Lanes<std::int32_t, K> a, Lanes<std::int32_t, K> b) {
    return a * b;
}
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> low_product(Lanes<std::int64_t, K> a, Lanes<std::int64_t, K> b) {
    const hn::ScalableTag<std::int64_t> d;
    const hn::ScalableTag<std::uint64_t> du;
    const hn::ScalableTag<std::uint32_t> d32;
    const auto x = hn::BitCast(du, a.v), y = hn::BitCast(du, b.v);
    const auto product = [&](auto p, auto q) {
        return hn::MulEven(hn::BitCast(d32, p), hn::BitCast(d32, q));
    };
    const auto cross = hn::Add(product(hn::ShiftRight<32>(x), y), product(x, hn::ShiftRight<32>(y)));
    return {hn::BitCast(d, hn::Add(product(x, y), hn::ShiftLeft<32>(cross)))};
}

/// quantise.h's quotient.  A floating-point estimate of the floor, off by one at most, is corrected by the
/// exact rest. 32-bit lanes: results of at most 22 bits, denominators below 2^29 (pipeline/plan.cpp checks).
/// Saturating wires only.
template <class T, KnownRescales K>
HWY_INLINE Lanes<T, K> quotient(Lanes<T, K> numerator, Lanes<T, K> denominator, const Rescale& to) {
    using F = lanes_detail::FloatOf<T>;
    const hn::ScalableTag<T> d;
    const hn::ScalableTag<F> df;
    const auto one = hn::Set(d, T{1}), zero = hn::Zero(d);
    const Lanes<T, K> scaled = shift_left(numerator, -to.shift);
    const auto factor = hn::Set(df, static_cast<F>(power_of_two<double>(-to.shift)));
    const auto ratio =
        hn::Div(hn::Mul(lanes_detail::to_floats(numerator), factor), lanes_detail::to_floats(denominator));
    const auto beyond = hn::Set(df, static_cast<F>(to.highest + 1));
    Lanes<T, K> q{hn::ConvertTo(d, hn::Min(ratio, beyond))};
    Lanes<T, K> rest = scaled - low_product(q, denominator);
    const auto below = hn::Lt(rest.v, zero);
    q.v = hn::Sub(q.v, hn::IfThenElseZero(below, one));
    rest.v = hn::Add(rest.v, hn::IfThenElseZero(below, denominator.v));
    const auto above = hn::Not(hn::Lt(rest.v, denominator.v));
    q.v = hn::Add(q.v, hn::IfThenElseZero(above, one));
    rest.v = hn::Sub(rest.v, hn::IfThenElseZero(above, denominator.v));
    const auto twice = hn::Add(rest.v, rest.v);
    if (to.rounding == Rounding::rnd)
        q.v = hn::Add(q.v, hn::IfThenZeroElse(hn::Lt(twice, denominator.v), one));
    if (to.rounding == Rounding::rnd_conv) {
        const auto up = hn::Or(hn::Gt(twice, denominator.v),
                               hn::And(hn::Eq(twice, denominator.v), hn::Ne(hn::And(q.v, one), zero)));
        q.v = hn::Add(q.v, hn::IfThenElseZero(up, one));
    }
    return clamp(q, limit_in_lanes<T, K>(to.lowest), limit_in_lanes<T, K>(to.highest));
}

// ------------------------------------------------------------------------------------------------ wide
// numbers

/// words.h's Wide of 32-bit lanes: doubles, the lower half of the lanes and the upper one.
template <KnownRescales K>
struct WideLanes {
    using V = hn::Vec<hn::ScalableTag<double>>;
    V low, high;
};
}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
namespace squint {
template <KnownRescales K>
struct WideOf<HWY_NAMESPACE::Lanes<std::int32_t, K>> {
    using Type = HWY_NAMESPACE::WideLanes<K>;
};
}  // namespace squint
HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

namespace lanes_detail {
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> narrow(const WideLanes<K>& x) {
    const hn::ScalableTag<std::int32_t> d;
#if HWY_TARGET == HWY_SCALAR
    return {hn::DemoteTo(d, x.low)};  // saturates, as the vectors' does
#else
    const hn::Half<decltype(d)> half;
    return {hn::Combine(d, hn::DemoteTo(half, x.high), hn::DemoteTo(half, x.low))};
#endif
}
template <KnownRescales K, class F>
HWY_INLINE WideLanes<K> by_halves(F&& f) {
#if HWY_TARGET == HWY_SCALAR
    const auto only = f([](const auto& x) { return x.low; });
    return {only, only};
#else
    return {f([](const auto& x) { return x.low; }), f([](const auto& x) { return x.high; })};
#endif
}
}  // namespace lanes_detail
/// 64-bit lanes are wide themselves.
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> widen(Lanes<std::int64_t, K> x) {
    return x;
}
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> wide_sum(Lanes<std::int64_t, K> high, int bits,
                                           Lanes<std::int64_t, K> low) {
    return shift_left(high, bits) + low;
}
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> wide_product(Lanes<std::int64_t, K> a, Lanes<std::int64_t, K> b) {
    return a * b;
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> widen(Lanes<std::int32_t, K> x) {
    const hn::ScalableTag<double> wide;
#if HWY_TARGET == HWY_SCALAR
    const auto only = hn::PromoteTo(wide, x.v);
    return {only, only};
#else
    const hn::Half<hn::ScalableTag<std::int32_t>> half;
    return {hn::PromoteTo(wide, hn::LowerHalf(half, x.v)), hn::PromoteTo(wide, hn::UpperHalf(half, x.v))};
#endif
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> operator+(const WideLanes<K>& a, const WideLanes<K>& b) {
    return {hn::Add(a.low, b.low), hn::Add(a.high, b.high)};
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> operator-(const WideLanes<K>& a, const WideLanes<K>& b) {
    return {hn::Sub(a.low, b.low), hn::Sub(a.high, b.high)};
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> shift_left(const WideLanes<K>& x, int bits) {
    const auto factor = hn::Set(hn::ScalableTag<double>(), power_of_two<double>(bits));
    return {hn::Mul(x.low, factor), hn::Mul(x.high, factor)};
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> wide_sum(Lanes<std::int32_t, K> high, int bits, Lanes<std::int32_t, K> low) {
    return shift_left(widen(high), bits) + widen(low);
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> wide_product(Lanes<std::int32_t, K> a, Lanes<std::int32_t, K> b) {
    const auto x = widen(a), y = widen(b);
    return {hn::Mul(x.low, y.low), hn::Mul(x.high, y.high)};
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> absolute(const WideLanes<K>& x) {
    return {hn::Abs(x.low), hn::Abs(x.high)};
}
template <KnownRescales K>
HWY_INLINE WideLanes<K> max(const WideLanes<K>& a, const WideLanes<K>& b) {
    return {hn::Max(a.low, b.low), hn::Max(a.high, b.high)};
}
/// An estimate, off by one at most, and its exact rest: the product of either half of the estimate with the
/// denominator has 53 bits at most (range.cpp notes it).  A result beyond 32 bits saturates.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> quotient(const WideLanes<K>& numerator, const WideLanes<K>& denominator,
                                           const Rescale& to) {
    const hn::ScalableTag<double> d;
    const auto one = hn::Set(d, 1.0), zero = hn::Zero(d);
    const auto factor = hn::Set(d, power_of_two<double>(-to.shift));
    const bool to_nearest = to.rounding == Rounding::rnd || to.rounding == Rounding::rnd_conv;
    const auto half = [&](auto part) SQUINT_WRITTEN_OUT {
        const auto below = part(denominator), scaled = hn::Mul(part(numerator), factor);
        const auto estimate = hn::Mul(scaled, hn::Div(one, below));
        auto q = to_nearest ? hn::Round(estimate) : hn::Trunc(estimate);
#if (HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2 && HWY_TARGET != HWY_SCALAR) || HWY_ARCH_ARM_A64
        const auto rest = hn::NegMulAdd(q, below, scaled);  // one rounding alone
#else
        const auto coarse = hn::Mul(hn::Trunc(hn::Mul(q, hn::Set(d, power_of_two<double>(-to.width / 2)))),
                                    hn::Set(d, power_of_two<double>(to.width / 2)));
        const auto rest =
            hn::Sub(hn::Sub(scaled, hn::Mul(coarse, below)), hn::Mul(hn::Sub(q, coarse), below));
#endif
        if (!to_nearest) {
            q = hn::Sub(q, hn::IfThenElseZero(hn::Lt(rest, zero), one));
            return hn::Add(q, hn::IfThenElseZero(hn::Ge(rest, below), one));
        }
        const auto twice = hn::Add(rest, rest);
        auto down = hn::Lt(twice, hn::Neg(below)), up = hn::Ge(twice, below);
        if (to.rounding == Rounding::rnd_conv) {
            const auto halved = hn::Mul(q, hn::Set(d, 0.5));
            const auto odd = hn::Ne(halved, hn::Trunc(halved));
            down = hn::Or(down, hn::And(hn::Eq(twice, hn::Neg(below)), odd));
            up = hn::Or(hn::Gt(twice, below), hn::And(hn::Eq(twice, below), odd));
        }
        q = hn::Sub(q, hn::IfThenElseZero(down, one));
        return hn::Add(q, hn::IfThenElseZero(up, one));
    };
    const auto q = lanes_detail::narrow(lanes_detail::by_halves<K>(half));
    return clamp(q, limit_in_lanes<std::int32_t, K>(to.lowest), limit_in_lanes<std::int32_t, K>(to.highest));
}

// ------------------------------------------------------------------------------------------------ memory:
// always 32-bit words

/// Wires pass between stages in buffers of 32-bit words, whatever the lanes a stage runs in.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> load(WordTag<Lanes<std::int32_t, K>>, const std::int32_t* from) {
    return {hn::LoadU(hn::ScalableTag<std::int32_t>(), from)};
}
template <KnownRescales K>
HWY_INLINE Lanes<std::int64_t, K> load(WordTag<Lanes<std::int64_t, K>>, const std::int32_t* from) {
    const hn::ScalableTag<std::int64_t> d;
    const hn::Rebind<std::int32_t, decltype(d)> narrow;
    return {hn::PromoteTo(d, hn::LoadU(narrow, from))};
}
template <KnownRescales K>
HWY_INLINE void store(Lanes<std::int32_t, K> x, std::int32_t* to) {
    hn::StoreU(x.v, hn::ScalableTag<std::int32_t>(), to);
}
template <KnownRescales K>
HWY_INLINE void store(Lanes<std::int64_t, K> x, std::int32_t* to) {
    const hn::ScalableTag<std::int64_t> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    const hn::Rebind<std::int32_t, decltype(d)> narrow;
    const hn::Rebind<std::uint32_t, decltype(d)> low;
    hn::StoreU(hn::BitCast(narrow, hn::TruncateTo(low, hn::BitCast(du, x.v))), narrow, to);
}
template <class L>
HWY_INLINE L load(const std::int32_t* from) {
    return load(WordTag<L>{}, from);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
