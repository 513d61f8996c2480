#include "pipeline/machines/scene_bound/beams.h"

#include <algorithm>
#include <cmath>

namespace squint {

Beams::Beams(const Plan& plan, const SampleErrors& errors, const CostBlocks& blocks,
             const CompositingCosts& compositing)
    : blocks_(blocks),
      compositing_(compositing),
      spacing_(plan.volume->spacing),
      step_world_(plan.step_world) {
    const Vec3 low = plan.volume->voxel_from_grid(plan.box_low),
               high = plan.volume->voxel_from_grid(plan.box_high);
    for (int axis = 0; axis < 3; ++axis) box_[static_cast<std::size_t>(axis)] = {low[axis], high[axis]};
    off_ = errors.displacement + 0x1p-20;
    // In the middle of slabs the last sample is less than a step behind the one before.
    if (plan.scene.classification.method == Method::pc_mid) earlier_ = 0.5;
    clipped_ = plan.clip.has_value();
}

std::vector<Beam> Beams::all() const {
    std::vector<Beam> beams;
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (const bool backwards : {false, true}) {
            Beam beam;
            beam.axis = axis, beam.backwards = backwards;
            const double half = box_[axis].width() / 2;
            for (std::size_t i = 0; i < 2; ++i) {
                const Beam::Range& across = box_[(axis + 1 + i) % 3];
                beam.place[i] = {across.low - half, across.high + half};
                beam.slope[i] = {-1, 1};
            }
            beams.push_back(beam);
        }
    return beams;
}

std::array<Beam, 2> Beams::halves(const Beam& beam) const {
    std::array<Beam, 2> both{beam, beam};
    const double half = box_[beam.axis].width() / 2;
    std::size_t widest = 0;
    double width = -1;
    for (std::size_t i = 0; i < 4; ++i) {
        const double here = i < 2 ? beam.place[i].width() : beam.slope[i - 2].width() * half;
        if (here > width) width = here, widest = i;
    }
    const auto side = [&](Beam& b) -> Beam::Range& {
        return widest < 2 ? b.place[widest] : b.slope[widest - 2];
    };
    const double cut = (side(both[0]).low + side(both[0]).high) / 2;
    side(both[0]).high = side(both[1]).low = cut;
    return both;
}

void Beams::step(Behind& behind, const CostBlocks::Found& found, bool surely) const {
    const double more = found.costs.more(behind.slabs);
    if (found.visible) behind.compositing += compositing_.each + compositing_.clear * behind.slabs;
    double slabs = surely ? behind.slabs + more : std::max(behind.slabs, behind.slabs + more);
    if (!surely) slabs = std::max(slabs, static_cast<double>(found.costs.last()));
    behind.slabs = std::min(slabs, compositing_.most);
}

std::optional<Behind> Beams::bound(const Beam& beam) const {
    Behind behind;
    double most = 0;  // a ray may begin anywhere: an eye may lie in the volume
    bool meets = false;
    walk(beam, [&](const CellBox& cells, std::int64_t samples, bool surely) {
        meets = true;
        const CostBlocks::Found found = blocks_.in(cells);
        for (std::int64_t i = 0; i < samples; ++i) {
            step(behind, found, surely && !clipped_);
            most = std::max(most, behind.slabs);
        }
    });
    if (!meets) return {};
    behind.slabs = most;
    return behind;
}

}  // namespace squint
