// What the composition (slab-inl.h) passes on and reports: samples, pixels, parts and observers.
#pragma once

#include "pipeline/refined.h"
#include "pipeline/stages/compositing.h"
#include "pipeline/stages/location.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace squint {

/// Parts of the composition: the six stages; those with two halves, or a forerunner, are two parts.  An
/// observer learns which part computes; widths and costs are recorded by part.
enum class Part { location, interpolation, input, gradient, normal, classification, shading, compositing };
inline constexpr int kParts = static_cast<int>(Part::compositing) + 1;
/// The stage that a part belongs to, as an index of kStages (pipeline/plan/plan.h).
constexpr std::size_t stage_index(Part part) {
    constexpr std::array<std::size_t, kParts> kStage{0, 1, 3, 2, 2, 3, 4, 5};
    return kStage[static_cast<std::size_t>(part)];
}

/// A sample after stages 1 and 2.
template <class W>
struct Sample {
    std::array<W, 3> location;
    CellPosition<W> position;
    W scalar;  // the interpolated sample
    W input;   // in table entries
    // Stage 3, where it has lit a slab beside this sample.
    std::array<W, 3> gradient;
    bool has_gradient = false;
};

/// MIP, MinIP, average: the state of a ray of `slabs` slabs, at least one.
template <class W>
struct ProjectedRay {
    W kept;       // MIP, MinIP: the extreme sample; average: the sum of both ends of every full slab
    W last_ends;  // average: the sum of both ends of the last slab
    W slabs;
    W last_length;  // of the last slab, in steps
};

/// The result of one ray.
template <class W>
struct Pixel {
    Accumulated<W> gathered;
    std::int64_t samples = 0;  // slabs composited
    // An observer records the rest, where a picture asks for it (machines/aovs.h).
    std::optional<double> first_hit;  // distance from the ray's origin to the first visible slab, world units
    double weighted_distance = 0, weight = 0;  // sum of w z and of w
    std::array<W, 3> first_normal{};
    RefinedSlabs refined;
};

/// Observes nothing.  Every observer of the composition has these members, and changes no word.
struct Silent {
    /// The composition enters a part.
    static constexpr void at(Part) {}
    /// Slab k begins.
    static constexpr void slab(const auto& /*k*/) {}
    /// A slab is looked at twice.
    static constexpr void looked_twice() {}
    /// A visible slab is lit in 2^bits pieces.
    static constexpr void cut(int /*bits*/) {}
    /// A visible slab is about to be lit with this normal.
    static constexpr void lit(const auto& /*normal*/) {}
    /// A slab, lit if light falls on it, was composited: the pixel before and after.
    static constexpr void composited(const auto& /*slab*/, const auto& /*before*/, const auto& /*after*/) {}
};

}  // namespace squint
