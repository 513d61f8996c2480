#include "pipeline/classification/pips.h"

#include "pipeline/preintegration/prefix_tables.h"

#include <array>
#include <cmath>

namespace squint {

PowerSeriesOfOrder1 build_power_series_of_order_1(const ClassificationInputs& in) {
    PowerSeriesOfOrder1 m;
    constexpr int kMostRows = 8192;
    const int bits = sub_entry_bits_for_color(in, kMostRows);
    m.prefix = build_prefix_lookup(in, bits);
    const Spec moment = in.specs[Wire::table_moment], ratio = in.specs[Wire::slab_ratio];
    Entries between;
    if (bits) between = preintegration::subdivided(in.entries, 1 << bits);
    const std::vector<Entry>& entry = bits ? between.entry : in.entries.entry;
    const double step = std::ldexp(in.step_world, -bits);
    std::vector<double> sums(entry.size() * 3);
    Vec3 sum{0, 0, 0};
    for (std::size_t i = 0; i + 1 < entry.size(); ++i)
        for (int c = 0; c < 3; ++c) {
            sum[c] += preintegration::colored_depth(entry[i].color[c], entry[i].extinction,
                                                    entry[i + 1].color[c], entry[i + 1].extinction);
            sums[3 * (i + 1) + static_cast<std::size_t>(c)] = sum[c] * step;
        }
    m.moment = Table(static_cast<int>(entry.size()), 3, in.keeps_exact);
    m.moment.wire = static_cast<int>(Wire::table_moment);
    m.moment.fill(sums, std::array{moment, moment, moment});
    m.to_ratio = Rescale(moment.format.fraction_bits - in.specs[Wire::table_extinction].format.fraction_bits,
                         ratio, static_cast<int>(Wire::slab_ratio));
    m.to_ratio.divides = true;
    m.one_ratio = ratio.format.one();
    m.to_ratio.highest = std::min(m.to_ratio.highest, m.one_ratio);  // a mean of colours
    const std::int32_t *depth = m.prefix.depth.narrow(), *colored = m.moment.narrow();
    const int stride = m.prefix.depth.columns(), n = m.moment.rows();
    if (!depth || !colored) {  // no 32-bit lanes for such words
        m.most_rise = m.prefix.total + 1;
        return m;
    }
    std::vector<std::int32_t> rows(static_cast<std::size_t>(4 * n));
    std::int32_t most_rise = 0;
    for (int i = 0; i < n; ++i) {
        std::int32_t* row = rows.data() + 4 * i;
        row[0] = depth[stride * i];
        for (int c = 0; c < 3; ++c) row[1 + c] = colored[3 * i + c];
        for (int c = 0; i > 0 && c < 4; ++c) most_rise = std::max(most_rise, row[c] - row[c - 4]);
    }
    m.most_rise = most_rise;
    m.rows = std::make_shared<const std::vector<std::int32_t>>(std::move(rows));
    return m;
}

}  // namespace squint
