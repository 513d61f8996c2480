// The maths of moments.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_CLASSIFICATION_MOMENTS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_MOMENTS_INL_H
#undef SQUINT_PIPELINE_CLASSIFICATION_MOMENTS_INL_H
#else
#define SQUINT_PIPELINE_CLASSIFICATION_MOMENTS_INL_H
#endif

#include "pipeline/classification/moments.h"

#include "pipeline/classification/prefix-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

template <class W>
using Powers = std::array<W, kMostMomentOrder>;

/// One end of a slab in its block: the depth from the block's start to the start of its sub-entry, to the end
/// itself, and to the end of the sub-entry.
template <class W>
struct MomentEnd {
    W row, fraction, start, depth, next;
};
template <class W>
HWY_INLINE MomentEnd<W> moment_end(const MomentSeries& m, W row, W fraction) {
    MomentEnd<W> end{
        row, fraction, gather(m.moments, row, 0), {}, gather(m.moments, row + constant<W>(1), 0)};
    end.depth = end.start + quantise(fraction * (end.next - end.start), m.to_part);
    return end;
}

/// A slab as three parts: a part of its first sub-entry, whole sub-entries, and a part of its last one, each
/// with its share of the depth.  Shares and moments are sums of positive terms, however short the slab.
template <class W>
struct SlabParts {
    MomentEnd<W> a, b;
    W span, whole;  // depths
    W first_share, whole_share;
    Powers<W> first_mean, last_mean;  // means of y^k over the parts
    Powers<W> whole_power;            // whole_share^(k + 1)
};
/// Promises that a value is at most one, which intervals cannot see.
template <class W>
HWY_INLINE W share_of(const MomentSeries& m, W part, W span) {
    return min(divide(part, span, m.to_share), constant<W>(std::int64_t{1} << m.word_fraction));
}
template <class W>
HWY_INLINE SlabParts<W> slab_parts(const MomentSeries& m, const MomentEnd<W>& a, const MomentEnd<W>& b) {
    const std::int64_t unit = std::int64_t{1} << m.word_fraction;
    const W zero = constant<W>(0), one = constant<W>(unit);
    const auto same = a.row == b.row;
    const auto product = [&](W x, W y) { return within(quantise(x * y, m.to_product), 0, unit); };
    SlabParts<W> parts{a, b, {}, {}, {}, {}, {}, {}, {}};
    const W first = clamp(select(same, b.depth, a.next) - a.depth, zero, one);
    parts.whole = clamp(select(same, zero, b.start - a.next), zero, one);
    const W last = clamp(select(same, zero, b.depth - b.start), zero, one);
    parts.span = within(divisor<W>(first + parts.whole + last), 1, unit);
    parts.first_share = share_of(m, first, parts.span);
    parts.whole_share = share_of(m, parts.whole, parts.span);
    const W behind = min(parts.first_share + parts.whole_share, one);
    W first_power = one, behind_power = one, mean = one;
    parts.whole_power[0] = parts.whole_share;
    parts.first_mean[0] = parts.last_mean[0] = one;
    for (std::size_t k = 1; k < static_cast<std::size_t>(m.order); ++k) {
        const W inverse = constant<W>(m.inverse[k]);
        first_power = product(first_power, parts.first_share);
        behind_power = product(behind_power, behind);
        parts.whole_power[k] = product(parts.whole_power[k - 1], parts.whole_share);
        parts.first_mean[k] = within(quantise(first_power * inverse, m.to_mean), 0, unit);
        // The mean of y^k over [b, 1] is (k mean_(k-1) + b^k) / (k + 1).
        mean = within(
            quantise((mean * constant<W>(static_cast<std::int64_t>(k)) + behind_power) * inverse, m.to_mean),
            0, unit);
        parts.last_mean[k] = mean;
    }
    return parts;
}

