#include "pipeline/classification/pips.h"

#include "pipeline/preintegration/prefix_tables.h"

namespace squint {

PowerSeriesOfOrder1 build_power_series_of_order_1(const ClassificationInputs& in) {
    PowerSeriesOfOrder1 m;
    m.prefix = build_prefix_lookup(in);
    const Spec moment = in.specs[Wire::table_moment], ratio = in.specs[Wire::slab_ratio];
    const preintegration::PrefixTables tables = preintegration::build_prefix_tables(in.entries, 1);
    m.moment = Table(in.entries.size(), 3);
    m.moment.wire = static_cast<int>(Wire::table_moment);
    for (int c = 0; c < 3; ++c)
        for (int i = 0; i < in.entries.size(); ++i)
            m.moment.set(
                i, c,
                tables.moment[0][static_cast<std::size_t>(c)][static_cast<std::size_t>(i)] * in.step_world,
                moment);
    m.to_part = Rescale(moment.format.fraction_bits + in.input_fraction, moment,
                        static_cast<int>(Wire::table_moment));
    m.to_ratio = Rescale(moment.format.fraction_bits - in.specs[Wire::table_extinction].format.fraction_bits,
                         ratio, static_cast<int>(Wire::slab_ratio));
    m.one_ratio = ratio.format.one();
    return m;
}

}  // namespace squint
