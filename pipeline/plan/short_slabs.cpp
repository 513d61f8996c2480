#include "pipeline/plan/short_slabs.h"

#include "core/portable_math.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace squint {
namespace {

double opacity(double depth) {
    return -portable::expm1(-depth);
}

/// (1 - e^-s) TV(p_x, p_s), s < x.
double attenuated_as_another(double x, double s) {
    const double equal = portable::log(x * opacity(s) / (s * opacity(x))) / (x - s);
    return opacity(x * equal) / opacity(x) * opacity(s) - opacity(s * equal);
}

/// As shorter_slab_error() of PI1D, whose colours are weighed by a = 1 - e^(-tau d) where they should be by tau
/// e^-t: the two are at most a factor apart, and two densities in [r, 1] of each other differ by (1 - sqrt r) / (1 +
/// sqrt r) at most.  `most`: the greatest tau d inside.
double weighed_by_opacity(double x, double most) {
    const double r = (most > 0 ? opacity(most) / most : 1) * portable::exp(-x), root = std::sqrt(r);
    return opacity(x) * (1 - root) / (1 + root);
}

/// C = x mean(c), limited to alpha: scaled by opacities where it should be by lengths.
double scaled_by_opacity(double x, double longest) {
    // Greatest where e^-s = alpha / x.
    const double s = std::min(longest * x, -portable::log(opacity(x) / x));
    return opacity(s) - opacity(x) * s / x;
}

/// f at depths 2^(k / 8), each standing for those below it.
class ByDepth {
  public:
    template <class F>
    explicit ByDepth(const F& f) {
        for (int k = 0; k < kRows; ++k)
            error_[static_cast<std::size_t>(k)] = f(std::exp2((k - kFirst) / 8.0));
    }
    double operator()(double depth) const {
        const int k = static_cast<int>(std::ceil(8 * std::log2(std::max(depth, 1e-6)))) + kFirst;
        return error_[static_cast<std::size_t>(std::clamp(k, 0, kRows - 1))];
    }

  private:
    static constexpr int kFirst = 8 * 12, kRows = 8 * 24;
    std::array<double, kRows> error_{};
};

/// Calls f(first, end, depth, most) for segments [first, end) of the entries that the data reaches: the greatest
/// depth of a full slab from the first segment to the last, and of a full slab of any one of its places.  Segments
/// are entries, or `step` of them side by side where there are many.
template <class F>
void for_slabs(const Plan& plan, const F& f) {
    constexpr int kMost = 256;
    const std::vector<Entry>& entry = plan.entries.entry;
    const double last_entry = plan.entries.size() - 1;
    const auto at = [&](std::uint32_t scalar) {
        return std::clamp(plan.entries.coordinate(scalar), 0.0, last_entry);
    };
    const int low =
                  std::min(static_cast<int>(std::floor(at(plan.volume->smallest))), plan.entries.size() - 2),
              high = std::max(low + 1, static_cast<int>(std::ceil(at(plan.volume->largest))));
    const int step = (high - low + kMost - 1) / kMost;
    const auto depth_at = [&](int i) {
        return entry[static_cast<std::size_t>(i)].extinction * plan.step_world;
    };
    for (int first = low; first < high; first += step) {
        double most = depth_at(first), inside = 0;  // inside: the sum over segments that are crossed whole
        int from = first;
        for (int end = std::min(first + step, high);; end = std::min(end + step, high)) {
            for (int i = from + 1; i <= end; ++i) most = std::max(most, depth_at(i));
            double sum = inside;
            for (int i = from; i < end; ++i) sum += (depth_at(i) + depth_at(i + 1)) / 2;
            // Both ends stand anywhere in theirs: whole are those between.
            const int whole = std::max(1, from - first - step);
            const double depth = from - first > step ? std::min(most, sum / whole) : most;
            f(first, end, depth, most);
            inside = sum, from = end;
            if (end == high) break;
            // A slab ends at a wall that it comes to.
            if (plan.scene.classification.opaque_prediction != WallRule::none &&
                entry[static_cast<std::size_t>(end)].opaque)
                break;
        }
    }
}

}  // namespace

double shorter_slab_error(double depth, double longest) {
    constexpr int kParts = 64;
    double worst = 0;
    for (int part = 1; part < kParts; ++part)
        worst = std::max(worst, attenuated_as_another(depth, depth * longest * part / kParts));
    return worst;
}

Approximation shorter_slabs(const Plan& plan) {
    Approximation found{kShorterSlabs, 0};
    const Method method = plan.scene.classification.method;
    const bool has_length = !std::visit([](const auto& m) { return m.kPremultiplied; }, plan.method);
    if (has_length || plan.projection_mode) return found;
    const Vec3 diagonal = plan.box_high - plan.box_low;
    const double longest = std::min(1.0, std::sqrt(diagonal.dot(diagonal)) / plan.step_world);
    const ByDepth error([&](double x) {
        return method == Method::pi2d ? shorter_slab_error(x, longest) : scaled_by_opacity(x, longest);
    });
    const auto lost = [&](double depth, double most, double swing) {
        return method == Method::pi1d   ? swing * weighed_by_opacity(depth * longest, most)
               : method == Method::pi2d ? swing * error(depth)
                                        : error(depth);
    };
    const std::vector<Entry>& entry = plan.entries.entry;
    std::array<double, 3> least{}, greatest{};
    int begun = -1, seen = 0;
    for_slabs(plan, [&](int first, int end, double depth, double most) {
        if (first != begun) {
            begun = first, seen = first;
            const Vec3& c = entry[static_cast<std::size_t>(first)].color;
            least = greatest = {c.x, c.y, c.z};
        }
        double swing = 0;
        for (; seen <= end; ++seen)
            for (int c = 0; c < 3; ++c) {
                const auto i = static_cast<std::size_t>(c);
                const double value = entry[static_cast<std::size_t>(seen)].color[c];
                least[i] = std::min(least[i], value), greatest[i] = std::max(greatest[i], value);
            }
        for (std::size_t c = 0; c < 3; ++c) swing = std::max(swing, greatest[c] - least[c]);
        found.lsb8 = std::max(found.lsb8, 255 * lost(depth, most, swing));
    });
    return found;
}

}  // namespace squint
