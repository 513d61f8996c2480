#include "pipeline/classification/tables/exact_series.h"

#include "core/portable_math.h"
#include "pipeline/classification/tables/legendre.h"
#include "pipeline/classification/tables/pieces.h"

#include <algorithm>
#include <cmath>

namespace squint::preintegration {

SlabValue ExactSeries::one_piece(double front, double back, double length) const {
    if (front == back) return point_slab(entries, front, length);
    const Moments m = tables.moments(front, back, length, order);
    if (!(m.depth > 0)) return {};
    const double alpha = -portable::expm1(-m.depth);
    // The powers of a nearly transparent slab underflow: its colour is the mean.
    const Vec3 color = m.depth < 1e-30 ? m.q[0] / m.depth
                       : legendre      ? legendre_color(m, order) / alpha
                                       : power_series_color(m, m.depth <= trusted_depth(order) ? order : 1);
    return {range.clamp(color) * alpha, alpha};
}

SlabValue ExactSeries::in_pieces(double front, double back, double length, double depth) const {
    const double rate = length / std::abs(back - front);
    const double start = tables.entry.depth_at(front), end = tables.entry.depth_at(back);
    const double share = std::min(1.0 / pieces, legendre_split_depth(order) / depth);
    double here = front;
    return composited(pieces, depth, 0, [&](int piece) {
        const double target =
            std::clamp(start + (end - start) * share * piece, std::min(start, end), std::max(start, end));
        const double next = piece == pieces ? back
                                            : std::clamp(tables.entry.coordinate_at(target),
                                                         std::min(front, back), std::max(front, back));
        SlabValue value = one_piece(here, next, rate * std::abs(next - here));
        here = next;
        return value;
    });
}

SlabValue ExactSeries::slab(double front, double back, double length) const {
    const RealCutSlab cut = cut_at_opaque(entries, prediction, front, back, length);
    if (cut.wall && cut.length == 0) return {cut.wall_color, 1};
    if (cut.front == cut.back) return point_slab(entries, cut.front, cut.length);
    if (!legendre) return cut.over_wall(one_piece(cut.front, cut.back, cut.length));
    const double depth = tables.moments(cut.front, cut.back, cut.length, 1).depth;
    return cut.over_wall(depth <= legendre_split_depth(order)
                             ? one_piece(cut.front, cut.back, cut.length)
                             : in_pieces(cut.front, cut.back, cut.length, depth));
}

ExactSeries build_exact_series(const Entries& entries, int order, bool legendre, bool predicts) {
    ExactSeries series{.entries = entries,
                       .prediction = predict_opaque(entries),
                       .range = color_range(entries),
                       .tables = build_disjoint_tables(entries, order),
                       .order = order,
                       .legendre = legendre};
    series.prediction.any = series.prediction.any && predicts;
    return series;
}

}  // namespace squint::preintegration
