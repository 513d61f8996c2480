// The maths of entries.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_CLASSIFICATION_ENTRIES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_ENTRIES_INL_H
#undef SQUINT_PIPELINE_CLASSIFICATION_ENTRIES_INL_H
#else
#define SQUINT_PIPELINE_CLASSIFICATION_ENTRIES_INL_H
#endif

#include "pipeline/classification/entries.h"

#include "fixedpoint/split_lerp.h"
#include "pipeline/stages/interpolation-inl.h"
#include "pipeline/stages/location-inl.h"

#include <hwy/highway.h>

#include <concepts>
#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

template <class W>
HWY_INLINE W classification_input(const InputStage& s, W sample) {
    if (s.scaled) sample = sample * constant<W>(s.scale);
    return clamp(quantise(sample, s.to_input), constant<W>(0), constant<W>(s.highest));
}
template <RealWord W>
HWY_INLINE W classification_input(const InputStage& s, W sample) {
    if (s.scaled) sample = sample * stage_constant<W>(s.scale, s.scale_exact, s.scale_fraction, s.active);
    return clamp(quantise(sample, s.to_input), constant<W>(0), constant<W>(s.highest));
}

/// Words that load two rows of a table of one column at once.
template <class W>
concept LoadsPairs = requires(const Table& table, W word) {
    { load_pair_of_rows(table, word) } -> std::same_as<std::array<W, 2>>;
};
/// Rows `row` and `row + 1` of a table of one column.
template <class W>
HWY_INLINE std::array<W, 2> two_rows(const Table& table, W row) {
    if constexpr (LoadsPairs<W>)
        return load_pair_of_rows(table, row);
    else
        return {gather(table, row, 0), gather(table, row + constant<W>(1), 0)};
}

/// The lerp between rows `row` and `row + 1` of a table of one column; its words are 0 or more.
template <class W>
HWY_INLINE W lerp_row(const Table& table, W row, W weight, int weight_bits, const Rescale& to) {
    const std::array<W, 2> ends = two_rows(table, row);
    return quantise(blend(ends[0], ends[1], weight, weight_bits), to);
}
/// Lanes that split the lerp need the width of its rise and of its result alone.
inline Range lerp_row(const Table& table, Range row, Range weight, int weight_bits, const Rescale& to) {
    const int lanes_before = Range::needs.lane_bits;
    const std::array<Range, 2> ends = two_rows(table, row);
    const Range result = quantise(blend(ends[0], ends[1], weight, weight_bits), to);
    if (!splits_lerp(to, weight_bits)) return result;
    Int128 rise = 0;
    for (int i = 0; i + 1 < table.rows(); ++i) {
        const Int128 change = table.word(i + 1, 0) - table.word(i, 0);
        rise = std::max(rise, change < 0 ? -change : change);
    }
    Range::needs.lane_bits = std::max(lanes_before, signed_bits(ends[0]));
    const Range rest = noted(Range{-rise, rise}) * weight;
    noted({rest.low, rest.high + (Int128{1} << to.shift) + to.bias});
    return noted(result);
}

/// a b of a few numbers, exact in a Wide, quantised once.
template <class W>
HWY_INLINE W quantised_wide_product(W a, W b, const Rescale& to) {
    return quantise(a * b, to);
}
inline Range quantised_wide_product(Range a, Range b, const Rescale& to) {
    const int lanes_before = Range::needs.lane_bits;
    const Range product = a * b, result = quantise(product, to);
    // One bit more for half a last bit that is added.
    Range::needs.wide_bits = std::max(Range::needs.wide_bits, signed_bits(product) + 1);
    Range::needs.lane_bits = to.wraps ? 65 : std::max(lanes_before, signed_bits(result));
    return result;
}

