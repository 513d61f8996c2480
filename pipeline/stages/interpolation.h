// Stage 2: interpolation.  Eight corners (I.0) and cell weights (1.F) -> sample (I.F).  Squeeze, section 4.5,
// equation 15; or equation 13, whose two products are rounded each.
#pragma once

#include "fixedpoint/words.h"

#include <array>

namespace squint {

struct StageInputs;

struct InterpolationStage {
    int weight_bits = 0;  // of a weight: one is 1 << weight_bits
    Rescale to_x, to_y, to_sample;
    int sample_fraction = 0;
    bool nearest = false;
    bool two_products = false;           // equation 13
    Rescale to_x_sum, to_y_sum, to_sum;  // its sums: limits alone

    template <class V>
    void visit(V&& v) {
        v(to_x), v(to_y), v(to_sample), v(to_x_sum), v(to_y_sum), v(to_sum);
    }
};
/// Builds the stage's constants.  Throws InputError where a wire cannot hold the scalars or a weight of one.
InterpolationStage build_interpolation(const StageInputs& in);

/// The corners of a cell, x fastest: 000 100 010 110 001 101 011 111.
template <class W>
struct Cell {
    std::array<W, 8> corner;
    W at(int i) const { return corner[static_cast<std::size_t>(i)]; }
    /// Interpolates between corners 2 i and 2 i + 1.
    W along_x(int i, W weight, int weight_bits, const Rescale& to) const {
        return quantise(blend(at(2 * i), at(2 * i + 1), weight, weight_bits), to);
    }
};

}  // namespace squint
