// Gradients, normals and light over bounded words: where the bound is tighter than that of the stages' operations.
#pragma once

#include "core/portable_math.h"
#include "pipeline/machines/certificate.h"
#include "pipeline/machines/certificate/payers.h"
#include "pipeline/machines/certificate/reached.h"

#include "pipeline/stages/faces.h"
#include "pipeline/stages/gradient-inl.h"
#include "pipeline/stages/inside-inl.h"
#include "pipeline/stages/shading-inl.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>

namespace squint::HWY_NAMESPACE {

/// The voxels around a cell as words know them, and the volume: what lies beside them counts where an error leads there.
template <>
struct Neighbourhood<Bounded> {
    const Volume* volume = nullptr;
    std::array<std::int64_t, 3> cell{};
    Neighbourhood<Int128> words;
    bool of_sums = false;  // over the 5^3 voxels about each
};

}  // namespace squint::HWY_NAMESPACE

namespace squint {

/// A constant of a stage: what its word is off by is known.
template <class W>
requires std::same_as<W, Bounded> W stage_constant(std::int64_t raw, double exact, int fraction, bool,
                                                   std::optional<Wire> wire = {}) {
    const double off = std::abs(static_cast<double>(raw) - std::ldexp(exact, fraction));
    return with_error(raw, Shares::one(wire ? static_cast<int>(*wire) : -1, rounding_of(off, Rounding::rnd)));
}

/// The differences of voxels that a gradient's rule lerps.
class DifferenceField {
  public:
    DifferenceField(const HWY_NAMESPACE::Neighbourhood<Bounded>& near, GradientRule rule, int axis)
        : near_(near), rule_(rule), axis_(static_cast<std::size_t>(axis)) {}
    using Place = std::array<std::int64_t, 3>;

    bool is_edge() const { return rule_ == GradientRule::analytic; }
    /// At a voxel, in units of the rule; analytic: of the edge that begins there.
    double at(const Place& p) const {
        if (is_edge()) return value(beside(p, axis_, 1)) - value(p);
        if (rule_ != GradientRule::sobel) return central(p);
        double sum = 0;
        const std::size_t first = (axis_ + 1) % 3, second = (axis_ + 2) % 3;
        for (int a = -1; a <= 1; ++a)
            for (int b = -1; b <= 1; ++b)
                sum +=
                    central(beside(beside(p, first, a), second, b)) * ((a == 0 ? 2 : 1) * (b == 0 ? 2 : 1));
        return sum;
    }
    /// How far two of them may lie apart.
    double range() const {
        constexpr double kSummed = kBoxSide * kBoxSide * kBoxSide;
        const auto levels = static_cast<double>(near_.volume->largest - near_.volume->smallest) *
                            (near_.of_sums ? kSummed : 1);
        return levels * (is_edge() ? 2 : rule_ == GradientRule::sobel ? 32 : 2);
    }
    /// The steepest change along each axis over cells.
    std::array<double, 3> slopes(const ReachedCells& cells) const {
        std::array<double, 3> steepest{};
        if (cells.far) return {range(), range(), range()};
        cells.corners([&](const Place& p) {
            const double here = at(p);
            for (std::size_t a = 0; a < 3; ++a) {
                if (p[a] > cells.high[a]) continue;
                Place next = p;
                ++next[a];
                steepest[a] = std::max(steepest[a], std::abs(at(next) - here));
            }
        });
        return steepest;
    }
    /// analytic: how far anything over cells is from a value.
    double from(double value, const ReachedCells& cells) const {
        if (cells.far) return range();
        double most = 0;
        cells.corners([&](const Place& p) {
            if (p[axis_] <= cells.high[axis_]) most = std::max(most, std::abs(at(p) - value));
        });
        return most;
    }

  private:
    static Place beside(Place p, std::size_t axis, int by) {
        p[axis] += by;
        return p;
    }
    double value(const Place& p) const;
    double central(const Place& p) const { return value(beside(p, axis_, 1)) - value(beside(p, axis_, -1)); }

