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

/// Of c alpha, or of parts of it, and of alpha.
template <std::size_t N>
struct Reaches {
    std::array<Reach, N> color;
    Reach alpha;
    void take(const Reaches& other) {
        for (std::size_t c = 0; c < N; ++c)
            color[c].take(other.color[c].low), color[c].take(other.color[c].high);
        alpha.take(other.alpha.low), alpha.take(other.alpha.high);
    }
    static Reaches at(double color, double alpha) {
        Reaches reach{{}, {alpha, alpha}};
        reach.color.fill({color, color});
        return reach;
    }
    // Colours that nothing dims pass the curve's own, up to the opacity.
    static Reaches any() {
        Reaches reach{{}, {0, 1}};
        reach.color.fill({0, 1});
        return reach;
    }
};
using SlabReach = Reaches<3>;
/// The colour of `part` with another opacity: C alpha' / alpha.
template <std::size_t N>
Reaches<N> with_opacity(const Reaches<N>& part, const Reach& alpha) {
    Reaches<N> slab{{}, alpha};
    for (std::size_t c = 0; c < N; ++c) {
        const Reach& color = part.color[c];
        const double least = part.alpha.high > 0 ? std::min(color.low / part.alpha.high, 1.0) : 0,
                     most = part.alpha.low > 0 ? std::min(color.high / part.alpha.low, 1.0) : 1;
        slab.color[c] = {least * alpha.low, most * alpha.high};
    }
    return slab;
}
/// What a wall behind `part` adds in its colour.
Reach behind(const Reach& part_alpha, double wall) {
    return {wall * (1 - part_alpha.high), wall * (1 - part_alpha.low)};
}
Reach sum_of(const Reach& a, const Reach& b) {
    return {std::max(a.low + b.low, 0.0), std::min(a.high + b.high, 1.0)};
}

/// What a method's slab is, or its parts are:
///
///     full(front, back, least part, most part)   all that a full slab's tables give over two intervals of inputs, of
///                                                which a wall lets that part of the way be seen
///     point(low, high, alpha)                    a point's
///     opaque(front)                              where the front surely is
///     before_wall(part, colour)                  what lies behind is a wall of that colour
///
/// Takes all that the slab may be; returns whether it is decided if a wall ends it.
template <std::size_t N, class Of>
bool take_all(const Function& f, const PrefixLookup& prefix, const SlabEnds& s, bool keeps_own_depth,
              const Of& of, Reaches<N>& reach) {
    const Reach at_front = s.front(), at_back = s.back();
    const Function::Opaque near = prefix.predicts ? f.opaque(s.low, s.high) : Function::Opaque{},
                           around_front =
                               prefix.predicts ? f.opaque(at_front.low, at_front.high) : Function::Opaque{};
    const bool may_be_full = s.l + s.l_off >= 1, may_be_shorter = s.l - s.l_off < 1;
    if (!near.any) {
        const Reaches<N> whole = of.full(at_front, at_back, 1.0, 1.0);
        if (may_be_full) reach.take(whole);
        if (may_be_shorter) reach.take(with_opacity(whole, own_opacity(f, s, s.to, false)));
        const double low = std::max(at_front.low, at_back.low), high = std::min(at_front.high, at_back.high);
        if (low <= high) {
            const Reach depths = f.over(Function::depth, low, high);
            reach.take(of.point(
                low, high, {opacity_of(depths.low * s.shortest()), opacity_of(depths.high * s.longest())}));
        }
        return true;
    }
    if (around_front.all) {
        reach.take(of.opaque(at_front));
        return true;
    }
    const std::optional<double> wall = s.first_wall(f);
    const bool meets = !around_front.any && wall && s.surely_meets(*wall);
    if (!meets) {
        reach.take(Reaches<N>::any());
        return false;
    }
    const Reach seen = s.way_to(*wall);
    const Reaches<N> part = of.full(at_front, Reach{*wall, *wall}, seen.low, seen.high);
    std::array<double, 3> color{};
    for (std::size_t c = 0; c < 3; ++c) color[c] = f.at(c, *wall);
    if (may_be_full && !keeps_own_depth) reach.take(of.before_wall(part, color));
    if (may_be_shorter || keeps_own_depth)
        reach.take(of.before_wall(with_opacity(part, own_opacity(f, s, *wall, true)), color));
    return true;
}