template <class W>
HWY_INLINE W opacity_of_depth(const OpacityUnit& unit, W depth) {
    const int fraction = unit.depth_fraction - unit.row_bits;
    const W row = min(floor_shift(depth, fraction), constant<W>(unit.rows.rows() - 2));
    const std::int64_t one = std::int64_t{1} << fraction;
    const W rest = within(min(depth - shift_left(row, fraction), constant<W>(one)), 0, one);
    return lerp_row(unit.rows, row, rest, fraction, unit.to_alpha);
}
/// 1 - exp(-x) for x >= 0 in float32.  With -x = n ln 2 + r, |r| <= ln 2 / 2, exp(r) - 1 is its series to
/// r^7, which is off by at most 2^-26 of r.
template <RealWord W>
HWY_INLINE W one_minus_exp(W x) {
    const auto k = [](double value) { return W::from(value); };
    const W y = k(0) - min(x, k(80));  // opaque to the last bit there; keeps 2^n in range
    const W n = floor_shift(y * k(1.44269504088896341) + k(0.5), 0);
    // ln 2 in two parts; n times the first is exact.
    const W r = (y - n * k(0x1.62ep-1)) - n * k(0x1.0bfbe8e7bcd5ep-15);
    const W tail =
        k(1.0 / 6) + r * (k(1.0 / 24) + r * (k(1.0 / 120) + r * (k(1.0 / 720) + r * k(1.0 / 5040))));
    const W grown = r + r * r * (k(0.5) + r * tail), unit = whole_power_of_two(n);
    return (k(1) - unit) - unit * grown;
}
inline Real<double> one_minus_exp(Real<double> x) {
    return {-portable::expm1(-x.v)};
}
/// Without rounding: the function itself, where its result is not rounded either.
template <RealWord W>
HWY_INLINE W opacity_of_depth(const OpacityUnit& unit, W depth) {
    return quantise_raw(
        shift_left(one_minus_exp(shift_left(depth, -unit.depth_fraction)), unit.alpha_fraction),
        unit.to_alpha);
}

/// The position of an input between two entries.
template <class W>
struct EntryPosition {
    W entry, fraction;
};
template <class W>
HWY_INLINE EntryPosition<W> entry_position(const EntrySpacing& e, W input) {
    const W entry = min(floor_shift(input, e.input_fraction), constant<W>(e.last_segment));
    const std::int64_t one = std::int64_t{1} << e.input_fraction;
    return {entry, within(min(input - shift_left(entry, e.input_fraction), constant<W>(one)), 0, one)};
}

/// The position of an input between two rows, 2^bits rows an entry.
template <class W>
HWY_INLINE EntryPosition<W> sub_entry_position(const EntrySpacing& e, int sub_entry_bits, W input) {
    const int bits = e.input_fraction - sub_entry_bits;
    const std::int64_t last = (static_cast<std::int64_t>(e.last_segment + 1) << sub_entry_bits) - 1;
    const W entry = min(floor_shift(input, bits), constant<W>(last));
    const std::int64_t one = std::int64_t{1} << bits;
    return {entry, within(min(input - shift_left(entry, bits), constant<W>(one)), 0, one)};
}

/// One where a position is opaque: on an opaque entry, or between two of them (docs/conventions.md).
template <class W>
HWY_INLINE auto is_opaque(const EntryLookup& e, const EntryPosition<W>& at) {
    const W zero = constant<W>(0), one = constant<W>(std::int64_t{1} << e.input_fraction);
    const W here = gather(e.matter, at.entry, EntryLookup::opaque);
    const W next = gather(e.matter, at.entry + constant<W>(1), EntryLookup::opaque);
    const W entry_bit = here - shift_left(floor_shift(here, 1), 1),
            next_bit = next - shift_left(floor_shift(next, 1), 1);
    return (constant<W>(1) < here) | ((at.fraction == zero) & (zero < entry_bit)) |
           ((at.fraction == one) & (zero < next_bit));
}

