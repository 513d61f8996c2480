// The maths of every classification method, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_CLASSIFICATION_METHODS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_METHODS_INL_H
#undef SQUINT_PIPELINE_CLASSIFICATION_METHODS_INL_H
#else
#define SQUINT_PIPELINE_CLASSIFICATION_METHODS_INL_H
#endif

#include "pipeline/classification/methods.h"

#include "pipeline/classification/moments-inl.h"
#include "pipeline/classification/pc-inl.h"
#include "pipeline/classification/pi1d-inl.h"
#include "pipeline/classification/pi2d-inl.h"
#include "pipeline/classification/pips-inl.h"

#include <hwy/highway.h>

#include <concepts>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// A method in the word W: its rules, its tables for visit() and describe(), and classify().
template <class M, class W>
concept Classifier = requires(const M& method, M& visited, ClassificationReport& report, W front, W back,
                              W length) {
    requires std::same_as<const bool, decltype(M::kPremultiplied)>;
    requires std::same_as<const bool, decltype(M::kNeedsBack)>;
    visited.visit([](auto&) {});
    method.describe(report);
    { classify(method, front, back, length) } -> std::same_as<Slab<W>>;
};
// Every method of the list satisfies it.
template <class... M>
constexpr bool are_classifiers(const std::variant<M...>*) {
    return (Classifier<M, std::int64_t> && ...) && (Classifier<M, Real<double>> && ...);
}
static_assert(are_classifiers(static_cast<const ClassificationMethod*>(nullptr)));

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
