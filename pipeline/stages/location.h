// Stage 1: sample location.  ray (P0, V) and sample number k -> cell (I.0) and interpolation weights (1.F),
// per axis. Squeeze, section 4.6; CONVENTIONS.md "Space and rays".
//
//     location 11.12    iiiiiiiiiii ffffffffffff
//                       cell index  weight (the fraction, widened by one bit so that 1.0 exists)
#ifndef SQUINT_PIPELINE_LOCATION_H
#define SQUINT_PIPELINE_LOCATION_H

#include "core/vector.h"
#include "fixedpoint/words.h"

#include <array>
#include <cmath>

namespace squint {

inline constexpr int kMostHalves = 8;  // a half vector for each light

/// One ray in doubles, before any precision is applied: what every word starts from.
struct RaySetup {
    Vec3 first{0, 0, 0};  // sample 0, in voxels
    Vec3 last{0, 0,
              0};  // sample `last_index`, in voxels: the exit, where samples are a whole step apart no more
    Vec3 step{0, 0, 0};         // V, in voxels
    Vec3 direction{0, 0, 1};    // unit, world
    int slabs = 0;              // n = ceil(chord / step); 0: the ray misses the volume
    int last_index = 0;         // n, or n - 1 where samples stand in the middle of slabs
    double last_length = 1;     // of the last slab, in steps: in (0, 1]
    double entry_distance = 0;  // world units from the ray's origin to sample 0
};

/// One ray in words.
template <class W>
struct RayWords {
    std::array<W, 3> first, last, step;
    W last_index, last_length;
    std::array<std::array<W, 3>, kMostHalves> half;  // per light; only where they differ from ray to ray
    std::array<W, 3> view;                           // towards the eye
};

struct LocationStage {
    int location_fraction = 0, direction_fraction = 0;
    int common_fraction = 0;  // of P0 + kV before it is quantised
    Rescale to_location, to_weight;
    std::array<std::int64_t, 3> limit{};        // the last voxel centre, as a location
    std::array<std::int64_t, 3> last_cell{};    // greatest index of a cell's lower corner
    std::array<std::int64_t, 3> low{}, high{};  // what P0 + kV can reach before it is clamped to the box
    int length_fraction = 0;
    Rescale to_first, to_direction, to_length;  // set-up values on their way to words: nothing to shift
    Spec location, direction, length;

    /// How far a sample may leave the box before it is clamped, in voxels: what rounding V adds up to.
    double drift() const { return std::ldexp(static_cast<double>(-low[0]), -common_fraction); }

    template <class V>
    void visit(V&& v) {
        v(to_location), v(to_weight), v(to_first), v(to_direction), v(to_length);
    }
};

template <class W>
struct CellPosition {
    std::array<W, 3> cell;    // index of the lower corner
    std::array<W, 3> weight;  // 1.F
};

}  // namespace squint
#endif

#include "fixedpoint/unrolled.h"

#include <hwy/highway.h>
#if defined(SQUINT_PIPELINE_LOCATION_TARGET) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_LOCATION_TARGET
#undef SQUINT_PIPELINE_LOCATION_TARGET
#else
#define SQUINT_PIPELINE_LOCATION_TARGET
#endif
HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// A constant in words: the rounded one, or (Real, inactive) the exact one in raw units.
template <class W>
HWY_INLINE W stage_constant(std::int64_t raw, double, int, bool) {
    return constant<W>(raw);
}
template <class W>
requires requires(W w) {
    typename W::IsReal;
}
HWY_INLINE W stage_constant(std::int64_t raw, double exact, int fraction, bool active) {
    return W::from(active ? static_cast<double>(raw) : exact * power_of_two<double>(fraction));
}

/// V along one axis, with the fraction bits of P0 + k V.
template <class W>
HWY_INLINE W stride(const LocationStage& s, const RayWords<W>& ray, int axis) {
    return shift_left(ray.step[static_cast<std::size_t>(axis)], s.common_fraction - s.direction_fraction);
}
/// P0 + k V along one axis, exact.
template <class W>
HWY_INLINE W exact_location(const LocationStage& s, const RayWords<W>& ray, W k, int axis) {
    const auto a = static_cast<std::size_t>(axis);
    const W start = shift_left(ray.first[a], s.common_fraction - s.location_fraction);
    return affine(start, k, stride(s, ray, axis), s.low[a], s.high[a]);
}
/// Sample k's location from the exact one: quantised once, then clamped to the box, for it never wraps round.
template <class W>
HWY_INLINE W rounded_location(const LocationStage& s, const RayWords<W>& ray, W exact, W k, int axis) {
    const auto a = static_cast<std::size_t>(axis);
    const W here = select(k == ray.last_index, ray.last[a], quantise(exact, s.to_location));
    return clamp(here, constant<W>(0), constant<W>(s.limit[a]));
}
template <class W>
HWY_INLINE W locate(const LocationStage& s, const RayWords<W>& ray, W k, int axis) {
    return rounded_location(s, ray, exact_location(s, ray, k, axis), k, axis);
}

/// One voxel on from a location along an axis, ahead or back; held inside the box.
template <class W>
HWY_INLINE W beside(const LocationStage& s, W location, int axis, bool ahead) {
    const W voxel = constant<W>(std::int64_t{1} << s.location_fraction);
    const W limit = constant<W>(s.limit[static_cast<std::size_t>(axis)]);
    return ahead ? min(location, limit - voxel) + voxel : max(location, voxel) - voxel;
}

/// The cell around a location and the weights of its upper corners; at the far face the last cell with a
/// weight of one.
template <class W>
HWY_INLINE CellPosition<W> cell_position(const LocationStage& s, const std::array<W, 3>& location) {
    CellPosition<W> position;
    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
        const W cell = min(floor_shift(location[a], s.location_fraction), constant<W>(s.last_cell[a]));
        position.cell[a] = cell;
        position.weight[a] = quantise(location[a] - shift_left(cell, s.location_fraction), s.to_weight);
    });
    return position;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
