#include "pipeline/classification/pips.h"

#include "pipeline/preintegration/prefix_tables.h"

#include <cmath>

namespace squint {

PowerSeriesOfOrder1 build_power_series_of_order_1(const ClassificationInputs& in) {
    PowerSeriesOfOrder1 m;
    constexpr int kMostRows = 8192;
    const int bits = sub_entry_bits_for_color(in, kMostRows);
    m.prefix = build_prefix_lookup(in, bits);
    const Spec moment = in.specs[Wire::table_moment], ratio = in.specs[Wire::slab_ratio];
    const preintegration::PrefixTables tables = preintegration::build_prefix_tables(
        bits ? preintegration::subdivided(in.entries, 1 << bits) : in.entries, 1);
    const double step = std::ldexp(in.step_world, -bits);
    m.moment = Table(tables.size(), 3);
    m.moment.wire = static_cast<int>(Wire::table_moment);
    for (int c = 0; c < 3; ++c)
        for (int i = 0; i < tables.size(); ++i)
            m.moment.set(i, c,
                         tables.moment[0][static_cast<std::size_t>(c)][static_cast<std::size_t>(i)] * step,
                         moment);
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
