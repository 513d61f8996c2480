// The maths of shading.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_SHADING_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_SHADING_INL_H
#undef SQUINT_PIPELINE_STAGES_SHADING_INL_H
#else
#define SQUINT_PIPELINE_STAGES_SHADING_INL_H
#endif

#include "pipeline/stages/shading.h"

#include "pipeline/classification/prefix-inl.h"
#include "pipeline/stages/shading/models-inl.h"

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// The opacity that highlights of a slab shine with: its own where colours are premultiplied, else one.
template <class W>
HWY_INLINE W opacity_of_light(const ShadingStage& s, W alpha) {
    const int finer = s.finer_than_alpha;
    return !s.premultiplied ? constant<W>(std::int64_t{1} << s.color_fraction)
           : finer >= 0     ? shift_left(alpha, finer)
                            : floor_shift(alpha, -finer);
}
/// Makes of a slab's colour what shines by a model's reflection.
template <class M, class W>
HWY_INLINE void add_light(M, const ShadingStage& s, const Reflection<W>& light, W opacity,
                          std::array<W, 3>& color) {
    for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t from = light.white ? 0 : c;
        color[c] = quantise(color[c] * light.diffuse[from] + opacity * light.specular[from], s.to_lit);
        if constexpr (M::kHeldToOpacity)
            color[c] = min(color[c], quantise(shift_left(opacity, s.intensity_fraction), s.to_lit));
    }
}

/// Lights a slab: returns `color`, straight or premultiplied, lit.  A zero normal gets only ambient light.
/// Reads `confidence` where light fades in.
template <class W>
HWY_INLINE void shade(const ShadingStage& s, const RayWords<W>& ray, const std::array<W, 3>& normal, W alpha,
                      std::array<W, 3>& color, W confidence = constant<W>(0)) {
    with_model(s.model, [&](auto model) SQUINT_WRITTEN_OUT {
        add_light(model, s, reflect(model, s, ray, normal, confidence), opacity_of_light(s, alpha), color);
    });
}

/// 2 / cos a - 1 for normals that differ by 2a: one, the straight line, from 90 degrees on.
template <class W>
HWY_INLINE W arc_between(const ShadingStage& s, const std::array<W, 3>& front, const std::array<W, 3>& back) {
    const KeptLength& k = s.kept;
    const W turn = dot(front, back, k.to_turn);
    const W zero = constant<W>(0), straight = constant<W>(std::int64_t{1} << KeptLength::kArcBits);
    const W facing = clamp(turn, zero, constant<W>(std::int64_t{1} << s.dot_fraction));
    const int fraction = s.dot_fraction - k.row_bits;
    const W row = min(floor_shift(facing, fraction), constant<W>((std::int64_t{1} << k.row_bits) - 1));
    const W rest = within(facing - shift_left(row, fraction), 0, std::int64_t{1} << fraction);
    const W arc = quantise(
        blend(gather(k.arc, row, 0), gather(k.arc, row + constant<W>(1), 0), rest, fraction), k.to_arc);
    return select(turn < zero, straight, arc);
}
/// The Bernstein coefficients of what runs from `front` to `back` with the normal, and is `level` where the normal
/// says nothing: (2 h F + B) / 3 and (F + 2 h B) / 3 between them.
template <class W>
HWY_INLINE std::array<W, 4> along_arc(const KeptLength& k, W front, W back, W level, W arc) {
    const auto between = [&](W near, W far) {
        const W thrice = shift_left(constant<W>(3) * level + (far - level), KeptLength::kArcBits) +
                         shift_left(arc * (near - level), 1);
        return divide(max(thrice, constant<W>(0)), constant<W>(3), k.to_between);
    };
    return {front, between(front, back), between(back, front), back};
}

/// What the scene's model reflects about one normal.  A call, for slabs that ask for three of them.
template <class W>
HWY_NOINLINE Reflection<W> reflection_of(const ShadingStage& s, const RayWords<W>& ray,
                                         const std::array<W, 3>& normal, W confidence) {
    return with_model(
        s.model, [&](auto model) SQUINT_WRITTEN_OUT { return reflect(model, s, ray, normal, confidence); });
}

/// Lights a slab whose tables say where its light lies: by what two normals make of it, in between with the way,
/// or kept at length one.  `color` comes back lit.
template <class W>
HWY_INLINE void shade_fading(const ShadingStage& s, const RayWords<W>& ray,
                             const std::array<std::array<W, 3>, 2>& normal, const std::array<W, 2>& certain,
                             const FadingLight<W>& light, std::array<W, 3>& color) {
    const W zero = constant<W>(0);
    const bool arcs = s.kept.wanted;
    const W straight = constant<W>(std::int64_t{1} << KeptLength::kArcBits);
    const W arc = arcs ? arc_between(s, normal[0], normal[1]) : straight;
    // A highlight is no quadratic: it fades.
    const W bent = with_model(s.model, [](auto model) { return model.kHasHighlights; }) ? straight : arc;
    const bool held = s.kept.held || with_model(s.model, [](auto model) { return model.kHeldToOpacity; });
    const Reflection<W> front = reflection_of(s, ray, normal[0], certain[0]),
                        back = reflection_of(s, ray, normal[1], certain[1]),
                        level = reflection_of(s, ray, std::array<W, 3>{zero, zero, zero}, zero);
    const auto along = [&](W from, W to, W middle, W h) SQUINT_WRITTEN_OUT {
        return arcs ? along_arc(s.kept, from, to, middle, h) : std::array<W, 4>{from, to, zero, zero};
    };
    for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t i = front.white ? 0 : c;
        const std::array<W, 4> diffuse = along(front.diffuse[i], back.diffuse[i], level.diffuse[i], arc),
                               specular = along(front.specular[i], back.specular[i], level.specular[i], bent);
        W sum = zero, opacity = zero;
        for (std::size_t k = 0; k < static_cast<std::size_t>(light.count); ++k) {
            sum = sum + light.part[k][c] * diffuse[k] + light.part[k][3] * specular[k];
            opacity = opacity + light.part[k][3];
        }
        color[c] = quantise(sum, s.to_lit);
        if (held) color[c] = min(color[c], quantise(shift_left(opacity, s.intensity_fraction), s.to_lit));
    }
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
