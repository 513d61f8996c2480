#include "pipeline/machines/lanes/blocks_met.h"

#include "pipeline/machines/lanes/cell_blocks.h"
#include "pipeline/machines/lanes/kept_empty_space.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

namespace squint::lanes {
namespace {

// How far samples may leave the rendered box, in voxels.
double drift_of(const Plan& plan) {
    const Index3& n = plan.volume->dims;
    const double of_floats = plan.float32 ? static_cast<double>(std::max({n.x, n.y, n.z})) * 0x1p-20 : 0;
    return of_floats + plan.location.drift();
}

// How many blocks apart a slab's ends may be; 0 where one sample classifies it.
int slab_reach(const Plan& plan) {
    if (!plan.samples_both_ends()) return 0;
    return static_cast<int>(std::ceil(std::min((plan.scene.sampling.step + drift_of(plan)) / kBlock, 1e6)));
}

// The memory that the system could give: pages of mapped files make way.
std::int64_t free_memory() {
    std::ifstream file("/proc/meminfo");
    for (std::string word; file >> word;)
        if (std::int64_t kib = 0; word == "MemAvailable:" && file >> kib) return kib << 10;
    return std::int64_t{sysconf(_SC_AVPHYS_PAGES)} * sysconf(_SC_PAGESIZE);
}

}  // namespace

BlockBox blocks_met(const Plan& plan) {
    const Volume& volume = *plan.volume;
    const BlockBox all = all_blocks_of(volume);
    const Vec3 low = volume.voxel_from_grid(plan.box_low), high = volume.voxel_from_grid(plan.box_high);
    const double beyond = kBlock * (slab_reach(plan) + 1) + drift_of(plan) + 1;
    BlockBox box;
    for (int a = 0; a < 3; ++a) {
        const auto block = [&](double voxel) {
            const double inside = std::clamp(voxel, 0.0, static_cast<double>(volume.dims[a] - 1));
            return std::min(static_cast<std::int64_t>(inside) >> kBlockBits, all.blocks[a] - 1);
        };
        box.low[a] = block(low[a] - beyond);
        box.blocks[a] = std::max(block(high[a] + beyond), box.low[a]) - box.low[a] + 1;
    }
    return box;
}

bool may_be_met(const BlockBox& box, const EmptySpace* empty, const Index3& cell_blocks, std::int64_t block,
                int apart) {
    constexpr int kBits = CellBlocks::kBits - kBlockBits;
    static_assert(kBits == 1);  // so that its middle is a corner of all its blocks
    const Index3 at(block % cell_blocks.x, block / cell_blocks.x % cell_blocks.y,
                    block / (cell_blocks.x * cell_blocks.y));
    for (int a = 0; a < 3; ++a)
        if ((at[a] + 1) << kBits <= box.low[a] || at[a] << kBits >= box.low[a] + box.blocks[a]) return false;
    return !empty || empty->clear_at(2 * at.x + 1, 2 * at.y + 1, 2 * at.z + 1) <= apart;
}

bool may_skip(const Plan& plan) {
    constexpr int kMostReach = 4;  // longer slabs skip little
    return plan.skips_empty_space && slab_reach(plan) <= kMostReach;
}

std::int64_t room_of(const RenderOptions& options) {
    return options.layout_bytes >= 0 ? options.layout_bytes : free_memory() / 2;
}

std::shared_ptr<const EmptySpace> empty_space_of(const Plan& plan, std::int64_t room) {
    if (!may_skip(plan)) return nullptr;
    const BlockBox box = blocks_met(plan);
    if (EmptySpace::bytes_for(*plan.volume, box) > room) return nullptr;
    return kept_empty_space(*plan.volume, box, plan.entries, slab_reach(plan), plan.entry_reach,
                            plan.projection_mode);
}

}  // namespace squint::lanes
