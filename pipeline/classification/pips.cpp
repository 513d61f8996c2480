#include "pipeline/classification/pips.h"

#include "pipeline/classification/tables/light_sums.h"
#include "pipeline/classification/tables/linear_entries.h"

#include <array>
#include <cmath>
#include <memory>
#include <span>

namespace squint {

namespace {

/// X1 of the pseudo code, its index put right: colour n meets the depth of entry n.
void write_light_sums_as_printed(const std::vector<Entry>& entries, double step, double* sums) {
    Vec3 sum{0, 0, 0};
    for (std::size_t i = 0; i < entries.size(); ++i) {
        for (int c = 0; c < 3; ++c) sums[3 * i + static_cast<std::size_t>(c)] = sum[c];
        sum += entries[i].color * (entries[i].extinction * step);
    }
}

}  // namespace

PowerSeriesOfOrder1 PowerSeriesOfOrder1::build(const ClassificationInputs& in) {
    PowerSeriesOfOrder1 m;
    const EntryRows color_rows = rows_for_color(in, kMostEntryRows);
    const int bits = color_rows.bits;
    m.rows_of_color = {"the mean colour of a row of X1", color_rows.lsb8};
    m.prefix = build_prefix_lookup(in, bits);
    if (in.keeps_exact && !m.prefix.as_printed) m.exact = exact_series_of(in);
    const Spec moment = in.specs[Wire::table_moment], ratio = in.specs[Wire::slab_ratio];
    Entries between;
    if (bits) between = preintegration::subdivided(in.entries, 1 << bits);
    const std::vector<Entry>& entry = bits ? between.entry : in.entries.entry;
    const double step = std::ldexp(in.step_world, -bits);
    const std::unique_ptr<double[]> sums = std::make_unique_for_overwrite<double[]>(3 * entry.size() + 1);
    if (m.prefix.as_printed)
        write_light_sums_as_printed(entry, step, sums.get());
    else
        write_light_sums(entry, step, sums.get());
    m.moment = Table(static_cast<int>(entry.size()), 3, in.keeps_exact);
    m.moment.wire = static_cast<int>(Wire::table_moment);
    m.moment.fill(std::span(sums.get(), 3 * entry.size()), std::array{moment, moment, moment});
    m.to_ratio = Rescale(moment.format.fraction_bits - in.specs[Wire::table_extinction].format.fraction_bits,
                         ratio, static_cast<int>(Wire::slab_ratio));
    m.to_ratio.divides = true;
    m.one_ratio = ratio.format.one();
    m.to_ratio.highest = std::min(m.to_ratio.highest, m.one_ratio);  // no mean exceeds its colours
    const std::int32_t *depth = m.prefix.depth.narrow(), *colored = m.moment.narrow();
    const int stride = m.prefix.depth.columns(), n = m.moment.rows();
    if (!depth || !colored) {  // 32-bit lanes cannot hold such words
        m.most_rise = m.prefix.total + 1;
        return m;
    }
    std::vector<std::int32_t> rows(static_cast<std::size_t>(4 * n));
    m.most_rise = join_rows(depth, stride, colored, n, rows.data());
    m.rows = std::make_shared<const std::vector<std::int32_t>>(std::move(rows));
    return m;
}

}  // namespace squint
