#include "pipeline/machines/certificate.h"

#include "core/error.h"
#include "core/portable_math.h"
#include "pipeline/classification/tables/exact_series.h"
#include "pipeline/render.h"
#include "pipeline/stages/ray_setup-inl.h"

#include "pipeline/classification/entries-inl.h"
#include "pipeline/stages/compositing-inl.h"
#include "pipeline/stages/interpolation-inl.h"
#include "pipeline/stages/location-inl.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <thread>
#include <vector>

namespace squint {
namespace {

constexpr int index_of(Wire wire) {
    return static_cast<int>(wire);
}
double in_double(Int128 x) {
    return static_cast<double>(x);
}
/// What quantising to a wire may take, in units of its last bit: nothing where it drops no bits.
double unit_of(const Rescale& to) {
    return to.shift > 0 ? rounding_of(1e-300, to.rounding) : 0;
}
/// Adds `known` to `shares`: as much as `usual` says of each, and what is more to the last.
void add_local(Shares& shares, double known, std::initializer_list<std::pair<int, double>> usual) {
    if (known == 0) return;
    double left = known;
    int last = Shares::kElsewhere;
    for (const auto& [who, error] : usual) shares[last = who] += error, left -= error;
    if (left > 0) shares[last] += left;
}

}  // namespace

// ---------------------------------------------------------------- stages that know more than their operations

// A set-up value: what its word is off by is known; no error where it is representable.
template <class W>
requires std::same_as<W, Bounded> W word_from(double value, const Spec& spec, const Rescale& to) {
    const std::int64_t raw = quantise_real(value, spec);
    const double off = std::abs(static_cast<double>(raw) - value * static_cast<double>(spec.format.one()));
    return with_error(raw, Shares::one(to.wire, rounding_of(off, spec.rounding)));
}

/// A word of zero stands for one; without rounding it may be anything that its error allows, and stays what it is.
template <class W, class N>
requires std::same_as<W, Bounded> N divisor(const N& x) {
    if (x.exact || x.v > 0) return x.v > 0 ? x : constant<Bounded>(1);
    return {1, false, x.error + Shares::one(-1, 1)};
}

/// The trilinear field is continuous over cell faces: a location that errs is a displacement of the point, not a
/// matter of cells.  The word's cell is the cell; the weight carries the displacement.
inline CellPosition<Bounded> cell_position(const LocationStage& s, const std::array<Bounded, 3>& location) {
    CellPosition<Bounded> position;
    for (std::size_t a = 0; a < 3; ++a) {
        const Int128 cell = std::min<Int128>(location[a].v >> s.location_fraction, s.last_cell[a]);
        position.cell[a] = {cell, true, {}};
        Bounded rest = location[a];
        rest.v -= cell << s.location_fraction;
        position.weight[a] = quantise(rest, s.to_weight);
    }
    return position;
}

namespace {

/// A cell in its volume: what lies beside it counts where an error leads there.
struct BoundedCell {
    const Volume& volume;
    std::array<std::int64_t, 3> at;
    Cell<Int128> corners;

