// Stage 4, PI2D: the slab integral in a table over both ends, for one slab length (Engel et al. 2001).
// inputs at both ends (I.F) -> premultiplied colour (1.F), opacity (1.F).
//
// size x size cells of four words, in the formats of slab_color and slab_alpha; node j stands at entry
// j (entries - 1) / (size - 1).  Bilinear, or the nearest cell.  Full slabs are looked up; a shorter slab,
// and one that an opaque entry ends, takes alpha exactly from T and the cell's colour times alpha' / alpha:
// the self-attenuation inside it stays that of a full slab.
#pragma once

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
    int node_fraction = 0;  // of a coordinate in nodes
    bool scaled = false;    // nodes are not one entry apart
    Approximation between_nodes;
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
