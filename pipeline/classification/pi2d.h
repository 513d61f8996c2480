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

#include <vector>

namespace squint {

struct PreIntegrated2D {
    static constexpr bool kPremultiplied = true;
    static constexpr bool kNeedsBack = true;
    static bool serves(const ClassificationSettings& settings) {
        return settings.method == Method::pi2d || settings.method == Method::pi2d_no_attenuation;
    }
    static PreIntegrated2D build(const ClassificationInputs& inputs);

    PrefixLookup prefix;
    PremultipliedRules premultiplied;
    CellTable cells;
    // Where light fades inside a slab: int u c m du (linear), or its Bernstein moments B_1 to B_3 (nlpi), of the
    // colours and of white.  B_0 is what is left of the slab, so that rounding cannot unbalance them.
    std::vector<CellTable> fades;
    Rescale to_way;  // the part of a slab's way up to a wall
    bool nearest = false, self_attenuation = true;
    int entries = 0;
    int node_fraction = 0;  // of a coordinate in nodes
    bool scaled = false;    // whether nodes and entries differ
    Approximation between_nodes;
    Rescale to_node;             // input (size - 1) / (entries - 1)
    Rescale to_color, to_alpha;  // lerps between nodes

    template <class V>
    void visit(V&& v) {
        prefix.visit(v), premultiplied.visit(v), v(cells), v(to_node), v(to_color), v(to_alpha), v(to_way);
        for (CellTable& fade : fades) v(fade);
    }
    int entry_reach() const { return (entries - 2) / (cells.size() - 1) + 1; }
    void describe(ClassificationReport& report) const;
};

}  // namespace squint
