// The float32 word of the fast path: many Real<float> (words.h) side by side, to compare fixed with floating
// point.  Only float itself rounds: a Rescale multiplies by a power of two, exactly.  Each operation is one
// of IEEE 754, in the order of Real and without fused products, which some targets lack: the bits of the
// scalar word on every CPU.
#if defined(SQUINT_FIXEDPOINT_WORDS_FLOAT_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_FIXEDPOINT_WORDS_FLOAT_LANES_INL_H
#undef SQUINT_FIXEDPOINT_WORDS_FLOAT_LANES_INL_H
#else
#define SQUINT_FIXEDPOINT_WORDS_FLOAT_LANES_INL_H
#endif

#include "fixedpoint/words/lane_tables-inl.h"
#include "fixedpoint/words/lanes-inl.h"

#include <bit>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

template <KnownRescales K>
struct Lanes<float, K> {
    using IsReal = void;
    using Element = float;
    using D = hn::ScalableTag<float>;
    using V = hn::Vec<D>;
    static constexpr KnownRescales kKnown = K;
    V v;
    static constexpr std::size_t count() { return HWY_LANES(float); }
    static HWY_INLINE Lanes from(double raw) { return {hn::Set(D(), static_cast<float>(raw))}; }
};

namespace lanes_detail {
/// 2^bits, -127 < bits < 128.
HWY_INLINE auto float_power_of_two(int bits) {
    return hn::Set(hn::ScalableTag<float>(), std::bit_cast<float>((127 + bits) << 23));
}
template <KnownRescales K>
HWY_INLINE auto to_integers(Lanes<float, K> x) {
    return hn::ConvertTo(hn::ScalableTag<std::int32_t>(), x.v);
}
}  // namespace lanes_detail

template <KnownRescales K>
HWY_INLINE Lanes<float, K> operator*(Lanes<float, K> a, Lanes<float, K> b) {
    return {hn::Mul(a.v, b.v)};
}
template <KnownRescales K>
HWY_INLINE Lanes<float, K> operator/(Lanes<float, K> a, Lanes<float, K> b) {
    return {hn::Div(a.v, b.v)};
}
// Of equal operands (zeros of either sign) returns the first; x86's instructions return the second.
template <KnownRescales K>
HWY_INLINE Lanes<float, K> min(Lanes<float, K> a, Lanes<float, K> b) {
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
    return {hn::Min(b.v, a.v)};
#else
    return {hn::IfThenElse(hn::Lt(b.v, a.v), b.v, a.v)};
#endif
}
template <KnownRescales K>
HWY_INLINE Lanes<float, K> max(Lanes<float, K> a, Lanes<float, K> b) {
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
    return {hn::Max(b.v, a.v)};
#else
    return {hn::IfThenElse(hn::Lt(a.v, b.v), b.v, a.v)};
#endif
}
template <KnownRescales K>
HWY_INLINE Lanes<float, K> absolute(Lanes<float, K> x) {
    return {hn::Abs(x.v)};
}
template <KnownRescales K>
HWY_INLINE Lanes<float, K> square_root(Lanes<float, K> x) {
    return {hn::Sqrt(x.v)};
}
template <KnownRescales K>
HWY_INLINE Lanes<float, K> shift_left(Lanes<float, K> x, int bits) {
    return {hn::Mul(x.v, lanes_detail::float_power_of_two(bits))};
}
template <KnownRescales K>
HWY_INLINE Lanes<float, K> floor_shift(Lanes<float, K> x, int bits) {
    const auto scaled = hn::Mul(x.v, lanes_detail::float_power_of_two(-bits));
#if HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
    return {hn::CopySign(hn::Floor(scaled), scaled)};  // hn::Floor loses the sign of zero
#else
    return {hn::Floor(scaled)};
#endif
}
/// 2^x of an integer, -127 < x < 128.
template <KnownRescales K>
HWY_INLINE Lanes<float, K> whole_power_of_two(Lanes<float, K> x) {
    const hn::ScalableTag<std::int32_t> d;
    const auto exponent = hn::Add(lanes_detail::to_integers(x), hn::Set(d, 127));
    return {hn::BitCast(hn::ScalableTag<float>(), hn::ShiftLeft<23>(exponent))};
}
template <KnownRescales K>
HWY_INLINE Lanes<float, K> quantise(Lanes<float, K> x, const Rescale& to) {
    return shift_left(x, -to.shift);
}
template <KnownRescales K>
HWY_INLINE Lanes<float, K> quantise_raw(Lanes<float, K> raw, const Rescale&) {
    return raw;
}
template <KnownRescales K>
HWY_INLINE Lanes<float, K> quotient(Lanes<float, K> numerator, Lanes<float, K> denominator,
                                    const Rescale& to) {
    return shift_left(numerator, -to.shift) / denominator;
}

