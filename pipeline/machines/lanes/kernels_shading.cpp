// Stages 3 and 5 in lanes, over the samples that a light falls on.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_shading.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/all_lanes-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/plain.h"
#include "pipeline/stages/gradient-inl.h"
#include "pipeline/stages/shading-inl.h"

#include <algorithm>
#include <array>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

/// A neighbourhood whose voxels are loaded as they are asked for.  kPlain: a cross of voxels below 2^15.
template <class L, bool kPlain>
struct StoredNeighbourhood {
    const lanes::Batch* pair;
    int place;
    bool cross;  // LitSamples::pair
    L at(int x, int y, int z) const {
        if (cross && lanes::is_outer_row(y, z)) return half_of(words(0, y, z), x == 2);
        return half_of(words(x / 2, y, z), x % 2 != 0);
    }
    L words(int x, int y, int z) const { return load<L>(pair[(z * 4 + y) * 2 + x].v + place); }
};

/// The default's gradient: central differences of voxels below 2^15.
bool is_plain(const GradientStage& s, const Volume& volume) {
    return s.rule == GradientRule::central && !s.fades && volume.largest < 1 << 15 && s.weight_bits <= 14 &&
           s.to_normal.rounding == Rounding::rnd_conv && lanes::drops_bits(s.to_first) &&
           lanes::drops_bits(s.to_second) && lanes::drops_bits(s.to_gradient) && s.to_scaled.shift > 0 &&
           (s.isotropic || !s.to_scaled.limits);
}
/// Says so to the compiler.
HWY_INLINE void take_as_plain(GradientStage& s) {
    s.rule = GradientRule::central, s.fades = false, s.to_normal.rounding = Rounding::rnd_conv;
    for (Rescale* to : {&s.to_first, &s.to_second, &s.to_gradient, &s.to_scaled})
        lanes::take_as_dropping_bits(*to);
    if (s.weight_bits > 14) __builtin_unreachable();
}

#if HWY_TARGET != HWY_SCALAR
/// gradient.h's, of differences in 16 bits: two of them a word.
template <KnownRescales K>
HWY_INLINE Lanes<std::int32_t, K> lerped_difference(
    const GradientStage& s, const StoredNeighbourhood<Lanes<std::int32_t, K>, true>& n, int y, int z,
    int axis, Lanes<std::int32_t, K> weight) {
    const hn::ScalableTag<std::int32_t> d;
    const hn::ScalableTag<std::int16_t> d16;
    const auto inner = [&](int py, int pz) SQUINT_WRITTEN_OUT {
        if (lanes::is_outer_row(py, pz)) return n.words(0, py, pz).v;
        return inner_pair(n.words(0, py, pz).v, n.words(1, py, pz).v);
    };
    const auto ahead = axis == 0 ? n.words(1, y, z).v : axis == 1 ? inner(y + 1, z) : inner(y, z + 1);
    const auto behind = axis == 0 ? n.words(0, y, z).v : axis == 1 ? inner(y - 1, z) : inner(y, z - 1);
    const auto differences = hn::BitCast(d, hn::Sub(hn::BitCast(d16, ahead), hn::BitCast(d16, behind)));
    return blend_pairs<K>(differences, pair_weights(weight.v, s.weight_bits), 0, s.to_first);
}
#endif

template <class L>
HWY_INLINE std::array<L, 3> load_three(const lanes::Batch (&from)[3], int at) {
    return {load<L>(from[0].v + at), load<L>(from[1].v + at), load<L>(from[2].v + at)};
}

template <class L, bool kPlain>
HWY_INLINE std::array<L, 3> stored_gradient(const GradientStage& s, const lanes::LitSamples& lit, int at) {
    if (s.rule == GradientRule::central_samples) {
        const auto between = [&](int axis) SQUINT_WRITTEN_OUT {
            const auto& scalars = lit.beside[axis];
            const L behind = load<L>(scalars[0].v + at), ahead = load<L>(scalars[1].v + at);
            return to_world(s, sample_difference(s, ahead, behind), axis);
        };
        return {between(0), between(1), between(2)};
    }
    const StoredNeighbourhood<L, kPlain> near{lit.pair, at, s.rule == GradientRule::central};
    const std::array<L, 3> weight = load_three<L>(lit.weight, at);
    const auto along = [&](int axis) SQUINT_WRITTEN_OUT {
        return to_world(s, voxel_difference(s, near, weight, axis), axis);
    };
    return {along(0), along(1), along(2)};
}

/// Stage 3's first half: raw gradients, as 32-bit words.  G: lanes whose lerps may need to be wider than all
/// that follows.  Loops apart, for each vector's way through them is one long chain: in a loop of its own the
/// next vectors' run beside it.
template <class G, bool kPlain>
void find_gradients(const Plan& plan, int count, lanes::LitSamples& lit) {
    GradientStage stage = plan.gradient;
    if constexpr (kPlain) take_as_plain(stage);
    for (int at = 0; at < count; at += static_cast<int>(G::count())) {
        const std::array<G, 3> gradient = stored_gradient<G, kPlain>(stage, lit, at);
        for (std::size_t a = 0; a < 3; ++a) store(gradient[a], lit.gradient[a].v + at);
    }
}