/// What the ends and the length make of a slab, by their errors.
class ByEnds {
  public:
    ByEnds(const SlabEnds& s, const Bounded& front, const Bounded& back, const Bounded& length)
        : s_(s), front_(front), back_(back), length_(length) {}
    bool decided_walls = true;
    void add(Shares& shares, double off) const {
        if (!(off > 0)) return;
        const double all = s_.from_off + s_.to_off + s_.l_off;
        if (!decided_walls || !std::isfinite(all)) {
            shares[kWallsPay] += std::min(off, 1.0);
            return;
        }
        if (s_.from_off > 0) shares.add(front_.error, off * s_.from_off / all / front_.most());
        if (s_.to_off > 0) shares.add(back_.error, off * s_.to_off / all / back_.most());
        if (s_.l_off > 0) shares.add(length_.error, off * s_.l_off / all / length_.most());
    }

  private:
    const SlabEnds& s_;
    const Bounded &front_, &back_, &length_;
};
/// An error, of which nothing is left where doubles cannot tell it from their own.
double told(double x) {
    return std::abs(x) < 0x1p-44 ? 0 : std::abs(x);
}
/// A slab's ends and length as the method without rounding takes them.
struct ExactEnds {
    Real<double> front, back, length;
    ExactEnds(const EntryLookup& e, const SlabEnds& s)
        : front{std::ldexp(s.from, e.input_fraction)},
          back{std::ldexp(s.to, e.input_fraction)},
          length{std::ldexp(s.l, e.length_fraction)} {}
};

/// A slab, where `full` is as above.
template <class Full>
struct WholeSlab {
    const Function& f;
    const Full& full;

    SlabReach point(double low, double high, const Reach& alpha) const {
        SlabReach at{{}, alpha};
        for (std::size_t c = 0; c < 3; ++c) {
            const Reach color = f.over(c, low, high);
            at.color[c] = {color.low * alpha.low, color.high * alpha.high};
        }
        return at;
    }
    SlabReach opaque(const Reach& front) const { return point(front.low, front.high, {1, 1}); }
    SlabReach before_wall(const SlabReach& part, const std::array<double, 3>& wall) const {
        SlabReach slab{{}, {1, 1}};
        for (std::size_t c = 0; c < 3; ++c)
            slab.color[c] = sum_of(part.color[c], behind(part.alpha, wall[c]));
        return slab;
    }
};
template <class Method, class Full>
Slab<Bounded> classify_within(const Method& m, const Bounded& front, const Bounded& back,
                              const Bounded& length, bool keeps_own_depth, const Full& full) {
    const PrefixLookup& prefix = m.words.prefix;
    const EntryLookup& e = prefix.entries;
    const Slab<Int128> word = HWY_NAMESPACE::classify(m.words, front.v, back.v, length.v);
    const SlabEnds s(e, m.function, front, back, length);

    // The same slab without rounding, from the word's own inputs.
    const EntryLookup& exact = m.real.prefix.entries;
    const ExactEnds ends(exact, s);
    const Slab<Real<double>> there = HWY_NAMESPACE::classify(m.real, ends.front, ends.back, ends.length);
    const double color_unit = 1 / static_cast<double>(m.words.premultiplied.one_color),
                 alpha_unit = std::ldexp(1.0, -e.alpha_fraction),
                 exact_color = 1 / static_cast<double>(m.real.premultiplied.one_color);
    const double alpha_here = std::ldexp(there.alpha.v, -exact.alpha_fraction);
    std::array<double, 3> color_here{};
    SlabReach reach = SlabReach::at(0, alpha_here);
    Shares alpha_error;
    std::array<Shares, 3> color_error;
    const double decay = 1 - alpha_here, got = in_double(word.alpha) * alpha_unit;
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

    ByEnds by_ends(s, front, back, length);
    if (!(front.exact && back.exact && length.exact))
        by_ends.decided_walls =
            take_all(m.function, prefix, s, keeps_own_depth, WholeSlab<Full>{m.function, full}, reach);
    by_ends.add(alpha_error, reach.alpha.from(alpha_here));
    Slab<Bounded> slab;
    slab.alpha = with_error(word.alpha, alpha_error.scaled(1 / alpha_unit));
    for (std::size_t c = 0; c < 3; ++c) {
        by_ends.add(color_error[c], reach.color[c].from(color_here[c]));
        slab.color[c] = with_error(word.color[c], color_error[c].scaled(1 / color_unit));
    }
    return slab;
}

