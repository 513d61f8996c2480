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
    W at(int i) const { return corner[static_cast<std::size_t>(i)]; }
    /// Between corners 2 i and 2 i + 1.
    W along_x(int i, W weight, int weight_bits, const Rescale& to) const {
        return quantise(blend(at(2 * i), at(2 * i + 1), weight, weight_bits), to);
    }
};

}  // namespace squint
#endif

#include "fixedpoint/unrolled.h"

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

/// Seven lerps: four along x, two along y, one along z.  Each level has a format of its own.  C: a Cell,
/// however its corners are kept.
template <class W, class C>
HWY_INLINE W interpolate(const InterpolationStage& s, const C& cell, const std::array<W, 3>& weight) {
    if (s.nearest) {
        const W half = constant<W>(std::int64_t{1} << (s.weight_bits - 1));
        const auto pick = [&](W near, W far, std::size_t axis) {
            return select(weight[axis] < half, near, far);
        };
        const W y0 = pick(pick(cell.at(0), cell.at(1), 0), pick(cell.at(2), cell.at(3), 0), 1);
        const W y1 = pick(pick(cell.at(4), cell.at(5), 0), pick(cell.at(6), cell.at(7), 0), 1);
        return shift_left(pick(y0, y1, 2), s.sample_fraction);
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
