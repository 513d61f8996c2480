// What the composition of the stages (slab-inl.h) hands on and reports: samples, pixels, parts and observers.
#pragma once

#include "pipeline/stages/compositing.h"
#include "pipeline/stages/location.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace squint {

/// Parts of the composition: the six stages, where one has two halves or a forerunner each of them.  An
/// observer learns which part computes; ledgers of widths and costs are kept by part.
enum class Part { location, interpolation, input, gradient, normal, classification, shading, compositing };
inline constexpr int kParts = static_cast<int>(Part::compositing) + 1;
/// The stage that a part belongs to, as an index of kStages (pipeline/plan/plan.h).
constexpr std::size_t stage_index(Part part) {
    constexpr std::array<std::size_t, kParts> kStage{0, 1, 3, 2, 2, 3, 4, 5};
    return kStage[static_cast<std::size_t>(part)];
}

/// Stages 1 and 2 at one sample.
template <class W>
struct Sample {
    std::array<W, 3> location;
    CellPosition<W> position;
    W scalar;  // sample
    W input;   // in table entries
    // Stage 3, where a slab beside it was lit by it.
    std::array<W, 3> gradient;
    bool has_gradient = false;
};

/// MIP, MinIP, average: what stands for a ray of `slabs` slabs, one at least.
template <class W>
struct ProjectedRay {
    W kept;       // MIP, MinIP: the extreme of all samples; average: the sum of both ends of every full slab
    W last_ends;  // average: the sum of the last slab's ends
    W slabs;
    W last_length;  // of the last slab, in steps
};

/// What one ray leaves behind.
template <class W>
struct Pixel {
    Accumulated<W> gathered;
    std::int64_t samples = 0;  // slabs composited
    // The rest is noted by an observer, where a picture asks for it (machines/aovs.h).
    std::optional<double> first_hit;  // distance from the ray's origin to the first visible slab, world units
    double weighted_distance = 0, weight = 0;  // sum of w z and of w
    std::array<W, 3> first_normal{};
};

/// Hears nothing.  An observer of the composition has these members; whatever it does changes no word.
struct Silent {
    /// The composition enters a part.
    static constexpr void at(Part) {}
    /// Slab k begins.
    static constexpr void slab(const auto& /*k*/) {}
    /// A visible slab is about to be lit with this normal.
    static constexpr void lit(const auto& /*normal*/) {}
    /// A slab, lit where it is, was composited: the pixel before and after it.
    static constexpr void composited(const auto& /*slab*/, const auto& /*before*/, const auto& /*after*/) {}
};

}  // namespace squint
