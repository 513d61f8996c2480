#include "pipeline/classification/tables/pi1d_table.h"

#include "core/portable_math.h"

#include <algorithm>
#include <cmath>

namespace squint::preintegration {
namespace {

double interpolated(const std::vector<double>& value, double s) {
    const int i = static_cast<int>(s);
    return s == i ? value[i] : value[i] + (s - i) * (value[i + 1] - value[i]);
}

double integral_to(const std::vector<double>& value, const std::vector<double>& sum, double s) {
    const int i = static_cast<int>(s);
    return s == i ? sum[i] : sum[i] + (s - i) * (value[i] + interpolated(value, s)) / 2;
}

/// The mean of the interpolant between two coordinates.
double mean_between(const std::vector<double>& value, const std::vector<double>& sum, double front,
                    double back) {
    if (static_cast<int>(front) == static_cast<int>(back))
        return (interpolated(value, front) + interpolated(value, back)) / 2;
    return (integral_to(value, sum, back) - integral_to(value, sum, front)) / (back - front);
}

std::vector<double> trapezoid_prefix(const std::vector<double>& value) {
    std::vector<double> sum(value.size(), 0);
    for (std::size_t i = 1; i < value.size(); ++i) sum[i] = sum[i - 1] + (value[i - 1] + value[i]) / 2;
    return sum;
}

}  // namespace

SlabValue with_length_ratio(const SlabValue& slab, double ratio) {
    if (ratio == 1 || slab.alpha <= 0 || slab.alpha >= 1) return slab;
    const double alpha = -portable::expm1(ratio * portable::log1p(-slab.alpha));
    return {slab.color * (alpha / slab.alpha), alpha};
}

SlabValue RealPreIntegrated1D::slab(double front, double back, double slab_length) const {
    const double last = static_cast<double>(value.size() - 1);
    front = std::clamp(front, 0.0, last);
    back = std::clamp(back, 0.0, last);
    SlabValue result;
    const double mean_value = mean_between(value, sum, front, back);
    result.alpha =
        mean == MeanOf::opacity_kye ? std::clamp(mean_value, 0.0, 1.0) : -portable::expm1(-mean_value);
    for (int channel = 0; channel < 3; ++channel) {
        const double colored_mean = mean_between(colored[channel], colored_sum[channel], front, back);
        result.color[channel] = std::clamp(colored_mean, 0.0, result.alpha);
    }
    return with_length_ratio(result, slab_length / length);
}

RealPreIntegrated1D build_pi1d(const Entries& entries, double length, MeanOf mean) {
    RealPreIntegrated1D tables{.mean = mean, .length = length};
    for (const Entry& entry : entries.entry) {
        const double depth = entry.extinction * length;
        const double value = entry.opaque                  ? 1
                             : mean == MeanOf::opacity_kye ? -portable::expm1(-depth)
                                                           : std::min(depth, 1.0);
        tables.value.push_back(value);
        for (int channel = 0; channel < 3; ++channel)
            tables.colored[channel].push_back(value * entry.color[channel]);
    }
    tables.sum = trapezoid_prefix(tables.value);
    for (int channel = 0; channel < 3; ++channel)
        tables.colored_sum[channel] = trapezoid_prefix(tables.colored[channel]);
    return tables;
}

}  // namespace squint::preintegration