double nodes_an_entry(const PreIntegrated2D& m) {
    return static_cast<double>(m.cells.size() - 1) / (m.entries - 1);
}
/// The places between two inputs at which a bilinear table has its extremes, in nodes; none where they are too many.
std::vector<double> extreme_nodes(const PreIntegrated2D& real, const Reach& inputs) {
    constexpr int kMostNodes = 24;
    const double rate = nodes_an_entry(real), low = inputs.low * rate, high = inputs.high * rate;
    std::vector<double> all{low, high};
    // The nearest node may be one beyond.
    const int first = static_cast<int>(std::floor(low)), last = static_cast<int>(std::ceil(high));
    if (last - first > kMostNodes) return {};
    for (int node = first; node <= last; ++node)
        if (real.nearest || (low < node && node < high)) all.push_back(node);
    return all;
}
/// Bilinear between nodes: the extremes over two intervals lie at their ends and at the nodes between.  `at(front, back)`:
/// what the tables have there.
template <std::size_t N, class At>
Reaches<N> over_cells(const PreIntegrated2D& real, const Reach& at_front, const Reach& at_back,
                      const At& at) {
    const auto there = [&](double node) {
        const double input = std::ldexp(node / nodes_an_entry(real), real.prefix.entries.input_fraction);
        return node_position(real, Real<double>{input});
    };
    const std::vector<double> columns = extreme_nodes(real, at_back);
    std::optional<Reaches<N>> reach;
    for (const double row : extreme_nodes(real, at_front))
        for (const double column : columns) {
            const Reaches<N> here = at(there(row), there(column));
            if (reach)
                reach->take(here);
            else
                reach = here;
        }
    return reach.value_or(Reaches<N>::any());
}

}  // namespace

Slab<Bounded> classify(const BoundedCells& m, const Bounded& front, const Bounded& back,
                       const Bounded& length) {
    const PreIntegrated2D& real = m.real;
    const double color_unit = 1 / static_cast<double>(real.premultiplied.one_color),
                 alpha_unit = std::ldexp(1.0, -real.prefix.entries.alpha_fraction);
    const auto full = [&](const Reach& at_front, const Reach& at_back, double, double) {
        return over_cells<3>(real, at_front, at_back, [&](const auto& row, const auto& column) {
            const auto cell = between_cells(real, real.cells, row, column);
            const double alpha = cell[3].v * alpha_unit;
            SlabReach at = SlabReach::at(0, alpha);
            for (std::size_t c = 0; c < 3; ++c) {
                const double color = std::min(cell[c].v * color_unit, alpha);
                at.color[c] = {color, color};
            }
            return at;
        });
    };
    return classify_within(m, front, back, length, true, full);
}

namespace {

/// Parts of a slab's light: part k of colour c, and of white (c = 3), at 4 k + c.
using LightReach = Reaches<16>;

/// The parts of what PreIntegrated2D looks up: the first is what the others leave of the slab.
class LightOfCells {
  public:
    LightOfCells(const PreIntegrated2D& real, const Function& f)
        : real_(real), f_(f), last_(real.fades.size()) {}

    LightReach full(const Reach& at_front, const Reach& at_back, double, double) const {
        const double color_unit = 1 / static_cast<double>(real_.premultiplied.one_color),
                     alpha_unit = std::ldexp(1.0, -real_.prefix.entries.alpha_fraction);
        return over_cells<16>(real_, at_front, at_back, [&](const auto& row, const auto& column) {
            const auto parts_of = [&](const CellTable& cells) {
                const auto cell = between_cells(real_, cells, row, column);
                return std::array<double, 4>{cell[0].v * color_unit, cell[1].v * color_unit,
                                             cell[2].v * color_unit, cell[3].v * alpha_unit};
            };
            const std::array<double, 4> slab = parts_of(real_.cells);
            LightReach at = LightReach::at(0, slab[3]);
            std::array<double, 4> left{};
            for (std::size_t c = 0; c < 4; ++c) left[c] = std::min(slab[c], slab[3]);
            for (std::size_t k = 1; k <= last_; ++k) {
                const std::array<double, 4> fade = parts_of(real_.fades[k - 1]);
                for (std::size_t c = 0; c < 4; ++c) {
                    const double part = std::min(fade[c], left[c]);
                    at.color[4 * k + c] = {part, part}, left[c] -= part;
                }
            }
            for (std::size_t c = 0; c < 4; ++c) at.color[c] = {left[c], left[c]};
            return at;
        });
    }
    /// What a point has beside the tables stands at the end.
    LightReach point(double low, double high, const Reach& alpha) const {
        const LightReach table = full({low, high}, {low, high}, 1, 1);
        LightReach all = with_rest(table, low, high, alpha);
        all.take(with_rest(with_opacity(table, alpha), low, high, alpha));
        if (!(alpha.low > 0)) all.take(LightReach::at(0, 0));  // a transparent slab is not lit
        return all;
    }
    LightReach opaque(const Reach&) const { return LightReach::any(); }
    LightReach before_wall(LightReach part, const std::array<double, 3>& wall) const {
        for (std::size_t c = 0; c < 4; ++c) {
            Reach& last = part.color[4 * last_ + c];
            last = sum_of(last, behind(part.alpha, c < 3 ? wall[c] : 1));
        }
        part.alpha = {1, 1};
        return part;
    }

