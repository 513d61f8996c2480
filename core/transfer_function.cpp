#include "core/transfer_function.h"

#include "core/error.h"
#include "core/portable_math.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace squint {
namespace {

constexpr int kDefaultEntries = 4096;
constexpr int kMostEntries = 1 << 16;

/// Piecewise linear between ascending points, constant outside; at a step the later point holds.  Remembers
/// where it was, so that values in order cost no search.
template <class Point, class Value>
class Curve {
  public:
    Curve(const std::vector<Point>& points, Value Point::*part) : points_(points), part_(part) {}

    Value operator()(double value) {
        while (after_ < points_.size() && points_[after_].value <= value) ++after_;
        while (after_ > 0 && points_[after_ - 1].value > value) --after_;
        if (after_ == 0) return points_.front().*part_;
        const Point& before = points_[after_ - 1];
        if (after_ == points_.size() || before.value == value) return before.*part_;
        const Point& after = points_[after_];
        const double weight = (value - before.value) / (after.value - before.value);
        return before.*part_ + (after.*part_ - before.*part_) * weight;
    }

  private:
    const std::vector<Point>& points_;
    Value Point::*part_;
    std::size_t after_ = 0;  // the first point whose value is greater
};

bool in_unit_range(double x) {
    return x >= 0 && x <= 1;
}  // false for what is not a number

std::string where(const TransferFunction& function) {
    return function.name.empty() ? "transfer function" : function.name;
}

template <class Point>
void check_ascending(const std::vector<Point>& points, const std::string& name) {
    if (points.empty()) throw InputError(name + ": no points, allowed is one or more");
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!std::isfinite(points[i].value))
            throw InputError(
                fmt::format("{} point {}: value {} is not finite", name, i + 1, points[i].value));
        if (i > 0 && points[i].value < points[i - 1].value)
            throw InputError(fmt::format("{} point {}: value {} after {}, allowed is ascending order", name,
                                         i + 1, points[i].value, points[i - 1].value));
    }
}

}  // namespace

Vec3 TransferFunction::color_at(double value) const {
    return Curve(color, &ColorPoint::color)(value);
}
double TransferFunction::alpha_at(double value) const {
    return Curve(opacity, &OpacityPoint::alpha)(value);
}

bool Entries::any_opaque() const {
    return std::any_of(entry.begin(), entry.end(), [](const Entry& e) { return e.opaque; });
}

void check(const TransferFunction& function) {
    const std::string name = where(function);
    check_ascending(function.color, name + ", colour");
    check_ascending(function.opacity, name + ", opacity");
    for (std::size_t i = 0; i < function.color.size(); ++i) {
        const Vec3& c = function.color[i].color;
        if (!in_unit_range(c.x) || !in_unit_range(c.y) || !in_unit_range(c.z))
            throw InputError(fmt::format("{}, colour point {}: [{}, {}, {}], allowed is 0 to 1", name, i + 1,
                                         c.x, c.y, c.z));
    }
    for (std::size_t i = 0; i < function.opacity.size(); ++i)
        if (!in_unit_range(function.opacity[i].alpha))
            throw InputError(fmt::format("{}, opacity point {}: alpha {}, allowed is 0 to 1", name, i + 1,
                                         function.opacity[i].alpha));
    if (!(function.unit_distance > 0) || !std::isfinite(function.unit_distance))
        throw InputError(fmt::format("{}: unit_distance {}, allowed is above 0 (world units)", name,
                                     function.unit_distance));
    if (function.entries != 0 && (function.entries < 2 || function.entries > kMostEntries))
        throw InputError(
            fmt::format("{}: {} entries, allowed is 2 to {}", name, function.entries, kMostEntries));
}

Entries sample_entries(const TransferFunction& function, const Volume& volume) {
    check(function);
    const std::int64_t levels = std::int64_t{volume.largest_representable()} + 1;
    const auto at_most = static_cast<int>(std::clamp<std::int64_t>(levels, 2, kDefaultEntries));
    const int count = function.entries != 0 ? function.entries : at_most;

    Entries entries;
    entries.unit_distance = function.unit_distance;
    entries.scalars_per_entry = static_cast<double>(std::max<std::int64_t>(levels - 1, 1)) / (count - 1);
    entries.entry.resize(static_cast<std::size_t>(count));
    Curve color(function.color, &ColorPoint::color);
    Curve alpha(function.opacity, &OpacityPoint::alpha);
    for (int i = 0; i < count; ++i) {
        Entry& entry = entries.entry[static_cast<std::size_t>(i)];
        const double value = volume.value_scale * (i * entries.scalars_per_entry) + volume.value_offset;
        entry.color = color(value);
        entry.alpha = alpha(value);
        entry.opaque = entry.alpha == 1;
        const double capped = std::min(entry.alpha, kLargestTranslucentAlpha);
        entry.extinction = (0 - portable::log1p(-capped)) / function.unit_distance;  // never a negative zero
    }
    return entries;
}

}  // namespace squint
