// Stage 4, PI2D: the slab integral in a table over both ends, for one slab length (Engel et al. 2001).
// Inputs at both ends (I.F) -> premultiplied colour (1.F), opacity (1.F).
//
// size x size nodes of four words, in the formats of slab_color and slab_alpha; node j lies at entry j
// (entries - 1) / (size - 1).  Bilinear, or the nearest node.  Full slabs are looked up.  A shorter slab, and
// one that ends at an opaque entry, takes alpha exactly from T and the table's colour times alpha' / alpha:
// it keeps the self-attenuation of a full slab.
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
    bool scaled = false;    // whether nodes and entries differ
    Approximation between_nodes;
    Rescale to_node;             // input (size - 1) / (entries - 1)
    Rescale to_color, to_alpha;  // lerps between nodes

    template <class V>
    void visit(V&& v) {
        prefix.visit(v), premultiplied.visit(v), v(cells), v(to_node), v(to_color), v(to_alpha);
    }
    int entry_reach() const { return (entries - 2) / (cells.size() - 1) + 1; }
    void describe(ClassificationReport& report) const;
};
PreIntegrated2D build_pre_integrated_2d(const ClassificationInputs& inputs);

}  // namespace squint
