// A slab too deep for one series, cut into pieces of which each is classified by itself.
#pragma once

#include "core/portable_math.h"
#include "pipeline/classification/tables/linear_entries.h"

namespace squint::preintegration {

/// A slab of optical depth `depth`, from its `pieces` front to back; value_of(k), k from 1 to pieces, is what the k-th
/// adds.  Behind a transparency below `spent` no piece is asked for: what lies there gets the colour so far.  The
/// opacity is 1 - exp(-depth), and the colour is scaled to it.
template <class ValueOf>
SlabValue composited(int pieces, double depth, double spent, const ValueOf& value_of) {
    SlabValue result;
    double through = 1;
    for (int piece = 1; piece <= pieces && through >= spent; ++piece) {
        const SlabValue value = value_of(piece);
        result.color += value.color * through;
        through *= 1 - value.alpha;
    }
    result.alpha = -portable::expm1(-depth);
    if (1 - through > 0) result.color *= result.alpha / (1 - through);
    return result;
}

}  // namespace squint::preintegration
