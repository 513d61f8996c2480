// Fills tables: with SIMD where their rounding is the usual one.
#include "fixedpoint/table.h"

#include <algorithm>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fixedpoint/table.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// scale, low and high repeat after `period` values, a multiple of every vector's lanes.  Returns false where
/// a word needs more than 32 bits; without kMayBeWide the limits exclude that.
template <bool kMayBeWide>
bool quantised(const double* HWY_RESTRICT values, std::size_t count, const double* HWY_RESTRICT scale,
               const double* HWY_RESTRICT low, const double* HWY_RESTRICT high, std::size_t period,
               std::int32_t* HWY_RESTRICT words) {
    const hn::ScalableTag<double> d;
    const hn::Rebind<std::int32_t, decltype(d)> half;
    const auto round = hn::Set(d, 0x1.8p52);
    auto smallest = hn::Zero(d), largest = hn::Zero(d);
    std::size_t i = 0, at = 0;
    for (; i + hn::Lanes(d) <= count; i += hn::Lanes(d)) {
        const auto scaled = hn::Mul(hn::LoadU(d, values + i), hn::LoadU(d, scale + at));
        const auto limited = hn::Min(hn::Max(scaled, hn::LoadU(d, low + at)), hn::LoadU(d, high + at));
        const auto whole =
            hn::IfThenElseZero(hn::Eq(scaled, scaled), hn::Sub(hn::Add(limited, round), round));
        if constexpr (kMayBeWide) smallest = hn::Min(smallest, whole), largest = hn::Max(largest, whole);
        hn::StoreU(hn::DemoteTo(half, whole), half, words + i);
        at = at + hn::Lanes(d) == period ? 0 : at + hn::Lanes(d);
    }
    for (; i < count; ++i, ++at) {
        const double scaled = values[i] * scale[at];
        const double limited = std::min(std::max(scaled, low[at]), high[at]);
        const double whole = scaled == scaled ? (limited + 0x1.8p52) - 0x1.8p52 : 0;
        smallest = hn::Min(smallest, hn::Set(d, whole)), largest = hn::Max(largest, hn::Set(d, whole));
        words[i] = static_cast<std::int32_t>(std::clamp(whole, -0x1p31, 0x1p31 - 1));
    }
    return hn::AllTrue(d,
                       hn::And(hn::Ge(smallest, hn::Set(d, -0x1p31)), hn::Lt(largest, hn::Set(d, 0x1p31))));
}

bool QuantiseRows(const double* HWY_RESTRICT values, std::size_t count, const double* HWY_RESTRICT scale,
                  const double* HWY_RESTRICT low, const double* HWY_RESTRICT high, std::size_t period,
                  std::int32_t* HWY_RESTRICT words) {
    const bool narrow =
        *std::min_element(low, low + period) >= -0x1p31 && *std::max_element(high, high + period) < 0x1p31;
    return (narrow ? quantised<false> : quantised<true>)(values, count, scale, low, high, period, words);
}

