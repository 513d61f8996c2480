// Sets up rays for stage 1: in doubles, before any rounding, then as words.  Over a real word D
// (core/rays-inl.h): one ray, or as many as a vector holds.
#if defined(SQUINT_PIPELINE_STAGES_RAY_SETUP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_RAY_SETUP_INL_H
#undef SQUINT_PIPELINE_STAGES_RAY_SETUP_INL_H
#else
#define SQUINT_PIPELINE_STAGES_RAY_SETUP_INL_H
#endif

#include "core/rays-inl.h"
#include "fixedpoint/words.h"
#include "pipeline/plan/plan.h"

#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// The part of a ray that is rendered.
template <class D>
HWY_INLINE IntervalOf<D> rendered_part(const Plan& plan, const RayOf<D>& ray) {
    const IntervalOf<D> inside = intersect_box(ray, plan.box_low, plan.box_high);
    if (!plan.clip) return inside;
    const IntervalOf<D> kept = intersect_turned_box(ray, *plan.clip);
    return {greater(inside.first, kept.first), lesser(inside.last, kept.last)};
}

/// RaySetup (pipeline/stages/location.h) over D; a ray that misses the volume has no slabs.
template <class D>
struct RaySetupOf {
    RealVector<D> first, last, step, direction;
    D slabs, last_index, last_length, entry_distance;
};

template <class D>
HWY_INLINE RaySetupOf<D> set_up_ray(const Plan& plan, D column, D row) {
    const Volume& volume = *plan.volume;
    const RayOf<D> ray = ray_through(plan.camera, column, row);
    const IntervalOf<D> inside = rendered_part(plan, ray);
    const D step_world(plan.step_world);
    const D steps = (inside.last - inside.first) / Divisor(plan.step_world);
    // A chord of n steps is n slabs: 2^-30 of a step forgives the rounding of the chord itself.
    const D whole = greater(D(1), ceiling(steps - D(0x1p-30)));
    // Samples of PC's mid-point rule lie in the middle of slabs.
    const bool middle = plan.scene.classification.method == Method::pc_mid && !plan.projection_mode;

    const auto hit = inside.first < inside.last;
    RaySetupOf<D> setup;
    setup.direction = ray.direction;
    setup.entry_distance = inside.first;
    setup.last_length = lesser(greater(steps - (whole - D(1)), D(0)), D(1));
    const D to_last = middle ? inside.last - D(0.5) * setup.last_length * step_world : inside.last;
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const D origin(volume.origin[axis]);
        const Divisor spacing(volume.spacing[axis]);
        const auto voxel_at = [&](D distance) HWY_ATTR {
            return (ray.origin[a] + ray.direction[a] * distance - origin) / spacing;
        };
        if (volume.is_thin(axis)) {  // the field is constant along it
            setup.step[a] = setup.first[a] = setup.last[a] = D(0);
            continue;
        }
        const D step = ray.direction[a] * step_world / spacing, first = voxel_at(inside.first);
        setup.step[a] = choose(hit, step, D(0));
        setup.first[a] = choose(hit, middle ? first + step * D(0.5) : first, D(0));
        setup.last[a] = choose(hit, voxel_at(to_last), D(0));
    }
    setup.slabs = choose(hit, whole, D(0));
    setup.last_index = middle ? greater(setup.slabs - D(1), D(0)) : setup.slabs;
    return setup;
}

// ------------------------------------------------------------------------------------------- words

/// A set-up value as a word: rounded by its wire, or (Real, inactive) exact.
template <class W>
W word_from(double value, const Spec& spec, const Rescale& to) {
    return constant<W>(quantise_real(value, static_cast<double>(spec.format.one()), to));
}
template <class W>
requires requires {
    typename W::IsReal;
}
W word_from(double value, const Spec& spec, const Rescale& to) {
    return to.active ? W::from(static_cast<double>(quantise_real(value, spec)))
                     : quantise(W::from(value * static_cast<double>(spec.format.one())), to);
}
template <class W>
requires std::same_as<W, Audited> W word_from(double value, const Spec& spec, const Rescale& to) {
    const std::int64_t raw = quantise_real(value, spec);
    const double exact = value * static_cast<double>(spec.format.one());
    Rescale free = to;
    free.lowest = std::numeric_limits<std::int64_t>::min(),
    free.highest = std::numeric_limits<std::int64_t>::max(), free.wraps = false;
    return record(raw, static_cast<double>(raw) != exact, exact, free);
}