/// A number of each channel.
template <class W>
using Channels = std::array<W, 3>;
template <class W>
HWY_INLINE Channels<W> shares_of(const MomentSeries& m, const Channels<W>& parts, W span) {
    Channels<W> shares = divide_three(parts, span, m.to_share);
    for (W& share : shares) share = min(share, constant<W>(std::int64_t{1} << m.word_fraction));
    return shares;
}

/// The moments int c y^k dy of each channel, k < order.
template <class W>
HWY_INLINE Channels<Powers<W>> mean_moments(const MomentSeries& m, const SlabParts<W>& p) {
    const auto count = static_cast<std::size_t>(m.order);
    const W zero = constant<W>(0), one = constant<W>(std::int64_t{1} << m.word_fraction);
    const auto same = p.a.row == p.b.row;
    const W a_next_row = p.a.row + constant<W>(1);
    Channels<Powers<W>> moments;
    Channels<W> first, last;
    for (std::size_t c = 0; c < 3; ++c) {
        Powers<W>& moment = moments[c];
        const auto light = [&](W row, std::size_t k) {
            return gather(m.moments, row, static_cast<int>(1 + 3 * k + c));
        };
        const W a_start = light(p.a.row, 0), a_next = light(a_next_row, 0), b_start = light(p.b.row, 0);
        const W a_here = a_start + quantise(p.a.fraction * (a_next - a_start), m.to_part);
        const W b_here =
            b_start + quantise(p.b.fraction * (light(p.b.row + constant<W>(1), 0) - b_start), m.to_part);
        first[c] = clamp(select(same, b_here, a_next) - a_here, zero, one);
        last[c] = clamp(select(same, zero, b_here - b_start), zero, one);

        // The whole sub-entries, from their own start and over their own depth.
        moment[0] = clamp(select(same, zero, b_start - a_next), zero, one);
        for (std::size_t k = 1; k < count; ++k)
            moment[k] = clamp(light(p.b.row, k) - light(a_next_row, k), zero, one);
        for (std::size_t pass = 1; pass < count; ++pass)
            for (std::size_t k = count - 1; k >= pass; --k)
                moment[k] = clamp(moment[k] - quantise(p.a.next * moment[k - 1], m.to_product), zero, one);
    }
    first = shares_of(m, first, p.span), last = shares_of(m, last, p.span);
    const W whole = divisor<W>(p.whole);
    // For a thin part the words resolve only the lower moments.
    for (std::size_t k = 0; k < count; ++k) {
        Channels<W> shares{moments[0][k], moments[1][k], moments[2][k]};
        for (std::size_t times = 0; times <= k; ++times) shares = shares_of(m, shares, whole);
        const auto thin = p.whole < constant<W>(resolved_depth(m.word_fraction, k));
        const bool smooths = k > 0 && any(thin);
        for (std::size_t c = 0; c < 3; ++c) {
            Powers<W>& moment = moments[c];
            moment[k] = shares[c];
            if (!smooths) continue;
            W sum = moment[0] * constant<W>(kSmooth[k][0]);
            for (std::size_t i = 1; i < k; ++i) sum = sum + moment[i] * constant<W>(kSmooth[k][i]);
            moment[k] = select(thin, clamp(quantise(max(sum, zero), m.to_mean), zero, one), moment[k]);
        }
    }

    // Joins the three parts, one after the other.
    for (std::size_t c = 0; c < 3; ++c) {
        Powers<W>& moment = moments[c];
        for (std::size_t k = 0; k < count; ++k)
            moment[k] = quantise(moment[k] * p.whole_power[k], m.to_product);
        for (std::size_t pass = 1; pass < count; ++pass)
            for (std::size_t k = count - 1; k >= pass; --k)
                moment[k] = min(moment[k] + quantise(p.first_share * moment[k - 1], m.to_product), one);
        for (std::size_t k = 0; k < count; ++k)
            moment[k] = min(moment[k] + quantise(first[c] * p.first_mean[k], m.to_product) +
                                quantise(last[c] * p.last_mean[k], m.to_product),
                            one);
    }
    return moments;
}

