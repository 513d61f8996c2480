// The fast path: packets of 16 rays go through the stages' kernels, batch after batch.  It gives the model's
// bits.
#pragma once

#include "core/image.h"
#include "pipeline/machines/lanes/empty_space.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/ray_counts.h"
#include "pipeline/machines/lanes/screen_mask.h"
#include "pipeline/machines/model.h"
#include "pipeline/render.h"

#include <memory>
#include <optional>
#include <string>

namespace squint::lanes {

/// Why lanes cannot run a plan, in a line; empty if they can.
std::optional<std::string> what_needs_the_model(const Plan& plan);

/// The words of a plan that they can run, and its schedule: the kernel of each segment, and why no faster one
/// runs it.  In one line; of the best target, with cells where they pay and memory has room for them.
std::string words_in_lanes(const Plan& plan);

/// What follows from empty space before any camera is known.
struct AboutEmptySpace {
    std::weak_ptr<const EmptySpace> empty;
    VisibleSurface surface;
    bool hides_something;  // rays may meet what cannot be seen
};

class LaneRenderer {
  public:
    /// Throws InputError for a target that this machine lacks.
    LaneRenderer(const Plan& plan, const RenderOptions& options);

    /// Like ModelRenderer::render_tile.
    void render_tile(int left, int top, int right, int bottom, Image& image,
                     TileStatistics& statistics) const;

    std::string target() const { return target_name(target_); }
    std::string why() const;
    std::int64_t bytes() const;

    /// How the volume lies in memory, and why.
    std::string layout() const { return layout_; }

  private:
    void find_empty();
    void choose_layout(const RenderOptions& options);
    void find_lit_cells(const RenderOptions& options);

    const Plan& plan_;
    std::int64_t target_;
    StageWays ways_;
    StageKernels kernels_;
    Schedule schedule_;
    std::shared_ptr<const EmptySpace> empty_;
    std::shared_ptr<const AboutEmptySpace> about_;  // with empty_
    const EmptySpace* asked_ = nullptr;             // by rays; null where all can be seen
    std::shared_ptr<const NearWalls> walls_;
    ScreenMask seen_;
    CountSlabs count_slabs_;
    std::shared_ptr<CellBlocks> cells_;
    std::shared_ptr<LitCells> lit_cells_;
    std::string no_lit_cells_;  // why a lit plan has none
    bool no_room_to_skip_ = false;
    std::int64_t room_ = 0;  // bytes for layouts beside the volume
    VoxelSource voxels_;
    std::string layout_;
};

}  // namespace squint::lanes
