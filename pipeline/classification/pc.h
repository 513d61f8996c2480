// Stage 4, post-classification: classifies the sample at the front or the middle of the slab.  Input (I.F, in
// table entries) -> straight colour (1.F), opacity (1.F).  Squeeze, section 4.4.
#pragma once

#include "pipeline/classification/entries.h"

namespace squint {

/// The entries alone: colour and opacity of a full step, and extinction for a ray's last, shorter slab.
struct PostClassification {
    static constexpr bool kPremultiplied = false;
    static constexpr bool kNeedsBack = false;
    static bool serves(const ClassificationSettings& settings) {
        return settings.method == Method::pc || settings.method == Method::pc_mid;
    }
    static PostClassification build(const ClassificationInputs& inputs);

    EntryLookup entries;

    template <class V>
    void visit(V&& v) {
        entries.visit(v);
    }
    void describe(ClassificationReport& report) const { entries.describe(report); }
};

}  // namespace squint
