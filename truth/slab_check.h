// Tests the classification of a plan on its own transfer function: words against the exact slab integral, on
// hard slabs.
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
    int beyond = 0;            // slabs that violate 0 <= C <= alpha <= 1
    double largest_color = 0;  // premultiplied, against the exact integral, in LSB8
    double largest_alpha = 0;
    HardSlab worst{0, 0, 0};  // the slab with the larger of both errors
};

/// Slabs in both directions between the ends of the scalar range, the function's knots, and 1 and 9 entries
/// beside them; with equal ends; with ends one last bit apart; whole and half ones.
std::vector<HardSlab> hard_slabs(const Plan& plan);

/// Classifies hard_slabs() in the model's widest word.  Without `exact` it checks only the range.
SlabCheck check_slabs(const Plan& plan, bool against_exact = true);

/// Every method that a scene can name and each of its orders, but pc_mid, whose slabs are those of pc.
struct NamedMethod {
    std::string name;  // "pips 3"
    Method method;
    int order;
};
std::vector<NamedMethod> every_method();

}  // namespace squint