    std::int64_t voxel(std::int64_t x, std::int64_t y, std::int64_t z) const {
        const Index3& d = volume.dims;
        return volume.at(std::min(x, d.x - 1), std::min(y, d.y - 1), std::min(z, d.z - 1));
    }
    /// The steepest edges of the cells [low, high] along each axis, levels a voxel.
    std::array<double, 3> slopes(const std::array<std::int64_t, 3>& low,
                                 const std::array<std::int64_t, 3>& high) const {
        std::array<double, 3> steepest{};
        for (std::int64_t z = low[2]; z <= high[2] + 1; ++z)
            for (std::int64_t y = low[1]; y <= high[1] + 1; ++y)
                for (std::int64_t x = low[0]; x <= high[0] + 1; ++x) {
                    const std::int64_t here = voxel(x, y, z);
                    const auto take = [&](std::size_t axis, std::int64_t next) {
                        steepest[axis] = std::max(steepest[axis], std::abs(static_cast<double>(next - here)));
                    };
                    if (x <= high[0]) take(0, voxel(x + 1, y, z));
                    if (y <= high[1]) take(1, voxel(x, y + 1, z));
                    if (z <= high[2]) take(2, voxel(x, y, z + 1));
                }
        return steepest;
    }
};
struct BoundedVolume {
    const Volume& volume;
    BoundedCell cell(const std::array<Bounded, 3>& at) const;
    template <class W>
    auto neighbourhood(const std::array<W, 3>& at) const;
    template <class W>
    auto box_sums(const std::array<W, 3>& at) const {
        return neighbourhood(at);
    }
    template <class W>
    W nears_wall(const WallStage& walls, const std::array<W, 3>& at) const;
};

}  // namespace

/// Lerps are contractions in their values, so what the point is displaced by counts with the steepest edges of the cells
/// that it can reach, and every level's own rounding once.
Bounded interpolate(const InterpolationStage& s, const BoundedCell& cell,
                    const std::array<Bounded, 3>& weight) {
    const Int128 word = HWY_NAMESPACE::interpolate(
        s, cell.corners, std::array<Int128, 3>{weight[0].v, weight[1].v, weight[2].v});
    // What the three levels have taken: none of them can be told from the others.
    const int bits = s.weight_bits;
    const long double part = std::ldexp(1.0L, -bits);
    const auto lerp = [&](long double a, long double b, std::size_t axis) {
        return a == b ? a : a + static_cast<long double>(weight[axis].v) * part * (b - a);
    };
    const auto at = [&](int i) { return static_cast<long double>(cell.corners.at(i)); };
    const long double z0 = lerp(lerp(at(0), at(1), 0), lerp(at(2), at(3), 0), 1);
    const long double z1 = lerp(lerp(at(4), at(5), 0), lerp(at(6), at(7), 0), 1);
    const long double exact = std::ldexp(lerp(z0, z1, 2), s.sample_fraction);
    auto taken = static_cast<double>(std::abs(static_cast<long double>(word) - exact));
    if (taken > 0) taken += static_cast<double>(exact) * 0x1p-58;  // long doubles have 64 bits
    Shares error;
    const double one = std::ldexp(1.0, s.sample_fraction);
    const auto of_level = [&](const Rescale& to, int bits_after) {
        return unit_of(to) * std::ldexp(1.0, s.sample_fraction - bits_after);
    };
    const int x_bits = bits - s.to_x.shift, y_bits = x_bits + bits - s.to_y.shift;
    add_local(error, taken,
              {{index_of(Wire::lerp_x), of_level(s.to_x, x_bits)},
               {index_of(Wire::lerp_y), of_level(s.to_y, y_bits)},
               {index_of(Wire::sample), unit_of(s.to_sample)}});
    if (weight[0].exact && weight[1].exact && weight[2].exact) return with_error(word, error);

    std::array<std::int64_t, 3> low{}, high{};
    const double whole = std::ldexp(1.0, bits);
    bool far = false;
    for (std::size_t a = 0; a < 3; ++a) {
        const double place = in_double(weight[a].v) / whole, off = weight[a].most() / whole * (1 + 1e-9);
        const std::int64_t last = std::max<std::int64_t>(cell.volume.dims[static_cast<int>(a)] - 2, 0);
        far = far || !(off < 4);
        const auto reached = [&](double p) {
            return std::clamp<std::int64_t>(cell.at[a] + static_cast<std::int64_t>(std::floor(p)), 0, last);
        };
        if (far) continue;
        low[a] = reached(place - off);
        high[a] = std::max(low[a], reached(std::ceil(place + off) - 1));
    }
    const auto range = static_cast<double>(cell.volume.largest - cell.volume.smallest);
    const std::array<double, 3> slope =
        far ? std::array<double, 3>{range, range, range} : cell.slopes(low, high);
    for (std::size_t a = 0; a < 3; ++a)
        if (slope[a] > 0) error.add(weight[a].error, slope[a] * one / whole);
    return with_error(word, error);
}

/// Entries a level are a constant of 20 bits: what it is off by is known.
inline Bounded classification_input(const InputStage& s, const Bounded& sample) {
    const Int128 word = HWY_NAMESPACE::classification_input(s, sample.v);
    if (!s.scaled) {
        const Bounded input = quantise(sample, s.to_input);
        return clamp(input, constant<Bounded>(0), constant<Bounded>(s.highest));
    }
    const double scale = s.scale_exact * std::ldexp(1.0, s.scale_fraction - s.to_input.shift);
    const double exact = std::clamp(in_double(sample.v) * scale, 0.0, static_cast<double>(s.highest));
    Shares error = sample.error.scaled(scale);
    add_local(error, std::abs(in_double(word) - exact),
              {{index_of(Wire::classification_input), unit_of(s.to_input)}, {Shares::kElsewhere, 0.0}});
    error[kDoublesPay] += exact * 0x1p-50;
    return with_error(word, error);
}

/// Words alone: errors of C and T are the ray's, not the slab's (Ray, below).
inline void composite(const CompositingStage& s, Accumulated<Bounded>& pixel,
                      const std::array<Bounded, 3>& color, const Bounded& alpha) {
    Accumulated<Int128> words{
        {pixel.color[0].v, pixel.color[1].v, pixel.color[2].v}, pixel.transparency.v, pixel.remainder.v};
    HWY_NAMESPACE::composite(s, words, {color[0].v, color[1].v, color[2].v}, alpha.v);
    for (std::size_t c = 0; c < 3; ++c) pixel.color[c].v = words.color[c];
    pixel.transparency.v = words.transparency, pixel.remainder.v = words.remainder;
}

}  // namespace squint

