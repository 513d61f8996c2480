// Classification methods that bound how far a slab of words is from the function's own.  The composition takes them for
// the plan's method.
#pragma once

#include "pipeline/classification/methods.h"
#include "pipeline/classification/tables/exact_series.h"
#include "pipeline/machines/certificate/function.h"
#include "pipeline/machines/certificate/inside.h"
#include "pipeline/machines/certificate/payers.h"

#include <limits>
#include <variant>

namespace squint {

/// Post-classification, and how far a slab is from the function's own at what the sample may be.
struct BoundedPostClassification {
    static constexpr bool kNeedsBack = false, kPremultiplied = false;
    const PostClassification& words;
    const Function& function;
};
Slab<Bounded> classify(const BoundedPostClassification& m, const Bounded& input, const Bounded&,
                       const Bounded& length);

/// What an order makes of colours: K = int c(y) w(y) dy over a slab's own depth x, y in [0, 1], with int w = 1.  Over
/// x up to `up_to`, `most` is the greatest |w|, `slope` that of dw / dy, `by_depth` that of dw / dx.
struct SeriesKernel {
    double most = 1, slope = 0, by_depth = 0;
    double up_to = std::numeric_limits<double>::infinity();
};
/// PIPS(1 to 5): w = p(xy) / int p(xy) dy, p the first terms of e^-t, which is positive up to the trusted depth.
/// LEG(2 to 4): w = sum (2j + 1) (-1)^j P_j(2y - 1) i_j(x / 2) / i_0(x / 2), up to the depth at which slabs are cut.
SeriesKernel series_kernel(int order, bool legendre);

/// PIPS(n) and LEG(n).  Without rounding a slab is the mean extinction on its way from one input to the other, and
/// the mean colour weighted by it.  Moving the ends by e moves the mean of a curve by its slope times e, however
/// short the way.
struct BoundedPowerSeries {
    static constexpr bool kNeedsBack = true, kPremultiplied = false;
    std::variant<const PowerSeriesOfOrder1*, const MomentSeries*> words;
    const Function& function;
    const preintegration::ExactSeries& exact;
    SeriesKernel kernel;
    BoundedPrefix prefix;
};
Slab<Bounded> classify(const BoundedPowerSeries& m, const Bounded& front, const Bounded& back,
                       const Bounded& length);

}  // namespace squint