/// The Legendre moments L_j from the moments int c y^k dy.
template <class W>
HWY_INLINE Powers<W> legendre_moments(const MomentSeries& m, const Powers<W>& mean) {
    const W one = constant<W>(std::int64_t{1} << m.word_fraction);
    Powers<W> result;
    for (std::size_t j = 0; j < static_cast<std::size_t>(m.order); ++j) {
        W sum = mean[0] * constant<W>(kShiftedLegendre[j][0]);
        for (std::size_t k = 1; k <= j; ++k) sum = sum + mean[k] * constant<W>(kShiftedLegendre[j][k]);
        result[j] = clamp(sum, constant<W>(0) - one, one);
    }
    return result;
}

/// The straight colour of the piece between two inputs, which is `depth` deep.
template <class W>
HWY_NOINLINE std::array<W, 3> series_color(const MomentSeries& m, W near, W far, W depth) {
    const W zero = constant<W>(0);
    // Choose the level whose block holds both ends.
    const EntryLookup& e = m.prefix.entries;
    const EntryPosition<W> low = sub_entry_position(e, m.sub_entry_bits, min(near, far)),
                           high = sub_entry_position(e, m.sub_entry_bits, max(near, far));
    const std::int64_t last = static_cast<std::int64_t>(m.prefix.entries.last_segment + 1)
                              << m.sub_entry_bits;
    const W level = within(bit_length(within(high.entry - low.entry, 0, last)), 0, m.levels.rows() - 1);
    const W block = within(shift_by(low.entry, zero - level), 0, last);
    const W base = gather(m.levels, level, 0) + block + within(shift_by(block, level), 0, last);
    const MomentEnd<W> a = moment_end(m, base + low.entry, low.fraction),
                       b = moment_end(m, base + high.entry, high.fraction);
    const SlabParts<W> parts = slab_parts(m, a, b);

    // Interpolate the weights between two rows.
    const int fraction = m.depth_fraction - m.row_bits;
    const W row = min(floor_shift(depth, fraction), constant<W>(m.weights.rows() - 2));
    const std::int64_t one = std::int64_t{1} << fraction;
    const W rest = within(min(depth - shift_left(row, fraction), constant<W>(one)), 0, one);
    Powers<W> weight;
    for (int j = 1; j < m.order; ++j)
        weight[static_cast<std::size_t>(j)] =
            quantise(blend(gather(m.weights, row, j - 1), gather(m.weights, row + constant<W>(1), j - 1),
                           rest, fraction),
                     m.to_weight);

    const auto descending = far < near;
    const auto deep = constant<W>(m.limit) < depth;
    const Channels<Powers<W>> moments = mean_moments(m, parts);
    Channels<W> color;
    for (std::size_t c = 0; c < 3; ++c) {
        const auto count = static_cast<std::size_t>(m.order);
        const Powers<W> moment = legendre_moments(m, moments[c]);
        W sum = shift_left(moment[0], m.weight_fraction);
        for (std::size_t j = 1; j < count; ++j) {
            const W seen = j % 2 ? select(descending, zero - moment[j], moment[j]) : moment[j];
            sum = sum + seen * weight[j];
        }
        if (!m.splits) sum = select(deep, shift_left(moment[0], m.weight_fraction), sum);
        color[c] =
            clamp(quantise(max(sum, zero), m.to_ratio), constant<W>(m.lowest[c]), constant<W>(m.highest[c]));
    }
    return color;
}

/// Finds the last input at which T, in units of its words, is at most `target`: by bisection, over entries
/// first, then inside one.
template <class W>
HWY_NOINLINE W input_at_depth(const MomentSeries& m, W target) {
    const PrefixLookup& p = m.prefix;
    const EntryLookup& e = p.entries;
    const W last = constant<W>(e.last_segment);
    W entry = constant<W>(0), fraction = constant<W>(0);
    for (int bit = e.last_segment; bit > 0; bit /= 2) {
        // Steps of 2^k, from the largest that fits.
        const int step = 1 << (31 - __builtin_clz(static_cast<unsigned>(bit)));
        const W next = min(entry + constant<W>(step), last);
        entry = select(target < gather(p.depth, next, 0), entry, next);
    }
    entry = within(entry, 0, e.last_segment);
    for (int bit = e.input_fraction - 1; bit >= 0; --bit) {
        const W next =
            within(fraction + constant<W>(std::int64_t{1} << bit), 0, std::int64_t{1} << e.input_fraction);
        const W there = floor_shift(depth_at(p, EntryPosition<W>{entry, next}), p.gained_bits());
        fraction = select(target < there, fraction, next);
    }
    return shift_left(entry, e.input_fraction) + fraction;
}

