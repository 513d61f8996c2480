// Bounded classification by pi2d and pi1d, whose slabs bring c alpha.  The range of a slab over all that its ends and
// its length may be is found from what the method without rounding has there.
#pragma once

#include "pipeline/classification/methods.h"
#include "pipeline/machines/certificate/function.h"
#include "pipeline/machines/certificate/inside.h"
#include "pipeline/machines/certificate/payers.h"

#include <vector>

namespace squint {

/// `real`: the same method in the plan that rounds nothing.
struct BoundedCells {
    static constexpr bool kNeedsBack = true, kPremultiplied = true;
    const PreIntegrated2D &words, &real;
    const Function& function;
    BoundedPrefix prefix;
    const std::vector<CellTable>& fades;  // the words': the composition asks for light where there are any
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
/// linear, nlpi: where light lies in the slab that classify gave.
FadingLight<Bounded> fading_light(const BoundedCells& m, const Bounded& front, const Bounded& back,
                                  const Bounded& length, const Slab<Bounded>& whole);

}  // namespace squint
