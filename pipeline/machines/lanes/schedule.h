// How a batch's way through the composition (pipeline/slab-inl.h) is cut into segments: the only place in the
// fast path where the order of the stages stands.
#pragma once

#include "pipeline/plan/plan.h"
#include "pipeline/slab.h"

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace squint::lanes {

struct StageKernels;

/// A loop over a batch that runs one part of its way or several: what it makes and uses itself stays in
/// registers, what another segment reads lies in the batch's buffers (packet.h).
enum class Segment {
    locate,       // cells, weights, lengths
    address,      // where the cells' voxels lie, and a request to memory for them
    fetch,        // corners
    interpolate,  // classification inputs
    classify,     // colours and opacities
    look_twice,   // for walls between samples
    light,        // of what is seen
    composite,    // onto pixels
    project,      // MIP, MinIP, average: inputs onto what stands for a ray
    // Two in one:
    locate_address,
    fetch_interpolate,
    classify_composite,
};
inline constexpr int kSegments = static_cast<int>(Segment::classify_composite) + 1;
std::string_view name_of(Segment segment);
/// The parts of the composition that a segment runs, in its order.
std::span<const Part> parts_of(Segment segment);

/// The kernel that runs a segment: its name, and why no faster one does (empty where there is none).
struct Instance {
    std::string name, why_not_faster;
};

/// The segments of a plan's batches.
struct Schedule {
    std::vector<Segment> ahead;       // of the batch to come, before
    std::vector<Segment> now;         // these of the batch at hand
    bool asks_ahead = false;          // a batch asks memory for the next one's voxels while it computes
    std::string name;                 // "locate+address|fetch+interpolate.u16|classify+composite.unit15"
    std::vector<std::string> missed;  // a line for each segment that might run faster: why not
};

/// Neighbours are run in one loop where there is a kernel for both.
Schedule schedule_of(const Plan& plan, const StageKernels& kernels);

}  // namespace squint::lanes
