// Stage 3: gradient.  voxels around a cell (I.0) and weights (1.F) -> raw gradient (sI.F, levels per smallest
// voxel spacing)
// -> normal (s1.F).  Squeeze, section 4.3.  Runs only where a light falls on a sample that is not
// transparent.
#pragma once

#include "fixedpoint/words.h"
#include "scene/scene.h"

#include <array>

namespace squint {

struct StageInputs;

struct GradientStage {
    GradientRule rule = GradientRule::central;
    int weight_bits = 0;
    int sample_fraction = 0;                // central_samples: fraction bits of the six samples
    Rescale to_first, to_second;            // lerp levels
    Rescale to_gradient;                    // third level, or the difference of samples
    Rescale to_scaled;                      // after the axis's own spacing
    std::array<std::int64_t, 3> spacing{};  // raw, in the wire's format; one where spacings are equal
    int spacing_fraction = 0;
    bool isotropic = true;
    std::array<double, 3> spacing_exact{1, 1, 1};
    bool active = true;
    Rescale to_normal;  // quotient of a component and the length
    int normal_fraction = 0;

    template <class V>
    void visit(V&& v) {
        v(to_first), v(to_second), v(to_gradient), v(to_scaled), v(to_normal);
    }
};
/// The stage's constants.  Throws InputError where a wire is unsigned and the scene is lit.
GradientStage build_gradient(const StageInputs& in);

/// Bits that normalising keeps of the largest component, and fraction bits it gives the length.
inline constexpr int kNormalBits = 15, kNormalGuard = 8;

/// The 4x4x4 voxels about a cell, the cell's corners in the middle; x fastest.  Clamped at the volume's
/// faces.
template <class W>
struct Neighbourhood {
    std::array<W, 64> voxel;
    const W& at(int x, int y, int z) const { return voxel[static_cast<std::size_t>((z * 4 + y) * 4 + x)]; }
};

}  // namespace squint
