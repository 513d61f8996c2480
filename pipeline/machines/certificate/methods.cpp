#include "pipeline/machines/certificate/methods.h"

#include "core/portable_math.h"
#include "pipeline/classification/entries-inl.h"
#include "pipeline/classification/methods-inl.h"
#include "pipeline/classification/tables/legendre.h"
#include "pipeline/classification/tables/power_series.h"
#include "pipeline/machines/certificate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace squint {

using namespace HWY_NAMESPACE;

Slab<Bounded> classify(const BoundedPostClassification& m, const Bounded& input, const Bounded&,
                       const Bounded& length) {
    const EntryLookup& e = m.words.entries;
    const Function& f = m.function;
    const Slab<Int128> word = HWY_NAMESPACE::classify_point(e, input.v, length.v);

    const double unit = std::ldexp(1.0, -e.input_fraction), full = std::ldexp(1.0, e.length_fraction);
    const double x = std::min(in_double(input.v) * unit, static_cast<double>(f.last())),
                 off = input.most() * unit;
    const double low = std::max(x - off, 0.0), high = std::min(x + off, static_cast<double>(f.last()));
    const double l = in_double(length.v) / full, l_off = length.most() / full;
    const auto to_input = [&](Shares& shares, double swing) {
        if (swing > 0) shares.add(input.error, swing / (off / unit));
    };

    Slab<Bounded> slab;
    const double color_one = std::ldexp(1.0, e.color_fraction);
    for (std::size_t c = 0; c < 3; ++c) {
        const double here = f.at(c, x);
        Shares error;
        to_input(error, f.over(c, low, high).from(here) * color_one);
        add_local(error, std::abs(in_double(word.color[c]) - here * color_one),
                  {{index_of(Wire::slab_ratio), unit_of(e.to_color)},
                   {index_of(Wire::table_color),
                    0.5 * std::ldexp(1.0, e.color_fraction - e.table_color_fraction)}});
        slab.color[c] = with_error(word.color[c], error);
    }

    // The opacity: of the point itself first, opaque or not; then of what else the input may be.
    const double alpha_one = std::ldexp(1.0, e.alpha_fraction), got = in_double(word.alpha) / alpha_one;
    const Function::Opaque here = f.opaque(x, x), near = f.opaque(low, high);
    const double depth = f.at(Function::depth, x) * l;
    const Reach depths = f.over(Function::depth, low, high);
    const Reach curve{opacity_of(depths.low * std::max(l - l_off, 0.0)),
                      opacity_of(depths.high * std::min(l + l_off, 1.0))};
    Shares error;
    if (near.all) {
        add_local(error, std::abs(got - 1), {{index_of(Wire::slab_alpha), 0.0}});
    } else if (here.any) {
        // Opaque, but perhaps missed: then anything that the curve has there.
        error[kWallsPay] += std::max(got - curve.low, 0.0);
        add_local(error, std::abs(got - 1), {{index_of(Wire::slab_alpha), 0.0}});
    } else {
        const double exact = opacity_of(depth), decay = 1 - curve.low;
        const double u_alpha = unit_of(e.to_alpha) / alpha_one;
        if (length.v < (Int128{1} << e.length_fraction) || l_off > 0) {
            const double extinction = 0.5 * std::ldexp(l * decay, -e.extinction_fraction),
                         depth_unit = std::ldexp(decay, -e.opacity.depth_fraction);
            add_local(error, std::abs(got - exact),
                      {{index_of(Wire::table_extinction), extinction},
                       {index_of(Wire::slab_depth), depth_unit},
                       {index_of(Wire::slab_alpha), unit_of(e.opacity.to_alpha) / alpha_one}});
            // What is left of the curve's swing where the length is what it is.
            const double swing =
                std::max(opacity_of(depths.high * l) - exact, exact - opacity_of(depths.low * l));
            to_input(error, swing);
            if (l_off > 0) error.add(length.error, std::max(curve.from(exact) - swing, 0.0) / length.most());
        } else {
            const EntryPosition<Int128> row = sub_entry_position(e, e.row_bits, input.v);
            const double way = std::ldexp(in_double(row.fraction), e.row_bits - e.input_fraction);
            const double from = std::ldexp(in_double(row.entry), -e.row_bits),
                         to = std::min(from + std::ldexp(1.0, -e.row_bits), static_cast<double>(f.last()));
            const double a = opacity_of(f.at(Function::depth, from)),
                         b = opacity_of(f.at(Function::depth, to));
            const double chord = a + way * (b - a);
            error[kRowsPay] += std::abs(chord - exact);
            const int table_fraction = e.to_alpha.shift + e.alpha_fraction - (e.input_fraction - e.row_bits);
            add_local(error, std::abs(got - chord),
                      {{index_of(Wire::slab_alpha), u_alpha},
                       {index_of(Wire::table_alpha), 0.5 * std::ldexp(1.0, -table_fraction)}});
            to_input(error, curve.from(exact));
        }
        if (near.any) error[kWallsPay] += std::max(1 - curve.high, 0.0);
    }
    slab.alpha = with_error(word.alpha, error.scaled(alpha_one));
    return slab;
}