#include "pipeline/slab-inl.h"

namespace squint {
namespace {

using namespace HWY_NAMESPACE;

BoundedCell BoundedVolume::cell(const std::array<Bounded, 3>& at) const {
    const std::array<std::int64_t, 3> place{static_cast<std::int64_t>(at[0].v),
                                            static_cast<std::int64_t>(at[1].v),
                                            static_cast<std::int64_t>(at[2].v)};
    return {volume, place, FromVolume{volume}.cell(std::array<Int128, 3>{at[0].v, at[1].v, at[2].v})};
}
// Lit scenes are not bounded yet: a word that nothing is known of.
template <class W>
auto BoundedVolume::neighbourhood(const std::array<W, 3>&) const {
    Neighbourhood<W> none;
    none.voxel.fill(unbounded(0));
    return none;
}
// Nor are slabs looked at twice.
template <class W>
W BoundedVolume::nears_wall(const WallStage&, const std::array<W, 3>&) const {
    return unbounded(0);
}

struct Interval {
    double low = 0, high = 0;
    void take(double x) { low = std::min(low, x), high = std::max(high, x); }
    /// How far anything in it is from a point in it.
    double from(double x) const { return std::max(high - x, x - low); }
};

/// The length of a full slab that the method's tables are built for: one scalar stands for a projection's ray, with its
/// opacity as declared.
double full_step(const Plan& plan) {
    return plan.projection_mode ? plan.entries.unit_distance : plan.step_world;
}

/// The function as no word has it: extinction of a full step and colour, linear between entries; opaque entries.
class Function {
  public:
    explicit Function(const Plan& plan) {
        for (const Entry& entry : plan.entries.entry) {
            curve_[3].push_back(entry.extinction * full_step(plan));
            for (int c = 0; c < 3; ++c) curve_[static_cast<std::size_t>(c)].push_back(entry.color[c]);
            opaque_.push_back(entry.opaque);
            has_opaque_ = has_opaque_ || entry.opaque;
        }
    }
    enum Curve : std::size_t { red, green, blue, depth };
    int last() const { return static_cast<int>(opaque_.size()) - 1; }

    double at(std::size_t curve, double input) const {
        const std::vector<double>& value = curve_[curve];
        const int i = std::clamp(static_cast<int>(input), 0, std::max(last() - 1, 0));
        if (last() == 0) return value[0];
        const auto n = static_cast<std::size_t>(i);
        return value[n] + (input - i) * (value[n + 1] - value[n]);
    }
    /// Of a curve over [low, high].
    Interval over(std::size_t curve, double low, double high) const {
        const double first = at(curve, low);
        Interval all{first, first};
        all.take(at(curve, high));
        for (int i = static_cast<int>(low) + 1; i < high; ++i)
            all.take(curve_[curve][static_cast<std::size_t>(i)]);
        return all;
    }
    /// The steepest segment of a curve over [low, high], per entry.
    double slope(std::size_t curve, double low, double high) const {
        double most = 0;
        const int first = std::clamp(static_cast<int>(low), 0, std::max(last() - 1, 0));
        for (int i = first; i < last() && (i == first || i < high); ++i)
            most = std::max(most, std::abs(curve_[curve][static_cast<std::size_t>(i) + 1] -
                                           curve_[curve][static_cast<std::size_t>(i)]));
        return most;
    }
    /// Whether anything, and everything, in [low, high] is opaque: entries, and what lies between two.
    struct Opaque {
        bool any = false, all = false;
    };
    Opaque opaque(double low, double high) const {
        if (!has_opaque_) return {};
        Opaque found{false, true};
        const int from = static_cast<int>(std::floor(low)), to = static_cast<int>(std::ceil(high));
        for (int i = from; i <= std::min(to, last()); ++i) {
            const bool here = opaque_[static_cast<std::size_t>(i)];
            found.all = found.all && here;
            found.any = found.any || (here && low <= i && i <= high);
        }
        found.any = found.any || found.all;
        return found;
    }

