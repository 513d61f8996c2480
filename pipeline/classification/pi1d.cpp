#include "pipeline/classification/pi1d.h"

#include "pipeline/classification/tables/pi1d_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace squint {

PreIntegrated1D PreIntegrated1D::build(const ClassificationInputs& in) {
    using preintegration::MeanOf;
    PreIntegrated1D m;
    m.prefix = build_prefix_lookup(in);
    m.premultiplied = build_premultiplied_rules(in.specs);
    m.is_opacity = in.settings.method == Method::pi1d;
    const preintegration::RealPreIntegrated1D tables = preintegration::build_pi1d(
        in.entries, in.step_world, m.is_opacity ? MeanOf::opacity_kye : MeanOf::clamped_extinction_engel);
    const Spec sum = in.specs[Wire::table_moment];
    require_range(in.specs, Wire::table_moment, tables.sum.back(),
                  "the prefix sums of the entries' opacities");
    // With straight sums a slab of one last bit gets the mean of its entry.
    double lost = 0;
    const auto& values = tables.value;
    for (std::size_t i = 0; i + 1 < values.size(); ++i)
        lost = std::max(lost, lost_along_ray(std::abs(values[i + 1] - values[i]) / 2,
                                             std::min(values[i], values[i + 1]), in.longest_ray));
    m.curved = lost > kMayBeLeftOut && in.input_fraction > 0;
    if (!m.curved) m.straight = {"sums straight between entries", std::min(lost, 255.0)};
    m.sum_fraction = sum.format.fraction_bits;
    const int columns = (m.curved ? 2 : 1) * PreIntegrated1D::columns;
    m.sums = Table(in.entries.size(), columns, in.keeps_exact);
    m.sums.wire = static_cast<int>(Wire::table_moment);
    static_assert(PreIntegrated1D::value == 3 && PreIntegrated1D::columns == 4);
    std::vector<double> sums;
    sums.reserve(tables.sum.size() * static_cast<std::size_t>(columns));
    for (std::size_t i = 0; i < tables.sum.size(); ++i) {
        for (const std::vector<double>* column :
             {&tables.colored_sum[0], &tables.colored_sum[1], &tables.colored_sum[2], &tables.sum})
            sums.push_back((*column)[i]);
        if (!m.curved) continue;
        const std::size_t next = std::min(i + 1, values.size() - 1);
        for (const std::vector<double>* column :
             {&tables.colored[0], &tables.colored[1], &tables.colored[2], &tables.value})
            sums.push_back((*column)[next] - (*column)[i]);
    }
    Spec bend = sum;
    bend.format.is_signed = true;
    const std::array specs{sum, sum, sum, sum, bend, bend, bend, bend};
    m.sums.fill(sums, std::span(specs).first(static_cast<std::size_t>(columns)));
    m.most_rise = most_rise_of(m.sums, PreIntegrated1D::columns);
    // A sum over a span: both have an input's fraction bits; a bend adds as many and one more.
    const int mean = sum.format.fraction_bits + (m.curved ? in.input_fraction + 1 : 0);
    const auto to = [&](Wire wire) {
        Rescale quotient(mean, in.specs[wire], static_cast<int>(wire));
        quotient.divides = true;
        return quotient;
    };
    m.to_color = to(Wire::slab_color), m.to_alpha = to(Wire::slab_alpha), m.to_depth = to(Wire::slab_depth);
    return m;
}

}  // namespace squint