/// Words that blend two packed numbers in one operation: what lerp_rows gives, of rows that are
/// Table::paired and weights of 14 bits at most.
template <class W>
concept BlendsPairs = requires(const std::int32_t* paired, W word, const Rescale& to) {
    { lerp_paired_rows(paired, word, word, 14, to, to) } -> std::same_as<std::array<W, 4>>;
};
/// Words that load two rows of a table at once.
template <class W>
concept LoadsRows = requires(const Table& table, W word) {
    { load_two_rows(table, word) } -> std::same_as<std::array<std::array<W, 4>, 2>>;
};
/// Interpolates between rows `row` and `row + 1` of a table with four columns: red, green, blue, alpha.
template <class W>
HWY_INLINE std::array<W, 4> lerp_rows(const Table& table, W row, W weight, int weight_bits,
                                      const Rescale& to_color, const Rescale& to_alpha) {
    if constexpr (BlendsPairs<W>)
        if (const std::int32_t* paired = table.paired(); paired && weight_bits <= 14)
            return lerp_paired_rows(paired, row, weight, weight_bits, to_color, to_alpha);
    const auto between = [&](W near, W far, const Rescale& to)
                             SQUINT_WRITTEN_OUT { return lerp(near, far, weight, weight_bits, to); };
    if constexpr (LoadsRows<W>) {
        const auto rows = load_two_rows(table, row);
        return {between(rows[0][0], rows[1][0], to_color), between(rows[0][1], rows[1][1], to_color),
                between(rows[0][2], rows[1][2], to_color), between(rows[0][3], rows[1][3], to_alpha)};
    } else {
        const W next = row + constant<W>(1);
        const auto column = [&](int c, const Rescale& to) SQUINT_WRITTEN_OUT {
            return between(gather(table, row, c), gather(table, next, c), to);
        };
        return {column(0, to_color), column(1, to_color), column(2, to_color), column(3, to_alpha)};
    }
}

/// The depth of a full step times the length of a slab, exact, then rounded once.
template <class W>
HWY_INLINE W shortened(W depth, W length, int length_fraction, const Rescale& to_shorter) {
    return quotient(wide_product(depth, length), widen(constant<W>(std::int64_t{1} << length_fraction)),
                    to_shorter);
}
/// The optical depth of a point over `length` steps; extinction is linear between entries.
template <class W>
HWY_INLINE W point_depth(const EntryLookup& e, const EntryPosition<W>& at, W length) {
    const W next = gather(e.matter, at.entry + constant<W>(1), EntryLookup::extinction);
    const W full = quantise(
        blend(gather(e.matter, at.entry, EntryLookup::extinction), next, at.fraction, e.input_fraction),
        e.to_depth);
    return shortened(full, length, e.length_fraction, e.to_shorter);
}

/// Finishes a point's slab of `length` steps from what stands `between` its two rows: a shorter slab has another
/// opacity, and an opaque place ends the ray.
template <class W>
HWY_INLINE Slab<W> finish_point(const EntryLookup& e, W input, const std::array<W, 4>& between, W length) {
    const W full = constant<W>(std::int64_t{1} << e.length_fraction);
    Slab<W> slab{{between[0], between[1], between[2]}, between[EntryLookup::alpha]};
    const bool may_be_opaque = e.has_opaque && any(!(slab.alpha < constant<W>(e.least_opaque)));
    const auto shorter = length < full;
    if (any(shorter)) {
        const W depth = point_depth(e, entry_position(e, input), length);
        slab.alpha = select(shorter, opacity_of_depth(e.opacity, depth), slab.alpha);
    }
    if (may_be_opaque)
        slab.alpha = select(is_opaque(e, entry_position(e, input)), constant<W>(e.one_alpha), slab.alpha);
    if constexpr (std::is_same_v<W, Real<double>>) {
        // Without rounding: the exact opacity in place of a table's rows.
        if (!e.table.active) {
            const EntryPosition<W> at = entry_position(e, input);
            slab.alpha = opacity_of_depth(e.opacity, point_depth(e, at, length));
            if (e.has_opaque) slab.alpha = select(is_opaque(e, at), constant<W>(e.one_alpha), slab.alpha);
        }
    }
    return slab;
}

/// Classifies one point for a slab of `length` steps: post-classification, and every method where both ends
/// are equal).
template <class W>
HWY_INLINE Slab<W> classify_point(const EntryLookup& e, W input, W length) {
    const EntryPosition<W> row = sub_entry_position(e, e.row_bits, input);
    return finish_point(
        e, input,
        lerp_rows(e.table, row.entry, row.fraction, e.input_fraction - e.row_bits, e.to_color, e.to_alpha),
        length);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
