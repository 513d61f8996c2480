// Stage 3: gradient.  Voxels around a cell (I.0) and weights (1.F) -> raw gradient (sI.F, levels per smallest
// voxel spacing) -> normal (s1.F).  Squeeze, section 4.3.
//
// Runs only where a light falls on a sample that is not transparent.
#pragma once

#include "fixedpoint/words.h"
#include "scene/scene.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace squint {

struct StageInputs;

/// shading.exaggeration: the normal is turned from the mean of the gradients at the 5^3 voxels about a place, which is
/// the gradient of the volume's sums over 5^3 (Guetat et al. 2010, section 5; docs/papers/guetat.md).
struct Exaggeration {
    bool wanted = false;
    std::int64_t raw = 0;  // e
    double exact = 0;
    int fraction = 0;
    bool active = true;  // Real: e rounded or exact
    Rescale to_length;   // of a unit vector times a length, to a gradient
};

struct GradientStage {
    GradientRule rule = GradientRule::central;
    int weight_bits = 0;
    int sample_fraction = 0;                // central_samples: of the six samples
    Rescale to_first, to_second;            // lerp levels
    Rescale to_gradient;                    // third level, or difference of samples
    Rescale to_scaled;                      // after scaling by the axis's own spacing
    std::array<std::int64_t, 3> spacing{};  // raw, in the wire's format; one where all spacings are equal
    int spacing_fraction = 0;
    bool isotropic = true;
    std::array<double, 3> spacing_exact{1, 1, 1};
    bool active = true;
    Rescale to_normal;  // quotient of a component and the length
    int normal_fraction = 0;
    // Real: a gradient below this, in raw units, is zero.  Rounding alone can leave it 1e-13 long, and
    // normalising would make a full normal of that where the field is flat.
    double vanishing = 0;
    // Light fades in up to |g| = g_0.  Components up to g_0 are shifted so that it has kNormalBits bits.
    bool fades = false;
    double floor_exact = 0;        // g_0 in raw units
    std::int64_t floor_raw = 0;    // its floor
    int floor_bits = 0;            // left shift; negative: right
    std::int64_t full_length = 0;  // confidence is one from here on, with kNormalGuard fraction bits
    int confidence_fraction = 0;
    Rescale to_confidence;
    // cubic_spline: weights of four voxels.
    int spline_fraction = 0;
    Rescale to_spline;
    Exaggeration exaggerated;

    template <class V>
    void visit(V&& v) {
        v(to_first), v(to_second), v(to_gradient), v(to_scaled), v(to_normal), v(to_confidence), v(to_spline);
        v(exaggerated.to_length);
    }
};
/// Builds the stage's constants.  Throws InputError where a wire is unsigned and the scene is lit.
GradientStage build_gradient(const StageInputs& in);
/// The same for the gradient of sums of 5^3 voxels: central differences, in the formats of a mean.
GradientStage build_box_gradient(const StageInputs& in);
/// Integer bits that a sum of 5^3 has beside its mean.
inline constexpr int kBoxBits = 7, kBoxSide = 5;

/// Bits that normalising keeps of the largest component, and fraction bits of the length.
inline constexpr int kNormalBits = 15, kNormalGuard = 8;

/// In doubles a gradient below this part of the data's range, in levels per smallest spacing, is zero.
inline constexpr double kVanishing = 0x1p-40;

/// Lets light fade in for gradients up to `length`, which is in raw units and above 0.
inline void fade_in_up_to(GradientStage& s, double length) {
    s.fades = true;
    s.floor_exact = length;
    s.floor_raw = std::max<std::int64_t>(1, static_cast<std::int64_t>(std::floor(length)));
    s.floor_bits = kNormalBits - static_cast<int>(std::bit_width(static_cast<std::uint64_t>(s.floor_raw)));
    // Dropped bits take less than one from each component, and less than two from the length.
    s.full_length = s.floor_bits < 0 ? ((s.floor_raw >> -s.floor_bits) - 2) << kNormalGuard
                                     : s.floor_raw << s.floor_bits << kNormalGuard;
}

}  // namespace squint