/// A float is wide itself.
template <KnownRescales K>
HWY_INLINE Lanes<float, K> widen(Lanes<float, K> x) {
    return x;
}
template <KnownRescales K>
HWY_INLINE Lanes<float, K> wide_sum(Lanes<float, K> high, int bits, Lanes<float, K> low) {
    return shift_left(high, bits) + low;
}
template <KnownRescales K>
HWY_INLINE Lanes<float, K> wide_product(Lanes<float, K> a, Lanes<float, K> b) {
    return a * b;
}
template <KnownRescales K>
HWY_INLINE bool any_positive(Lanes<float, K> x) {
    return any(Lanes<float, K>{hn::Zero(hn::ScalableTag<float>())} < x);
}

// ------------------------------------------------------------------------------------------ tables

template <KnownRescales K>
HWY_INLINE Lanes<float, K> gather(const Table& table, Lanes<float, K> row, int column) {
    const hn::ScalableTag<std::int32_t> d;
    const auto index =
        hn::Add(hn::Mul(lanes_detail::to_integers(row), hn::Set(d, table.columns())), hn::Set(d, column));
    return {hn::GatherIndex(hn::ScalableTag<float>(), table.floats(), index)};
}
/// Four floats at index 4 position, and the four after them.
template <KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<float, K>, 4>, 2> load_two_rows(
    const float* rows, Lanes<float, K>, hn::Vec<hn::ScalableTag<std::int32_t>> position) {
    const hn::ScalableTag<float> d;
    using L = Lanes<float, K>;
    const auto both =
        load_two_rows(reinterpret_cast<const std::int32_t*>(rows), Lanes<std::int32_t, K>{position});
    const auto float_at = [&](std::size_t row, std::size_t c) { return L{hn::BitCast(d, both[row][c].v)}; };
    return {{{float_at(0, 0), float_at(0, 1), float_at(0, 2), float_at(0, 3)},
             {float_at(1, 0), float_at(1, 1), float_at(1, 2), float_at(1, 3)}}};
}
template <KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<float, K>, 4>, 2> load_two_rows(const float* rows,
                                                                       Lanes<float, K> row) {
    return load_two_rows(rows, row, lanes_detail::to_integers(row));
}
template <KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<float, K>, 4>, 2> load_two_rows(const Table& table,
                                                                       Lanes<float, K> row) {
    return load_two_rows(table.floats(), row);
}
template <KnownRescales K>
HWY_INLINE std::array<std::array<Lanes<float, K>, 4>, 2> gather_two_cells(const CellTable& table,
                                                                          Lanes<float, K> row,
                                                                          Lanes<float, K> column) {
    const hn::ScalableTag<std::int32_t> d;
    const auto first = hn::Mul(lanes_detail::to_integers(row), hn::Set(d, table.size()));
    return load_two_rows(table.floats(), row, hn::Add(first, lanes_detail::to_integers(column)));
}
template <KnownRescales K>
HWY_INLINE std::array<Lanes<float, K>, 4> gather_cell(const CellTable& table, Lanes<float, K> row,
                                                      Lanes<float, K> column) {
    return gather_two_cells(table, row, column)[0];
}

// ------------------------------------------------------------------------------------------ memory

/// In the buffers between stages a float is stored as its bits.
template <KnownRescales K>
HWY_INLINE Lanes<float, K> load(WordTag<Lanes<float, K>>, const std::int32_t* from) {
    return {hn::BitCast(hn::ScalableTag<float>(), hn::LoadU(hn::ScalableTag<std::int32_t>(), from))};
}
template <KnownRescales K>
HWY_INLINE void store(Lanes<float, K> x, std::int32_t* to) {
    const hn::ScalableTag<std::int32_t> d;
    hn::StoreU(hn::BitCast(d, x.v), d, to);
}
/// Integers stay integers in the buffers.
template <KnownRescales K>
HWY_INLINE Lanes<float, K> load_whole(WordTag<Lanes<float, K>>, const std::int32_t* from) {
    return {hn::ConvertTo(hn::ScalableTag<float>(), hn::LoadU(hn::ScalableTag<std::int32_t>(), from))};
}
template <KnownRescales K>
HWY_INLINE void store_whole(Lanes<float, K> x, std::int32_t* to) {
    hn::StoreU(lanes_detail::to_integers(x), hn::ScalableTag<std::int32_t>(), to);
}
template <KnownRescales K>
HWY_INLINE Lanes<float, K> half_of(Lanes<float, K> both, bool upper) {
    const Lanes<std::int32_t, K> words{hn::BitCast(hn::ScalableTag<std::int32_t>(), both.v)};
    return {hn::ConvertTo(hn::ScalableTag<float>(), half_of(words, upper).v)};
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
