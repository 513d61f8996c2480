// The stages as kernels over a batch: function pointers, chosen once a render for a SIMD target and a width
// of lanes.
#pragma once

#include "pipeline/lanes/packet.h"
#include "pipeline/plan.h"

#include <cstdint>
#include <string>
#include <vector>

namespace squint::lanes {

struct StageKernels {
    /// Rows [from, to): cells, weights and slab lengths.
    void (*locate)(const Plan&, const RayPacket&, int from, int to, Samples&) = nullptr;
    /// Rows [from, to): corners to inputs.
    void (*interpolate)(const Plan&, int from, int to, Samples&) = nullptr;
    /// Slabs [0, steps): inputs to colours and opacities.
    void (*classify)(const Plan&, int steps, Samples&) = nullptr;
    /// Colours of the first `count` gathered samples; reads and writes up to the next multiple of the lanes.
    void (*shade)(const Plan&, int count, LitSamples&) = nullptr;
    /// Slabs [0, steps) onto pixels; rays freeze where they end.
    void (*composite)(const Plan&, const RayPacket&, int steps, const Samples&, PixelPacket&) = nullptr;
};

/// Bits of the lanes each stage runs in: 32 or 64.
struct StageWidths {
    int location = 32, interpolation = 32, input = 32, classification = 32, shading = 64, compositing = 32;
};

/// One of Highway's targets this processor has, by name; the best for an empty name.  Throws InputError,
/// listing those there are.
std::int64_t find_target(const std::string& name);
std::vector<std::string> target_names();  // best first
std::string target_name(std::int64_t target);

StageKernels kernels_for(const Plan& plan, const StageWidths& widths, std::int64_t target);

// One a file of kernels.
void sampling_kernels(std::int64_t target, const StageWidths& widths, StageKernels& kernels);
void classification_kernel(std::int64_t target, const Plan& plan, const StageWidths& widths,
                           StageKernels& kernels);
void shading_kernel(std::int64_t target, StageKernels& kernels);
void compositing_kernel(std::int64_t target, const StageWidths& widths, StageKernels& kernels);

}  // namespace squint::lanes
