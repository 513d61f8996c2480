// What light may be off by at one place of a scene, whatever the view: docs/guarantees.md#the-scene-bound.
//
// With g the raw gradient, g_0 shading.gradient_floor and v = g / max(|g|, g_0), light adds
//
//     kd min(|v|, sum of tint (-v.L)+)  and  ks min(|v|, sum of tint |v| ((-v.H)+ / |v|)^p)
//
// to ambient light.  Both are Lipschitz in v: the first by the sum of tints, T; the second by T L_p, with
//
//     L_p = sqrt(p) (p / (p + 1))^((p - 1) / 2),
//
// the greatest slope of |v| cos^p.  v itself changes by at most the change of g over max(|g|, g_0).
#pragma once

#include "fixedpoint/words/bounded.h"
#include "pipeline/machines/scene_bound/sample_errors.h"
#include "pipeline/plan/plan.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace squint {

/// Of 1.0, for matter of any colour up to 1.
struct LightErrors {
    bool lit = false;
    double brightest = 1;  // no matter shines more, lit or unlit
    double per_turn = 0;   // the most that light changes by as v does
    double rounding = 0;   // the most that words take of g, as a vector, in levels per smallest spacing
    double stage = 0;      // what words of normals and light are off by, at any gradient
    Shares of_displacement, of_rounding, of_stage;  // their causes; the first in voxels
    double displacement = 0;

    double of(const CellValues& cell) const {
        return std::min(per_turn * (displacement * cell.turn + rounding * cell.weak), brightest) + stage;
    }
    Shares shares_of(const CellValues& cell) const {
        Shares all = of_stage;
        all.add(of_displacement, per_turn * cell.turn), all.add(of_rounding, per_turn * cell.weak);
        return all;
    }
};

/// Why light of a plan has no scene bound, and what is allowed, in a line; empty where it has one.
std::optional<std::string> what_light_is_not_bounded(const Plan& plan);

/// Of a plan that is unlit, or whose light is bounded.
LightErrors light_errors(const Plan& plan, const SampleErrors& samples);

/// How fast light can change in the cells of a volume.
class CellLights {
  public:
    CellLights(const Plan& plan, const LightErrors& errors);
    /// Sets `turn` and `weak`.
    void add_to(CellValues& values, const std::array<std::int64_t, 3>& cell) const;

  private:
    Vec3 gradient_at(const std::array<std::int64_t, 3>& voxel) const;

    const Volume& volume_;
    GradientRule rule_;
    Vec3 scale_;  // of a difference of voxels to levels per smallest spacing
    double floor_ = 1, rounding_ = 0;
    bool by_ends_ = false;  // light takes a mean of two gradients, which may be weaker than both
};

}  // namespace squint
