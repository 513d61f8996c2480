#include "pipeline/machines/certificate/premultiplied.h"

#include "core/portable_math.h"
#include "pipeline/classification/methods-inl.h"
#include "pipeline/machines/certificate.h"
#include "pipeline/machines/certificate/slab_ends.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace squint {

using namespace HWY_NAMESPACE;

namespace {

/// Of c alpha, and of alpha.
struct SlabReach {
    std::array<Reach, 3> color;
    Reach alpha;
    void take(const SlabReach& other) {
        for (std::size_t c = 0; c < 3; ++c)
            color[c].take(other.color[c].low), color[c].take(other.color[c].high);
        alpha.take(other.alpha.low), alpha.take(other.alpha.high);
    }
};
/// The colour of `part` with another opacity: C alpha' / alpha.
SlabReach with_opacity(const SlabReach& part, const Reach& alpha) {
    SlabReach slab{{}, alpha};
    for (std::size_t c = 0; c < 3; ++c) {
        const Reach& color = part.color[c];
        const double least = part.alpha.high > 0 ? std::min(color.low / part.alpha.high, 1.0) : 0,
                     most = part.alpha.low > 0 ? std::min(color.high / part.alpha.low, 1.0) : 1;
        slab.color[c] = {least * alpha.low, most * alpha.high};
    }
    return slab;
}
/// A wall of colour `wall` behind `part`.
SlabReach before_wall(const SlabReach& part, const std::array<double, 3>& wall) {
    SlabReach slab{{}, {1, 1}};
    for (std::size_t c = 0; c < 3; ++c)
        slab.color[c] = {part.color[c].low + wall[c] * (1 - part.alpha.high),
                         std::min(part.color[c].high + wall[c] * (1 - part.alpha.low), 1.0)};
    return slab;
}

/// `full(front, back, least part, most part)`: all that a full slab's tables give over two intervals of inputs, of
/// which a wall lets that part of the way be seen.
template <class Method, class Full>
Slab<Bounded> classify_within(const Method& m, const Bounded& front, const Bounded& back,
                              const Bounded& length, bool keeps_own_depth, const Full& full) {
    const PrefixLookup& prefix = m.words.prefix;
    const EntryLookup& e = prefix.entries;
    const Function& f = m.function;
    const Slab<Int128> word = HWY_NAMESPACE::classify(m.words, front.v, back.v, length.v);
    const SlabEnds s(e, f, front, back, length);

    // The same slab without rounding, from the word's own inputs.
    const EntryLookup& exact = m.real.prefix.entries;
    const auto raw = [](double x, int fraction) { return Real<double>{std::ldexp(x, fraction)}; };
    const Slab<Real<double>> there =
        HWY_NAMESPACE::classify(m.real, raw(s.from, exact.input_fraction), raw(s.to, exact.input_fraction),
                                raw(s.l, exact.length_fraction));
    const double color_unit = 1 / static_cast<double>(m.words.premultiplied.one_color),
                 alpha_unit = std::ldexp(1.0, -e.alpha_fraction),
                 exact_color = 1 / static_cast<double>(m.real.premultiplied.one_color);
    const double alpha_here = std::ldexp(there.alpha.v, -exact.alpha_fraction);
    std::array<double, 3> color_here{};
    SlabReach reach{{}, {alpha_here, alpha_here}};
    Shares alpha_error;
    std::array<Shares, 3> color_error;
    const double decay = 1 - alpha_here, got = in_double(word.alpha) * alpha_unit;
    const auto told = [](double x) { return std::abs(x) < 0x1p-44 ? 0 : std::abs(x); };
    add_local(alpha_error, told(got - alpha_here),
              {{index_of(Wire::slab_alpha), alpha_unit / 2},
               {index_of(Wire::slab_depth), std::ldexp(decay, -e.opacity.depth_fraction)},
               {kRowsPay, 0.0}});
    for (std::size_t c = 0; c < 3; ++c) {
        color_here[c] = there.color[c].v * exact_color;
        reach.color[c] = {color_here[c], color_here[c]};
        add_local(color_error[c], told(in_double(word.color[c]) * color_unit - color_here[c]),
                  {{index_of(Wire::slab_color), color_unit}, {kRowsPay, 0.0}});
    }

    bool decided_walls = true;
    if (!(front.exact && back.exact && length.exact)) {
        const Reach at_front = s.front(), at_back = s.back();
        const Function::Opaque near = prefix.predicts ? f.opaque(s.low, s.high) : Function::Opaque{},
                               around_front = prefix.predicts ? f.opaque(at_front.low, at_front.high)
                                                              : Function::Opaque{};
        const auto point_at = [&](double low, double high, const Reach& alpha) {
            SlabReach point{{}, alpha};
            for (std::size_t c = 0; c < 3; ++c) {
                const Reach color = f.over(c, low, high);
                point.color[c] = {color.low * alpha.low, color.high * alpha.high};
            }
            return point;
        };
        const bool may_be_full = s.l + s.l_off >= 1, may_be_shorter = s.l - s.l_off < 1;
        if (!near.any) {
            const SlabReach whole = full(at_front, at_back, 1.0, 1.0);
            if (may_be_full) reach.take(whole);
            if (may_be_shorter) reach.take(with_opacity(whole, own_opacity(f, s, s.to, false)));
            const double low = std::max(at_front.low, at_back.low),
                         high = std::min(at_front.high, at_back.high);
            if (low <= high) {
                const Reach depths = f.over(Function::depth, low, high);
                reach.take(
                    point_at(low, high,
                             {opacity_of(depths.low * s.shortest()), opacity_of(depths.high * s.longest())}));
            }
        } else if (around_front.all) {
            reach.take(point_at(at_front.low, at_front.high, {1, 1}));
        } else {
            const std::optional<double> wall = s.first_wall(f);
            const bool meets = !around_front.any && wall && s.surely_meets(*wall);
            if (meets) {
                const Reach seen = s.way_to(*wall);
                const SlabReach part = full(at_front, Reach{*wall, *wall}, seen.low, seen.high);
                std::array<double, 3> color{};
                for (std::size_t c = 0; c < 3; ++c) color[c] = f.at(c, *wall);
                if (may_be_full && !keeps_own_depth) reach.take(before_wall(part, color));
                if (may_be_shorter || keeps_own_depth)
                    reach.take(before_wall(with_opacity(part, own_opacity(f, s, *wall, true)), color));
            } else {
                decided_walls = false;
                SlabReach any{{}, {0, 1}};
                // Colours that nothing dims pass the curve's own, up to the opacity.
                for (Reach& color : any.color) color = {0, 1};
                reach.take(any);
            }
        }
    }
    // What the ends and the length make of it, by their errors.
    const double all = s.from_off + s.to_off + s.l_off;
    const auto moved = [&](Shares& shares, double off) {
        if (!(off > 0)) return;
        if (!decided_walls || !std::isfinite(all)) {
            shares[kWallsPay] += std::min(off, 1.0);
            return;
        }
        if (s.from_off > 0) shares.add(front.error, off * s.from_off / all / front.most());
        if (s.to_off > 0) shares.add(back.error, off * s.to_off / all / back.most());
        if (s.l_off > 0) shares.add(length.error, off * s.l_off / all / length.most());
    };
    moved(alpha_error, reach.alpha.from(alpha_here));
    Slab<Bounded> slab;
    slab.alpha = with_error(word.alpha, alpha_error.scaled(1 / alpha_unit));
    for (std::size_t c = 0; c < 3; ++c) {
        moved(color_error[c], reach.color[c].from(color_here[c]));
        slab.color[c] = with_error(word.color[c], color_error[c].scaled(1 / color_unit));
    }
    return slab;
}

}  // namespace

