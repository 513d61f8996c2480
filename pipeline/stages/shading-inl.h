// The maths of shading.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_SHADING_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_SHADING_INL_H
#undef SQUINT_PIPELINE_STAGES_SHADING_INL_H
#else
#define SQUINT_PIPELINE_STAGES_SHADING_INL_H
#endif

#include "pipeline/stages/shading.h"

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

/// Lights a slab: returns `color`, straight or premultiplied, lit.  A zero normal gets only ambient light.
/// Reads `confidence` where light fades in.
template <class W>
HWY_INLINE void shade(const ShadingStage& s, const RayWords<W>& ray, const std::array<W, 3>& normal, W alpha,
                      std::array<W, 3>& color, W confidence = constant<W>(0)) {
    const W opacity = s.premultiplied ? alpha : constant<W>(std::int64_t{1} << s.color_fraction);
    with_model(s.model, [&]<class M>(M model) SQUINT_WRITTEN_OUT {
        const Reflection<W> light = reflect(model, s, ray, normal, confidence);
        for (std::size_t c = 0; c < 3; ++c) {
            const std::size_t from = light.white ? 0 : c;
            color[c] = quantise(color[c] * light.diffuse[from] + opacity * light.specular[from], s.to_lit);
            if constexpr (M::kHeldToOpacity)
                color[c] = min(color[c], quantise(shift_left(opacity, s.intensity_fraction), s.to_lit));
        }
    });
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
