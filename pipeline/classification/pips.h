// Stage 4, PIPS(1): pre-integration by the first-order power series (Lee & Shin 2013, equations 8 and 22).
// Inputs at both ends (I.F) -> straight colour K (1.F), opacity (1.F):
//
//     x = length (T(s_b) - T(s_f)) / |s_b - s_f|     alpha = 1 - exp(-x)
//     K = (X(s_b) - X(s_f)) / (T(s_b) - T(s_f))
//
// Exact in alpha.  K is the mean colour weighted by extinction: it does not tell front from back, and errs by
// x^2 dc / 8 for a colour that changes by dc inside the slab.  Between rows the colour is their mean; an
// entry has several rows where that would show.  Orders above 1: moments.h.
#pragma once

#include "pipeline/classification/prefix.h"

#include <memory>

namespace squint {

struct PowerSeriesOfOrder1 {
    static constexpr bool kPremultiplied = false;
    static constexpr bool kNeedsBack = true;
    static bool serves(const ClassificationSettings& settings) {
        return settings.method == Method::pips && settings.order_or_least() == 1;
    }
    static PowerSeriesOfOrder1 build(const ClassificationInputs& inputs);

    PrefixLookup prefix;
    Table moment;  // X[i], colour over depth, in three columns; a row for each of T
    std::shared_ptr<const std::vector<std::int32_t>> rows;  // T and X1 side by side, for 32-bit lanes
    std::shared_ptr<const std::vector<float>> float_rows;   // the same unrounded, for lanes of floats
    std::int64_t most_rise = 0;                             // the most that T or X1 rises from row to row
    Rescale to_ratio;
    std::int64_t one_ratio = 0;
    Approximation rows_of_color;                               // the mean colour in a row
    std::shared_ptr<const preintegration::ExactSeries> exact;  // used without rounding: no rows

    template <class V>
    void visit(V&& v) {
        prefix.visit(v), v(moment), v(to_ratio);
    }
    void describe(ClassificationReport& report) const {
        prefix.describe(report);
        report.add("X1", moment, "prefix sums of colour over depth");
        report.add(rows_of_color);
    }
};

}  // namespace squint
