// How well a plan's classification does on its own transfer function: words against the exact slab integral,
// on the slabs that are hard for it.
#pragma once

#include "pipeline/plan/plan.h"

#include <string>
#include <vector>

namespace squint {

struct HardSlab {
    std::int64_t front, back;  // raw classification inputs
    std::int64_t length;       // raw, in steps
};

struct SlabCheck {
    int slabs = 0;
    int beyond = 0;            // slabs outside 0 <= C <= alpha <= 1
    double largest_color = 0;  // error against the exact integral, premultiplied, in LSB8
    double largest_alpha = 0;
    HardSlab worst{0, 0, 0};  // where the larger of both is
};

/// Both directions between the ends of the scalar range, the knots of the function and 1 and 9 entries beside
/// them; equal ends; ends one last bit apart; full slabs and half ones.
std::vector<HardSlab> hard_slabs(const Plan& plan);

/// Classifies hard_slabs in the model's widest word.  Without the exact integral only the range is checked.
SlabCheck check_slabs(const Plan& plan, bool against_exact = true);

/// Every method that a scene can name, as settings: pc, pi1d, pi1d_engel, pi2d, pi2d_no_attenuation, pips 1
/// to 5, leg 2 to 4.
struct NamedMethod {
    std::string name;  // "pips 3"
    Method method;
    int order;
};
std::vector<NamedMethod> every_method();

}  // namespace squint
