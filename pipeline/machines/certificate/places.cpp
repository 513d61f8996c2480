#include "pipeline/machines/certificate/inside.h"
#include "pipeline/machines/certificate/slab_ends.h"

#include <array>
#include <cstddef>
#include <optional>

namespace squint {
namespace {

constexpr double kAway = 0x1p-30;  // of doubles, of the rows of even matter

/// To [0, 1].
double clamped(double x) {
    return std::clamp(x, 0.0, 1.0);
}
/// Both places, as parts of the way, and the share of the light that comes from the far one.
struct PlacesReach {
    Reach near, far, share;
};

/// How far the function's extinction on a straight way is from what T's rows say of it: none where T bends.
double off_by_rows(const BoundedPrefix& p, double low, double high) {
    if (p.exact.curved) return 0;
    return std::ldexp(p.function.slope(Function::depth, low, high), -p.exact.sub_entry_bits - 1);
}
/// The mean extinction in a quarter of a way, whose ends may be `off` beside it.
Reach quarter_mean(const BoundedPrefix& p, double a, double b, double off, double last) {
    const Function& f = p.function;
    const double low = std::max(std::min(a, b) - off, 0.0), high = std::min(std::max(a, b) + off, last);
    const double mean = f.mean(Function::depth, a, b), rows = off_by_rows(p, low, high),
                 by = f.slope(Function::depth, low, high) * off;
    const Reach all = f.over(Function::depth, low, high);
    return {std::max({mean - by, all.low, 0.0}) - rows, std::min(mean + by, all.high) + rows};
}

Reach clear_of(const Reach& depth) {
    return {1 - opacity_of(depth.high), 1 - opacity_of(depth.low)};
}
/// Even matter's lean and spread at the depths that are reached; the lean rises, the spread falls.
struct Leans {
    Reach lean, spread;
};
Leans leans_at(const EvenMatter& even, const Reach& depth) {
    const auto at = [&](double x, int column) {
        const Real<double> raw{std::ldexp(std::min(x, 2 * EvenMatter::kDeepest), even.depth_fraction)};
        return std::ldexp(HWY_NAMESPACE::even_matter<2>(even, raw)[static_cast<std::size_t>(column)].v,
                          -kShareBits);
    };
    return {{at(depth.low, 0) - kAway, at(depth.high, 0) + kAway},
            {at(depth.high, 1) - kAway, at(depth.low, 1) + kAway}};
}

/// Adds what the ends' and the length's errors make, by their sizes.
void by_ends(Shares& shares, const SlabEnds& ends, const Bounded& front, const Bounded& back,
             const Bounded& length, double error) {
    const double moves = ends.from_off + ends.to_off + ends.l_off;
    if (!(error > 0) || !(moves > 0)) return;
    if (!std::isfinite(moves)) {
        shares[Shares::kElsewhere] += error;
        return;
    }
    if (ends.from_off > 0) shares.add(front.error, error * ends.from_off / moves / front.most());
    if (ends.to_off > 0) shares.add(back.error, error * ends.to_off / moves / back.most());
    if (ends.l_off > 0) shares.add(length.error, error * ends.l_off / moves / length.most());
}

/// places_of_light() without rounding, over all that the slab may be.  Nothing where errors decide whether a wall ends it.
std::optional<PlacesReach> all_places(const InsideStage& s, const BoundedPrefix& p, const SlabEnds& ends) {
    const Function& f = p.function;
    std::optional<double> wall;
    if (p.words.predicts && f.opaque(ends.low, ends.high).any) {
        if (!ends.surely_cut(f)) return {};
        wall = ends.first_wall(f);
    }
    const double end = wall.value_or(ends.to), end_off = wall ? 0 : ends.to_off;
    // The shares of the depth in front of the quarters' ends.
    const double off = std::max(ends.from_off, end_off), span = std::abs(end - ends.from);
    if (!std::isfinite(off)) return {};
    std::array<Reach, kQuarters> mean;
    for (std::size_t k = 0; k < kQuarters; ++k) {
        const auto at = [&](std::size_t i) {
            return ends.from + static_cast<double>(i) / kQuarters * (end - ends.from);
        };
        mean[k] = quarter_mean(p, at(k), at(k + 1), off, ends.last);
        mean[k].low = std::max(mean[k].low, 0.0);
    }
    constexpr double kLeastSpan = 16;  // raw: as places_of_light
    const double raw = std::ldexp(1.0, p.exact.entries.input_fraction),
                 moves = ends.from_off + end_off + kAway * span;
    const bool may_be_short = (span - moves) * raw < kLeastSpan, is_short = (span + moves) * raw < kLeastSpan;
    std::array<Reach, kQuarters - 1> y;
    for (std::size_t i = 0; i < y.size(); ++i) {
        const double even = static_cast<double>(i + 1) / kQuarters;
        Reach before, behind;
        for (std::size_t k = 0; k < kQuarters; ++k) {
            Reach& to = k <= i ? before : behind;
            to.low += mean[k].low, to.high += mean[k].high;
        }
        const double least = before.low + behind.high, most = before.high + behind.low;
        y[i] = {least > 0 ? before.low / least : 0, most > 0 ? before.high / most : 1};
        if (is_short) y[i] = {even, even};
        if (may_be_short) y[i].take(even);
        y[i] = {clamped(y[i].low - kAway), clamped(y[i].high + kAway)};
    }
    const auto square = [](const Reach& x) {
        const double a = x.low * (1 - x.low), b = x.high * (1 - x.high);
        return Reach{std::min(a, b), x.low <= 0.5 && 0.5 <= x.high ? 0.25 : std::max(a, b)};
    };
    const std::array<Reach, 3> yy{square(y[0]), square(y[1]), square(y[2])};
    const Reach twelvefold{11 - 4 * (y[0].high + y[2].high) - 2 * y[1].high,
                           11 - 4 * (y[0].low + y[2].low) - 2 * y[1].low};
    const Reach turn{6 * (2 * (yy[0].low + yy[2].low) + yy[1].low),
                     6 * (2 * (yy[0].high + yy[2].high) + yy[1].high)};
    const auto place = [&](const Reach& less) {
        const double least = std::min(turn.low * less.low, turn.high * less.low),
                     most = std::max(turn.low * less.high, turn.high * less.high);
        return Reach{clamped((twelvefold.low - most) / 12), clamped((twelvefold.high - least) / 12)};
    };
    const Reach depth = own_depth(f, ends, end, wall.has_value());
    const Leans at = leans_at(p.real.even, depth);
    const bool two = s.rule == InsideRule::two_point;
    const Reach centre = place(at.lean);
    if (wall) {
        const Reach way = ends.way_to(*wall), clear = clear_of(depth);
        const Reach before{centre.low * way.low, centre.high * way.high};
        if (two) return PlacesReach{before, way, clear};
        // before + clear (way - before), which rises with each.
        const auto both = [](double part, double seen, double to) { return (part + seen * (1 - part)) * to; };
        const Reach all{both(centre.low, clear.low, way.low), both(centre.high, clear.high, way.high)};
        return PlacesReach{all, all, {0, 0}};
    }
    if (!two) return PlacesReach{centre, centre, {0, 0}};
    const Reach sum{at.lean.low + at.spread.low, std::min(at.lean.high + at.spread.high, 1.0)},
        rest{at.lean.low - at.spread.high, at.lean.high - at.spread.low};
    return PlacesReach{place({std::min(sum.low, 1.0), sum.high}), place(rest), {0.5, 0.5}};
}

}  // namespace

HWY_NAMESPACE::LightPlaces<Bounded> places_of_light(const InsideStage& s, const BoundedPrefix& p,
                                                    const Bounded& front, const Bounded& back,
                                                    const Bounded& length) {
    const HWY_NAMESPACE::LightPlaces<Int128> words =
        HWY_NAMESPACE::places_of_light(s, p.words, front.v, back.v, length.v);
    const SlabEnds ends(p.words.entries, p.function, front, back, length);
    const std::optional<PlacesReach> here = all_places(s, p, ends.here()), all = all_places(s, p, ends);
    // An input between the ends is rounded to the wire's last bit.
    const double span = std::abs(in_double(back.v - front.v)), of_inputs = span > 0 ? 2 / span : 1;
    const auto place = [&](Int128 word, int bits, auto member) {
        const double got = std::ldexp(in_double(word), -bits), one = std::ldexp(1.0, bits);
        Shares error;
        if (!all || !here) {
            error[kWallsPay] = std::max(got, 1 - got) * one;
            return with_error(word, error);
        }
        const double known = std::max(((*here).*member).from(got), 0.0),
                     most = std::max(((*all).*member).from(got), known);
        const double by_inputs = std::min(known, of_inputs);
        error[index_of(Wire::classification_input)] += by_inputs * one;
        error[Shares::kElsewhere] += (known - by_inputs) * one;
        by_ends(error, ends, front, back, length, (most - known) * one);
        return with_error(word, error);
    };
    return {place(words.near, kWayBits, &PlacesReach::near), place(words.far, kWayBits, &PlacesReach::far),
            place(words.share, kShareBits, &PlacesReach::share)};
}

Bounded lean_between(const InsideStage& s, const BoundedPrefix& p, const Bounded& near, const Bounded& far,
                     const Bounded& length) {
    const SlabEnds ends(p.words.entries, p.function, near, far, length);
    const Int128 word = HWY_NAMESPACE::lean_between(s, p.words, near.v, far.v, length.v);
    const double one = std::ldexp(1.0, kShareBits), got = in_double(word) / one;
    Shares error;
    const bool has_wall = p.words.predicts && p.function.opaque(ends.low, ends.high).any;
    if (has_wall && !ends.surely_cut(p.function)) {
        error[kWallsPay] = std::max(got, 1 - got) * one;
    } else {
        const auto lean = [&](const SlabEnds& at) {
            const std::optional<double> wall = has_wall ? at.first_wall(p.function) : std::nullopt;
            const bool stays = wall && *wall != at.to;
            return leans_at(p.real.even, own_depth(p.function, at, stays ? *wall : at.to, stays)).lean;
        };
        const double known = std::max(lean(ends.here()).from(got), 0.0),
                     most = std::max(lean(ends).from(got), known);
        error[index_of(Wire::slab_depth)] += known * one;
        by_ends(error, ends, near, far, length, (most - known) * one);
    }
    return with_error(word, error);
}

}  // namespace squint