SeriesKernel series_kernel(int order, bool legendre) {
    using preintegration::legendre_split_depth;
    using preintegration::trusted_depth;
    // Greatest values over [0, trusted_depth] and [0, legendre_split_depth], rounded up.
    constexpr double kPips[][3] = {{2, 2, 2}, {1.6, 3, 1.13}, {2.07, 3.1, 1.22}, {2.5, 11, 2.4}};
    constexpr double kLeg[][3] = {{1.8, 1.5, 0.5}, {2, 2.7, 0.8}, {2.8, 6.5, 1.2}};
    if (order == 1) return {};
    const auto& of = legendre ? kLeg[order - 2] : kPips[order - 2];
    return {of[0], of[1], of[2], legendre ? legendre_split_depth(order) : trusted_depth(order)};
}
Slab<Bounded> classify(const BoundedPowerSeries& m, const Bounded& front, const Bounded& back,
                       const Bounded& length) {
    const PrefixLookup& prefix =
        std::visit([](auto* words) -> const PrefixLookup& { return words->prefix; }, m.words);
    const EntryLookup& e = prefix.entries;
    const Function& f = m.function;
    const Slab<Int128> word = std::visit(
        [&](auto* words) { return HWY_NAMESPACE::classify(*words, front.v, back.v, length.v); }, m.words);

    const double unit = std::ldexp(1.0, -e.input_fraction), full = std::ldexp(1.0, e.length_fraction);
    const auto last = static_cast<double>(f.last());
    const double from = std::min(in_double(front.v) * unit, last),
                 to = std::min(in_double(back.v) * unit, last);
    const double from_off = front.most() * unit, to_off = back.most() * unit;
    const double low = std::max(std::min(from - from_off, to - to_off), 0.0),
                 high = std::min(std::max(from + from_off, to + to_off), last);
    const double l = in_double(length.v) / full, l_off = length.most() / full;
    const preintegration::SlabValue here = m.exact.slab(from, to, l * m.exact.step);
    // A slab whose word has no length has a colour all the same.
    const preintegration::SlabValue seen = here.alpha > 0 ? here : m.exact.slab(from, to, m.exact.step);
    const double alpha_one = std::ldexp(1.0, e.alpha_fraction), color_one = std::ldexp(1.0, e.color_fraction);
    const bool decided = front.exact && back.exact && length.exact;

    // What the word is off by at its own inputs is known; what no wire says the rows do.
    Shares alpha_error;
    const double got = in_double(word.alpha) / alpha_one, decay = 1 - here.alpha;
    const double rise = std::ldexp(1.0, prefix.sub_entry_bits - e.extinction_fraction);
    add_local(alpha_error, std::abs(got - here.alpha),
              {{index_of(Wire::slab_alpha), unit_of(e.opacity.to_alpha) / alpha_one},
               {index_of(Wire::slab_depth), std::ldexp(decay, -e.opacity.depth_fraction)},
               {index_of(Wire::table_extinction), decay * l * rise},
               {kRowsPay, 0.0}});
    std::array<Shares, 3> color_error;
    std::array<double, 3> straight{};
    for (std::size_t c = 0; c < 3; ++c) {
        if (seen.alpha > 0) straight[c] = seen.color[static_cast<int>(c)] / seen.alpha;
        add_local(color_error[c], std::abs(in_double(word.color[c]) / color_one - straight[c]),
                  {{index_of(Wire::slab_ratio), std::ldexp(1.0, -e.color_fraction)}, {kRowsPay, 0.0}});
    }

    // Both ends' displacement, by who makes it; `of` of them together.
    const auto to_ends = [&](Shares& shares, double error, double of_front, double of_back,
                             double of_length) {
        const double all = of_front + of_back + of_length;
        if (!(error > 0) || !(all > 0)) return;
        if (of_front > 0) shares.add(front.error, error * of_front / all / front.most());
        if (of_back > 0) shares.add(back.error, error * of_back / all / back.most());
        if (of_length > 0) shares.add(length.error, error * of_length / all / length.most());
    };
    const Reach depths = f.over(Function::depth, low, high);
    const Function::Opaque near = f.opaque(low, high);
    if (decided) {
        // Nothing to move.
    } else if (!near.any) {
        const double steep = f.slope(Function::depth, low, high);
        const double by_front = l * steep * from_off / 2, by_back = l * steep * to_off / 2,
                     by_length = l_off * depths.high;
        const double shift = by_front + by_back + by_length, depth = -portable::log1p(-here.alpha);
        const Reach moved{opacity_of(std::max(depth - shift, std::max(l - l_off, 0.0) * depths.low)),
                          opacity_of(std::min(depth + shift, std::min(l + l_off, 1.0) * depths.high))};
        to_ends(alpha_error, std::max(moved.from(here.alpha), 0.0), by_front, by_back, by_length);
        // x dK = int (c - K) dtau + int tau dc.
        const double mean = l > 0 ? depth / l : -portable::log1p(-seen.alpha),
                     least = std::max(mean - steep * (from_off + to_off) / 2, depths.low);
        const double outside = std::numeric_limits<double>::infinity();
        // The share of the depth that the ends' displacement adds or takes.
        const double all_depth = mean * std::abs(to - from), moved_depth = depths.high * (from_off + to_off),
                     share = all_depth > moved_depth ? moved_depth / (all_depth - moved_depth) : outside;
        const SeriesKernel& k = m.kernel;
        for (std::size_t c = 0; c < 3; ++c) {
            const Reach colors = f.over(c, low, high);
            const double swing = colors.high - colors.low;
            const double all = colors.from(straight[c]) + (k.most - 1) * swing;
            double by_ends = outside;
            if (m.exact.order == 1 || (!m.exact.legendre && depth - shift > k.up_to)) {
                if (least > 0 && seen.alpha > 0)
                    by_ends = swing * steep * (from_off + to_off) / 2 / least +
                              f.slope(c, low, high) * std::max(from_off, to_off);
            } else if (depth + shift <= k.up_to) {
                by_ends = swing / 2 * ((3 * k.most + 2 * k.slope) * share + k.by_depth * shift);
            }
            to_ends(color_error[c], std::min(all, by_ends), from_off, to_off, l_off);
        }
    } else {
        // The first opaque place on the way, and whether both ways surely meet it.
        const auto around = [&](double at, double off) {
            return f.opaque(std::max(at - off, 0.0), std::min(at + off, last));
        };
        const Function::Opaque at_front = around(from, from_off);
        const std::optional<double> wall = m.exact.prediction.first(from, to);
        const double way = from < to ? 1 : -1;
        const bool meets =
            !at_front.any && wall && (*wall - from) * way > from_off && (to - *wall) * way > to_off;
        Reach reach[3];
        for (std::size_t c = 0; c < 3; ++c) reach[c] = f.over(c, low, high);
        if (at_front.all) {
            for (std::size_t c = 0; c < 3; ++c)
                to_ends(
                    color_error[c],
                    f.slope(c, std::max(from - from_off, 0.0), std::min(from + from_off, last)) * from_off,
                    from_off, 0, 0);
        } else if (meets) {
            // The part before the wall changes in length and in depth.
            const double span = std::abs(to - from) - from_off - to_off,
                         part = std::abs(*wall - from) / std::abs(to - from);
            const double a = std::min(from - way * from_off, *wall),
                         b = std::max(from - way * from_off, *wall);
            const double steep = f.slope(Function::depth, std::max(a, 0.0), std::min(b, last));
            const double deep = f.over(Function::depth, std::max(a, 0.0), std::min(b, last)).high;
            const double moves =
                l * (deep * (from_off + to_off) / span + part * steep * from_off) + l_off * deep;
            const double of_order =
                m.exact.order == 1 ? 0 : (3 * m.kernel.most + 2 * m.kernel.slope + m.kernel.by_depth) / 2;
            for (std::size_t c = 0; c < 3; ++c) {
                const double swing = reach[c].high - reach[c].low;
                to_ends(color_error[c],
                        std::min(reach[c].from(straight[c]),
                                 (2 + of_order) * swing * moves +
                                     f.slope(c, std::max(a, 0.0), std::min(b, last)) * from_off),
                        from_off, to_off, l_off > 0 ? l_off : 0);
            }
        } else {
            const double least = opacity_of(depths.low * std::max(l - l_off, 0.0));
            alpha_error[kWallsPay] += std::max(1 - here.alpha, here.alpha - least);
            for (std::size_t c = 0; c < 3; ++c)
                color_error[c][kWallsPay] += std::max(reach[c].from(straight[c]), 0.0);
        }
    }
    Slab<Bounded> slab;
    for (std::size_t c = 0; c < 3; ++c)
        slab.color[c] = with_error(word.color[c], color_error[c].scaled(color_one));
    slab.alpha = with_error(word.alpha, alpha_error.scaled(alpha_one));
    return slab;
}

}  // namespace squint
