#include "pipeline/plan/findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace squint {
namespace {

constexpr const char* kEmpty = "the picture is empty";

std::optional<std::string> clip_beside(const Plan& plan) {
    for (int axis = 0; axis < 3; ++axis)
        if (!(plan.box_low[axis] < plan.box_high[axis]))
            return fmt::format(
                "clip: the box kept lies beside the volume, which spans {:g} to {:g} along {}{}: {}",
                plan.volume->box_low()[axis], plan.volume->box_high()[axis], plan.clip ? "its own " : "",
                "xyz"[axis], kEmpty);
    return std::nullopt;
}

/// Whether all corners of the box lie behind a plane beyond which the camera sees nothing.
std::optional<std::string> camera_elsewhere(const Plan& plan) {
    const Camera& camera = plan.camera;
    const bool perspective = camera.projection == Projection::perspective;
    const double up = camera.half_height, across = up * camera.width / camera.height;
    bool behind = true;
    std::array<bool, 4> beside{true, true, true, true};
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = (corner >> axis & 1 ? plan.box_high : plan.box_low)[axis];
        const Vec3 from_eye = p - camera.eye;
        const double z = from_eye.dot(camera.view), x = from_eye.dot(camera.right),
                     y = from_eye.dot(camera.up);
        const double scale = perspective ? z : 1;
        behind = behind && z <= 0;
        beside = {beside[0] && x > across * scale, beside[1] && -x > across * scale,
                  beside[2] && y > up * scale, beside[3] && -y > up * scale};
    }
    if (behind) return fmt::format("camera: the volume lies behind the eye: {}", kEmpty);
    if (beside != std::array<bool, 4>{})
        return fmt::format("camera: the volume lies beside what the picture shows: {}", kEmpty);
    return std::nullopt;
}

/// The entries that samples of the data can meet.
struct MetEntries {
    std::size_t first, last;
};
MetEntries met_entries(const Plan& plan) {
    const auto last = static_cast<double>(plan.entries.size() - 1);
    const auto at = [&](std::uint32_t scalar) {
        return std::clamp(plan.entries.coordinate(scalar), 0.0, last);
    };
    return {static_cast<std::size_t>(std::floor(at(plan.volume->smallest))),
            static_cast<std::size_t>(std::ceil(at(plan.volume->largest)))};
}

std::string data_text(const Volume& volume) {
    const auto [least, greatest] =
        std::minmax({volume.value_at(volume.smallest), volume.value_at(volume.largest)});
    return fmt::format("{:g} to {:g}", least, greatest);
}

std::optional<std::string> function_outside(const Plan& plan, const MetEntries& met) {
    const auto& entries = plan.entries.entry;
    if (std::any_of(entries.begin() + static_cast<std::ptrdiff_t>(met.first),
                    entries.begin() + static_cast<std::ptrdiff_t>(met.last) + 1,
                    [](const Entry& e) { return e.is_visible(); }))
        return std::nullopt;
    const TransferFunction function = resolve_transfer_function(plan.scene, *plan.volume);
    const auto& points = function.opacity;
    const auto seen = [](const OpacityPoint& p) { return p.alpha > 0; };
    const auto first = std::find_if(points.begin(), points.end(), seen);
    if (first == points.end()) return fmt::format("transfer_function: every opacity is 0: {}", kEmpty);
    const auto last = std::find_if(points.rbegin(), points.rend(), seen);
    // Opacity rises from the point before the first visible one, and is constant beyond the ends.
    const bool to_the_left = first == points.begin(), to_the_right = last == points.rbegin();
    const std::string where =
        to_the_right  ? fmt::format("above {:g}", to_the_left ? 0.0 : (first - 1)->value)
        : to_the_left ? fmt::format("below {:g}", (last - 1)->value)
                      : fmt::format("between {:g} and {:g}", (first - 1)->value, (last - 1)->value);
    return fmt::format("transfer_function: no opacity is above 0 at the data's values, {}, only {}: {}",
                       data_text(*plan.volume), where, kEmpty);
}

std::optional<std::string> function_of_two_values(const Plan& plan, const MetEntries& met) {
    constexpr double kPart = 0.01;
    const auto& entries = plan.entries.entry;
    const auto alike = [](const Entry& a, const Entry& b) {
        return a.color == b.color && a.alpha == b.alpha;
    };
    const Entry &low = entries[met.first], &high = entries[met.last];
    if (low.color == high.color || low.alpha == high.alpha) return std::nullopt;
    std::size_t from = met.first, to = met.last;
    while (from < to && alike(entries[from + 1], low)) ++from;
    while (to > from && alike(entries[to - 1], high)) --to;
    const auto changes = static_cast<double>(to - from), all = static_cast<double>(met.last - met.first);
    if (changes > kPart * all) return std::nullopt;
    const auto value_at = [&](std::size_t entry) {
        return plan.volume->value_at(static_cast<double>(entry) * plan.entries.scalars_per_entry);
    };
    return fmt::format(
        "transfer_function: it changes between {:g} and {:g} alone, {:.2g} % of the data's values, {}: what "
        "is seen "
        "has two values; transfer_function.range = \"data\" stretches it",
        value_at(from), value_at(to), 100 * changes / all, data_text(*plan.volume));
}

}  // namespace

std::vector<std::string> findings_of(const Plan& plan) {
    std::vector<std::string> findings;
    const auto add = [&](std::optional<std::string> finding) {
        if (finding) findings.push_back(std::move(*finding));
        return finding.has_value();
    };
    if (!add(clip_beside(plan))) add(camera_elsewhere(plan));
    const MetEntries met = met_entries(plan);
    if (!add(function_outside(plan, met))) add(function_of_two_values(plan, met));
    return findings;
}

}  // namespace squint
