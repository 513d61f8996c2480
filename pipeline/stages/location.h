// Stage 1: sample location.  Ray (P0, V) and sample number k -> cell (I.0) and interpolation weights (1.F),
// per axis.  Squeeze, section 4.6; docs/conventions.md#space-and-rays.
//
//     location 11.12    iiiiiiiiiii ffffffffffff
//                       cell index  weight (the fraction, widened by one bit so that 1.0 exists)
#pragma once

#include "core/vector.h"
#include "fixedpoint/words.h"

#include <array>
#include <cmath>

namespace squint {

struct StageInputs;

inline constexpr int kMostHalves = 8;  // one half vector for each light

/// One ray in doubles, before any rounding: all words start from it.
struct RaySetup {
    Vec3 first{0, 0, 0};  // sample 0, in voxels
    // Sample `last_index`, in voxels: the exit, which is less than a step from the sample before.
    Vec3 last{0, 0, 0};
    Vec3 step{0, 0, 0};         // V, in voxels
    Vec3 direction{0, 0, 1};    // unit, in grid space
    int slabs = 0;              // n = ceil(chord / step); 0: the ray misses the volume
    int last_index = 0;         // n, or n - 1 where samples lie in the middle of slabs
    double last_length = 1;     // of the last slab, in steps: in (0, 1]
    double entry_distance = 0;  // world units from the ray's origin to sample 0
};

/// One ray in words.
template <class W>
struct RayWords {
    std::array<W, 3> first, last, step;
    W last_index, last_length;
    std::array<std::array<W, 3>, kMostHalves> half;  // for each light; only where they differ between rays
    std::array<W, 3> view;                           // towards the eye
};

struct LocationStage {
    int location_fraction = 0, direction_fraction = 0;
    int common_fraction = 0;  // of P0 + kV before it is quantised
    Rescale to_location, to_weight;
    std::array<std::int64_t, 3> limit{};        // the last voxel centre, as a location
    std::array<std::int64_t, 3> last_cell{};    // the largest index of a cell's lower corner
    std::array<std::int64_t, 3> low{}, high{};  // the reach of P0 + kV before it is clamped to the box
    int length_fraction = 0;
    Rescale to_first, to_direction, to_length;  // for set-up values: nothing is shifted
    Spec location, direction, length;

    /// How far a sample may leave the box before it is clamped, in voxels: the sum of V's roundings.
    double drift() const { return std::ldexp(static_cast<double>(-low[0]), -common_fraction); }

    template <class V>
    void visit(V&& v) {
        v(to_location), v(to_weight), v(to_first), v(to_direction), v(to_length);
    }
};
/// Builds the stage's constants.  Throws InputError where a wire cannot hold the volume or the step.
LocationStage build_location(const StageInputs& in);

template <class W>
struct CellPosition {
    std::array<W, 3> cell;    // index of the lower corner
    std::array<W, 3> weight;  // 1.F
};

}  // namespace squint
