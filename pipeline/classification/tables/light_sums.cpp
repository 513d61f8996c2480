#include "pipeline/classification/tables/light_sums.h"

#include <algorithm>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/classification/tables/light_sums.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::CappedTag<double, 4>;  // red, green, blue, and an unused lane
using V = hn::Vec<Tag>;
constexpr Tag kTag;
constexpr int kLanes = static_cast<int>(HWY_MIN(HWY_LANES(double), 4)), kVectors = 4 / kLanes;

/// x / 6, rounded once.  Where multiply-add is fused, the remainder corrects a product with 1/6 (Markstein
/// 1990), in a quarter of a division's time.
V sixth_of(V x) {
#if HWY_NATIVE_FMA
    const V sixth = hn::Set(kTag, 1.0 / 6), guess = hn::Mul(x, sixth);
    return hn::MulAdd(hn::NegMulAdd(hn::Set(kTag, 6), guess, x), sixth, guess);
#else
    return hn::Div(x, hn::Set(kTag, 6));
#endif
}

void WriteLightSums(std::span<const Entry> entries, double step, double* sums) {
    const V two = hn::Set(kTag, 2), of_step = hn::Set(kTag, step);
    static_assert(offsetof(Entry, alpha) == 3 * sizeof(double));  // the fourth of a row of four
    for (int v = 0; v < kVectors; ++v) {
        const auto color = [&](std::size_t i) { return hn::LoadU(kTag, &entries[i].color.x + v * kLanes); };
        V sum = hn::Zero(kTag), before = color(0), tau_before = hn::Set(kTag, entries[0].extinction);
        // Several vectors share a row: each keeps what it does not own, or what comes next overwrites it.
        const int own = std::min(kLanes, 3 - v * kLanes);
        const auto put = [&](double* row) {
            if (kVectors == 1 || own == kLanes) return hn::StoreU(sum, kTag, row + v * kLanes);
            alignas(32) double lanes[kLanes];
            hn::Store(sum, kTag, lanes);
            std::copy_n(lanes, std::max(own, 0), row + v * kLanes);
        };
        put(sums);
        V scaled = sum;
        for (std::size_t i = 0; i + 1 < entries.size(); ++i) {
            const V after = color(i + 1), tau_after = hn::Set(kTag, entries[i + 1].extinction);
            V light =
                hn::Add(hn::Mul(hn::Mul(two, before), tau_before), hn::Mul(hn::Mul(two, after), tau_after));
            light = hn::Add(light, hn::Mul(before, tau_after));
            light = hn::Add(light, hn::Mul(after, tau_before));
            scaled = hn::Add(scaled, sixth_of(light));
            sum = hn::Mul(scaled, of_step);
            put(sums + 3 * (i + 1));
            before = after, tau_before = tau_after;
        }
    }
}

double LargestSwing(std::span<const Entry> entries) {
    double largest = 0;
    for (int v = 0; v < kVectors; ++v) {
        const auto color = [&](std::size_t i) { return hn::LoadU(kTag, &entries[i].color.x + v * kLanes); };
        V most[4] = {hn::Zero(kTag), hn::Zero(kTag), hn::Zero(kTag), hn::Zero(kTag)};
        V before = color(0);
        for (std::size_t i = 1; i < entries.size(); ++i) {
            const V here = color(i);
            most[i % 4] = hn::Max(most[i % 4], hn::Abs(hn::Sub(here, before)));
            before = here;
        }
        alignas(32) double lanes[kLanes];
        hn::Store(hn::Max(hn::Max(most[0], most[1]), hn::Max(most[2], most[3])), kTag, lanes);
        for (int lane = 0; lane < std::min(kLanes, 3 - v * kLanes); ++lane)
            largest = std::max(largest, lanes[lane]);
    }
    return largest;
}

std::int32_t JoinRows(const std::int32_t* depth, int stride, const std::int32_t* light, int rows,
                      std::int32_t* joined) {
    // Three words and the first of the next row, which that row's depth overwrites.
    const hn::CappedTag<std::int32_t, 4> four;
    const bool at_once = hn::MaxLanes(four) == 4;
    for (int i = 0; i < rows; ++i) {
        std::int32_t* const row = joined + 4 * i;
        row[0] = depth[stride * i];
        if (at_once && i + 1 < rows)
            hn::StoreU(hn::LoadU(four, light + 3 * i), four, row + 1);
        else
            for (int c = 0; c < 3; ++c) row[1 + c] = light[3 * i + c];
    }
    const hn::ScalableTag<std::int32_t> d;
    auto most = hn::Zero(d);
    const int lanes = static_cast<int>(hn::Lanes(d)), words = 4 * (rows - 1);
    std::int32_t rest = 0;
    int i = 0;
    for (; i + lanes <= words; i += lanes)
        most = hn::Max(most, hn::Sub(hn::LoadU(d, joined + i + 4), hn::LoadU(d, joined + i)));
    for (; i < words; ++i) rest = std::max(rest, joined[i + 4] - joined[i]);
    return std::max(rest, hn::GetLane(hn::MaxOfLanes(d, most)));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace squint
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint {

HWY_EXPORT(WriteLightSums);
HWY_EXPORT(LargestSwing);
HWY_EXPORT(JoinRows);

void write_light_sums(std::span<const Entry> entries, double step, double* sums) {
    HWY_DYNAMIC_DISPATCH(WriteLightSums)(entries, step, sums);
}
double largest_swing(std::span<const Entry> entries) {
    return HWY_DYNAMIC_DISPATCH(LargestSwing)(entries);
}
std::int32_t join_rows(const std::int32_t* depth, int stride, const std::int32_t* light, int rows,
                       std::int32_t* joined) {
    return HWY_DYNAMIC_DISPATCH(JoinRows)(depth, stride, light, rows, joined);
}

}  // namespace squint
#endif