/// Its second half: normals.
template <class L, bool kPlain>
void find_normals(const Plan& plan, int count, lanes::LitSamples& lit) {
    GradientStage stage = plan.gradient;
    if constexpr (kPlain) take_as_plain(stage);
    for (int at = 0; at < count; at += static_cast<int>(L::count())) {
        const std::array<L, 3> gradient = load_three<L>(lit.gradient, at);
        const std::array<L, 3> normal = normalise(stage, gradient);
        for (std::size_t a = 0; a < 3; ++a) store(normal[a], lit.normal[a].v + at);
        if (stage.fades) store(confidence(stage, gradient), lit.confidence.v + at);
    }
}

/// The default's shading: a white light on one side of things, orthographic Blinn-Phong by squarings of
/// straight colours; sums that no limit meets but the clamps that follow.
bool is_plain(const ShadingStage& s) {
    const bool is_clamped = s.to_dot.shift > 0 && !s.to_dot.wraps && s.to_dot.lowest <= 0 &&
                            s.to_dot.highest >= std::int64_t{1} << s.dot_fraction;
    return s.model == ShadingModel::blinn_phong && s.power == PowerRule::squaring && s.lights == 1 &&
           s.white && !s.two_sided && !s.fades && !s.half_per_ray && !s.premultiplied && is_clamped &&
           lanes::does_nothing(s.to_power_input) &&
           std::ranges::all_of(std::array{s.to_power, s.to_diffuse_sum, s.to_specular_sum, s.to_diffuse,
                                          s.to_specular, s.to_lit},
                               lanes::drops_bits);
}
/// Says so to the compiler.
HWY_INLINE void take_as_plain(ShadingStage& s) {
    s.model = ShadingModel::blinn_phong, s.power = PowerRule::squaring, s.lights = 1;
    s.white = true, s.two_sided = s.fades = s.half_per_ray = s.premultiplied = false;
    lanes::take_as_doing_nothing(s.to_power_input);
    for (Rescale* to : {&s.to_dot, &s.to_power, &s.to_diffuse_sum, &s.to_specular_sum, &s.to_diffuse,
                        &s.to_specular, &s.to_lit})
        lanes::take_as_dropping_bits(*to);
}

/// Stage 5.
template <class L, bool kPlain>
void shade_samples(const Plan& plan, int count, lanes::LitSamples& lit) {
    std::conditional_t<kPlain, ShadingStage, const ShadingStage&> shading = plan.shading;
    if constexpr (kPlain) take_as_plain(shading);
    const bool per_ray = shading.needs_ray();
    for (int at = 0; at < count; at += static_cast<int>(L::count())) {
        RayWords<L> ray;
        if (per_ray) {
            ray.view = load_three<L>(lit.view, at);
            for (std::size_t l = 0; l < static_cast<std::size_t>(shading.lights); ++l)
                ray.half[l] = load_three<L>(lit.half[l], at);
        }
        std::array<L, 3> color = load_three<L>(lit.color, at);
        const L certain = shading.fades ? load<L>(lit.confidence.v + at) : constant<L>(0);
        shade(shading, ray, load_three<L>(lit.normal, at), load<L>(lit.alpha.v + at), color, certain);
        for (std::size_t c = 0; c < 3; ++c) store(color[c], lit.color[c].v + at);
    }
}

}  // namespace

void shading_kernels_of(const Plan& plan, const lanes::StageWays& ways, lanes::StageKernels& kernels) {
    if (ways.gradient.is_float) {
        using L = Lanes<float, KnownRescales::nothing>;
        kernels.find_gradients = &find_gradients<L, false>;
        kernels.find_normals = &find_normals<L, false>;
        kernels.shade = &shade_samples<L, false>;
        return;
    }
    constexpr KnownRescales kEven = KnownRescales::halves_to_even;
    const bool plain_gradient = is_plain(plan.gradient, *plan.volume);
    lanes::with_integer_word<Lanes, kEven>(ways.gradient, [&]<class G>() {
        kernels.find_gradients = &find_gradients<G, false>;
        if constexpr (std::is_same_v<G, Lanes<std::int32_t, kEven>>)
            if (plain_gradient) kernels.find_gradients = &find_gradients<G, true>;
    });
    lanes::with_integer_word<Lanes, kEven>(ways.shading, [&]<class L>() {
        kernels.find_normals = &find_normals<L, false>;
        kernels.shade = &shade_samples<L, false>;
        if constexpr (std::is_same_v<L, Lanes<std::int32_t, kEven>>) {
            if (plain_gradient) kernels.find_normals = &find_normals<L, true>;
            if (is_plain(plan.shading)) kernels.shade = &shade_samples<L, true>;
        }
    });
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void shading_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, shading_kernels_of, plan, ways, kernels)
}
}  // namespace squint::lanes
#endif
