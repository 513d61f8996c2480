// Must be included first: it selects the SIMD targets, and Highway reads that selection only once.
#include "pipeline/machines/lanes/targets.h"

#include "core/error.h"
#include "pipeline/machines/lanes/kernels.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <hwy/targets.h>

namespace squint::lanes {
namespace {

// Better targets are lower bits.
std::vector<std::int64_t> targets_here() {
    std::vector<std::int64_t> targets;
    const std::int64_t there = (hwy::SupportedTargets() | HWY_EMU128) & HWY_TARGETS;
    for (int bit = 0; bit < 63; ++bit)
        if (there >> bit & 1) targets.push_back(std::int64_t{1} << bit);
    return targets;
}

}  // namespace

std::string target_name(std::int64_t target) {
    return hwy::TargetName(target);
}

std::vector<std::string> target_names() {
    std::vector<std::string> names;
    for (const std::int64_t target : targets_here()) names.push_back(target_name(target));
    return names;
}

std::int64_t find_target(const std::string& name) {
    const std::vector<std::int64_t> targets = targets_here();
    if (name.empty()) return targets.front();
    for (const std::int64_t target : targets)
        if (target_name(target) == name) return target;
    throw InputError(fmt::format("--target: no SIMD target \"{}\" on this machine; there are {}", name,
                                 fmt::join(target_names(), ", ")));
}

StageKernels kernels_for(const Plan& plan, const StageWays& ways, const VoxelSource& source,
                         std::int64_t target) {
    StageKernels kernels;
    ray_kernels(target, kernels);
    sampling_kernels(target, plan, ways, source, kernels);
    voxel_kernels(target, source, kernels);
    lit_voxel_kernels(target, source, kernels);
    classification_kernel(target, plan, ways.classification, kernels);
    moments_kernel(target, plan, ways.classification, kernels);
    point_kernels(target, plan, ways, kernels);
    gradient_kernels(target, plan, ways, kernels);
    shading_kernels(target, plan, ways, kernels);
    inside_kernels(target, plan, ways, kernels);
    fading_kernels(target, plan, ways, kernels);
    wall_kernels(target, ways, kernels);
    compositing_kernel(target, plan, ways.compositing, kernels);
    projection_kernel(target, plan, kernels);
    return kernels;
}

}  // namespace squint::lanes