    const HWY_NAMESPACE::Neighbourhood<Bounded>& near_;
    GradientRule rule_;
    std::size_t axis_;
};

/// The spline's slope along `axis` is continuous over cell faces: how steep it is along each axis over cells.  With D the
/// differences along the axis, its own change is straight in t, from 2 (D1 - D0) - (D2 - D1) to 2 (D2 - D1) - (D1 - D0);
/// across, it changes by the slope of splines again.  Weights of four values sum to 5/4 in size at most, those of
/// three differences to 3/2.
inline std::array<double, 3> spline_steepness(const Volume& volume, const ReachedCells& cells, int axis) {
    constexpr double kValues = 1.25, kSlopes = 1.5;
    const auto a = static_cast<std::size_t>(axis), b = (a + 1) % 3, c = (a + 2) % 3;
    const Index3& d = volume.dims;
    std::array<double, 3> steepest{};
    const auto of_cell = [&](const std::array<std::int64_t, 3>& cell) {
        double difference[3][4][4];
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 4; ++j)
                for (int k = 0; k < 4; ++k) {
                    std::array<std::int64_t, 3> at{};
                    at[a] = cell[a] - 1 + i, at[b] = cell[b] - 1 + j, at[c] = cell[c] - 1 + k;
                    const auto value = [&] {
                        return static_cast<double>(
                            volume.at(voxel_at(at[0], d.x), voxel_at(at[1], d.y), voxel_at(at[2], d.z)));
                    };
                    const double here = value();
                    ++at[a];
                    difference[i][j][k] = value() - here;
                }
        for (int j = 0; j < 4; ++j)
            for (int k = 0; k < 4; ++k) {
                const double near = difference[1][j][k] - difference[0][j][k],
                             far = difference[2][j][k] - difference[1][j][k];
                const double along = std::max(std::abs(2 * near - far), std::abs(2 * far - near));
                steepest[a] = std::max(steepest[a], kValues * kValues * along);
                for (int i = 0; i < 3; ++i) {
                    const double to = kSlopes * kSlopes * kValues, here = difference[i][j][k];
                    if (j < 3)
                        steepest[b] = std::max(steepest[b], to * std::abs(difference[i][j + 1][k] - here));
                    if (k < 3)
                        steepest[c] = std::max(steepest[c], to * std::abs(difference[i][j][k + 1] - here));
                }
            }
    };
    for (std::int64_t z = cells.low[2]; z <= cells.high[2]; ++z)
        for (std::int64_t y = cells.low[1]; y <= cells.high[1]; ++y)
            for (std::int64_t x = cells.low[0]; x <= cells.high[0]; ++x) of_cell({x, y, z});
    return steepest;
}
inline Bounded bounded_spline(const GradientStage& s, const HWY_NAMESPACE::Neighbourhood<Bounded>& near,
                              const std::array<Bounded, 3>& weight, int axis) {
    struct Exact {
        const HWY_NAMESPACE::Neighbourhood<Int128>& words;
        Bounded at(int x, int y, int z) const { return {words.at(x, y, z), true, {}}; }
    };
    // Roundings, of the word's own place.
    const std::array<Bounded, 3> place{Bounded{weight[0].v, true, {}}, Bounded{weight[1].v, true, {}},
                                       Bounded{weight[2].v, true, {}}};
    Bounded slope = HWY_NAMESPACE::spline_difference(s, Exact{near.words}, place, axis);
    if (weight[0].exact && weight[1].exact && weight[2].exact) return slope;
    const int fraction = 3 * s.spline_fraction - s.to_first.shift - s.to_second.shift - s.to_gradient.shift;
    const double one = std::ldexp(1.0, fraction), whole = std::ldexp(1.0, s.weight_bits);
    const ReachedCells cells = reached_cells(*near.volume, near.cell, weight, s.weight_bits);
    slope.exact = false;
    if (cells.far) {
        const auto range = static_cast<double>(near.volume->largest - near.volume->smallest);
        slope.error[Shares::kElsewhere] += 5 * range * one;  // 2 x 3/2 x (5/4)^2 of it
        return slope;
    }
    const std::array<double, 3> steep = spline_steepness(*near.volume, cells, axis);
    for (std::size_t i = 0; i < 3; ++i)
        if (steep[i] > 0) slope.error.add(weight[i].error, steep[i] * one / whole);
    return slope;
}