/// Bilinear between nodes: the extremes over two intervals lie at their ends and at the nodes between.
Slab<Bounded> classify(const BoundedCells& m, const Bounded& front, const Bounded& back,
                       const Bounded& length) {
    const PreIntegrated2D& real = m.real;
    const int input_fraction = real.prefix.entries.input_fraction, nodes = real.cells.size();
    const double rate = static_cast<double>(nodes - 1) / (real.entries - 1);
    const auto places = [&](const Reach& inputs) {
        constexpr int kMostNodes = 24;
        const double low = inputs.low * rate, high = inputs.high * rate;
        std::vector<double> all{low, high};
        // The nearest node may be one beyond.
        const int first = static_cast<int>(std::floor(low)), last = static_cast<int>(std::ceil(high));
        if (last - first > kMostNodes) return std::vector<double>{};
        for (int node = first; node <= last; ++node)
            if (real.nearest || (low < node && node < high)) all.push_back(node);
        return all;
    };
    const auto full = [&](const Reach& at_front, const Reach& at_back, double, double) {
        const double color_unit = 1 / static_cast<double>(real.premultiplied.one_color),
                     alpha_unit = std::ldexp(1.0, -real.prefix.entries.alpha_fraction);
        const auto there = [&](double node) {
            return node_position(real, Real<double>{std::ldexp(node / rate, input_fraction)});
        };
        const std::vector<double> rows = places(at_front), columns = places(at_back);
        std::optional<SlabReach> reach;
        for (const double row : rows)
            for (const double column : columns) {
                const auto cell = between_cells(real, real.cells, there(row), there(column));
                const double alpha = cell[3].v * alpha_unit;
                SlabReach at{{}, {alpha, alpha}};
                for (std::size_t c = 0; c < 3; ++c) {
                    const double color = std::min(cell[c].v * color_unit, alpha);
                    at.color[c] = {color, color};
                }
                if (reach)
                    reach->take(at);
                else
                    reach = at;
            }
        constexpr Reach kAny{0, 1};
        return reach.value_or(SlabReach{{kAny, kAny, kAny}, kAny});
    };
    return classify_within(m, front, back, length, true, full);
}

/// Means of curves that are straight between entries: moving the ends by e moves them by half their slope times e.
Slab<Bounded> classify(const BoundedMeans& m, const Bounded& front, const Bounded& back,
                       const Bounded& length) {
    const auto full = [&](const Reach& at_front, const Reach& at_back, double least_part, double most_part) {
        const double from = (at_front.low + at_front.high) / 2, to = (at_back.low + at_back.high) / 2,
                     off = at_front.high - at_front.low + at_back.high - at_back.low,
                     low = std::min(at_front.low, at_back.low), high = std::max(at_front.high, at_back.high);
        const auto mean = [&](std::size_t curve) {
            const double here = m.means.mean(curve, from, to), by = m.means.slope(curve, low, high) * off / 4;
            return Reach{std::max(here - by, 0.0) * least_part, (here + by) * most_part};
        };
        SlabReach slab{{}, mean(Function::depth)};
        if (!m.words.is_opacity) slab.alpha = {opacity_of(slab.alpha.low), opacity_of(slab.alpha.high)};
        slab.alpha.high = std::min(slab.alpha.high, 1.0);
        for (std::size_t c = 0; c < 3; ++c) {
            const Reach color = mean(c);
            slab.color[c] = {std::min(color.low, slab.alpha.low), std::min(color.high, slab.alpha.high)};
        }
        return slab;
    };
    return classify_within(m, front, back, length, false, full);
}

}  // namespace squint
