// Bounded classification by pi2d and pi1d, whose slabs bring c alpha.  The range of a slab over all that its ends and
// its length may be is found from what the method without rounding has there.
#pragma once

#include "pipeline/classification/methods.h"
#include "pipeline/machines/certificate/function.h"
#include "pipeline/machines/certificate/inside.h"
#include "pipeline/machines/certificate/payers.h"

namespace squint {

/// `real`: the same method in the plan that rounds nothing.
struct BoundedCells {
    static constexpr bool kNeedsBack = true, kPremultiplied = true;
    const PreIntegrated2D &words, &real;
    const Function& function;
    BoundedPrefix prefix;
};
struct BoundedMeans {
    static constexpr bool kNeedsBack = true, kPremultiplied = true;
    const PreIntegrated1D &words, &real;
    const Function &function, &means;
    BoundedPrefix prefix;
};
Slab<Bounded> classify(const BoundedCells& m, const Bounded& front, const Bounded& back,
                       const Bounded& length);
Slab<Bounded> classify(const BoundedMeans& m, const Bounded& front, const Bounded& back,
                       const Bounded& length);

}  // namespace squint
