// Classification methods that bound how far a slab of words is from the function's own.  The composition takes them for
// the plan's method.
#pragma once

#include "pipeline/classification/entries.h"
#include "pipeline/classification/pc.h"
#include "pipeline/classification/pips.h"
#include "pipeline/classification/tables/exact_series.h"
#include "pipeline/machines/certificate/function.h"
#include "pipeline/machines/certificate/payers.h"

namespace squint {

/// Post-classification, and how far a slab is from the function's own at what the sample may be.
struct BoundedPostClassification {
    static constexpr bool kNeedsBack = false;
    const PostClassification& words;
    const Function& function;
};
Slab<Bounded> classify(const BoundedPostClassification& m, const Bounded& input, const Bounded&,
                       const Bounded& length);

/// PIPS(1).  Without rounding a slab is the mean extinction on its way from one input to the other, and the mean colour
/// weighted by it: moving the ends by e moves the mean of a curve by its slope times e, however short the way is.
struct BoundedPowerSeries {
    static constexpr bool kNeedsBack = true;
    const PowerSeriesOfOrder1& words;
    const Function& function;
    const preintegration::ExactSeries& exact;
};
Slab<Bounded> classify(const BoundedPowerSeries& m, const Bounded& front, const Bounded& back,
                       const Bounded& length);

}  // namespace squint
