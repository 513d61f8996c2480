// The maths of interpolation.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_INTERPOLATION_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_INTERPOLATION_INL_H
#undef SQUINT_PIPELINE_STAGES_INTERPOLATION_INL_H
#else
#define SQUINT_PIPELINE_STAGES_INTERPOLATION_INL_H
#endif

#include "pipeline/stages/interpolation.h"

#include "fixedpoint/unrolled-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// v0 + w (v1 - v0), exact until its one rounding.  A weight of one returns v1; equal corners return
/// themselves.
template <class W>
HWY_INLINE W lerp(W v0, W v1, W weight, int weight_bits, const Rescale& to) {
    return quantise(blend(v0, v1, weight, weight_bits), to);
}

/// v0 (1 - w) + v1 w, either product rounded: Squeeze, equation 13.
template <class W>
HWY_INLINE W lerp_of_two_products(W v0, W v1, W weight, int weight_bits, const Rescale& to,
                                  const Rescale& to_sum) {
    const W rest = constant<W>(std::int64_t{1} << weight_bits) - weight;
    return quantise(quantise(v0 * rest, to) + quantise(v1 * weight, to), to_sum);
}

/// Seven lerps: four along x, two along y, one along z; each level has its own format.  C is a Cell, whatever
/// holds its corners.
template <class W, class C>
HWY_INLINE W interpolate(const InterpolationStage& s, const C& cell, const std::array<W, 3>& weight) {
    if (s.nearest) {
        const W half = constant<W>(std::int64_t{1} << std::max(s.weight_bits - 1, 0));
        const auto pick = [&](W near, W far, std::size_t axis) {
            return select(weight[axis] < half, near, far);
        };
        const W y0 = pick(pick(cell.at(0), cell.at(1), 0), pick(cell.at(2), cell.at(3), 0), 1);
        const W y1 = pick(pick(cell.at(4), cell.at(5), 0), pick(cell.at(6), cell.at(7), 0), 1);
        return shift_left(pick(y0, y1, 2), s.sample_fraction);
    }
    if (s.two_products) {
        const auto between = [&](W v0, W v1, std::size_t axis, const Rescale& to, const Rescale& to_sum) {
            return lerp_of_two_products(v0, v1, weight[axis], s.weight_bits, to, to_sum);
        };
        const auto row = [&](int i) {
            return between(cell.at(2 * i), cell.at(2 * i + 1), 0, s.to_x, s.to_x_sum);
        };
        const W y0 = between(row(0), row(1), 1, s.to_y, s.to_y_sum);
        const W y1 = between(row(2), row(3), 1, s.to_y, s.to_y_sum);
        return between(y0, y1, 2, s.to_sample, s.to_sum);
    }
    const auto along_x = [&](int i) SQUINT_WRITTEN_OUT {  // y fastest
        return cell.along_x(i, weight[0], s.weight_bits, s.to_x);
    };
    const W z0 = lerp(along_x(0), along_x(1), weight[1], s.weight_bits, s.to_y);
    const W z1 = lerp(along_x(2), along_x(3), weight[1], s.weight_bits, s.to_y);
    return lerp(z0, z1, weight[2], s.weight_bits, s.to_sample);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
