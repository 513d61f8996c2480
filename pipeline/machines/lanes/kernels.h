// The stages as kernels over a batch: function pointers, chosen once a render for a SIMD target, a width of
// lanes, a layout of the volume and what is known of the roundings.
#pragma once

#include "core/image.h"
#include "pipeline/machines/lanes/cell_blocks.h"
#include "pipeline/machines/lanes/empty_space.h"
#include "pipeline/machines/lanes/packet.h"
#include "pipeline/machines/lanes/schedule.h"
#include "pipeline/plan/plan.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace squint::lanes {

/// Where voxels are fetched from.
struct VoxelSource {
    const Volume* volume = nullptr;
    const std::uint8_t* cells = nullptr;  // null: from the volume itself
    Index3 blocks{0, 0, 0};
    std::vector<std::int32_t> slots;  // of each block: its first cell, or -1: from the volume itself
    // A packet's rays lie so far apart that each asks memory for its own voxels.
    bool requests_all = false;
};

struct StageKernels {
    /// Sets up a packet's rays: stage 1's words.
    void (*set_up)(const Plan&, const PacketPlace&, RayPacket&) = nullptr;
    /// About where they run, for visible_rows.
    void (*set_course)(const Plan&, const EmptySpace&, const RayPacket&, RayCourse&) = nullptr;
    /// The next rows, from slab k on, in which any ray may meet something to be seen; no rows at the end.
    Rows (*visible_rows)(const EmptySpace&, const RayPacket&, int k, RayCourse&) = nullptr;
    /// Slabs [from, to) composite nothing: they count as composited.
    void (*pass_over)(const RayPacket&, int from, int to, PixelPacket&) = nullptr;
    /// Rows [from, to): cells, weights and slab lengths.
    void (*locate)(const Plan&, const RayPacket&, int from, int to, Samples&) = nullptr;
    /// Rows [from, to): where the voxels lie, and a request to memory for them.
    void (*prefetch)(const VoxelSource&, int from, int to, Samples&) = nullptr;
    /// Rows [from, to) that have their places: the request alone.
    void (*request)(const VoxelSource&, int from, int to, const Samples&) = nullptr;
    /// locate and the places of its cells, without a request.
    void (*locate_address)(const Plan&, const VoxelSource&, const RayPacket&, int from, int to,
                           Samples&) = nullptr;
    /// Rows [from, to): corners by pairs.
    void (*fetch)(const VoxelSource&, int from, int to, Samples&) = nullptr;
    /// Rows [from, to): corners to inputs.
    void (*interpolate)(const Plan&, int from, int to, Samples&) = nullptr;
    /// fetch and interpolate.  Meanwhile rows [next_from, next_to) of the batch to come are requested.
    void (*fetch_interpolate)(const Plan&, const VoxelSource&, int from, int to, Samples&, int next_from,
                              int next_to, const Samples& next) = nullptr;
    /// Slabs [0, steps): inputs to colours and opacities.
    void (*classify)(const Plan&, int steps, Samples&) = nullptr;
    /// Front to back: of slabs [0, steps), those behind the end of their ray become transparent, for nobody
    /// sees them.
    void (*hide)(const Plan&, const RayPacket&, const PixelPacket&, int steps, Samples&) = nullptr;
    /// Of slabs [0, steps): those in which something is to be seen, packed.  Gives their number.
    int (*gather_lit)(const Plan&, const RayPacket&, int steps, const Samples&, LitSamples&) = nullptr;
    /// The ends of slabs in which something is to be seen, in rows [0, steps], each once and none that is
    /// known; notes of which rays the one in row `steps` is among them.  Gives their number.
    int (*gather_ends)(const Plan&, const RayPacket&, int steps, const Samples&, Row& known,
                       LitSamples& ends) = nullptr;
    /// Raw gradients of gathered slabs: the sums of those at their ends.
    void (*add_ends)(const Plan&, int count, const EndGradients&, LitSamples&) = nullptr;
    /// Places `part` 2^-bits of the way along gathered slabs [at, at + count), to places from `to` on.
    void (*place_between)(const Plan&, const LitSamples& slabs, int at, int count, int part, int bits,
                          LitSamples& places, int to) = nullptr;
    /// Raw gradients of the first `count` gathered places; this, find_normals and shade read and write up to
    /// the next multiple of the lanes.
    void (*find_gradients)(const Plan&, int count, LitSamples&) = nullptr;
    /// log2 of the pieces of gathered slabs, from the raw gradients at their ends, by place in the batch.
    void (*find_cuts)(const Plan&, int count, const EndGradients&, LitSamples&) = nullptr;
    /// Of gathered slabs those with so many cuts, and their number; up to the next sixteen the last again.
    int (*pick_by_cuts)(const Plan&, int count, int cuts, const LitSamples&, LitSamples& picked) = nullptr;
    /// Sixteen slabs from `at` on in 2^bits pieces, row i piece i, ready to be classified.
    void (*cut)(const Plan&, const LitSamples& slabs, int at, int bits, Samples&) = nullptr;
    /// Their pieces, lit, back to one colour each.
    void (*join)(const Plan&, const LitSamples& pieces, int bits, LitSamples& slabs, int at) = nullptr;
    /// The voxels about the first `count` gathered samples, as many as the gradient's rule wants.
    void (*fetch_lit)(const Plan&, int count, LitSamples&) = nullptr;
    /// In place of fetch_lit for gradients from samples.  Rows [0, rows) of 16 gathered samples each: one
    /// voxel on along an axis, their cells and weights.
    void (*step_aside)(const Plan&, const LitSamples&, int axis, bool ahead, int rows, Samples&) = nullptr;
    /// Rows [from, to): corners to scalars, which take the inputs' place.
    void (*interpolate_scalars)(const Plan&, int from, int to, Samples&) = nullptr;
    /// Their normals, and how far each is to be trusted.
    void (*find_normals)(const Plan&, int count, LitSamples&) = nullptr;
    /// Their colours.
    void (*shade)(const Plan&, int count, LitSamples&) = nullptr;
    /// Slabs [0, steps) onto pixels; rays freeze where they end.  Where the plan wants depth, `between` takes
    /// T at the slabs' ends: row s at the front of slab s.
    void (*composite)(const Plan&, const RayPacket&, int steps, const Samples&, PixelPacket&,
                      Batch& between) = nullptr;
    /// classify and composite, where nothing stands between them.
    void (*classify_composite)(const Plan&, const RayPacket&, int steps, const Samples&,
                               PixelPacket&) = nullptr;
    /// R G B A of a packet's pixels into an image.
    void (*store_colors)(const Plan&, const PixelPacket&, const PacketPlace&, Image&) = nullptr;
    /// Inputs of slabs [0, steps) onto what stands for their rays: in place of classifying and compositing
    /// them.
    void (*project)(const RayPacket&, int steps, const Samples&, ProjectionPacket&) = nullptr;

