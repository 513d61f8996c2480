// The stages as kernels over a batch: function pointers, chosen once per picture for a SIMD target, a width
// of lanes, a layout of the volume and what is known of the roundings.
#pragma once

#include "core/image.h"
#include "pipeline/machines/lanes/cell_blocks.h"
#include "pipeline/machines/lanes/empty_space.h"
#include "pipeline/machines/lanes/lit_cells.h"
#include "pipeline/machines/lanes/near_walls.h"
#include "pipeline/machines/lanes/packet.h"
#include "pipeline/machines/lanes/schedule.h"
#include "pipeline/plan/plan.h"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace squint::lanes {

/// The source of voxels.
struct VoxelSource {
    const Volume* volume = nullptr;
    const std::uint8_t* cells = nullptr;  // null: from the volume itself
    Index3 blocks{0, 0, 0};
    std::vector<std::int32_t> slots;  // first cell of each block; -1: not built, read the volume
    // A packet's rays lie so far apart that each asks memory for its own voxels.
    bool requests_all = false;
    std::shared_ptr<const std::vector<CellBlocks::Near>> near;  // may be null
    const LitCells* lit = nullptr;  // perhaps still to be built; null: differences come from voxels
};

struct StageKernels {
    /// Sets up the rays of a packet: the words of stage 1.
    void (*set_up)(const Plan&, const PacketPlace&, RayPacket&) = nullptr;
    /// Computes about where they run, for visible_rows.
    void (*set_course)(const Plan&, const EmptySpace&, const RayPacket&, RayCourse&) = nullptr;
    /// The next rows, from slab k on, in which a ray may meet something visible; no rows at the end.
    Rows (*visible_rows)(const EmptySpace&, const RayPacket&, int k, RayCourse&) = nullptr;
    /// Slabs [from, to) composite nothing: counts them as composited.
    void (*pass_over)(const RayPacket&, int from, int to, PixelPacket&) = nullptr;
    /// Rows [from, to): computes cells, weights and slab lengths.
    void (*locate)(const Plan&, const RayPacket&, int from, int to, Samples&) = nullptr;
    /// Rows [from, to): computes where voxels lie, and requests them from memory.
    void (*prefetch)(const VoxelSource&, int from, int to, Samples&) = nullptr;
    /// Rows [from, to) that have their places: the request alone.
    void (*request)(const VoxelSource&, int from, int to, const Samples&) = nullptr;
    /// locate and the places of its cells, without a request.  Cells are stored where keeps_cells(), and where one
    /// of a vector has no place.
    void (*locate_address)(const Plan&, const VoxelSource&, const RayPacket&, int from, int to,
                           Samples&) = nullptr;
    /// Rows [from, to): loads corners, in pairs.
    void (*fetch)(const VoxelSource&, int from, int to, Samples&) = nullptr;
    /// Rows [from, to): turns corners into inputs.
    void (*interpolate)(const Plan&, int from, int to, Samples&) = nullptr;
    /// fetch and interpolate.  Meanwhile rows [next_from, next_to) of the batch to come are requested.
    void (*fetch_interpolate)(const Plan&, const VoxelSource&, int from, int to, Samples&, int next_from,
                              int next_to, const Samples& next) = nullptr;
    /// Slabs [0, steps): turns inputs into colours and opacities.
    void (*classify)(const Plan&, int steps, Samples&) = nullptr;
    /// Front to back: makes those of slabs [0, steps) transparent that lie behind the end of their ray,
    /// because they are not seen.
    void (*hide)(const Plan&, const RayPacket&, const PixelPacket&, int steps, Samples&) = nullptr;
    /// Packs those of slabs [0, steps) that are visible.  Returns their number.
    int (*gather_lit)(const Plan&, const RayPacket&, int steps, const Samples&, LitSamples&) = nullptr;
    /// Packs the ends of visible slabs, in rows [0, steps], each end once and none whose gradient is known;
    /// notes the rays whose end in row `steps` is among them.  Returns their number.
    int (*gather_ends)(const Plan&, const RayPacket&, int steps, const Samples&, Row& known,
                       LitSamples& ends) = nullptr;
    /// Raw gradients of packed slabs: the sums of those at their ends.
    void (*add_ends)(const Plan&, int count, const EndGradients&, LitSamples&) = nullptr;
    /// Where light lies in packed slabs, as shading.inside asks: at one or two places, or fading.
    void (*find_light)(const Plan&, int count, const LitSamples&, SlabLight&) = nullptr;
    /// Raw gradients of the slabs `from` on the way from one end to the other: at light.way[0], to `near`, and at
    /// light.way[1], unless `far` is null.
    void (*lerp_ends)(const Plan&, int count, const EndGradients&, const Batch& from, const SlabLight& light,
                      LitSamples& near, LitSamples* far) = nullptr;
    /// Joins light from two places; `far` has that of the second.
    void (*join_places)(const Plan&, int count, const SlabLight&, const LitSamples& far,
                        LitSamples&) = nullptr;
    /// Lights slabs by what fades from their normals to those of `far`.
    void (*shade_fading)(const Plan&, int count, const SlabLight&, const LitSamples& far,
                         LitSamples&) = nullptr;
    /// Stores places `part` 2^-bits of the way along packed slabs [at, at + count), from place `to` on.
    void (*place_between)(const Plan&, const LitSamples& slabs, int at, int count, int part, int bits,
                          LitSamples& places, int to) = nullptr;
    /// Computes raw gradients at the first `count` packed places.  This kernel, find_normals and shade read
    /// and write up to the next multiple of the number of lanes.
    void (*find_gradients)(const Plan&, int count, LitSamples&) = nullptr;
    /// log2 of the pieces of packed slabs, from the raw gradients at their ends, by place in the batch.
    void (*find_cuts)(const Plan&, int count, const EndGradients&, LitSamples&) = nullptr;
    /// Packs those with so many cuts; returns their number.  The last one repeats to a multiple of sixteen.
    int (*pick_by_cuts)(const Plan&, int count, int cuts, const LitSamples&, LitSamples& picked) = nullptr;
    /// Cuts sixteen slabs from `at` on into 2^bits pieces, row i piece i, ready to be classified.
    void (*cut)(const Plan&, const LitSamples& slabs, int at, int bits, Samples&) = nullptr;
    /// Joins their pieces, lit if light falls on them, to one colour and one opacity each.
    void (*join)(const Plan&, const Batch (&color)[3], const Batch& alpha, int bits, LitSamples& slabs,
                 int at) = nullptr;
    /// Packs those of slabs [0, steps) that are looked at twice for walls, of rays that go on.  Returns their number;
    /// the last one repeats to a multiple of sixteen.
    int (*gather_second_looks)(const Plan&, const NearWalls&, const RayPacket&, const PixelPacket&, int steps,
                               const Samples&, LitSamples& slabs) = nullptr;
    /// Places of the samples that cut sixteen of them from `at` on into 2^bits: rows [1, 2^bits).
    void (*place_samples_between)(const Plan&, const LitSamples& slabs, int at, int bits, Samples&) = nullptr;
    /// Loads the voxels around the first `count` packed samples, as many as the gradient rule needs.
    void (*fetch_lit)(const Plan&, const VoxelSource&, int count, LitSamples&) = nullptr;
    /// In place of fetch_lit, where no_differences is empty: central differences, of lit cells where they are built.
    void (*fetch_differences)(const Plan&, const VoxelSource&, int count, LitSamples&) = nullptr;
    std::string no_differences;  // why gradients are taken from voxels
    /// In place of fetch_lit, for gradients from samples: rows [0, rows) of 16 packed samples each get the
    /// cells and weights one voxel further along an axis.
    void (*step_aside)(const Plan&, const LitSamples&, int axis, bool ahead, int rows, Samples&) = nullptr;
    /// Rows [from, to): turns corners into scalars, which take the place of inputs.
    void (*interpolate_scalars)(const Plan&, int from, int to, Samples&) = nullptr;
    /// Computes their normals, and how far each is to be trusted.
    void (*find_normals)(const Plan&, int count, LitSamples&) = nullptr;
    /// Computes their colours.
    void (*shade)(const Plan&, int count, LitSamples&) = nullptr;
    /// Composites slabs [0, steps) onto pixels; rays freeze where they end.  Where the plan wants depth,
    /// `between` receives T at the slabs' ends: row s at the front of slab s.
    void (*composite)(const Plan&, const RayPacket&, int steps, const Samples&, PixelPacket&,
                      Batch& between) = nullptr;
    /// classify and composite, where nothing stands between them; `rows` are unit_rows.
    void (*classify_composite)(const Plan&, const std::int16_t* rows, const RayPacket&, int steps,
                               const Samples&, PixelPacket&) = nullptr;
    /// Stores R G B A of a packet's pixels in an image.
    void (*store_colors)(const Plan&, const PixelPacket&, const PacketPlace&, Image&) = nullptr;
    /// In place of classifying and compositing: adds the inputs of slabs [0, steps) to the projection of
    /// their rays.
    void (*project)(const RayPacket&, int steps, const Samples&, ProjectionPacket&) = nullptr;

