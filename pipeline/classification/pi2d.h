// Stage 4, PI2D: the slab integral in a table over both ends, for one slab length (Engel et al. 2001).
// inputs at both ends (I.F) -> premultiplied colour (1.F), opacity (1.F).
//
// size x size cells of four words, in the formats of slab_color and slab_alpha; node j stands at entry
// j (entries - 1) / (size - 1).  Bilinear, or the nearest cell.  Full slabs are looked up; a shorter slab,
// and one that an opaque entry ends, takes alpha exactly from T and the cell's colour times alpha' / alpha:
// the self-attenuation inside it stays that of a full slab.
#ifndef SQUINT_PIPELINE_CLASSIFICATION_PI2D_H
#define SQUINT_PIPELINE_CLASSIFICATION_PI2D_H

#include "fixedpoint/cell_table.h"
#include "pipeline/classification/prefix.h"

namespace squint {

struct PreIntegrated2D {
    static constexpr bool kPremultiplied = true;
    static constexpr bool kNeedsBack = true;
    PrefixLookup prefix;
    PremultipliedRules premultiplied;
    CellTable cells;
    bool nearest = false, self_attenuation = true;
    int entries = 0;
    int node_fraction = 0;       // of a coordinate in nodes
    bool scaled = false;         // nodes are not one entry apart
    Rescale to_node;             // input (size - 1) / (entries - 1)
    Rescale to_color, to_alpha;  // lerps between cells

    template <class V>
    void visit(V&& v) {
        prefix.visit(v), premultiplied.visit(v), v(cells), v(to_node), v(to_color), v(to_alpha);
    }
    int entry_reach() const { return (entries - 2) / (cells.size() - 1) + 1; }
    void describe(ClassificationReport& report) const;
};
PreIntegrated2D build_pre_integrated_2d(const ClassificationInputs& inputs);

}  // namespace squint
#endif

#include "pipeline/classification/prefix.h"

#include <hwy/highway.h>
#if defined(SQUINT_PIPELINE_CLASSIFICATION_PI2D_TARGET) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_PI2D_TARGET
#undef SQUINT_PIPELINE_CLASSIFICATION_PI2D_TARGET
#else
#define SQUINT_PIPELINE_CLASSIFICATION_PI2D_TARGET
#endif
HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// Where an input stands between two nodes.
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
    return {cell, min(node - shift_left(cell, bits), constant<W>(std::int64_t{1} << bits))};
}

/// The table between its cells: three lerps, each rounded once.
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
    if (any(other)) {
        const W depth = slab_depth(m.prefix, cut, length);
        const Slab<W> part =
            with_alpha(m.premultiplied, slab, opacity_of_depth(m.prefix.entries.opacity, depth));
        for (std::size_t c = 0; c < 3; ++c) slab.color[c] = select(other, part.color[c], slab.color[c]);
        slab.alpha = select(other, part.alpha, slab.alpha);
    }
    return finish_premultiplied(m.prefix, m.premultiplied, cut, front, length, slab);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
