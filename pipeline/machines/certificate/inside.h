// Places, pieces and light inside a slab over bounded words, where a bound of the whole is tighter than those of the
// operations in inside-inl.h, added up.
#pragma once

#include "pipeline/machines/certificate.h"
#include "pipeline/machines/certificate/function.h"
#include "pipeline/machines/certificate/payers.h"
#include "pipeline/machines/certificate/slab_ends.h"

#include "pipeline/classification/prefix-inl.h"
#include "pipeline/stages/inside-inl.h"
#include "pipeline/stages/shading-inl.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace squint::HWY_NAMESPACE {

/// The pieces beside their words: straight colours are a mean, and err as one.
template <>
struct PieceLight<Bounded> {
    std::array<Bounded, 3> light;
    Bounded through;
    std::array<Slab<Bounded>, std::size_t{1} << kMostCuts> piece{};
    std::size_t count = 0;
};

}  // namespace squint::HWY_NAMESPACE

namespace squint {

/// What light inside a slab asks of a method with prefix sums.  `exact`, `real`: the same lookup, with rows and inputs of
/// its own, and the stage of the plan that rounds nothing.
struct BoundedPrefix {
    const PrefixLookup &words, &exact;
    const InsideStage& real;
    const Function& function;
};

/// A mean of two errs by the mean of what they err by, and by its own rounding.
inline Bounded mean_of(const Bounded& front, const Bounded& back, int part, int bits, Int128 word,
                       const Rescale& to) {
    const double way = std::ldexp(part, -bits);
    Bounded x{word, front.exact && back.exact, {}};
    x.error.add(front.error, 1 - way), x.error.add(back.error, way);
    const Int128 exact = (front.v << bits) + (back.v - front.v) * part, taken = exact - (word << bits);
    if (taken == 0) return x;
    x.exact = false;
    x.error[to.wire < 0 ? Shares::kElsewhere : to.wire] +=
        rounding_of(std::ldexp(std::abs(in_double(taken)), -bits), to.rounding);
    return x;
}
inline std::array<Bounded, 3> location_between(const InsideStage& s, const std::array<Bounded, 3>& front,
                                               const std::array<Bounded, 3>& back, int part, int bits) {
    const auto words =
        HWY_NAMESPACE::location_between(s, std::array<Int128, 3>{front[0].v, front[1].v, front[2].v},
                                        std::array<Int128, 3>{back[0].v, back[1].v, back[2].v}, part, bits);
    std::array<Bounded, 3> between;
    for (std::size_t a = 0; a < 3; ++a)
        between[a] =
            mean_of(front[a], back[a], part, bits, words[a], s.to_location[static_cast<std::size_t>(bits)]);
    return between;
}
inline Bounded input_between(const InsideStage& s, const Bounded& front, const Bounded& back, int part,
                             int bits) {
    return mean_of(front, back, part, bits, HWY_NAMESPACE::input_between(s, front.v, back.v, part, bits),
                   s.to_input[static_cast<std::size_t>(bits)]);
}

/// A slab is looked at twice or not: where errors decide, all that both differ by counts.
inline Slab<Bounded> either(Truth twice, const Slab<Bounded>& looked, const Slab<Bounded>& once) {
    const Slab<Bounded>&chosen = twice.is ? looked : once, &other = twice.is ? once : looked;
    if (twice.sure) return chosen;
    const auto of_both = [](const Bounded& a, const Bounded& b) {
        Shares other_error = b.error;
        other_error[kWallsPay] += in_double(absolute(a.v - b.v));
        return with_error(a.v, greatest(a.error, other_error));
    };
    Slab<Bounded> slab;
    for (std::size_t c = 0; c < 3; ++c) slab.color[c] = of_both(chosen.color[c], other.color[c]);
    slab.alpha = of_both(chosen.alpha, other.alpha);
    return slab;
}

/// T' (1 - alpha') - T (1 - alpha) = (1 - alpha)(T' - T) - T' (alpha' - alpha).
inline void add_piece(const InsideStage& s, HWY_NAMESPACE::PieceLight<Bounded>& sum,
                      const std::array<Bounded, 3>& color, const Bounded& alpha) {
    HWY_NAMESPACE::PieceLight<Int128> words{{sum.light[0].v, sum.light[1].v, sum.light[2].v}, sum.through.v};
    HWY_NAMESPACE::add_piece(s, words, {color[0].v, color[1].v, color[2].v}, alpha.v);
    for (std::size_t c = 0; c < 3; ++c) {
        if (s.premultiplied)
            sum.light[c] = affine(sum.light[c], sum.through, color[c], 0, s.most_light);
        else
            sum.light[c].v = words.light[c];
    }
    const double one = static_cast<double>(s.one_alpha), through = in_double(sum.through.v);
    const Int128 taken = sum.through.v * (s.one_alpha - alpha.v) - words.through * s.one_alpha;
    Bounded next{words.through, sum.through.exact && alpha.exact && taken == 0, {}};
    next.error.add(sum.through.error, 1 - std::clamp(alpha.low() / one, 0.0, 1.0));
    next.error.add(alpha.error, through / one);
    if (taken != 0)
        next.error[s.to_part.wire < 0 ? Shares::kElsewhere : s.to_part.wire] +=
            rounding_of(std::abs(in_double(taken)) / one, s.to_part.rounding);
    sum.through = next;
    if (sum.count < sum.piece.size()) sum.piece[sum.count++] = {color, alpha};
}
/// With t what the pieces in front let through, g what lies behind one, closed by the mean colour c itself,
///
///     alpha' (c' - c) = sum t' ((alpha'_i - alpha_i)(c_i - g_i) + alpha'_i (c'_i - c_i)),
///
/// and c_i and g_i lie among the pieces' colours.
inline std::array<Bounded, 3> color_of_pieces(const InsideStage& s,
                                              const HWY_NAMESPACE::PieceLight<Bounded>& sum) {
    if (s.premultiplied) return HWY_NAMESPACE::color_of_pieces<Bounded>(s, sum);
    const auto words = HWY_NAMESPACE::color_of_pieces(
        s,
        HWY_NAMESPACE::PieceLight<Int128>{{sum.light[0].v, sum.light[1].v, sum.light[2].v}, sum.through.v});
    const double one = static_cast<double>(s.one_alpha);
    std::array<Bounded, 3> color;
    for (std::size_t c = 0; c < 3; ++c) {
        color[c] = {words[c], true, {}};
        if (sum.count == 0) continue;
        Reach reach{std::numeric_limits<double>::infinity(), 0};
        double light = 0, clear = 1;
        for (std::size_t i = 0; i < sum.count; ++i) {
            const Bounded& of = sum.piece[i].color[c];
            reach.low = std::min(reach.low, std::max(of.low(), 0.0)),
            reach.high = std::max(reach.high, of.high());
            const double alpha = in_double(sum.piece[i].alpha.v) / one;
            light += clear * alpha * in_double(of.v), clear -= clear * alpha;
        }
        const double opacity = 1 - clear, got = in_double(words[c]), most = std::max(reach.from(got), 0.0);
        Shares error;
        if (opacity > 0) {
            const double taken = std::abs(got - light / opacity);
            add_local(error, taken < 0x1p-40 ? 0 : taken,
                      {{index_of(s.color_wire), 0.5}, {index_of(Wire::slab_alpha), 0.0}});
            double in_front = 1;
            for (std::size_t i = 0; i < sum.count; ++i) {
                const double alpha = in_double(sum.piece[i].alpha.v) / one;
                error.add(sum.piece[i].alpha.error, in_front * (reach.high - reach.low) / opacity / one);
                error.add(sum.piece[i].color[c].error, in_front * alpha / opacity);
                in_front -= in_front * alpha;
            }
        }
        const double all = error.sum();
        if (!(opacity > 0 && all <= most))
            error = std::isfinite(all) && all > 0 ? error.scaled(most / all)
                                                  : Shares::one(index_of(Wire::slab_alpha), most);
        color[c] = with_error(words[c], error);
    }
    return color;
}

/// A slab cut at a wall: where errors decide whether it is, its end may be any.
inline HWY_NAMESPACE::CutSlab<Bounded> cut_at_wall(const BoundedPrefix& p, const Bounded& front,
                                                   const Bounded& back) {
    const HWY_NAMESPACE::CutSlab<Int128> words = HWY_NAMESPACE::cut_at_wall(p.words, front.v, back.v);
    HWY_NAMESPACE::CutSlab<Bounded> cut{
        {}, {}, front, {words.end_input, true, {}}, {}, {words.wall, true, {}}, {}};
    cut.span = absolute(back - front);
    const SlabEnds ends(p.words.entries, p.function, front, back, {});
    if (!p.words.predicts || !p.function.opaque(ends.low, ends.high).any) {
        cut.end_input = back;
    } else if (!ends.surely_cut(p.function)) {
        const double most = std::ldexp(ends.last, p.words.entries.input_fraction);
        cut.wall = with_error(words.wall, Shares::one(kWallsPay, 1));
        cut.end_input = with_error(words.end_input, Shares::one(kWallsPay, most));
    }
    return cut;
}
/// The part of the way up to a wall.
inline Bounded way_to_wall(const HWY_NAMESPACE::CutSlab<Bounded>& cut, const Rescale& to_way) {
    const double all = std::ldexp(1.0, kWayBits);
    HWY_NAMESPACE::CutSlab<Int128> words{};
    words.front_input = cut.front_input.v, words.end_input = cut.end_input.v;
    words.span = cut.span.v, words.wall = cut.wall.v;
    const Int128 word = HWY_NAMESPACE::way_to_wall(words, to_way);
    const Truth has_wall = constant<Bounded>(0) < cut.wall;
    if (!has_wall.sure) return with_error(word, Shares::one(kWallsPay, all));
    if (!has_wall.is) return {word, true, {}};
    const double span = in_double(cut.span.v), way = std::abs(in_double(words.end_input - words.front_input)),
                 off = cut.span.most(), here = span > 0 ? way / span : 0;
    Shares error = Shares::one(-1, std::abs(in_double(word) - here * all) + 0x1p-30);
    if (off > 0) {
        const double least = std::max(way - off, 0.0) / (span + off),
                     most = span > off ? std::min((way + off) / (span - off), 1.0) : 1;
        error.add(cut.span.error, std::max(most - here, here - least) * all / off);
    }
    return with_error(word, error);
}
/// The lesser of what is not negative and a limit.
inline Bounded at_most(const Bounded& x, std::int64_t limit) {
    return clamp(x, constant<Bounded>(0), constant<Bounded>(limit));
}
/// A part is no more than all.
inline Bounded part_of_color(const InsideStage& s, const Bounded& part, const Bounded& color,
                             const Bounded& quarters_color) {
    Bounded x = HWY_NAMESPACE::part_of_color<Bounded>(s, part, color, quarters_color);
    const double most = std::max(in_double(x.v), color.high() - in_double(x.v)) + 1, off = x.most();
    if (!(off <= most))
        x = with_error(x.v, std::isfinite(off) ? x.error.scaled(most / off) : Shares::one(-1, most));
    return x;
}
/// The angle between two normals: 2 / cos a - 1 falls as they turn to each other, and is one from 90 degrees on.
inline Bounded arc_between(const ShadingStage& s, const std::array<Bounded, 3>& front,
                           const std::array<Bounded, 3>& back) {
    const auto words_of = [](const std::array<Bounded, 3>& n) {
        return std::array<Int128, 3>{n[0].v, n[1].v, n[2].v};
    };
    const Int128 word = HWY_NAMESPACE::arc_between(s, words_of(front), words_of(back));
    const Bounded turn = HWY_NAMESPACE::dot(front, back, s.kept.to_turn);
    // Straight between rows, the table errs by 4e-6.
    constexpr double kOfRows = 5e-6;
    const double one = std::ldexp(1.0, s.dot_fraction);
    const auto at = [](double t) { return t < 0 ? 1.0 : 2 * std::sqrt(2 / (1 + std::min(t, 1.0))) - 1; };
    const double t = in_double(turn.v) / one, off = turn.most() / one,
                 unit = std::ldexp(1.0, KeptLength::kArcBits);
    const double known = std::abs(in_double(word) / unit - at(t)) + kOfRows;
    Reach reach{at(t), at(t)};
    if (off > 0) {
        reach.take(at(std::min(t + off, 1.0)));
        if (t + off >= 0) reach.take(at(std::max(t - off, 0.0)));
        if (t - off < 0) reach.take(1);
    }
    Shares error = Shares::one(index_of(Wire::dot), known * unit);
    if (const double by = reach.from(at(t)); by > 0) {
        if (std::isfinite(turn.most()))
            error.add(turn.error, by * unit / turn.most());
        else
            error[Shares::kElsewhere] += by * unit;
    }
    return with_error(word, error);
}

/// centroid, two_point: where light lies, over all that the ends and the length may be.
HWY_NAMESPACE::LightPlaces<Bounded> places_of_light(const InsideStage& s, const BoundedPrefix& p,
                                                    const Bounded& front, const Bounded& back,
                                                    const Bounded& length);
/// linear, nlpi: how the light of a quarter leans.
Bounded lean_between(const InsideStage& s, const BoundedPrefix& p, const Bounded& near, const Bounded& far,
                     const Bounded& length);

}  // namespace squint