    /// The kernel that runs each segment, where one has more than one kernel to choose from.
    std::array<Instance, kSegments> instances{};
    void chose(Segment segment, std::string name, std::string why_not_faster = {}) {
        instances[static_cast<std::size_t>(segment)] = {std::move(name), std::move(why_not_faster)};
    }
};

/// How one stage runs: bits of its lanes, 32 or 64, and what its kernel may take for granted; or in floats.
struct StageWay {
    int bits = 32;
    KnownRescales known = KnownRescales::nothing;
    bool is_float = false;
};
/// Why a stage does not run in the narrow lanes of a kernel that takes `known` for granted; empty where it
/// does.
inline std::string why_not_narrow(const StageWay& way, KnownRescales known) {
    if (way.is_float) return "words are floats";
    if (way.bits == 64) return "words are wide";
    if (way.known < known) return "a wire rounds by a rule of its own, or meets its limits";
    return {};
}

struct StageWays {
    StageWay location, interpolation, classification, compositing;
    StageWay gradient, shading;  // up to the raw gradient; normalising it, and what light does
    StageWay input;              // from a sample to table entries: no narrower than interpolation
};
StageWays ways_of(const Plan& plan);

/// One of Highway's targets this processor has, by name; the best for an empty name.  Throws InputError,
/// listing those there are.
std::int64_t find_target(const std::string& name);
std::vector<std::string> target_names();  // best first
std::string target_name(std::int64_t target);

StageKernels kernels_for(const Plan& plan, const StageWays& ways, const VoxelSource& source,
                         std::int64_t target);

// One a file of kernels.
void ray_kernels(std::int64_t target, StageKernels& kernels);
void sampling_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, const VoxelSource& source,
                      StageKernels& kernels);
void voxel_kernels(std::int64_t target, const VoxelSource& source, StageKernels& kernels);
void classification_kernel(std::int64_t target, const Plan& plan, const StageWay& way, StageKernels& kernels);
void point_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels);
void shading_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels);
void inside_kernels(std::int64_t target, const StageWays& ways, StageKernels& kernels);
void compositing_kernel(std::int64_t target, const Plan& plan, const StageWay& way, StageKernels& kernels);
void projection_kernel(std::int64_t target, const Plan& plan, StageKernels& kernels);

/// Calls f with the word for a way; `Known` is what a kernel is compiled to take for granted where it can.
template <template <class, KnownRescales> class Lanes, KnownRescales Known, class F>
void with_integer_word(const StageWay& way, F&& f) {
    // One lane alone is as fast in 64 bits: the portable target is compiled for them only.
    constexpr bool kAlone = Lanes<std::int32_t, KnownRescales::nothing>::count() == 1;
    if constexpr (kAlone)
        f.template operator()<Lanes<std::int64_t, KnownRescales::nothing>>();
    else if (way.bits == 64)
        f.template operator()<Lanes<std::int64_t, KnownRescales::nothing>>();
    else if (way.known >= Known)
        f.template operator()<Lanes<std::int32_t, Known>>();
    else
        f.template operator()<Lanes<std::int32_t, KnownRescales::nothing>>();
}
template <template <class, KnownRescales> class Lanes, KnownRescales Known, class F>
void with_word(const StageWay& way, F&& f) {
    if (way.is_float)
        f.template operator()<Lanes<float, KnownRescales::nothing>>();
    else
        with_integer_word<Lanes, Known>(way, f);
}

}  // namespace squint::lanes