/// Returns false where a word has more than 16 bits.
bool PairRows(const std::int32_t* HWY_RESTRICT words, std::size_t count, std::int32_t* HWY_RESTRICT paired) {
    const hn::ScalableTag<std::int32_t> d;
    const auto less = hn::Set(d, static_cast<std::int32_t>(0x80008000u));
    auto any = hn::Zero(d);
    std::size_t i = 0;
    for (; i + 4 + hn::Lanes(d) <= count; i += hn::Lanes(d)) {
        const auto here = hn::LoadU(d, words + i), next = hn::LoadU(d, words + i + 4);
        any = hn::Or(any, here);
        hn::StoreU(hn::Xor(hn::Or(here, hn::ShiftLeft<16>(next)), less), d, paired + i);
    }
    std::uint32_t rest = 0;
    for (; i < count; ++i) {
        const auto here = static_cast<std::uint32_t>(words[i]),
                   next = static_cast<std::uint32_t>(words[i + 4 < count ? i + 4 : i]);
        rest |= here;
        paired[i] = static_cast<std::int32_t>((here | next << 16) ^ 0x80008000u);
    }
    return hn::AllTrue(d, hn::Eq(hn::ShiftRight<16>(any), hn::Zero(d))) && rest >> 16 == 0;
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace squint
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint {

HWY_EXPORT(QuantiseRows);
HWY_EXPORT(PairRows);

namespace {

constexpr std::size_t kMostLanes = 8;  // doubles a vector

bool fits_32_bits(std::int64_t raw) {
    return raw >= std::numeric_limits<std::int32_t>::min() && raw <= std::numeric_limits<std::int32_t>::max();
}

}  // namespace

bool quantise_rows(std::span<const double> values, std::span<const double> scale, std::span<const double> low,
                   std::span<const double> high, std::int32_t* words) {
    const std::size_t columns = scale.size(), period = columns * kMostLanes;
    std::vector<double> pattern(3 * period);
    for (std::size_t i = 0; i < period; ++i)
        pattern[i] = scale[i % columns], pattern[period + i] = low[i % columns],
        pattern[2 * period + i] = high[i % columns];
    return HWY_DYNAMIC_DISPATCH(QuantiseRows)(values.data(), values.size(), pattern.data(),
                                              pattern.data() + period, pattern.data() + 2 * period, period,
                                              words);
}

Table::Table(int rows, int columns, bool keeps_exact)
    : rows_(rows), columns_(columns), data_(std::make_shared<Data>()) {
    data_->size = static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
    if (keeps_exact) data_->exact.assign(data_->size, 0);
}

void Table::widen() {
    data_->wide = std::make_unique<std::int64_t[]>(data_->size);
    if (data_->narrow) std::copy_n(data_->narrow.get(), data_->size, data_->wide.get());
    data_->narrow.reset();
}

void Table::put(std::size_t at, double exact_raw, std::int64_t raw) {
    if (!data_->exact.empty()) data_->exact[at] = exact_raw;
    if (!data_->wide && !data_->narrow) data_->narrow = std::make_unique<std::int32_t[]>(data_->size);
    if (!data_->wide && !fits_32_bits(raw)) widen();
    if (data_->narrow)
        data_->narrow[at] = static_cast<std::int32_t>(raw);
    else
        data_->wide[at] = raw;
}

void Table::fill(std::span<const double> values, std::span<const Spec> columns) {
    assert(values.size() == data_->size && columns.size() == static_cast<std::size_t>(columns_));
    std::vector<double> scale, low, high;
    bool usual = true;
    for (const Spec& spec : columns) {
        usual = usual && spec.rounding == Rounding::rnd_conv && spec.overflow == Overflow::sat &&
                spec.format.width() <= 51;
        scale.push_back(static_cast<double>(spec.format.one()));
        low.push_back(static_cast<double>(spec.format.smallest()));
        high.push_back(static_cast<double>(spec.format.largest()));
    }
    if (usual) {
        data_->narrow = std::make_unique_for_overwrite<std::int32_t[]>(data_->size);
        usual = quantise_rows(values, scale, low, high, data_->narrow.get());
        for (std::size_t i = 0; i < data_->exact.size(); ++i)
            data_->exact[i] = values[i] * scale[i % columns.size()];
        if (usual) return;
    }
    std::vector<Rescale> to;
    for (const Spec& spec : columns) to.emplace_back(spec.format.fraction_bits, spec);
    for (std::size_t i = 0, c = 0; i < values.size(); ++i, c = c + 1 == columns.size() ? 0 : c + 1)
        put(i, values[i] * scale[c], quantise_real(values[i], scale[c], to[c]));
}

void Table::pair_rows() {
    data_->paired.reset();
    if (columns_ != 4 || !data_->narrow) return;
    data_->paired = std::make_unique_for_overwrite<std::int32_t[]>(data_->size);
    if (!HWY_DYNAMIC_DISPATCH(PairRows)(data_->narrow.get(), data_->size, data_->paired.get()))
        data_->paired.reset();
}

}  // namespace squint
#endif
