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

/// Interpolates the table between its nodes: three lerps, each rounded once.
template <class W>
HWY_INLINE Slab<W> look_up(const PreIntegrated2D& m, W front, W back) {
    const EntryPosition<W> f = node_position(m, front), b = node_position(m, back);
    std::array<W, 4> cell;
    if (m.nearest) {
        cell = gather_cell(m.cells, f.entry, b.entry);
    } else {
        const auto [left, right] = gather_two_cells(m.cells, f.entry, b.entry);
        const auto [below, across] = gather_two_cells(m.cells, f.entry + constant<W>(1), b.entry);
        for (std::size_t c = 0; c < 4; ++c) {
            const Rescale& to = c < 3 ? m.to_color : m.to_alpha;
            const W here = quantise(blend(left[c], right[c], b.fraction, m.node_fraction), to);
            const W next = quantise(blend(below[c], across[c], b.fraction, m.node_fraction), to);
            cell[c] = quantise(blend(here, next, f.fraction, m.node_fraction), to);
        }
    }
    const W limit = largest_color(m.premultiplied, cell[3]);
    return {{min(cell[0], limit), min(cell[1], limit), min(cell[2], limit)}, cell[3]};
}

template <class W>
HWY_INLINE Slab<W> classify(const PreIntegrated2D& m, W front, W back, W length) {
    const CutSlab<W> cut = cut_at_wall(m.prefix, front, back);
    Slab<W> slab = look_up(m, front, cut.end_input);
    const auto other = is_shorter(m.prefix.entries, length) | (constant<W>(0) < cut.wall);
    take_own_depth(m.prefix, m.premultiplied, cut, length, other, slab);
    return finish_premultiplied(m.prefix, m.premultiplied, cut, front, length, slab);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