/// The optical depth of a cut slab, and the difference of T that gives it.
template <class W>
struct SlabDepth {
    W difference, depth;
};

/// The straight colour of a slab in kPieces pieces of equal depth; only the last may exceed the limit.
template <class W>
HWY_NOINLINE std::array<W, 3> color_in_pieces(const MomentSeries& m, const CutSlab<W>& cut, W front, W length,
                                              const SlabDepth<W>& whole) {
    const PrefixLookup& p = m.prefix;
    const W zero = constant<W>(0), one = constant<W>(p.entries.one_alpha);
    const W difference = floor_shift(whole.difference, p.gained_bits());
    const W share = min(floor_shift(difference, 2),
                        divide(difference * constant<W>(m.limit), divisor<W>(whole.depth), m.to_cut));
    const auto ascending = front < cut.end_input;
    const W signed_share = select(ascending, share, zero - share);
    const W low = min(front, cut.end_input), high = max(front, cut.end_input);
    W near = front, near_depth = depth_at(p, cut.front), through = one;
    W target = floor_shift(near_depth, p.gained_bits());
    std::array<W, 3> light{zero, zero, zero};
    for (int piece = 1; piece <= kPieces; ++piece) {
        target = target + signed_share;
        const W far =
            piece == kPieces ? cut.end_input : clamp(input_at_depth(m, max(target, zero)), low, high);
        const W far_depth = depth_at(p, entry_position(p.entries, far));
        const W depth = depth_of(p, absolute(far_depth - near_depth), divisor<W>(cut.span), length);
        const std::array<W, 3> color = series_color(m, near, far, depth);
        const W part =
            min(quantise(through * opacity_of_depth(p.entries.opacity, depth), m.to_piece), through);
        for (std::size_t c = 0; c < 3; ++c) light[c] = light[c] + part * color[c];
        through = through - part;
        near = far, near_depth = far_depth;
    }
    const W seen = divisor<W>(one - through);
    for (std::size_t c = 0; c < 3; ++c)
        light[c] =
            clamp(divide(light[c], seen, m.to_whole), constant<W>(m.lowest[c]), constant<W>(m.highest[c]));
    return light;
}

template <class W>
HWY_INLINE Slab<W> classify(const MomentSeries& m, W front, W back, W length) {
    if constexpr (std::is_same_v<W, Real<double>>)
        if (m.exact && !m.moments.active && !m.prefix.depth.active)
            return exact_slab_of(m.prefix.entries, *m.exact, front, back, length);
    const CutSlab<W> cut = cut_at_wall(m.prefix, front, back);
    const W difference = absolute(depth_at(m.prefix, cut.end) - depth_at(m.prefix, cut.front));
    const SlabDepth<W> whole{difference, depth_of(m.prefix, difference, divisor<W>(cut.span), length)};
    Slab<W> slab{series_color(m, front, cut.end_input, whole.depth),
                 opacity_of_depth(m.prefix.entries.opacity, whole.depth)};
    if (m.splits) {
        const auto deep = constant<W>(m.limit) < whole.depth;
        if (any(deep)) {
            const std::array<W, 3> color = color_in_pieces(m, cut, front, length, whole);
            for (std::size_t c = 0; c < 3; ++c) slab.color[c] = select(deep, color[c], slab.color[c]);
        }
    }
    return finish_straight(m.prefix, cut, front, length, slab);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