/// central and sobel lerp a field that is continuous over cell faces, as the samples' is; analytic jumps there.
inline Bounded voxel_difference(const GradientStage& s, const HWY_NAMESPACE::Neighbourhood<Bounded>& near,
                                const std::array<Bounded, 3>& weight, int axis) {
    if (s.rule == GradientRule::cubic_spline) return bounded_spline(s, near, weight, axis);
    const Int128 word = HWY_NAMESPACE::voxel_difference(
        s, near.words, std::array<Int128, 3>{weight[0].v, weight[1].v, weight[2].v}, axis);
    const DifferenceField field(near, s.rule, axis);
    const int bits = s.weight_bits;
    // Between the differences at the cell's corners; analytic has no lerp along the axis itself.
    std::array<std::int64_t, 8> at{};
    for (std::size_t i = 0; i < 8; ++i) {
        std::array<std::int64_t, 3> place = near.cell;
        for (std::size_t a = 0; a < 3; ++a)
            if (!(field.is_edge() && static_cast<int>(a) == axis)) place[a] += (i >> a) & 1;
        at[i] = static_cast<std::int64_t>(field.at(place));
    }
    const BetweenCorners between(at, weight, bits);
    const int first = bits - s.to_first.shift,
              second = field.is_edge() ? first : first + bits - s.to_second.shift,
              fraction = second + bits - s.to_gradient.shift;
    const double taken = between.from(word, fraction);
    const auto of_level = [&](const Rescale& to, int bits_after) {
        return unit_of(to) * std::ldexp(1.0, fraction - bits_after);
    };
    Shares error;
    add_local(error, taken,
              {{index_of(Wire::gradient_lerp),
                of_level(s.to_first, first) + (field.is_edge() ? 0 : of_level(s.to_second, second))},
               {index_of(Wire::gradient), unit_of(s.to_gradient)}});
    if (weight[0].exact && weight[1].exact && weight[2].exact) return with_error(word, error);

    const ReachedCells cells = reached_cells(*near.volume, near.cell, weight, bits);
    const double one = std::ldexp(1.0, fraction), whole = std::ldexp(1.0, bits);
    double all = 0;
    for (const Bounded& w : weight) all += w.most();
    if (field.is_edge() && !cells.is_one()) {
        const double off = field.from(between.value(), cells) * one;
        for (const Bounded& w : weight)
            if (!w.exact && off > 0) error.add(w.error, off / all);
        return with_error(word, error);
    }
    const std::array<double, 3> slope = field.slopes(cells);
    for (std::size_t a = 0; a < 3; ++a)
        if (slope[a] > 0 && !weight[a].exact) error.add(weight[a].error, slope[a] * one / whole);
    return with_error(word, error);
}

/// A gradient's length, and how far its end may be displaced.
struct GradientReach {
    double length = 0, off = 0, sum = 0;  // sum: of the components' errors, which share what follows
    explicit GradientReach(const std::array<Bounded, 3>& g) {
        double square = 0, off_square = 0;
        for (const Bounded& x : g) {
            const double v = in_double(x.v), e = x.most();
            square += v * v, off_square += e * e, sum += e;
        }
        length = std::sqrt(square), off = std::sqrt(off_square) * (1 + 0x1p-40);
    }
    bool is_exact() const { return off == 0; }
    /// Whether it may point anywhere, or be none.
    bool may_vanish(double vanishing) const { return !(length - off > 2 * vanishing) || !(off < length); }
};

/// -g / |g|: an error of g turns it by asin(e / |g|) at most; where g may vanish it is any direction, or none.
inline std::array<Bounded, 3> normalise(const GradientStage& s, const std::array<Bounded, 3>& g) {
    const std::array<Int128, 3> word =
        HWY_NAMESPACE::normalise(s, std::array<Int128, 3>{g[0].v, g[1].v, g[2].v});
    const GradientReach reach(g);
    const double one = std::ldexp(1.0, s.normal_fraction);
    std::array<Bounded, 3> normal;
    for (std::size_t a = 0; a < 3; ++a) {
        Shares error;
        const double got = in_double(word[a]) / one;
        if (!reach.is_exact() && reach.may_vanish(s.vanishing)) {
            const double off = (1 + std::abs(got)) * one;
            // Where light fades out, finer words help; elsewhere a gradient may always be shorter than its error.
            if (s.fades && std::isfinite(reach.sum))
                for (const Bounded& x : g)
                    if (!x.exact) error.add(x.error, off / reach.sum);
            if (!s.fades || !std::isfinite(reach.sum)) error[kGradientsPay] += off;
        } else if (reach.length > 0) {
            const double exact = -in_double(g[a].v) / reach.length;
            add_local(error, std::abs(got - exact) * one + 0x1p-40 * one,
                      {{index_of(Wire::normal), unit_of(s.to_normal)}});
            if (!reach.is_exact()) {
                const double turn = reach.off / reach.length,
                             kept = std::sqrt(std::max(1 - turn * turn, 0.0));
                const double off = (1 - kept) * std::abs(exact) +
                                   turn * std::sqrt(std::max(1 - exact * exact, 0.0)) + 0x1p-40;
                for (const Bounded& x : g)
                    if (!x.exact) error.add(x.error, off * one / reach.sum);
            }
        }
        normal[a] = with_error(word[a], error);
    }
    return normal;
}