  private:
    std::array<std::vector<double>, 4> curve_;
    std::vector<bool> opaque_;
    bool has_opaque_ = false;
};

/// Post-classification, and how far a slab is from the function's own at what the sample may be.
struct BoundedPostClassification {
    static constexpr bool kNeedsBack = false;
    const PostClassification& words;
    const Function& function;
};
double opacity(double depth) {
    return -portable::expm1(-depth);
}
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
    const Interval depths = f.over(Function::depth, low, high);
    const Interval curve{opacity(depths.low * std::max(l - l_off, 0.0)),
                         opacity(depths.high * std::min(l + l_off, 1.0))};
    Shares error;
    if (near.all) {
        add_local(error, std::abs(got - 1), {{index_of(Wire::slab_alpha), 0.0}});
    } else if (here.any) {
        // Opaque, but perhaps missed: then anything that the curve has there.
        error[kWallsPay] += std::max(got - curve.low, 0.0);
        add_local(error, std::abs(got - 1), {{index_of(Wire::slab_alpha), 0.0}});
    } else {
        const double exact = opacity(depth), decay = 1 - curve.low;
        const double u_alpha = unit_of(e.to_alpha) / alpha_one;
        if (length.v < (Int128{1} << e.length_fraction) || l_off > 0) {
            const double extinction = 0.5 * std::ldexp(l * decay, -e.extinction_fraction),
                         depth_unit = std::ldexp(decay, -e.opacity.depth_fraction);
            add_local(error, std::abs(got - exact),
                      {{index_of(Wire::table_extinction), extinction},
                       {index_of(Wire::slab_depth), depth_unit},
                       {index_of(Wire::slab_alpha), unit_of(e.opacity.to_alpha) / alpha_one}});
            // What is left of the curve's swing where the length is what it is.
            const double swing = std::max(opacity(depths.high * l) - exact, exact - opacity(depths.low * l));
            to_input(error, swing);
            if (l_off > 0) error.add(length.error, std::max(curve.from(exact) - swing, 0.0) / length.most());
        } else {
            const EntryPosition<Int128> row = sub_entry_position(e, e.row_bits, input.v);
            const double way = std::ldexp(in_double(row.fraction), e.row_bits - e.input_fraction);
            const double from = std::ldexp(in_double(row.entry), -e.row_bits),
                         to = std::min(from + std::ldexp(1.0, -e.row_bits), static_cast<double>(f.last()));
            const double a = opacity(f.at(Function::depth, from)), b = opacity(f.at(Function::depth, to));
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

/// PIPS(1).  Without rounding a slab is the mean extinction on its way from one input to the other, and the mean colour
/// weighted by it: moving the ends by e moves the mean of a curve by its slope times e, however short the way is.
struct BoundedPowerSeries {
    static constexpr bool kNeedsBack = true;
    const PowerSeriesOfOrder1& words;
    const Function& function;
    const preintegration::ExactSeries& exact;
};
Slab<Bounded> classify(const BoundedPowerSeries& m, const Bounded& front, const Bounded& back,
                       const Bounded& length) {
    const PrefixLookup& prefix = m.words.prefix;
    const EntryLookup& e = prefix.entries;
    const Function& f = m.function;
    const Slab<Int128> word = HWY_NAMESPACE::classify(m.words, front.v, back.v, length.v);

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
    const Interval depths = f.over(Function::depth, low, high);
    const Function::Opaque near = f.opaque(low, high);
    if (decided) {
        // Nothing to move.
    } else if (!near.any) {
        const double steep = f.slope(Function::depth, low, high);
        const double by_front = l * steep * from_off / 2, by_back = l * steep * to_off / 2,
                     by_length = l_off * depths.high;
        const double shift = by_front + by_back + by_length, depth = -std::log1p(-here.alpha);
        const Interval moved{opacity(std::max(depth - shift, std::max(l - l_off, 0.0) * depths.low)),
                             opacity(std::min(depth + shift, std::min(l + l_off, 1.0) * depths.high))};
        to_ends(alpha_error, std::max(moved.from(here.alpha), 0.0), by_front, by_back, by_length);
        // x dK = int (c - K) dtau + int tau dc.
        const double mean = l > 0 ? depth / l : -std::log1p(-seen.alpha),
                     least = std::max(mean - steep * (from_off + to_off) / 2, depths.low);
        for (std::size_t c = 0; c < 3; ++c) {
            const Interval colors = f.over(c, low, high);
            const double all = colors.from(straight[c]),
                         own = f.slope(c, low, high) * std::max(from_off, to_off);
            const double of_depth = least > 0 && seen.alpha > 0
                                        ? (colors.high - colors.low) * steep * (from_off + to_off) / 2 / least
                                        : std::numeric_limits<double>::infinity();
            to_ends(color_error[c], std::min(all, of_depth + own), from_off, to_off, 0);
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
        Interval reach[3];
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
            for (std::size_t c = 0; c < 3; ++c) {
                const double swing = reach[c].high - reach[c].low;
                to_ends(
                    color_error[c],
                    std::min(reach[c].from(straight[c]),
                             2 * swing * moves + f.slope(c, std::max(a, 0.0), std::min(b, last)) * from_off),
                    from_off, to_off, l_off > 0 ? l_off : 0);
            }
        } else {
            const double least = opacity(depths.low * std::max(l - l_off, 0.0));
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

// ----------------------------------------------------------------------------------------------------- along a ray

/// Hears every slab of a ray, then bounds its pixel.
class Ray : public Silent {
  public:
    explicit Ray(const Plan& plan) : s_(plan.compositing) {
        const double alpha_bits = std::ldexp(1.0, -s_.alpha_fraction);
        alpha_unit_ = alpha_bits;
        const int color =
            s_.premultiplied ? s_.color_fraction : plan.specs[Wire::slab_ratio].format.fraction_bits;
        color_unit_ = std::ldexp(1.0, -color);
        for (const Entry& entry : plan.entries.entry)
            brightest_ = std::max({brightest_, entry.color.x, entry.color.y, entry.color.z});
    }

    void begin() { slabs_.clear(); }
    void composited(const Slab<Bounded>& slab, const Accumulated<Bounded>& before,
                    const Accumulated<Bounded>& after) {
        Seen seen{{}, in_double(slab.alpha.v) * alpha_unit_, clear(before), clear(after), {}};
        bool changed = seen.alpha != 0 || !slab.alpha.exact || seen.clear_before != seen.clear_after;
        for (std::size_t c = 0; c < 3; ++c) {
            const double unit = 1 / static_cast<double>(s_.color_unit());
            seen.color[c] = {in_double(slab.color[c].v) * color_unit_, in_double(before.color[c].v) * unit,
                             in_double(after.color[c].v) * unit, slab.color[c].error.scaled(color_unit_)};
            changed = changed || before.color[c].v != after.color[c].v;
        }
        if (!changed) return;
        seen.alpha_error = slab.alpha.error.scaled(alpha_unit_);
        slabs_.push_back(seen);
    }

    /// Shares of R, G, B and A, of 1.0.  `stopped`: the ray ended before its last slab.
    std::array<Shares, 4> bound(bool stopped) {
        std::array<Shares, 4> all;
        for (Seen& seen : slabs_) seen.alpha_off = seen.alpha_error.sum();
        if (s_.form == CompositingForm::back_to_front)
            from_the_front(all);
        else
            from_the_back(all, stopped);
        for (std::size_t c = 0; c < 4; ++c) {
            Shares& shares = all[c];
            shares[kDoublesPay] += 0x1p-36 + shares.sum() * 0x1p-20;
        }
        return all;
    }
    /// What no bound need pass: the pixel without rounding lies in [0, brightest].
    static void limit(std::array<Shares, 4>& all, const std::array<double, 4>& words, double brightest) {
        for (std::size_t c = 0; c < 4; ++c) {
            const double most = std::max(std::abs(words[c]), (c == 3 ? 1 : brightest) - words[c]),
                         sum = all[c].sum();
            if (!(sum <= most))
                all[c] = std::isfinite(sum) ? all[c].scaled(most / sum) : Shares::one(-1, most);
        }
    }
    double brightest() const { return brightest_; }

  private:
    struct Color {
        double value = 0, before = 0, after = 0;
        Shares error;
    };
    struct Seen {
        Shares alpha_error;
        double alpha = 0, clear_before = 1, clear_after = 1;
        std::array<Color, 3> color;
        double alpha_off = 0, clear_off = 0;  // clear_off: of T behind the slab
    };
    using Reach = std::array<Interval, 4>;  // of R, G, B and A

    double clear(const Accumulated<Bounded>& pixel) const {
        const auto unit = static_cast<double>(s_.unit());
        const double t = in_double(pixel.transparency.v) / unit;
        return s_.form == CompositingForm::alpha ? 1 - t : t;
    }
    static Interval opacities(const Seen& k) {
        return {std::max(k.alpha - k.alpha_off, 0.0), std::min(k.alpha + k.alpha_off, 1.0)};
    }
    Interval colors(const Seen& k, std::size_t c) const {
        if (c == 3) return {1, 1};
        const double off = k.color[c].error.sum();
        return {std::max(k.color[c].value - off, 0.0), std::min(k.color[c].value + off, brightest_)};
    }
    /// G_k from G_(k+1): G is linear in alpha, and rises with c and what lies behind.
    Interval gathered(const Seen& k, std::size_t c, const Interval& behind) const {
        const Interval alpha = opacities(k), color = colors(k, c);
        const auto at = [](double a, double color_, double g) { return g + a * (color_ - g); };
        return {std::min(at(alpha.low, color.low, behind.low), at(alpha.high, color.low, behind.low)),
                std::max(at(alpha.low, color.high, behind.high), at(alpha.high, color.high, behind.high))};
    }
    // One last bit of a wire, of 1.0.
    static double bit(int fraction) { return std::ldexp(1.0, -fraction); }

    /// Whether what w rounds is carried on to the next slab, and T loses w itself.
    bool carries() const { return s_.form == CompositingForm::w_carry && s_.to_transparency.shift <= 0; }
    /// What a step of C and T is off by, of which nothing is left where doubles cannot tell.
    static double told(double x) { return std::abs(x) < 0x1p-46 ? 0 : std::abs(x); }

    // kappa + lambda G, G what lies behind: in w lambda = -rho and kappa = rho c + sigma.  Where the remainder is
    // carried rho is left out, and returned.
    double add_step(Shares& shares, const Seen& k, std::size_t c, const Interval& behind,
                    double apart) const {
        const bool is_color = c < 3;
        const double value = is_color ? k.color[c].value : 1;
        const double gained =
            is_color ? k.color[c].after - k.color[c].before : k.clear_before - k.clear_after;
        double lambda = k.clear_after - k.clear_before * (1 - k.alpha);
        double kappa = gained - k.clear_before * k.alpha * value, carried = 0;
        if (carries()) carried = -lambda, kappa -= carried * value, lambda = 0;
        const double known = std::max(told(kappa + lambda * behind.low), told(kappa + lambda * behind.high));
        const double of_color = is_color ? unit_of(s_.to_color) * bit(s_.sum_fraction) : 0,
                     of_clear =
                         told(lambda) > 0 ? unit_of(s_.to_transparency) * bit(s_.transparency_fraction) : 0;
        if (s_.takes_from_transparency()) {
            const double of_w =
                told(lambda) > 0 ? unit_of(s_.to_contribution) * bit(s_.contribution_fraction) : 0;
            add_local(shares, known,
                      {{index_of(Wire::contribution), of_w * apart},
                       {index_of(Wire::transparency), of_clear * behind.high},
                       {index_of(Wire::color), of_color}});
        } else {
            const double of_product = is_color ? unit_of(s_.to_slab_color) * bit(s_.color_fraction) : 0;
            add_local(shares, known,
                      {{index_of(Wire::slab_color), of_product * k.clear_before},
                       {index_of(Wire::transparency), of_clear * (is_color ? behind.high : apart)},
                       {index_of(Wire::color), of_color}});
        }
        return carried;
    }

    void from_the_back(std::array<Shares, 4>& all, bool stopped) {
        const double threshold = s_.threshold_exact;
        const double carry_bit = bit(s_.contribution_fraction);
        double off = 0;
        for (Seen& k : slabs_) {  // T' - T = (T' - T)(1 - alpha) - T' dalpha + lambda
            const double lambda = std::abs(k.clear_after - k.clear_before * (1 - k.alpha));
            off = off * (1 - opacities(k).low) + k.clear_before * k.alpha_off + (carries() ? 0 : lambda);
            k.clear_off = off + (carries() ? carry_bit : 0) + 0x1p-40;
        }
        const bool may_go_on =
            stopped && !slabs_.empty() && slabs_.back().clear_after + slabs_.back().clear_off >= threshold;
        for (std::size_t c = 0; c < 4; ++c) {
            Shares& shares = all[c];
            Interval behind{0, 0};
            double ended =
                may_go_on ? (slabs_.back().clear_after + slabs_.back().clear_off) * (c == 3 ? 1 : brightest_)
                          : 0;
            // Of the carried remainder, r - 1/2 within a half: sum (r_k - r_(k+1)) f_k with f = c - G is, by parts,
            // at most half a bit of |f| at the hindmost and of how f varies.
            double each = 0, varies = 0, hindmost = 0;
            std::optional<std::pair<Interval, Interval>> farther;
            for (std::size_t i = slabs_.size(); i-- > 0;) {
                const Seen& k = slabs_[i];
                const Interval color = colors(k, c);
                const double apart = std::max(color.high - behind.low, behind.high - color.low);
                // The ray without rounding may have ended here, this one went on.
                if (threshold > 0 && k.clear_after - k.clear_off < threshold && k.clear_after >= threshold)
                    ended = std::max(ended, threshold * behind.high);
                shares.add(k.alpha_error, k.clear_before * apart);
                if (c < 3) shares.add(k.color[c].error, k.clear_before * k.alpha);
                if (const double carried = add_step(shares, k, c, behind, apart); carried != 0) {
                    each += std::abs(carried) * apart;
                    if (farther)
                        varies += difference(color, behind, farther->first, farther->second);
                    else
                        hindmost = apart;
                    farther.emplace(color, behind);
                }
                behind = gathered(k, c, behind);
            }
            shares[index_of(Wire::contribution)] += std::min(each, carry_bit / 2 * (hindmost + varies));
            shares[kTerminationPays] += ended;
        }
    }
    // sup |(c - G) - (d - H)|, where G and c lie in intervals of neighbouring slabs.
    static double difference(const Interval& c, const Interval& g, const Interval& d, const Interval& h) {
        return std::max(c.high - g.low - d.low + h.high, d.high - h.low - c.low + g.high);
    }

    // Back to front: C_k = C_(k+1) (1 - alpha_k) + c_k alpha_k.  What slab k errs by is dimmed by what lies in front:
    //     E_k = dalpha (c_k - C'_(k+1)) + alpha' dc + kappa + (1 - alpha_k) E_(k+1)
    void from_the_front(std::array<Shares, 4>& all) {
        double in_front = 1;
        for (std::size_t i = slabs_.size(); i-- > 0;) {  // slabs_ begins with the hindmost
            const Seen& k = slabs_[i];
            for (std::size_t c = 0; c < 4; ++c) {
                const double before = c == 3 ? 1 - k.clear_before : k.color[c].before,
                             after = c == 3 ? 1 - k.clear_after : k.color[c].after,
                             value = c == 3 ? 1 : k.color[c].value;
                const Interval color = colors(k, c);
                Shares& shares = all[c];
                shares.add(k.alpha_error,
                           in_front * std::max(std::abs(color.high - before), std::abs(color.low - before)));
                if (c < 3) shares.add(k.color[c].error, in_front * k.alpha);
                const double kappa = after - before * (1 - k.alpha) - value * k.alpha;
                if (std::abs(kappa) >= 0x1p-46)
                    add_local(shares, in_front * std::abs(kappa),
                              {{c == 3 ? index_of(Wire::transparency) : index_of(Wire::color), 0.0}});
            }
            in_front *= 1 - opacities(k).low;
        }
    }

    const CompositingStage& s_;
    double alpha_unit_ = 1, color_unit_ = 1, brightest_ = 0;
    std::vector<Seen> slabs_;
};

// --------------------------------------------------------------------------------------------------------- pictures

/// One row's rays.
struct Row {
    std::vector<float> most;  // of each ray that met the volume, LSB8
    Certificate part;
};

template <class M>
void certify_row(const Plan& plan, const M& bounded_method, int row, int payer, Image* image, Row& to) {
    const BoundedVolume voxels{*plan.volume};
    Ray ray(plan);
    for (int column = 0; column < plan.camera.width; ++column) {
        const RaySetup setup = plan.set_up(column, row);
        if (setup.slabs == 0) continue;
        ray.begin();
        Pixel<Bounded> pixel;
        cast_ray(plan, bounded_method, voxels, ray_words<Bounded>(plan, setup), setup.slabs, ray, pixel);
        std::array<Shares, 4> bound = ray.bound(pixel.samples < setup.slabs);
        const Accumulated<Bounded>& words = pixel.gathered;
        Ray::limit(bound,
                   color_of(plan.compositing,
                            Accumulated<double>{{in_double(words.color[0].v), in_double(words.color[1].v),
                                                 in_double(words.color[2].v)},
                                                in_double(words.transparency.v)}),
                   ray.brightest());
        Certificate& part = to.part;
        ++part.rays;
        double most = 0;
        std::array<bool, kDoubtNames.size()> doubts{};
        for (std::size_t c = 0; c < 4; ++c) {
            const Shares lsb8 = bound[c].scaled(255);
            const double sum = lsb8.sum();
            most = std::max(most, sum);
            doubts[0] = doubts[0] || lsb8[kWallsPay] > kUndecided;
            doubts[1] = doubts[1] || lsb8[kTerminationPays] > kUndecided;
            part.greatest = greatest(part.greatest, lsb8);
            if (sum > part.most)
                part.most = sum, part.shares = lsb8, part.column = column, part.row = row,
                part.channel = static_cast<int>(c);
            if (image) {
                const std::size_t at =
                    static_cast<std::size_t>(row) * static_cast<std::size_t>(image->width) +
                    static_cast<std::size_t>(column);
                const double value = payer < 0 ? bound[c].sum() : bound[c][payer];
                auto stored = static_cast<float>(value);
                if (static_cast<double>(stored) < value) stored = std::nextafter(stored, 2.0f);
                image->channels[c].values[at] = stored;
            }
        }
        for (std::size_t d = 0; d < doubts.size(); ++d) part.undecided[d] += doubts[d];
        if (doubts[0] || doubts[1])
            ++part.undecided_rays;
        else
            part.most_decided = std::max(part.most_decided, most);
        to.most.push_back(static_cast<float>(most));
    }
}

}  // namespace

std::string_view payer_name(int payer) {
    if (payer < kWires) return kWireInfo[static_cast<std::size_t>(payer)].name;
    constexpr std::array<std::string_view, kPayers - kWires> kNames{"rows of tables", "walls", "termination",
                                                                    "doubles"};
    return payer < kPayers ? kNames[static_cast<std::size_t>(payer - kWires)] : "constants";
}

std::vector<std::pair<std::string_view, double>> shares_by_stage(const Certificate& certificate) {
    std::vector<std::pair<std::string_view, double>> all;
    for (const std::string_view stage : kStages) {
        double sum = 0;
        for (int p = 0; p < kWires; ++p)
            if (kWireInfo[static_cast<std::size_t>(p)].stage == stage) sum += certificate.shares[p];
        all.emplace_back(stage, sum);
    }
    for (int p = kWires; p < kPayers; ++p) all.emplace_back(payer_name(p), certificate.shares[p]);
    all.emplace_back(payer_name(Shares::kElsewhere), certificate.shares[Shares::kElsewhere]);
    return all;
}

nlohmann::ordered_json json_of(const Certificate& c) {
    using Json = nlohmann::ordered_json;
    Json stages = Json::object(), payers = Json::object(), undecided = Json::object();
    for (const auto& stage : shares_by_stage(c)) stages[std::string(stage.first)] = stage.second;
    for (int p = 0; p < Shares::kMost; ++p)
        if (c.greatest[p] > 0)
            payers[std::string(payer_name(p))] = {{"share_lsb8", c.shares[p]},
                                                  {"greatest_lsb8", c.greatest[p]}};
    for (std::size_t d = 0; d < kDoubtNames.size(); ++d)
        undecided[std::string(kDoubtNames[d])] = c.undecided[d];
    return {{"most_lsb8", c.most},
            {"median_lsb8", c.median},
            {"most_decided_lsb8", c.most_decided},
            {"at", {c.column, c.row}},
            {"channel", std::string(1, "RGBA"[c.channel])},
            {"rays", c.rays},
            {"undecided_rays", c.undecided_rays},
            {"undecided", undecided},
            {"stages_lsb8", stages},
            {"payers", payers}};
}

std::optional<std::string> what_is_not_bounded(const Plan& plan) {
    if (plan.real)
        return fmt::format("precision.preset {} rounds nothing; allowed: any other preset", plan.real_name());
    const bool is_series = std::holds_alternative<PowerSeriesOfOrder1>(plan.method);
    if (!std::holds_alternative<PostClassification>(plan.method) && !is_series)
        return fmt::format(
            "classification.method {}{} is not bounded yet; allowed: pc, pc_mid, pips of order 1",
            name_of(plan.scene.classification.method),
            plan.scene.classification.method == Method::pips ? " of this order" : "");
    const WallRule walls = plan.scene.classification.opaque_prediction;
    if (plan.walls.looks_twice || (is_series && plan.entries.any_opaque() && walls == WallRule::none))
        return fmt::format(
            "opaque entries with classification.opaque_prediction {} are not bounded yet; allowed: ends",
            name_of(walls));
    if (plan.lit) return "light is not bounded yet; allowed: shading.model none, or no lights";
    if (plan.interpolation.nearest)
        return "sampling.interpolation nearest jumps from voxel to voxel; allowed: trilinear";
    return {};
}

Certificate certify(const Plan& plan, const CertificateOptions& options) {
    if (const auto obstacle = what_is_not_bounded(plan)) throw InputError("--bound: " + *obstacle);
    const Function function(plan);
    Certificate all;
    Image* image = nullptr;
    if (options.channels) {
        all.image.width = plan.camera.width, all.image.height = plan.camera.height;
        for (const char* name : {"bound.R", "bound.G", "bound.B", "bound.A"}) all.image.add_float(name);
        image = &all.image;
    }
    std::vector<Row> rows(static_cast<std::size_t>(plan.camera.height));
    std::atomic<bool> stopped{false};
    tbb::task_arena arena(options.threads > 0
                              ? options.threads
                              : static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
    const auto certify_all = [&](const auto& method) {
        arena.execute([&] {
            tbb::parallel_for(0, plan.camera.height, [&](int row) {
                if (options.cancelled && *options.cancelled) stopped = true;
                if (!stopped)
                    certify_row(plan, method, row, options.payer, image, rows[static_cast<std::size_t>(row)]);
            });
        });
    };
    if (const auto* words = std::get_if<PostClassification>(&plan.method)) {
        certify_all(BoundedPostClassification{*words, function});
    } else {
        const auto& series = std::get<PowerSeriesOfOrder1>(plan.method);
        preintegration::ExactSeries exact = preintegration::build_exact_series(
            plan.entries, 1, false, plan.scene.classification.opaque_prediction != WallRule::none);
        exact.step = full_step(plan);
        certify_all(BoundedPowerSeries{series, function, exact});
    }
    if (stopped) throw Cancelled{};
    std::vector<float> most;
    for (const Row& row : rows) {
        const Certificate& part = row.part;
        most.insert(most.end(), row.most.begin(), row.most.end());
        all.rays += part.rays;
        if (part.most > all.most)
            all.most = part.most, all.shares = part.shares, all.column = part.column, all.row = part.row,
            all.channel = part.channel;
        all.most_decided = std::max(all.most_decided, part.most_decided);
        all.greatest = greatest(all.greatest, part.greatest);
        for (std::size_t d = 0; d < all.undecided.size(); ++d) all.undecided[d] += part.undecided[d];
        all.undecided_rays += part.undecided_rays;
    }
    if (!most.empty()) {
        const auto middle = most.begin() + static_cast<std::ptrdiff_t>(most.size() / 2);
        std::nth_element(most.begin(), middle, most.end());
        all.median = *middle;
    }
    return all;
}

}  // namespace squint
