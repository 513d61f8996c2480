// The maths of location.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_LOCATION_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_LOCATION_INL_H
#undef SQUINT_PIPELINE_STAGES_LOCATION_INL_H
#else
#define SQUINT_PIPELINE_STAGES_LOCATION_INL_H
#endif

#include "pipeline/stages/location.h"

#include "fixedpoint/unrolled-inl.h"
#include "scene/wires.h"

#include <hwy/highway.h>

#include <optional>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// A constant in words: rounded, or (Real, inactive) exact in raw units.  `wire`: the wire of its
/// format.
template <class W>
HWY_INLINE W stage_constant(std::int64_t raw, double, int, bool, std::optional<Wire> wire = {}) {
    if (wire) note_wire(WordTag<W>{}, static_cast<int>(*wire));
    return constant<W>(raw);
}
template <class W>
requires requires(W w) {
    typename W::IsReal;
}
HWY_INLINE W stage_constant(std::int64_t raw, double exact, int fraction, bool active,
                            std::optional<Wire> = {}) {
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
/// Of a sample that lies inside the box and is not the ray's last.
template <class W>
HWY_INLINE W rounded_inside(const LocationStage& s, W exact) {
    return quantise(exact, s.to_location);
}
/// Sample k's location: quantised once, then clamped to the box, so that it never wraps.
template <class W>
HWY_INLINE W rounded_location(const LocationStage& s, const RayWords<W>& ray, W exact, W k, int axis) {
    const auto a = static_cast<std::size_t>(axis);
    const W here = select(k == ray.last_index, ray.last[a], rounded_inside(s, exact));
    return clamp(here, constant<W>(0), constant<W>(s.limit[a]));
}
template <class W>
HWY_INLINE W locate(const LocationStage& s, const RayWords<W>& ray, W k, int axis) {
    return rounded_location(s, ray, exact_location(s, ray, k, axis), k, axis);
}

/// One voxel ahead of or behind a location along an axis, clamped to the box.
template <class W>
HWY_INLINE W beside(const LocationStage& s, W location, int axis, bool ahead) {
    const W voxel = constant<W>(std::int64_t{1} << s.location_fraction);
    const W limit = constant<W>(s.limit[static_cast<std::size_t>(axis)]);
    return ahead ? min(location, limit - voxel) + voxel : max(location, voxel) - voxel;
}

/// The cell around a location before the last voxel centre, and the weights of its upper corners.
template <class W>
HWY_INLINE CellPosition<W> cell_position_inside(const LocationStage& s, const std::array<W, 3>& location) {
    CellPosition<W> position;
    for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
        position.cell[a] = floor_shift(location[a], s.location_fraction);
        position.weight[a] = quantise(fraction_bits(location[a], s.location_fraction), s.to_weight);
    });
    return position;
}
/// The cell around a location, and the weights of its upper corners; at the far face the last cell, with a
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
