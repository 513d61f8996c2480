#include "pipeline/classification/pi1d.h"

#include "pipeline/classification/tables/pi1d_table.h"

namespace squint {

PreIntegrated1D build_pre_integrated_1d(const ClassificationInputs& in) {
    using preintegration::MeanOf;
    PreIntegrated1D m;
    m.prefix = build_prefix_lookup(in);
    m.premultiplied = build_premultiplied_rules(in.specs);
    m.is_opacity = in.settings.method == Method::pi1d;
    const preintegration::PreIntegrated1D tables = preintegration::build_pi1d(
        in.entries, in.step_world, m.is_opacity ? MeanOf::opacity_kye : MeanOf::clamped_extinction_engel);
    const Spec sum = in.specs[Wire::table_moment];
    require_range(in.specs, Wire::table_moment, tables.sum.back(),
                  "the prefix sums of the entries' opacities");
    m.sums = Table(in.entries.size(), PreIntegrated1D::columns, in.keeps_exact);
    m.sums.wire = static_cast<int>(Wire::table_moment);
    static_assert(PreIntegrated1D::value == 3 && PreIntegrated1D::columns == 4);
    std::vector<double> sums;
    sums.reserve(tables.sum.size() * 4);
    for (std::size_t i = 0; i < tables.sum.size(); ++i)
        for (const std::vector<double>* column :
             {&tables.colored_sum[0], &tables.colored_sum[1], &tables.colored_sum[2], &tables.sum})
            sums.push_back((*column)[i]);
    m.sums.fill(sums, std::array{sum, sum, sum, sum});
    m.most_rise = most_rise_of(m.sums, PreIntegrated1D::columns);
    const int mean =
        sum.format.fraction_bits;  // of a sum with input_fraction bits more over a span with them
    const auto to = [&](Wire wire) {
        Rescale quotient(mean, in.specs[wire], static_cast<int>(wire));
        quotient.divides = true;
        return quotient;
    };
    m.to_color = to(Wire::slab_color), m.to_alpha = to(Wire::slab_alpha), m.to_depth = to(Wire::slab_depth);
    return m;
}

}  // namespace squint
