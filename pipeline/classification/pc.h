// Stage 4, post-classification: the sample's own entry, front or middle of the slab.
// input (I.F, in table entries) -> straight colour (1.F), opacity (1.F).  Squeeze, section 4.4.
#ifndef SQUINT_PIPELINE_CLASSIFICATION_PC_H
#define SQUINT_PIPELINE_CLASSIFICATION_PC_H

#include "pipeline/classification/entries.h"

namespace squint {

/// The entries alone: colour, opacity of a full step, extinction for a ray's last, shorter slab.
struct PostClassification {
    static constexpr bool kPremultiplied = false;
    static constexpr bool kNeedsBack = false;
    EntryLookup entries;

    template <class V>
    void visit(V&& v) {
        entries.visit(v);
    }
    void describe(ClassificationReport& report) const { entries.describe(report); }
};
PostClassification build_post_classification(const ClassificationInputs& inputs);

}  // namespace squint
#endif

#include "pipeline/classification/entries.h"

#include <hwy/highway.h>
#if defined(SQUINT_PIPELINE_CLASSIFICATION_PC_TARGET) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_PC_TARGET
#undef SQUINT_PIPELINE_CLASSIFICATION_PC_TARGET
#else
#define SQUINT_PIPELINE_CLASSIFICATION_PC_TARGET
#endif
HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

template <class W>
HWY_INLINE Slab<W> classify(const PostClassification& m, W front, W, W length) {
    return classify_point(m.entries, front, length);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
