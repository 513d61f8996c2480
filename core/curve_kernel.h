// Samples a curve between two control points at many entries at once.
#pragma once

#include <span>

namespace squint {

/// Sample i stands at value scale * (i * spacing) + offset.
struct SampleValues {
    double scale, spacing, offset;

    double operator()(int i) const { return scale * (i * spacing) + offset; }
};

/// Two neighbouring control points: their values, and some of the curve's channels there.
struct CurveStretch {
    double from, to;
    std::span<const double> before, after;  // channel by channel
};

/// result[i] = before + (after - before) (value - from) / (to - from) for first <= i < end, in exactly these
/// operations: SIMD gives the bits of one sample at a time.  results: where each channel's sample 0 lies.
void sample_stretch(const SampleValues& values, const CurveStretch& stretch, int first, int end,
                    std::span<double* const> results);

}  // namespace squint
