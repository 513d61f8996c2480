#include "pipeline/classification/tables/linear_entries.h"

#include "core/portable_math.h"

#include <algorithm>
#include <cmath>

namespace squint::preintegration {
namespace {

struct Place {
    int entry;        // the entry at or below
    double fraction;  // of the way to the next one; 0 at the last
};

Place place(const Entries& entries, double coordinate) {
    const double s = clamped_coordinate(entries, coordinate);
    const int entry = static_cast<int>(std::floor(s));
    return {entry, s - entry};
}

}  // namespace

double clamped_coordinate(const Entries& entries, double coordinate) {
    return std::clamp(coordinate, 0.0, static_cast<double>(entries.size() - 1));
}

double extinction_at(const Entries& entries, double coordinate) {
    const auto [i, w] = place(entries, coordinate);
    const double tau = entries.entry[i].extinction;
    return w == 0 ? tau : tau + w * (entries.entry[i + 1].extinction - tau);
}

Vec3 color_at(const Entries& entries, double coordinate) {
    const auto [i, w] = place(entries, coordinate);
    const Vec3 color = entries.entry[i].color;
    return w == 0 ? color : color + (entries.entry[i + 1].color - color) * w;
}

bool opaque_at(const Entries& entries, double coordinate) {
    const auto [i, w] = place(entries, coordinate);
    return entries.entry[i].opaque && (w == 0 || entries.entry[i + 1].opaque);
}

SlabValue point_slab(const Entries& entries, double coordinate, double length) {
    const Vec3 color = color_at(entries, coordinate);
    if (opaque_at(entries, coordinate)) return {color, 1};
    const double alpha = -portable::expm1(-extinction_at(entries, coordinate) * length);
    return {color * alpha, alpha};
}

Entries subdivided(const Entries& entries, int per_entry) {
    Entries fine = entries;
    fine.entry.clear();
    fine.scalars_per_entry = entries.scalars_per_entry / per_entry;
    const int count = (entries.size() - 1) * per_entry + 1;
    for (int j = 0; j < count; ++j) {
        const double s = static_cast<double>(j) / per_entry;
        const Entry& below = entries.entry[j / per_entry];
        const double alpha = opaque_at(entries, s) ? 1 : std::min(below.alpha, kLargestTranslucentAlpha);
        fine.entry.push_back({color_at(entries, s), alpha, extinction_at(entries, s), opaque_at(entries, s)});
    }
    return fine;
}

double deepest_entry(const Entries& entries, double length) {
    double deepest = 0;
    for (int i = 0; i + 1 < entries.size(); ++i)
        deepest =
            std::max(deepest, (entries.entry[i].extinction + entries.entry[i + 1].extinction) / 2 * length);
    return deepest;
}

}  // namespace squint::preintegration
