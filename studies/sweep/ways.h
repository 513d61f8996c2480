// The ways that the slabs of a picture take through the composition's branches: which are lit, opaque, cut.
#pragma once

#include "pipeline/plan/plan.h"

#include <cstdint>
#include <string>
#include <vector>

namespace squint::sweep {

/// Slabs that compute the same: the same way, after a neighbour that left the same.
struct SlabWay {
    bool is_first = true;  // of its ray: no neighbour before it shares a sample
    std::string before;    // the answers of one such neighbour, in Branching::ways' letters
    std::string ways;      // its own
    std::int64_t slabs = 0;
};
/// Of a projection, whose rays are classified once: how each ray ends, in place of a slab.
struct PictureWays {
    std::int64_t rays = 0;   // that meet the volume
    std::int64_t slabs = 0;  // that they take
    std::vector<SlabWay> ways;
};

/// Casts at most `most` x `most` rays, evenly spaced, by the golden model.  The plan rounds: !plan.real.
PictureWays ways_of(const Plan& plan, int most);

}  // namespace squint::sweep