  private:
    LightReach with_rest(LightReach parts, double low, double high, const Reach& alpha) const {
        for (std::size_t c = 0; c < 4; ++c) {
            const Reach color = c < 3 ? f_.over(c, low, high) : Reach{1, 1};
            Reach seen;
            for (std::size_t k = 0; k <= last_; ++k)
                seen.low += parts.color[4 * k + c].low, seen.high += parts.color[4 * k + c].high;
            Reach& last = parts.color[4 * last_ + c];
            last = sum_of(last, {color.low * alpha.low - seen.high, color.high * alpha.high - seen.low});
        }
        parts.alpha = alpha;
        return parts;
    }

    const PreIntegrated2D& real_;
    const Function& f_;
    std::size_t last_;
};

}  // namespace

FadingLight<Bounded> fading_light(const BoundedCells& m, const Bounded& front, const Bounded& back,
                                  const Bounded& length, const Slab<Bounded>& whole) {
    const PrefixLookup& prefix = m.words.prefix;
    FadingLight<Int128> word = HWY_NAMESPACE::fading_light(
        m.words, front.v, back.v, length.v,
        Slab<Int128>{{whole.color[0].v, whole.color[1].v, whole.color[2].v}, whole.alpha.v});
    const SlabEnds s(prefix.entries, m.function, front, back, length);
    const ExactEnds ends(m.real.prefix.entries, s);
    const Slab<Real<double>> exact = HWY_NAMESPACE::classify(m.real, ends.front, ends.back, ends.length);
    FadingLight<Real<double>> there =
        HWY_NAMESPACE::fading_light(m.real, ends.front, ends.back, ends.length, exact);
    // A transparent slab is not lit, whatever its tables hold between nodes.
    if (whole.alpha.v == 0) word.part = {};
    if (!(exact.alpha.v > 0)) there.part = {};
    const double unit = 1 / static_cast<double>(m.words.premultiplied.one_color),
                 exact_unit = 1 / static_cast<double>(m.real.premultiplied.one_color);
    const auto count = static_cast<std::size_t>(word.count);
    const auto here = [&](std::size_t k, std::size_t c) { return there.part[k][c].v * exact_unit; };
    LightReach reach = LightReach::at(0, 0);
    for (std::size_t k = 0; k < count; ++k)
        for (std::size_t c = 0; c < 4; ++c) reach.color[4 * k + c] = {here(k, c), here(k, c)};
    ByEnds by_ends(s, front, back, length);
    if (!(front.exact && back.exact && length.exact))
        by_ends.decided_walls =
            take_all(m.function, prefix, s, true, LightOfCells(m.real, m.function), reach);
    FadingLight<Bounded> light{
        word.count, {}, way_to_wall(cut_at_wall(m.prefix, front, back), m.words.to_way)};
    for (std::size_t k = 0; k < count; ++k)
        for (std::size_t c = 0; c < 4; ++c) {
            Shares error;
            add_local(error, told(in_double(word.part[k][c]) * unit - here(k, c)),
                      {{index_of(Wire::slab_color), unit}, {kRowsPay, 0.0}});
            by_ends.add(error, reach.color[4 * k + c].from(here(k, c)));
            light.part[k][c] = with_error(word.part[k][c], error.scaled(1 / unit));
        }
    return light;
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
