#include "pipeline/machines/lanes/schedule.h"

#include "pipeline/machines/lanes/kernels.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>

namespace squint::lanes {
namespace {

using enum Segment;

constexpr Part kLocation[] = {Part::location}, kSample[] = {Part::interpolation, Part::input},
               kClassification[] = {Part::classification},
               kSecondLook[] = {Part::location, Part::interpolation, Part::input, Part::classification},
               kLight[] = {Part::gradient, Part::normal, Part::shading}, kCompositing[] = {Part::compositing},
               kPoint[] = {Part::classification, Part::compositing};

// Addresses, voxels and a projection's merging are no parts; its end is composed by the model.
struct Row {
    Segment segment;
    std::string_view name;
    std::span<const Part> parts;
};
constexpr Row kSegmentRows[] = {
    {locate, "locate", kLocation},
    {address, "address", {}},
    {fetch, "fetch", {}},
    {interpolate, "interpolate", kSample},
    {classify, "classify", kClassification},
    {look_twice, "look_twice", kSecondLook},
    {light, "light", kLight},
    {composite, "composite", kCompositing},
    {project, "project", {}},
    {locate_address, "locate+address", kLocation},
    {fetch_interpolate, "fetch+interpolate", kSample},
    {classify_composite, "classify+composite", kPoint},
};
constexpr const Row& row_of(Segment segment) {
    return kSegmentRows[static_cast<std::size_t>(segment)];
}
static_assert([] {
    for (int i = 0; i < kSegments; ++i)
        if (kSegmentRows[i].segment != static_cast<Segment>(i)) return false;
    return std::size(kSegmentRows) == kSegments;
}());

// A batch's way, in the order of the composition.  What comes before `fetch` is done a batch ahead, for memory
// is slow.
constexpr Segment kWay[] = {locate, address, fetch, interpolate, classify, look_twice, light, composite};
constexpr Segment kProjection[] = {locate, address, fetch, interpolate, project};

// Where it is not cut if there is a kernel for both.
struct Fusion {
    Segment first, second, both;
};
constexpr Fusion kFusions[] = {
    {locate, address, locate_address},
    {fetch, interpolate, fetch_interpolate},
    {classify, composite, classify_composite},
};

}  // namespace

std::string_view name_of(Segment segment) {
    return row_of(segment).name;
}
std::span<const Part> parts_of(Segment segment) {
    return row_of(segment).parts;
}

Schedule schedule_of(const Plan& plan, const StageKernels& kernels) {
    const auto instance = [&](Segment s) { return kernels.instances[static_cast<std::size_t>(s)]; };
    const std::span<const Segment> way = plan.projection_mode ? std::span<const Segment>(kProjection) : kWay;
    std::vector<Segment> segments(way.begin(), way.end());
    if (!plan.lit) std::erase(segments, light);
    if (!plan.walls.looks_twice) std::erase(segments, look_twice);
    for (const Fusion& fusion : kFusions) {
        const std::array pair{fusion.first, fusion.second};
        const auto at = std::search(segments.begin(), segments.end(), pair.begin(), pair.end());
        if (at == segments.end() || instance(fusion.both).name.empty()) continue;
        *at = fusion.both;
        segments.erase(at + 1);
    }
    Schedule schedule;
    for (const Segment segment : segments) {
        const bool is_ahead = segment == locate || segment == address || segment == locate_address;
        (is_ahead ? schedule.ahead : schedule.now).push_back(segment);
        schedule.asks_ahead |= segment == fetch_interpolate;
        const Instance chosen = instance(segment);
        const std::string name = chosen.name.empty() ? std::string(name_of(segment)) : chosen.name;
        schedule.name += (schedule.name.empty() ? "" : "|") + name;
        if (!chosen.why_not_faster.empty())
            schedule.missed.push_back(fmt::format("{}: {}", name, chosen.why_not_faster));
    }
    return schedule;
}

}  // namespace squint::lanes
