#include "core/transfer_function.h"

#include "core/curve_kernel.h"
#include "core/error.h"
#include "core/portable_math.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>

namespace squint {
namespace {

constexpr int kMostEntries = 1 << 16;

/// Piecewise linear between ascending points, constant outside; at a step the later point holds.  Remembers
/// its place, so that ascending values need no search.
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

/// Samples a curve at `count` entries, one stretch between two points at a time.  parts(point): its channels;
/// results: where each channel's samples go.
template <class Point, class Parts>
void sample_curve(const std::vector<Point>& points, const SampleValues& values, int count, const Parts& parts,
                  std::span<double* const> results) {
    const bool ascending = values.scale > 0;
    // The first sample that is not before `value` in the order of samples.
    const auto first_at = [&](double value, int from) {
        int low = from, high = count;
        while (low < high) {
            const int middle = low + (high - low) / 2;
            const bool before = ascending ? values(middle) < value : values(middle) >= value;
            (before ? low : high) = before ? middle + 1 : middle;
        }
        return low;
    };
    int done = 0;
    const auto flat = [&](int end, const Point& p) {
        if (end <= done) return;
        for (std::size_t c = 0; c < results.size(); ++c)
            std::fill(results[c] + done, results[c] + end, parts(p)[c]);
        done = end;
    };
    const int last = static_cast<int>(points.size()) - 1;
    const auto point = [&](int k) -> const Point& { return points[static_cast<std::size_t>(k)]; };
    const Point &first = point(ascending ? 0 : last), &final = point(ascending ? last : 0);
    flat(first_at(first.value, 0), first);
    for (int k = 0; k < last; ++k) {
        const int at = ascending ? k : last - 1 - k;  // between points `at` and `at` + 1
        const Point &a = point(at), &b = point(at + 1);
        const int end = first_at(ascending ? b.value : a.value, done);
        if (end > done)
            sample_stretch(values, {a.value, b.value, parts(a), parts(b)}, done, end, results), done = end;
    }
    flat(count, final);
}

/// -ln(1 - alpha) / unit_distance, with alphas limited.
void extinction_of(std::span<const double> alpha, double unit_distance, std::span<double> extinction) {
    for (std::size_t i = 0; i < alpha.size(); ++i)
        extinction[i] = -std::min(alpha[i], kLargestTranslucentAlpha);
    portable::log1p_each(extinction, extinction);
    for (double& e : extinction) e = 0 - e;  // never a negative zero
    if (unit_distance != 1)
        for (double& e : extinction) e /= unit_distance;
}

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
    const SampleValues values{volume.value_scale, entries.scalars_per_entry, volume.value_offset};
    const auto size = static_cast<std::size_t>(count);
    const std::unique_ptr<double[]> sampled = std::make_unique_for_overwrite<double[]>(5 * size);
    double *const red = sampled.get(), *const green = red + size, *const blue = green + size,
                  *const alpha = blue + size, *const extinction = alpha + size;
    const std::array<double*, 3> colors{red, green, blue};
    sample_curve(
        function.color, values, count, [](const ColorPoint& p) { return std::span(&p.color.x, 3); }, colors);
    sample_curve(
        function.opacity, values, count, [](const OpacityPoint& p) { return std::span(&p.alpha, 1); },
        std::span(&alpha, 1));
    extinction_of(std::span(alpha, size), function.unit_distance, std::span(extinction, size));
    entries.entry.reserve(size);
    std::array<Entry, 64> block;  // in the cache; zeroing all entries first would take as long as the rest
    for (std::size_t i = 0; i < size; i += block.size()) {
        const std::size_t end = std::min(size - i, block.size());
        for (std::size_t k = 0, j = i; k < end; ++k, ++j)
            block[k] = {{red[j], green[j], blue[j]}, alpha[j], extinction[j], alpha[j] == 1};
        entries.entry.insert(entries.entry.end(), block.begin(), block.begin() + end);
    }
    return entries;
}

}  // namespace squint
