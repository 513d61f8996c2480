// The maths of pi2d.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_CLASSIFICATION_PI2D_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_PI2D_INL_H
#undef SQUINT_PIPELINE_CLASSIFICATION_PI2D_INL_H
#else
#define SQUINT_PIPELINE_CLASSIFICATION_PI2D_INL_H
#endif

#include "pipeline/classification/pi2d.h"

#include "pipeline/classification/prefix-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// The position of an input between two nodes.
template <class W>
HWY_INLINE EntryPosition<W> node_position(const PreIntegrated2D& m, W input) {
    const int bits = m.node_fraction;
    W node = m.scaled ? divide(input * constant<W>(m.cells.size() - 1), constant<W>(m.entries - 1), m.to_node)
                      : quantise(input, m.to_node);
    if (m.nearest) {
        const W half = constant<W>((std::int64_t{1} << bits) >> 1);
        return {min(floor_shift(node + half, bits), constant<W>(m.cells.size() - 1)), constant<W>(0)};
    }
    const W cell = min(floor_shift(node, bits), constant<W>(m.cells.size() - 2));
    const std::int64_t one = std::int64_t{1} << bits;
    return {cell, within(min(node - shift_left(cell, bits), constant<W>(one)), 0, one)};
}

/// A lerp between numbers of 0 or more.
template <class W>
HWY_INLINE W lerp_nodes(W v0, W v1, W weight, int weight_bits, const Rescale& to) {
    return quantise(blend(v0, v1, weight, weight_bits), to);
}
inline Range lerp_nodes(Range v0, Range v1, Range weight, int weight_bits, const Rescale& to) {
    const int lanes_before = Range::needs.lane_bits;
    const Range result = quantise(blend(v0, v1, weight, weight_bits), to);
    if (!splits_lerp(to, weight_bits)) return result;
    // The rise's upper bits times the weight, and what is added to it before the sum is rounded.
    Range::needs.lane_bits = lanes_before;
    const int low = to.shift / 2;
    const Range rest = floor_shift(noted(v1 - v0), low) * weight;
    const Int128 added = (Int128{1} << to.shift) + to.bias + (weight.high << low);
    noted({0, added});
    noted({rest.low, rest.high + (added >> low)});
    return noted(result);
}

/// Interpolates a table between its nodes: three lerps, each rounded once.
template <class W>
HWY_INLINE std::array<W, 4> between_cells(const PreIntegrated2D& m, const CellTable& cells,
                                          const EntryPosition<W>& f, const EntryPosition<W>& b) {
    if (m.nearest) return gather_cell(cells, f.entry, b.entry);
    const auto [left, right] = gather_two_cells(cells, f.entry, b.entry);
    const auto [below, across] = gather_two_cells(cells, f.entry + constant<W>(1), b.entry);
    std::array<W, 4> cell;
    for (std::size_t c = 0; c < 4; ++c) {
        const Rescale& to = c < 3 ? m.to_color : m.to_alpha;
        const W here = lerp_nodes(left[c], right[c], b.fraction, m.node_fraction, to);
        const W next = lerp_nodes(below[c], across[c], b.fraction, m.node_fraction, to);
        cell[c] = lerp_nodes(here, next, f.fraction, m.node_fraction, to);
    }
    return cell;
}
/// What the method computes of one sample: the back of a slab is the front of the next.
template <class W>
struct NodeSample {
    W input;
    EntryPosition<W> at;  // in nodes
};
template <class W>
HWY_INLINE NodeSample<W> sample_of(const PreIntegrated2D& m, W input) {
    return {input, node_position(m, input)};
}
template <class W>
HWY_INLINE Slab<W> look_up(const PreIntegrated2D& m, const EntryPosition<W>& front,
                           const EntryPosition<W>& back) {
    const std::array<W, 4> cell = between_cells(m, m.cells, front, back);
    const W limit = largest_color(m.premultiplied, cell[3]);
    return {{min(cell[0], limit), min(cell[1], limit), min(cell[2], limit)}, cell[3]};
}

