#include "pipeline/machines/lanes/exaggerated.h"

#include "pipeline/slab-inl.h"

#include <array>

namespace squint::lanes {

using namespace HWY_NAMESPACE;

void exaggerate(const Plan& plan, int count, LitSamples& places) {
    const FromVolume voxels{*plan.volume};
    using Vector = std::array<std::int64_t, 3>;
    const auto at = [](const Batch(&from)[3], int i) {
        return Vector{from[0].v[i], from[1].v[i], from[2].v[i]};
    };
    for (int i = 0; i < count; ++i) {
        const Vector gradient = exaggerated_gradient(plan, voxels, at(places.cell, i), at(places.weight, i),
                                                     at(places.gradient, i));
        for (std::size_t a = 0; a < 3; ++a) places.gradient[a].v[i] = static_cast<Word>(gradient[a]);
    }
}

}  // namespace squint::lanes