    /// The kernel that runs each segment, where one has more than one kernel to choose from.
    std::array<Instance, kSegments> instances{};
    void chose(Segment segment, std::string name, std::string why_not_faster = {}) {
        instances[static_cast<std::size_t>(segment)] = {std::move(name), std::move(why_not_faster)};
    }

    /// The entries' rows as UnitLanes (fixedpoint/words/unit_lanes-inl.h), the last one twice;
    /// empty where a number does not fit them.
    std::vector<std::int16_t> unit_rows;
};

/// How one stage runs: bits of its lanes (32 or 64) and what its kernel may assume; or in floats.
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
    StageWay gradient, shading;  // up to the raw gradient; normalising and light
    StageWay input;              // from sample to table entries: no narrower than interpolation
    StageWay places, between;    // light inside a slab: its places, and gradients there
};
StageWays ways_of(const Plan& plan);

/// One of Highway's targets that this processor has, by name; the best for an empty name.  Throws InputError
/// listing those there are.
std::int64_t find_target(const std::string& name);
std::vector<std::string> target_names();  // best first
std::string target_name(std::int64_t target);

/// Whether cells are read behind stage 2.
inline bool keeps_cells(const Plan& plan) {
    return plan.lit || plan.walls.looks_twice;
}

StageKernels kernels_for(const Plan& plan, const StageWays& ways, const VoxelSource& source,
                         std::int64_t target);

// One a file of kernels.
void ray_kernels(std::int64_t target, StageKernels& kernels);
void sampling_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, const VoxelSource& source,
                      StageKernels& kernels);
void voxel_kernels(std::int64_t target, const VoxelSource& source, StageKernels& kernels);
void lit_voxel_kernels(std::int64_t target, const VoxelSource& source, StageKernels& kernels);
void classification_kernel(std::int64_t target, const Plan& plan, const StageWay& way, StageKernels& kernels);
void moments_kernel(std::int64_t target, const Plan& plan, const StageWay& way, StageKernels& kernels);
void point_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels);
void gradient_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels);
void shading_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels);
void fading_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels);
void inside_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels);
void wall_kernels(std::int64_t target, const StageWays& ways, StageKernels& kernels);
void compositing_kernel(std::int64_t target, const Plan& plan, const StageWay& way, StageKernels& kernels);
void projection_kernel(std::int64_t target, const Plan& plan, StageKernels& kernels);

/// Calls f with the word for a StageWay; `Known` is what its kernel assumes where it can.
template <template <class, KnownRescales> class Lanes, KnownRescales Known, class F>
void with_integer_word(const StageWay& way, F&& f) {
    // One lane alone is as fast in 64 bits: the portable target has no others.
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
