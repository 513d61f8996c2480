#include "pipeline/classification/prefix.h"

#include "pipeline/classification/tables/light_sums.h"
#include "pipeline/classification/tables/linear_entries.h"
#include "pipeline/classification/tables/opaque_prediction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

namespace squint {

namespace {

// A straight T errs by half the change of extinction over a row, in a slab of one last bit at the row's end.
// A ray along which the field is even meets that slab again and again.
double lost_by_straight_lines(const Entries& rows, double step, double longest_ray) {
    double worst = 0;
    for (int i = 0; i + 1 < rows.size(); ++i) {
        const Entry &a = rows.entry[static_cast<std::size_t>(i)],
                    &b = rows.entry[static_cast<std::size_t>(i) + 1];
        const double half = std::abs(b.extinction - a.extinction) * step / 2;
        const double least = std::min(a.extinction, b.extinction) * step;
        if (255 * half * std::min(longest_ray, 1 / (least + half)) <= worst) continue;
        worst = std::max(worst, std::min(lost_along_ray(half, least, longest_ray), 255.0));
    }
    return worst;
}

}  // namespace

EntryRows rows_for_color(const ClassificationInputs& in, int most_rows) {
    if (is_as_printed(in.settings)) return {};
    double worst = largest_swing(in.entries.entry) * 2 / 3;
    if (worst <= kInsideEntry) return {0, 255 * worst};
    worst = kInsideEntry;  // never less: one row is enough for that
    for (int i = 0; i + 1 < in.entries.size(); ++i) {
        const Entry &a = in.entries.entry[static_cast<std::size_t>(i)],
                    &b = in.entries.entry[static_cast<std::size_t>(i) + 1];
        const double swing = std::max({std::abs(b.color.x - a.color.x), std::abs(b.color.y - a.color.y),
                                       std::abs(b.color.z - a.color.z)});
        // A mean weighted by extinction differs by at most two thirds of the swing from either end, and so
        // does the colour of a ray of such slabs.
        const double depth = std::max(a.extinction, b.extinction) * in.step_world * in.longest_ray;
        if (swing * 2 / 3 * std::min(depth, 1.0) > worst)  // more than its opacity allows
            worst = std::max(worst, swing * 2 / 3 * -portable::expm1(-depth));
    }
    int bits = 0;
    while (std::ldexp(worst, -bits) > kInsideEntry && bits < in.input_fraction &&
           (in.entries.size() - 1) << (bits + 1) <= most_rows)
        ++bits;
    return {bits, 255 * std::ldexp(worst, -bits)};
}

bool is_as_printed(const ClassificationSettings& settings) {
    return settings.as_printed && settings.method == Method::pips;
}

std::int64_t most_rise_of(const Table& sums, int columns) {
    std::int64_t most = 0;
    for (int i = 0; i + 1 < sums.rows(); ++i)
        for (int c = 0; c < columns; ++c) most = std::max(most, sums.word(i + 1, c) - sums.word(i, c));
    return most;
}

PrefixLookup build_prefix_lookup(const ClassificationInputs& in, int sub_entry_bits) {
    PrefixLookup p;
    p.entries = build_entry_lookup(in);
    const Spec extinction = in.specs[Wire::table_extinction], depth = in.specs[Wire::slab_depth];
    const int n = in.entries.size();
    Entries between;
    if (sub_entry_bits) between = preintegration::subdivided(in.entries, 1 << sub_entry_bits);
    const Entries& fine = sub_entry_bits ? between : in.entries;
    const double step = std::ldexp(in.step_world, -sub_entry_bits);
    const int rows = fine.size();
    p.sub_entry_bits = sub_entry_bits;
    const auto extinction_of = [&](int i) { return fine.entry[static_cast<std::size_t>(i)].extinction; };
    std::vector<double> depths(static_cast<std::size_t>(rows));
    p.as_printed = is_as_printed(in.settings);
    double sum = 0;  // trapezoids: exact for linear extinction
    for (int i = 0; i + 1 < rows; ++i) {
        const double a = extinction_of(i), b = p.as_printed ? a : extinction_of(i + 1);
        sum += 0.5 * (a + b);
        depths[static_cast<std::size_t>(i) + 1] = sum * step;
    }
    const double lost = lost_by_straight_lines(fine, in.step_world, in.longest_ray);
    p.curved = lost > kMayBeLeftOut && p.place_bits() > 0 && !p.as_printed;
    if (!p.curved) p.straight = {"T straight between its rows", lost};
    const std::size_t columns = p.curved ? 2 : 1;
    if (p.curved) {
        depths.resize(2 * depths.size());
        for (int i = rows - 1; i >= 0; --i) {
            double* const row = depths.data() + 2 * i;
            row[0] = depths[static_cast<std::size_t>(i)];
            row[1] = i + 1 < rows ? (extinction_of(i + 1) - extinction_of(i)) * step : 0;
        }
    }
    require_range(in.specs, Wire::table_extinction, sum * step,
                  "the prefix sums of the entries' optical depths");
    p.depth = Table(rows, static_cast<int>(columns), in.keeps_exact);
    p.depth.wire = static_cast<int>(Wire::table_extinction);
    Spec signed_extinction = extinction;
    signed_extinction.format.is_signed = true;
    const std::array specs{extinction, signed_extinction};
    p.depth.fill(depths, std::span(specs).first(columns));
    p.total = p.depth.word(rows - 1, 0);
    p.most_rise = most_rise_of(p.depth, 1);
    const int wire = static_cast<int>(Wire::slab_depth);
    p.to_depth = Rescale(extinction.format.fraction_bits + p.gained_bits() - in.input_fraction, depth, wire);
    p.to_depth.divides = true;
    p.to_shorter = p.entries.to_shorter;
    p.to_wall = Rescale(p.entries.color_fraction + p.entries.alpha_fraction, in.specs[Wire::slab_ratio],
                        static_cast<int>(Wire::slab_ratio));
    p.predicts = p.entries.has_opaque && in.settings.opaque_prediction != WallRule::none;
    if (p.predicts) {
        const preintegration::OpaquePrediction prediction = preintegration::predict_opaque(in.entries);
        p.walls = Table(n, 2);
        for (int i = 0; i < n; ++i) {
            p.walls.set_raw(i, 0, prediction.up[static_cast<std::size_t>(i)]);
            p.walls.set_raw(i, 1, p.as_printed ? -1 : prediction.down[static_cast<std::size_t>(i)]);
        }
    }
    return p;
}

std::shared_ptr<const preintegration::ExactSeries> exact_series_of(const ClassificationInputs& in) {
    preintegration::ExactSeries series = preintegration::build_exact_series(
        in.entries, in.settings.order_or_least(), in.settings.method == Method::leg,
        in.settings.opaque_prediction != WallRule::none);
    series.step = in.step_world;
    return std::make_shared<const preintegration::ExactSeries>(std::move(series));
}

PremultipliedRules build_premultiplied_rules(const WireSpecs& specs) {
    const Spec color = specs[Wire::slab_color];
    const int alpha = specs[Wire::slab_alpha].format.fraction_bits, wire = static_cast<int>(Wire::slab_color);
    PremultipliedRules rules;
    rules.to_product = Rescale(specs[Wire::slab_ratio].format.fraction_bits + alpha, color, wire);
    rules.to_scaled = Rescale(color.format.fraction_bits, color, wire);
    rules.to_scaled.divides = true;
    rules.finer = color.format.fraction_bits - alpha;
    rules.one_color = std::min(color.format.one(), color.format.largest());
    return rules;
}

}  // namespace squint