/// Lanes hold words as doubles until all of a ray are there: integers of 32 bits.
HWY_INLINE Reals make_word(WordTag<Reals>, std::int64_t value) {
    return Reals(static_cast<double>(value));
}
HWY_INLINE Reals bounded(Reals x, Reals low, Reals high) {
    return lesser(greater(x, low), high);
}
template <class W>
HWY_INLINE W bounded(W x, W low, W high) {
    return clamp(x, low, high);
}
/// quantise_real() for formats of at most 31 bits and a sign.
template <class W>
requires std::same_as<W, Reals> HWY_INLINE Reals word_from(Reals value, const Spec& spec, const Rescale& to) {
    namespace hn = hwy::HWY_NAMESPACE;
    const Reals scaled = value * Reals(static_cast<double>(spec.format.one()));
    if (!to.active) return scaled;
    Reals raw(to.rounding == Rounding::rnd_conv ? hn::Round(scaled.v) : hn::Floor(scaled.v));
    const Reals rest = scaled - raw;
    if (to.rounding == Rounding::rnd) raw = raw + choose(rest < Reals(0.5), Reals(0), Reals(1));
    if (to.rounding == Rounding::trn_zero)
        raw = raw + choose((Reals(0) < rest) & (raw < Reals(0)), Reals(1), Reals(0));
    const Reals lowest(static_cast<double>(to.lowest)), highest(static_cast<double>(to.highest));
    const Reals saturated = choose(raw == raw, bounded(raw, lowest, highest), Reals(0));  // NaN gives 0
    if (!to.wraps) return saturated;
    const double modulus = power_of_two<double>(to.width);
    Reals low_bits = raw - Reals(modulus) * Reals(hn::Floor((raw * Reals(1 / modulus)).v));
    if (to.is_signed) low_bits = low_bits - choose(low_bits < Reals(modulus / 2), Reals(0), Reals(modulus));
    return choose((Reals(-0x1p62) < scaled) & (scaled < Reals(0x1p62)), low_bits, saturated);
}

template <class W, class Setup>
HWY_INLINE RayWords<W> ray_words(const Plan& plan, const Setup& ray) {
    using D = std::remove_cvref_t<decltype(ray.first[0])>;
    const LocationStage& s = plan.location;
    RayWords<W> words;
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const W low = constant<W>(0), high = constant<W>(s.limit[a]);
        words.first[a] = bounded(word_from<W>(ray.first[axis], s.location, s.to_first), low, high);
        words.last[a] = bounded(word_from<W>(ray.last[axis], s.location, s.to_first), low, high);
        words.step[a] = word_from<W>(ray.step[axis], s.direction, s.to_direction);
    }
    if constexpr (std::same_as<W, Reals>)
        words.last_index = ray.last_index;
    else
        words.last_index = constant<W>(ray.last_index);
    words.last_length = word_from<W>(ray.last_length, s.length, s.to_length);
    if (!plan.lit) return words;
    const ShadingStage& shading = plan.shading;
    const RealVector<D> eye{D(0) - ray.direction[0], D(0) - ray.direction[1], D(0) - ray.direction[2]};
    for (std::size_t a = 0; a < 3; ++a)
        words.view[a] = word_from<W>(eye[a], shading.light_spec, shading.to_light);
    for (std::size_t l = 0; shading.half_per_ray && l < static_cast<std::size_t>(shading.lights); ++l) {
        const auto& light = shading.light_exact[l];
        const RealVector<D> half =
            unit_vector(RealVector<D>{D(light[0]) + eye[0], D(light[1]) + eye[1], D(light[2]) + eye[2]});
        for (std::size_t a = 0; a < 3; ++a)
            words.half[l][a] = word_from<W>(half[a], shading.light_spec, shading.to_light);
    }
    return words;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
