// Stage 2: interpolation.  eight corners (I.0) and cell weights (1.F) -> sample (I.F).  Squeeze, section 4.5,
// equation 15.
#ifndef SQUINT_PIPELINE_INTERPOLATION_H
#define SQUINT_PIPELINE_INTERPOLATION_H

#include "fixedpoint/words.h"

#include <array>

namespace squint {

struct InterpolationStage {
    int weight_bits = 0;  // fraction bits of a weight: one is 1 << weight_bits
    Rescale to_x, to_y, to_sample;
    int sample_fraction = 0;
    bool nearest = false;

    template <class V>
    void visit(V&& v) {
        v(to_x), v(to_y), v(to_sample);
    }
};

/// Corners in the order x fastest: 000 100 010 110 001 101 011 111.
template <class W>
struct Cell {
    std::array<W, 8> corner;
};

}  // namespace squint
#endif

#include <hwy/highway.h>
#if defined(SQUINT_PIPELINE_INTERPOLATION_TARGET) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_INTERPOLATION_TARGET
#undef SQUINT_PIPELINE_INTERPOLATION_TARGET
#else
#define SQUINT_PIPELINE_INTERPOLATION_TARGET
#endif
HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// v0 + w (v1 - v0), exact until its one rounding.  A weight of one returns v1; equal corners return
/// themselves.
template <class W>
HWY_INLINE W lerp(W v0, W v1, W weight, int weight_bits, const Rescale& to) {
    return quantise(blend(v0, v1, weight, weight_bits), to);
}

/// Seven lerps: four along x, two along y, one along z.  Each level has a format of its own.
template <class W>
HWY_INLINE W interpolate(const InterpolationStage& s, const Cell<W>& cell, const std::array<W, 3>& weight) {
    const auto& c = cell.corner;
    if (s.nearest) {
        const W half = constant<W>(std::int64_t{1} << (s.weight_bits - 1));
        const auto pick = [&](W near, W far, std::size_t axis) {
            return select(weight[axis] < half, near, far);
        };
        const W y0 = pick(pick(c[0], c[1], 0), pick(c[2], c[3], 0), 1);
        const W y1 = pick(pick(c[4], c[5], 0), pick(c[6], c[7], 0), 1);
        return shift_left(pick(y0, y1, 2), s.sample_fraction);
    }
    const W y0z0 = lerp(c[0], c[1], weight[0], s.weight_bits, s.to_x);
    const W y1z0 = lerp(c[2], c[3], weight[0], s.weight_bits, s.to_x);
    const W y0z1 = lerp(c[4], c[5], weight[0], s.weight_bits, s.to_x);
    const W y1z1 = lerp(c[6], c[7], weight[0], s.weight_bits, s.to_x);
    const W z0 = lerp(y0z0, y1z0, weight[1], s.weight_bits, s.to_y);
    const W z1 = lerp(y0z1, y1z1, weight[1], s.weight_bits, s.to_y);
    return lerp(z0, z1, weight[2], s.weight_bits, s.to_sample);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
