#include "core/curve_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/curve_kernel.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

void SampleStretch(const SampleValues& values, const CurveStretch& s, int first, int end,
                   std::span<double* const> results) {
    const hn::ScalableTag<double> d;
    const auto from = hn::Set(d, s.from), width = hn::Set(d, s.to - s.from);
    const auto scale = hn::Set(d, values.scale), spacing = hn::Set(d, values.spacing),
               offset = hn::Set(d, values.offset);
    const int lanes = static_cast<int>(hn::Lanes(d));
    auto index = hn::Iota(d, static_cast<double>(first));
    int i = first;
    for (; i + lanes <= end; i += lanes, index = hn::Add(index, hn::Set(d, static_cast<double>(lanes)))) {
        const auto value = hn::Add(hn::Mul(scale, hn::Mul(index, spacing)), offset);
        const auto weight = hn::Div(hn::Sub(value, from), width);
        for (std::size_t c = 0; c < results.size(); ++c) {
            const auto rise = hn::Set(d, s.after[c] - s.before[c]);
            hn::StoreU(hn::Add(hn::Set(d, s.before[c]), hn::Mul(rise, weight)), d, results[c] + i);
        }
    }
    for (; i < end; ++i) {
        const double weight = (values(i) - s.from) / (s.to - s.from);
        for (std::size_t c = 0; c < results.size(); ++c)
            results[c][i] = s.before[c] + (s.after[c] - s.before[c]) * weight;
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace squint
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint {

HWY_EXPORT(SampleStretch);

void sample_stretch(const SampleValues& values, const CurveStretch& stretch, int first, int end,
                    std::span<double* const> results) {
    HWY_DYNAMIC_DISPATCH(SampleStretch)(values, stretch, first, end, results);
}

}  // namespace squint
#endif
