// The one list of reflection models.  A model is a file: a type with two facts, and reflect().  To add one: its file,
// its line here, its name in scene.h, its equation in truth/reference_light.cpp.  Compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_SHADING_MODELS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_SHADING_MODELS_INL_H
#undef SQUINT_PIPELINE_STAGES_SHADING_MODELS_INL_H
#else
#define SQUINT_PIPELINE_STAGES_SHADING_MODELS_INL_H
#endif

#include "pipeline/stages/shading/blinn_phong-inl.h"
#include "pipeline/stages/shading/cone-inl.h"
#include "pipeline/stages/shading/gooch-inl.h"
#include "pipeline/stages/shading/phong-inl.h"

#include <hwy/highway.h>

#include <concepts>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// A reflection model: from a normal, and the confidence in it, to a Reflection.
template <class M, class W>
concept ReflectionModel = requires(const M& model, const ShadingStage& stage, const RayWords<W>& ray,
                                   const std::array<W, 3>& normal, W confidence) {
    { reflect(model, stage, ray, normal, confidence) } -> std::same_as<Reflection<W>>;
    { M::kHeldToOpacity } -> std::convertible_to<bool>;  // lit light never exceeds the opacity
    { M::kHasHighlights } -> std::convertible_to<bool>;  // what it adds to colours is no line in N.L
};

template <class... M>
concept ReflectionModels = (ReflectionModel<M, std::int64_t> && ...);
static_assert(ReflectionModels<Phong, BlinnPhong, Cone, Gooch>);

/// Calls f with the type of the model: the one list of models.
template <class F>
HWY_INLINE decltype(auto) with_model(ShadingModel model, F&& f) {
    switch (model) {
        case ShadingModel::phong:
            return f(Phong{});
        case ShadingModel::cone:
            return f(Cone{});
        case ShadingModel::gooch:
            return f(Gooch{});
        default:
            return f(BlinnPhong{});
    }
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
