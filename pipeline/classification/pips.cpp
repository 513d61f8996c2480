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
    for (int i = 0; i + 1 < m.moment.rows(); ++i) {
        m.most_rise = std::max(m.most_rise, m.prefix.depth.word(i + 1, 0) - m.prefix.depth.word(i, 0));
        for (int c = 0; c < 3; ++c)
            m.most_rise = std::max(m.most_rise, m.moment.word(i + 1, c) - m.moment.word(i, c));
    }
    if (m.prefix.depth.narrow() && m.moment.narrow()) {
        std::vector<std::int32_t> rows;
        for (int i = 0; i < m.moment.rows(); ++i) {
            rows.push_back(static_cast<std::int32_t>(m.prefix.depth.word(i, 0)));
            for (int c = 0; c < 3; ++c) rows.push_back(static_cast<std::int32_t>(m.moment.word(i, c)));
        }
        m.rows = std::make_shared<const std::vector<std::int32_t>>(std::move(rows));
    }
    return m;
}

}  // namespace squint
