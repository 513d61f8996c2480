#include "pipeline/classification/tables/moment_rows.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/classification/tables/moment_rows.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::ScalableTag<double>;
using V = hn::Vec<Tag>;
constexpr Tag kTag;
constexpr int kLanes = static_cast<int>(HWY_LANES(double));

/// One lane for each column, a few vectors a row.  A lane's sum grows by the depth or light of its entry
/// times the mean of t^k over the entry, where k is the lane's moment.
template <int kOrder>
void write_rows(const MomentSteps& steps, int first, int end, double unit, int word_fraction,
                std::int32_t* HWY_RESTRICT words) {
    const hn::Rebind<std::int32_t, Tag> half;
    constexpr int columns = 1 + 3 * kOrder, kVectors = (columns + kLanes - 1) / kLanes;
    const V one = hn::Set(kTag, 1), round = hn::Set(kTag, 0x1.8p52), in_block = hn::Set(kTag, unit);
    const V scale = hn::Set(kTag, static_cast<double>(std::int64_t{1} << word_fraction)),
            largest = hn::Set(kTag, static_cast<double>((std::int64_t{2} << word_fraction) - 1));
    V of_moment[kVectors];  // each lane's k
    V sum[kVectors];
    for (int v = 0; v < kVectors; ++v) {
        alignas(64) double k[kLanes];
        for (int lane = 0; lane < kLanes; ++lane) {
            const int column = v * kLanes + lane;
            k[lane] = column == 0 ? 0 : (column - 1) / 3;
        }
        of_moment[v] = hn::Load(kTag, k), sum[v] = hn::Zero(kTag);
    }
    V depth = hn::Zero(kTag);
    const auto put = [&] {
        for (int v = 0; v < kVectors; ++v) {
            const V raw = hn::Min(hn::Mul(sum[v], scale), largest);
            hn::StoreU(hn::DemoteTo(half, hn::Sub(hn::Add(raw, round), round)), half, words + v * kLanes);
        }
        words += columns;
    };
    put();
    for (int i = first; i < end; ++i) {
        const double* const step = steps.of(i);
        const V next = hn::Add(depth, hn::Mul(hn::Set(kTag, step[0]), in_block));
        V mean[kVectors];
        for (int v = 0; v < kVectors; ++v) mean[v] = one;
        V of_power = one, power = one;
        for (int k = 1; k < kOrder; ++k) {
            const V order = hn::Set(kTag, static_cast<double>(k));
            power = k == 1 ? depth : hn::Mul(power, depth);
            of_power =
                k == 1 ? hn::Add(next, depth) : hn::Add(hn::Mul(hn::Mul(order, next), of_power), power);
            of_power = k == 1 ? hn::Mul(of_power, hn::Set(kTag, 0.5))
                              : hn::Div(of_power, hn::Set(kTag, static_cast<double>(k + 1)));
            for (int v = 0; v < kVectors; ++v)
                mean[v] = hn::IfThenElse(hn::Eq(of_moment[v], order), of_power, mean[v]);
        }
        for (int v = 0; v < kVectors; ++v) {
            const V light = hn::Mul(hn::LoadU(kTag, step + v * kLanes), in_block);
            sum[v] = hn::Add(sum[v], hn::Mul(light, mean[v]));
        }
        depth = next;
        put();
    }
}

void WriteMomentRows(const MomentSteps& steps, int first, int end, double unit, int word_fraction,
                     std::int32_t* words) {
    switch (steps.order) {
        case 2:
            return write_rows<2>(steps, first, end, unit, word_fraction, words);
        case 3:
            return write_rows<3>(steps, first, end, unit, word_fraction, words);
        case 4:
            return write_rows<4>(steps, first, end, unit, word_fraction, words);
        default:
            return write_rows<5>(steps, first, end, unit, word_fraction, words);
    }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace squint
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint {

HWY_EXPORT(WriteMomentRows);

void write_moment_rows(const MomentSteps& steps, int first, int end, double unit, int word_fraction,
                       std::int32_t* words) {
    HWY_DYNAMIC_DISPATCH(WriteMomentRows)(steps, first, end, unit, word_fraction, words);
}

}  // namespace squint
#endif
