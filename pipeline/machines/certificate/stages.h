// Stages whose bound is tighter than that of their operations, and the composition over bounded words: whoever
// includes this runs it.
#pragma once

#include "pipeline/machines/certificate/inside.h"
#include "pipeline/machines/certificate/light.h"
#include "pipeline/machines/certificate/payers.h"
#include "pipeline/machines/certificate/reached.h"
#include "pipeline/stages/ray_setup-inl.h"

#include "pipeline/classification/entries-inl.h"
#include "pipeline/stages/compositing-inl.h"
#include "pipeline/stages/interpolation-inl.h"
#include "pipeline/stages/location-inl.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>

namespace squint {

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

/// A cell in its volume: what lies beside it counts where an error leads there.
struct BoundedCell {
    const Volume& volume;
    std::array<std::int64_t, 3> at;
    Cell<Int128> corners;

    std::int64_t voxel(std::int64_t x, std::int64_t y, std::int64_t z) const {
        const Index3& d = volume.dims;
        return volume.at(std::min(x, d.x - 1), std::min(y, d.y - 1), std::min(z, d.z - 1));
    }
    /// The steepest edges of cells along each axis, levels a voxel.
    std::array<double, 3> slopes(const ReachedCells& cells) const {
        std::array<double, 3> steepest{};
        const auto range = static_cast<double>(volume.largest - volume.smallest);
        if (cells.far) return {range, range, range};
        cells.corners([&](const std::array<std::int64_t, 3>& p) {
            const std::int64_t here = voxel(p[0], p[1], p[2]);
            const auto take = [&](std::size_t axis, std::int64_t next) {
                steepest[axis] = std::max(steepest[axis], std::abs(static_cast<double>(next - here)));
            };
            if (p[0] <= cells.high[0]) take(0, voxel(p[0] + 1, p[1], p[2]));
            if (p[1] <= cells.high[1]) take(1, voxel(p[0], p[1] + 1, p[2]));
            if (p[2] <= cells.high[2]) take(2, voxel(p[0], p[1], p[2] + 1));
        });
        return steepest;
    }
};
struct BoundedVolume {
    const Volume& volume;
    int weight_bits = 0;
    BoundedCell cell(const std::array<Bounded, 3>& at) const;
    template <class W>
    auto neighbourhood(const std::array<W, 3>& at) const;
    template <class W>
    auto box_sums(const std::array<W, 3>& at) const;
};

/// The voxel nearest to a point, and all those that its location's error may make the nearest.
inline Bounded nearest_of(const InterpolationStage& s, const BoundedCell& cell,
                          const std::array<Bounded, 3>& weight, Int128 word) {
    const double whole = std::ldexp(1.0, s.weight_bits), one = std::ldexp(1.0, s.sample_fraction);
    std::array<std::int64_t, 3> low{}, high{};
    double all = 0;
    bool far = false;
    for (std::size_t a = 0; a < 3; ++a) {
        const double place = in_double(weight[a].v) / whole + 0.5, off = weight[a].most() / whole;
        all += weight[a].most(), far = far || !(off < 4);
        if (far) break;
        low[a] = cell.at[a] + static_cast<std::int64_t>(std::floor(place - off * (1 + 1e-9)));
        high[a] = cell.at[a] + static_cast<std::int64_t>(std::floor(place + off * (1 + 1e-9)));
    }
    double most = static_cast<double>(cell.volume.largest - cell.volume.smallest) * one;
    if (!far) {
        most = 0;
        for (std::int64_t z = low[2]; z <= high[2]; ++z)
            for (std::int64_t y = low[1]; y <= high[1]; ++y)
                for (std::int64_t x = low[0]; x <= high[0]; ++x) {
                    const auto value = static_cast<double>(cell.voxel(std::max<std::int64_t>(x, 0),
                                                                      std::max<std::int64_t>(y, 0),
                                                                      std::max<std::int64_t>(z, 0)));
                    most = std::max(most, std::abs(value * one - in_double(word)));
                }
    }
    Shares error;
    if (most > 0 && all > 0)
        for (const Bounded& w : weight)
            if (!w.exact) error.add(w.error, most / all);
    return with_error(word, std::isfinite(all) ? error : Shares::one(-1, most));
}

/// Lerps are contractions in their values, so what the point is displaced by counts with the steepest edges of the cells
/// that it can reach, and every level's own rounding once.
inline Bounded interpolate(const InterpolationStage& s, const BoundedCell& cell,
                           const std::array<Bounded, 3>& weight) {
    const Int128 word = HWY_NAMESPACE::interpolate(
        s, cell.corners, std::array<Int128, 3>{weight[0].v, weight[1].v, weight[2].v});
    if (s.nearest) return nearest_of(s, cell, weight, word);
    // What the three levels have taken: none of them can be told from the others.
    const int bits = s.weight_bits;
    std::array<std::int64_t, 8> corner{};
    for (std::size_t i = 0; i < 8; ++i) corner[i] = static_cast<std::int64_t>(cell.corners.corner[i]);
    const double taken = BetweenCorners(corner, weight, bits).from(word, s.sample_fraction);
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

    const double whole = std::ldexp(1.0, bits);
    const std::array<double, 3> slope = cell.slopes(reached_cells(cell.volume, cell.at, weight, bits));
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

/// Words alone: errors of C and T are the ray's, not the slab's (ray.h).
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

inline BoundedCell BoundedVolume::cell(const std::array<Bounded, 3>& at) const {
    const std::array<std::int64_t, 3> place{static_cast<std::int64_t>(at[0].v),
                                            static_cast<std::int64_t>(at[1].v),
                                            static_cast<std::int64_t>(at[2].v)};
    const HWY_NAMESPACE::FromVolume voxels{volume};
    return {volume, place, voxels.cell(std::array<Int128, 3>{at[0].v, at[1].v, at[2].v})};
}
template <class W>
auto BoundedVolume::neighbourhood(const std::array<W, 3>& at) const {
    const HWY_NAMESPACE::FromVolume voxels{volume};
    const std::array<Int128, 3> cell{at[0].v, at[1].v, at[2].v};
    return HWY_NAMESPACE::Neighbourhood<W>{
        &volume, {to_index(at[0]), to_index(at[1]), to_index(at[2])}, voxels.neighbourhood(cell), false};
}
template <class W>
auto BoundedVolume::box_sums(const std::array<W, 3>& at) const {
    const HWY_NAMESPACE::FromVolume voxels{volume};
    const std::array<Int128, 3> cell{at[0].v, at[1].v, at[2].v};
    return HWY_NAMESPACE::Neighbourhood<W>{
        &volume, {to_index(at[0]), to_index(at[1]), to_index(at[2])}, voxels.box_sums(cell), true};
}

inline double DifferenceField::value(const Place& p) const {
    const Volume& volume = *near_.volume;
    const Place at{voxel_at(p[0], volume.dims.x), voxel_at(p[1], volume.dims.y),
                   voxel_at(p[2], volume.dims.z)};
    if (!near_.of_sums) return static_cast<double>(volume.at(at[0], at[1], at[2]));
    std::array<int, 3> from_cell{};
    bool is_near = true;
    for (std::size_t a = 0; a < 3; ++a) {
        from_cell[a] = static_cast<int>(p[a] - near_.cell[a]) + 1;
        is_near = is_near && 0 <= from_cell[a] && from_cell[a] < 4;
    }
    if (is_near) return static_cast<double>(near_.words.at(from_cell[0], from_cell[1], from_cell[2]));
    const HWY_NAMESPACE::FromVolume voxels{volume};
    return static_cast<double>(voxels.box_sums(std::array<Int128, 3>{at[0], at[1], at[2]}).at(1, 1, 1));
}

/// Whether a cell holds a wall, in all cells that the point may lie in.
inline Bounded nears_wall(const BoundedVolume& voxels, const WallStage& walls,
                          const CellPosition<Bounded>& at) {
    const HWY_NAMESPACE::FromVolume volume{voxels.volume};
    const std::array<std::int64_t, 3> cell{to_index(at.cell[0]), to_index(at.cell[1]), to_index(at.cell[2])};
    const std::int64_t here = volume.nears_wall(walls, cell);
    if (at.weight[0].exact && at.weight[1].exact && at.weight[2].exact) return {here, true, {}};
    const ReachedCells cells = reached_cells(voxels.volume, cell, at.weight, voxels.weight_bits);
    bool same = !cells.far;
    for (std::int64_t z = cells.low[2]; same && z <= cells.high[2]; ++z)
        for (std::int64_t y = cells.low[1]; same && y <= cells.high[1]; ++y)
            for (std::int64_t x = cells.low[0]; same && x <= cells.high[0]; ++x)
                same = volume.nears_wall(walls, std::array<std::int64_t, 3>{x, y, z}) == here;
    return same ? Bounded{here, true, {}} : with_error(here, Shares::one(kWallsPay, 1));
}

}  // namespace squint