/// The part of a slab in front of a wall.
template <class W>
HWY_INLINE Slab<W> translucent_part(const PreIntegrated2D& m, const CutSlab<W>& cut, const Slab<W>& full,
                                    W length) {
    Slab<W> slab = full;
    const auto other = is_shorter(m.prefix.entries, length) | (constant<W>(0) < cut.wall);
    take_own_depth(m.prefix, m.premultiplied, cut, length, other, slab);
    return slab;
}
/// The slab between nodes, in front of the wall that may end it.
template <class W>
HWY_INLINE Slab<W> classify(const PreIntegrated2D& m, const CutSlab<W>& cut, const EntryPosition<W>& front,
                            const EntryPosition<W>& end, W length) {
    const Slab<W> part = translucent_part(m, cut, look_up(m, front, end), length);
    return finish_premultiplied(m.prefix, m.premultiplied, cut, cut.front_input, length, part);
}
template <class W>
HWY_INLINE Slab<W> classify(const PreIntegrated2D& m, const NodeSample<W>& front, const NodeSample<W>& back,
                            W length) {
    const CutSlab<W> cut = cut_at_wall(m.prefix, front.input, back.input);
    const bool is_cut = m.prefix.predicts && any(constant<W>(0) < cut.wall);
    return classify(m, cut, front.at, is_cut ? node_position(m, cut.end_input) : back.at, length);
}
template <class W>
HWY_INLINE Slab<W> classify(const PreIntegrated2D& m, W front, W back, W length) {
    const CutSlab<W> cut = cut_at_wall(m.prefix, front, back);
    return classify(m, cut, node_position(m, front), node_position(m, cut.end_input), length);
}

/// Of the slab that classify gave.  What a shorter or cut slab keeps of a full one it keeps of each part; a wall
/// and, where the ends are equal, a point's rest stand at the end.
template <class W>
HWY_INLINE FadingLight<W> fading_light(const PreIntegrated2D& m, W front, W back, W length,
                                       const Slab<W>& whole) {
    const CutSlab<W> cut = cut_at_wall(m.prefix, front, back);
    const EntryPosition<W> f = node_position(m, front), b = node_position(m, cut.end_input);
    const Slab<W> full = look_up(m, f, b), slab = translucent_part(m, cut, full, length);
    const auto has_wall = constant<W>(0) < cut.wall;
    const auto other = is_shorter(m.prefix.entries, length) | has_wall;
    FadingLight<W> light{static_cast<int>(m.fades.size()) + 1, {}, way_to_wall(cut, m.to_way)};
    const auto with_white = [&](const Slab<W>& s) -> std::array<W, 4> {
        return {s.color[0], s.color[1], s.color[2], largest_color(m.premultiplied, s.alpha)};
    };
    const std::array<W, 4> seen = with_white(slab), all = with_white(whole);
    light.part[0] = seen;
    for (std::size_t k = 1; k <= m.fades.size(); ++k) {
        const std::array<W, 4> cell = between_cells(m, m.fades[k - 1], f, b);
        const std::array<W, 4> part{cell[0], cell[1], cell[2], largest_color(m.premultiplied, cell[3])};
        const auto kept = [&](W of_full) {
            const Slab<W> less =
                with_alpha(m.premultiplied, {{of_full, of_full, of_full}, full.alpha}, slab.alpha);
            return select(other, less.color[0], of_full);
        };
        for (std::size_t c = 0; c < 4; ++c) {
            light.part[k][c] = min(any(other) ? kept(part[c]) : part[c], light.part[0][c]);
            light.part[0][c] = within(light.part[0][c] - light.part[k][c], 0, m.premultiplied.one_color);
        }
    }
    std::array<W, 4>& last = light.part[m.fades.size()];
    for (std::size_t c = 0; c < 4; ++c)
        last[c] = clamp(last[c] + (all[c] - seen[c]), constant<W>(0), constant<W>(m.premultiplied.one_color));
    return light;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
