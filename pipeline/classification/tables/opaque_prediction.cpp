#include "pipeline/classification/tables/opaque_prediction.h"

#include <cmath>

namespace squint::preintegration {

OpaquePrediction predict_opaque(const Entries& entries) {
    const int size = entries.size();
    OpaquePrediction prediction;
    prediction.up.assign(size, size);
    prediction.down.assign(size, -1);
    for (int i = 0, nearest = -1; i < size; ++i) {
        if (entries.entry[i].opaque) nearest = i;
        prediction.down[i] = nearest;
    }
    for (int i = size - 1, nearest = size; i >= 0; --i) {
        if (entries.entry[i].opaque) nearest = i;
        prediction.up[i] = nearest;
    }
    prediction.any = prediction.up[0] < size;
    return prediction;
}

std::optional<double> OpaquePrediction::first(double front, double back) const {
    const int below = static_cast<int>(std::floor(front));
    const int above = static_cast<int>(std::ceil(front));
    if (down[below] == below && up[above] == above) return front;  // on an opaque entry or between two
    if (front <= back && up[above] <= back) return up[above];
    if (front >= back && down[below] >= back) return down[below];
    return std::nullopt;
}

SlabValue RealCutSlab::over_wall(const SlabValue& part) const {
    if (!wall) return part;
    return {part.color + wall_color * (1 - part.alpha), 1};
}

RealCutSlab cut_at_opaque(const Entries& entries, const OpaquePrediction& prediction, double front,
                          double back, double length) {
    front = clamped_coordinate(entries, front);
    back = clamped_coordinate(entries, back);
    if (!prediction.any) return {front, back, length};
    const std::optional<double> wall = prediction.first(front, back);
    if (!wall) return {front, back, length};
    const double shortened = *wall == front ? 0 : length * std::abs(*wall - front) / std::abs(back - front);
    return {front, *wall, shortened, true, color_at(entries, *wall)};
}

}  // namespace squint::preintegration
