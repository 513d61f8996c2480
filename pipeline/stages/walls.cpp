#include "pipeline/stages/walls.h"

#include "pipeline/classification/tables/opaque_prediction.h"

#include <algorithm>
#include <cmath>

namespace squint {

WallStage build_walls(const Entries& entries, std::int64_t levels) {
    WallStage walls{true, {}};
    const preintegration::OpaquePrediction prediction = preintegration::predict_opaque(entries);
    const int last = entries.size() - 1;
    const auto none = static_cast<std::int32_t>(levels);
    walls.next.assign(static_cast<std::size_t>(levels), none);
    for (std::int32_t level = 0; level < none; ++level) {
        const double at = std::clamp(entries.coordinate(level), 0.0, static_cast<double>(last));
        const std::optional<double> wall = prediction.first(at, last);
        if (!wall) continue;
        // The first level that is not in front of it.
        auto next = std::max(level, static_cast<std::int32_t>(std::floor(*wall * entries.scalars_per_entry)));
        while (next < none && entries.coordinate(next) < *wall) ++next;
        walls.next[static_cast<std::size_t>(level)] = next;
    }
    return walls;
}

}  // namespace squint
