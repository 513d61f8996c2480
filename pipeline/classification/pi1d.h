// Stage 4, PI1D: one-dimensional tables for one slab length, without self-attenuation inside the slab.
// Inputs at both ends (I.F) -> premultiplied colour (1.F), opacity (1.F):
//
//     kye    alpha = mean of a_i, C = mean of a_i c_i over the slab's entries, a_i = 1 - exp(-tau_i d)
//     engel  alpha = 1 - exp(-mean of v_i), C = mean of v_i c_i <= alpha, v_i = min(tau_i d, 1)
//
// (Kye et al. 2008; Engel's clamped variant, Lee & Shin, section 3.3).  An opaque entry counts 1:
// one among n gives 1/n, unless opaque prediction ends the slab there.  Means are differences of
// prefix sums over |s_b - s_f|.  A shorter slab takes alpha exactly from T, and the colour in
// proportion.
#pragma once

#include "pipeline/classification/prefix.h"

namespace squint {

struct PreIntegrated1D {
    static constexpr bool kPremultiplied = true;
    static constexpr bool kNeedsBack = true;
    static bool serves(const ClassificationSettings& settings) {
        return settings.method == Method::pi1d || settings.method == Method::pi1d_engel;
    }
    static PreIntegrated1D build(const ClassificationInputs& inputs);

    enum Column {
        value = 3,
        columns = 4
    };  // red, green, blue before it; where `curved`, their bends after it
    PrefixLookup prefix;
    PremultipliedRules premultiplied;
    Table sums;              // prefix sums of value times colour, and of value
    bool curved = false;     // sums bend between entries, because values are linear there
    Approximation straight;  // where they do not bend
    int sum_fraction = 0;
    std::int64_t most_rise = 0;  // the most that a sum rises from row to row
    bool is_opacity = true;
    Rescale to_color;  // means
    Rescale to_alpha;
    Rescale to_depth;

    template <class V>
    void visit(V&& v) {
        prefix.visit(v), premultiplied.visit(v), v(sums), v(to_color), v(to_alpha), v(to_depth);
    }
    void describe(ClassificationReport& report) const {
        prefix.describe(report);
        report.add("sums", sums,
                   is_opacity ? "prefix sums of opacity and coloured opacity, for one slab length"
                              : "prefix sums of clamped depth and coloured depth, for one slab length");
        report.add(straight);
    }
};

}  // namespace squint