/// min(1, |g| / g_0) changes by no more than |g| does, over g_0.
inline Bounded confidence(const GradientStage& s, const std::array<Bounded, 3>& g) {
    const Int128 word = HWY_NAMESPACE::confidence(s, std::array<Int128, 3>{g[0].v, g[1].v, g[2].v});
    const GradientReach reach(g);
    const double one = std::ldexp(1.0, s.confidence_fraction);
    const double exact = std::min(1.0, reach.length / s.floor_exact), got = in_double(word) / one;
    Shares error;
    add_local(error, std::abs(got - exact) < 0x1p-45 ? 0 : std::abs(got - exact) * one,
              {{index_of(Wire::confidence), unit_of(s.to_confidence)}});
    const double most = std::min(1.0, (reach.length + reach.off) / s.floor_exact),
                 least = std::max(0.0, std::min(1.0, (reach.length - reach.off) / s.floor_exact));
    if (const double off = std::max(most - exact, exact - least); off > 0) {
        if (!std::isfinite(reach.sum)) return unbounded(word);
        for (const Bounded& x : g)
            if (!x.exact) error.add(x.error, off * one / reach.sum);
    }
    return with_error(word, error);
}

/// An error of g changes its length by no more than its own.
inline Bounded gradient_length(const std::array<Bounded, 3>& g) {
    const Int128 word = HWY_NAMESPACE::gradient_length(std::array<Int128, 3>{g[0].v, g[1].v, g[2].v});
    const GradientReach reach(g);
    if (!std::isfinite(reach.sum)) return unbounded(word);
    const double one = std::ldexp(1.0, kNormalGuard);
    Shares error;
    add_local(error, std::abs(in_double(word) - reach.length * one), {});
    for (const Bounded& x : g)
        if (!x.exact) error.add(x.error, reach.off * one / reach.sum);
    return with_error(word, error);
}

/// x^p over all that x may be.
inline Bounded power(const ShadingStage& s, const Bounded& facing) {
    const Bounded x = quantise(facing, s.to_power_input);
    const Int128 word = HWY_NAMESPACE::power(s, facing.v);
    const double one = std::ldexp(1.0, s.power_fraction);
    const auto at = [&](double t) {
        t = std::clamp(t / one, 0.0, 1.0);
        if (s.power == PowerRule::table) return portable::pow(t, s.exponent);
        if (s.power == PowerRule::parabola) {
            // The slope of cone_of(), to whose fall 2^-shift gives the words' fraction.
            const double slope = std::ldexp(static_cast<double>(s.parabola_slope), -s.to_fall.shift);
            return std::max(1 - (1 - t) * slope, 0.0);
        }
        for (int i = 0; i < s.squarings; ++i) t *= t;
        return t;
    };
    const double exact = at(in_double(x.v));
    Shares error;
    const double known = std::abs(in_double(word) / one - exact);
    add_local(error, known < 0x1p-45 ? 0 : known * one, {{index_of(Wire::power), 0.5}});
    if (x.exact) return with_error(word, error);
    const double swing = std::max(at(x.high()) - exact, exact - at(x.low()));
    if (!std::isfinite(x.most())) return unbounded(word);
    if (swing > 0) error.add(x.error, swing * one / x.most());
    return with_error(word, error);
}

/// The angle between two gradients, and all that errors may make of it, decide the pieces.
inline Bounded cuts_between(const std::array<Bounded, 3>& front, const std::array<Bounded, 3>& back) {
    const Int128 word = HWY_NAMESPACE::cuts_between(std::array<Int128, 3>{front[0].v, front[1].v, front[2].v},
                                                    std::array<Int128, 3>{back[0].v, back[1].v, back[2].v});
    const GradientReach f(front), b(back);
    const auto unsure = [&](int least, int most) {
        const double off = std::max(std::abs(in_double(word) - least), std::abs(in_double(word) - most));
        return with_error(word, Shares::one(-1, off));
    };
    if (f.is_exact() && b.is_exact() && (f.length == 0 || b.length == 0)) return unsure(0, 0);
    if (!(f.off < f.length) || !(b.off < b.length)) return unsure(0, kMostCuts);
    double dot = 0;
    for (std::size_t a = 0; a < 3; ++a) dot += in_double(front[a].v) * in_double(back[a].v);
    // Cosines of the angle less and more what both may turn by: asin(e / |g|) each.
    const double sin_f = f.off / f.length, sin_b = b.off / b.length, cos_f = std::sqrt(1 - sin_f * sin_f),
                 cos_b = std::sqrt(1 - sin_b * sin_b);
    const double sine = sin_f * cos_b + cos_f * sin_b, cosine = cos_f * cos_b - sin_f * sin_b;
    const double between = std::clamp(dot / (f.length * b.length), -1.0, 1.0),
                 across = std::sqrt(1 - between * between);
    const double nearest = cosine <= between ? 1 : between * cosine + across * sine,
                 farthest = cosine <= -between ? -1 : between * cosine - across * sine;
    const auto cuts = [](double c) { return c < 23.0 / 32 ? 2 : c < 31.0 / 32 ? 1 : 0; };
    return unsure(cuts(nearest + 1e-7), cuts(farthest - 1e-7));
}

}  // namespace squint
