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
        if (to.shift > 0)
            x.v = shift_right_same(hn::Add(biased(), hn::And(shift_right_same(x.v, to.shift),
                                                             hn::Set(d, static_cast<T>(to.to_even)))),
                                   to.shift);
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
    return {hn::GatherIndex(d, table.words().data(), index.v)};
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
/// Blends of packed pairs (low half: weight 0), unsigned, by weights of at most 14 bits.
HWY_INLINE auto blend_pairs(hn::Vec<hn::ScalableTag<std::int32_t>> pairs,
                            hn::Vec<hn::ScalableTag<std::int32_t>> weight, int weight_bits) {
    const hn::ScalableTag<std::int32_t> d;
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR
    // Highway's operation is x86's pairwise one here: one instruction for both products and their sum.  Its
    // factors are signed: 2^15 is taken from both values, and given back to their mean.
    const hn::ScalableTag<std::int16_t> d16;
    const auto weights = hn::Or(hn::Sub(hn::Set(d, 1 << weight_bits), weight), hn::ShiftLeft<16>(weight));
    const auto centred = hn::Xor(pairs, hn::Set(d, static_cast<std::int32_t>(0x80008000)));
    auto unused = hn::Zero(d);
    return hn::ReorderWidenMulAccumulate(d, hn::BitCast(d16, centred), hn::BitCast(d16, weights),
                                         hn::Set(d, 1 << (weight_bits + 15)), unused);
#else
    const auto low = hn::And(pairs, hn::Set(d, 0xffff)),
               high = hn::And(hn::ShiftRight<16>(pairs), hn::Set(d, 0xffff));
    return hn::Add(shift_left_same(low, weight_bits), hn::Mul(weight, hn::Sub(high, low)));
#endif
}
template <class T, KnownRescales K>
HWY_INLINE std::array<Lanes<T, K>, 4> blend_rows(const Table& table, Lanes<T, K> row, Lanes<T, K> weight,
                                                 int weight_bits) {
    using L = Lanes<T, K>;
    if constexpr (sizeof(T) == 4)
        if (const std::int32_t* paired = table.paired(); paired && weight_bits <= 14) {
            const hn::ScalableTag<T> d;
            alignas(64) T at[HWY_LANES(T)];
            hn::Store(row.v, d, at);
            const auto pairs = load_quads([&](int lane) { return paired + std::int64_t{4} * at[lane]; });
            return {L{blend_pairs(pairs[0], weight.v, weight_bits)},
                    L{blend_pairs(pairs[1], weight.v, weight_bits)},
                    L{blend_pairs(pairs[2], weight.v, weight_bits)},
                    L{blend_pairs(pairs[3], weight.v, weight_bits)}};
        }
    const L next = row + make_word(WordTag<L>{}, 1);
    const auto between = [&](int c) {
        return blend(gather(table, row, c), gather(table, next, c), weight, weight_bits);
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
        const auto mask = hn::Set(d, 0xffff);
        const hn::RebindToUnsigned<decltype(d)> du;
        const auto upper = [&](auto v) { return hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(du, v))); };
        return {L{hn::And(low, mask)}, L{upper(low)}, L{hn::And(high, mask)}, L{upper(high)}};
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
