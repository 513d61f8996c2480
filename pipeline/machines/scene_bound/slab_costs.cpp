#include "pipeline/machines/scene_bound/slab_costs.h"

#include "core/portable_math.h"
#include "pipeline/machines/certificate.h"
#include "pipeline/machines/certificate/payers.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace squint {
namespace {

constexpr int kMostBins = 4096;  // where rows need no more
constexpr int kErrors = 9;

float not_less(double x) {
    const auto y = static_cast<float>(x);
    return static_cast<double>(y) < x ? std::nextafter(y, std::numeric_limits<float>::infinity()) : y;
}

/// The steepest that opacity changes with an input in [low, high], per entry: of a full slab, and of any shorter one.
struct Steepness {
    double full = 0, shorter = 0;
};
Steepness steepness(const Function& f, double low, double high) {
    Steepness most;
    const int first = std::clamp(static_cast<int>(low), 0, std::max(f.last() - 1, 0));
    for (int i = first; i < f.last() && (i == first || i < high); ++i) {
        const double from = std::max(low, static_cast<double>(i)), to = std::min(high, i + 1.0);
        const double slope = f.slope(Function::depth, from, from);
        const double least = std::min(f.at(Function::depth, from), f.at(Function::depth, to));
        most.full = std::max(most.full, slope * portable::exp(-least));
        // l exp(-l tau) at its greatest l <= 1.
        most.shorter = std::max(most.shorter, slope * (least < 1 ? portable::exp(-least) : 0.36788 / least));
    }
    return most;
}

const EntryLookup& entries_of(const Plan& plan) {
    const auto* pips = std::get_if<PowerSeriesOfOrder1>(&plan.method);
    return pips ? pips->prefix.entries : std::get<PostClassification>(plan.method).entries;
}
/// What the lines and the end of the table of opacities are off by.
double off_of_lines(const OpacityUnit& table) {
    return std::ldexp(1.0, -2 * table.row_bits - 3) + std::ldexp(1.0, -table.alpha_fraction - 3) +
           portable::exp(-std::ldexp(table.rows.rows() - 2, -table.row_bits));
}

/// h(v - light): a slab that is seen by `alpha` costs alpha `light` more.
Costs lit(const Costs& dark, const LitCosts& before, double light) {
    Costs costs;
    for (std::size_t k = 0; k < kKnots.size(); ++k) {
        const double v = kKnots[k] - light;
        double h = 0;
        if (v >= 0) {
            h = dark.more(v);
        } else if (v < -1) {
            h = before.at[kKnots.size() - 2] - (v + 1) * static_cast<double>(before.at.back());
        } else {
            std::size_t i = 1;
            while (i + 1 < kKnots.size() && kKnots[i] < -v) ++i;
            const double way = (-v - kKnots[i - 1]) / (kKnots[i] - kKnots[i - 1]),
                         from = i == 1 ? dark.at[0] : before.at[i - 2];
            h = from + way * (static_cast<double>(before.at[i - 1]) - from);
        }
        costs.at[k] = not_less(h + std::abs(h) * 0x1p-30 + 0x1p-60);
    }
    costs.at.back() = not_less((dark.last() + light * before.at.back()) * (1 + 0x1p-30));
    return costs;
}

/// How far two neighbouring words of a table's column are from the values that they stand for.
struct RowErrors {
    double most = 0;
    bool nothing = true;  // both words are zero
};

}  // namespace

SlabCosts::SlabCosts(const Plan& plan, const SampleErrors& errors, const LightErrors& light, double reach)
    : errors_(errors), light_(light), reach_(reach) {
    const Function function(plan);
    const EntryLookup& e = entries_of(plan);
    const int last = function.last();
    int bits = e.row_bits;
    while (bits < e.row_bits + 4 && last << (bits + 1) <= kMostBins) ++bits;
    per_entry_ = std::ldexp(1.0, bits);
    const int count = std::max(last << bits, 1);
    const PowerSeriesOfOrder1* pips = pips_of(plan);
    if (pips)
        steepest_row_ = std::ldexp(function.slope(Function::depth, 0, last), -pips->prefix.sub_entry_bits);
    for (int i = 0; i < count; ++i) {
        const double from = i / per_entry_, to = std::min((i + 1) / per_entry_, 1.0 * last);
        bin_.push_back(bin_at(plan, function, from, to));
        if (pips) add_ways(plan, *pips, function, from, to, bin_.back());
    }
    for (int i = 0; i <= last; ++i) flat_.push_back(bin_at(plan, function, i, i));
    for (std::vector<InputBin>* bins : {&bin_, &flat_})
        for (InputBin& bin : *bins) bin.count_with(light.brightest);
    costing_.push_back(0), visible_.push_back(0);
    for (const InputBin& bin : bin_) {
        costing_.push_back(costing_.back() + (bin.costs() || bin.opacity > 0));
        visible_.push_back(visible_.back() + bin.visible);
    }
    for (int i = 0; i < kErrors; ++i) error_.push_back(i < 2 ? 0 : std::ldexp(reach, i + 1 - kErrors));
    const auto fill = [&](auto& table, const auto& of) {
        table.resize(kErrors);
        for (std::size_t m = 0; m < kErrors; ++m) {
            auto& level = table[m];
            level.resize(static_cast<std::size_t>(std::bit_width(static_cast<unsigned>(count))));
            for (InputBin bin : bin_) {
                if (m == 0) bin.wall = bin.last_wall = 0;
                level[0].push_back(of(bin, error_[m]));
            }
            for (std::size_t l = 1; l < level.size(); ++l) {
                const std::size_t half = std::size_t{1} << (l - 1);
                level[l] = level[l - 1];
                for (std::size_t i = 0; i + half < level[l].size(); ++i)
                    level[l][i].take(level[l - 1][i + half]);
            }
        }
    };
    fill(table_, costs_of);
    if (light.lit) fill(lit_table_, lit_costs_of);
}

InputBin SlabCosts::bin_at(const Plan& plan, const Function& f, double from, double to) const {
    const EntryLookup& e = entries_of(plan);
    const bool point = from == to;
    const auto highest = static_cast<double>(f.last());
    const double low = std::max(from - reach_, 0.0), high = std::min(to + reach_, highest);
    // What the table's words and its straight lines are off by, of 1.0.
    const double rows = std::ldexp(1.0, e.row_bits);
    const auto row = static_cast<std::int64_t>(from * rows),
               next = std::min<std::int64_t>(point ? row : row + 1, e.table.rows() - 1);
    const int weight_bits = e.input_fraction - e.row_bits;
    const auto errors_of = [&](int column, int fraction, const auto& exact) {
        RowErrors errors;
        for (const std::int64_t r : {row, next}) {
            const auto word = static_cast<double>(e.table.word(r, column));
            const double place = std::min(static_cast<double>(r) / rows, highest);
            errors.most = std::max(errors.most, std::abs(std::ldexp(word, -fraction) - exact(place)));
            errors.nothing = errors.nothing && word == 0;
        }
        return errors;
    };
    const auto alpha_at = [&](double place) { return opacity_of(f.at(Function::depth, place)); };
    const RowErrors alpha =
        errors_of(EntryLookup::alpha, e.to_alpha.shift + e.alpha_fraction - weight_bits, alpha_at);
    // A row itself passes through, where no bits of it are dropped.
    const auto unit = [&](const Rescale& rescale, int fraction) {
        return point && rescale.shift <= weight_bits ? 0 : unit_of(rescale) * std::ldexp(1.0, -fraction);
    };
    const double alpha_unit = alpha.nothing ? 0 : unit(e.to_alpha, e.alpha_fraction);
    const double start = static_cast<double>(row) / rows, end = static_cast<double>(next) / rows;
    const double rise =
                     std::abs(f.at(Function::depth, std::min(end, highest)) - f.at(Function::depth, start)),
                 least =
                     std::min(f.at(Function::depth, std::min(end, highest)), f.at(Function::depth, start));
    const double bend = rise * rise / 8 * portable::exp(-least);
    double color = 0, color_steep = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const RowErrors of = errors_of(static_cast<int>(c), e.table_color_fraction,
                                       [&](double place) { return f.at(c, place); });
        color = std::max(color, of.most);
        color_steep = std::max(color_steep, f.slope(c, low, high));
    }
    const double color_unit = unit(e.to_color, e.color_fraction);

    InputBin bin;
    const Reach depths = f.over(Function::depth, from, to);
    const double off = alpha.most + alpha_unit + bend;
    const double most = std::min(opacity_of(depths.high) + off, 1.0);
    bin.visible = !alpha.nothing;
    bin.opacity = bin.visible ? std::max(opacity_of(depths.low) - off - 0x1p-40, 0.0) : 0;
    const Steepness steep = steepness(f, low, high);
    const double seen = bin.visible ? most : 0;
    bin.seen = bin.last_seen = seen;
    bin.steep = steep.full + seen * color_steep;
    bin.last_steep = steep.shorter + seen * color_steep;
    const auto add_color = [&](Shares& shares) {
        shares[index_of(Wire::table_color)] += seen * color;
        shares[index_of(Wire::slab_ratio)] += seen * color_unit;
    };
    bin.of_table[index_of(Wire::table_alpha)] = alpha.most;
    bin.of_table[index_of(Wire::slab_alpha)] = alpha_unit;
    bin.of_table[kRowsPay] = bend;
    add_color(bin.of_table);
    bin.table = bin.of_table.sum();

    // A ray's last slab takes its opacity from its depth; a length within half a last bit of one is one.
    const double deepest = f.over(Function::depth, low, high).high;
    const Function::Opaque near = f.opaque(low, high);
    if (deepest > 0 || near.any) {
        const OpacityUnit& table = e.opacity;
        const auto segment = std::min<std::int64_t>(static_cast<std::int64_t>(from), e.last_segment);
        double matter = 0;
        for (std::int64_t i = std::max<std::int64_t>(segment, 0);
             i <= std::min<std::int64_t>(segment + 1, f.last()); ++i)
            matter = std::max(
                matter, std::abs(std::ldexp(static_cast<double>(e.matter.word(i, EntryLookup::extinction)),
                                            -e.extinction_fraction) -
                                 f.at(Function::depth, static_cast<double>(i))));
        Shares& last = bin.of_last_table;
        last = greatest(bin.of_table, Shares::one(index_of(Wire::table_extinction), matter));
        last[index_of(Wire::slab_depth)] +=
            (unit_of(e.to_depth) + rounding_of(1e-300, e.to_shorter.rounding)) *
            std::ldexp(1.0, -table.depth_fraction);
        last[index_of(Wire::slab_alpha)] =
            std::max(last[index_of(Wire::slab_alpha)],
                     unit_of(table.to_alpha) * std::ldexp(1.0, -table.alpha_fraction)) +
            off_of_lines(table);
        last[index_of(Wire::length)] += rounding_of(1e-300, plan.location.length.rounding) *
                                        std::ldexp(1.0, -e.length_fraction) * deepest;
        bin.last_table = last.sum();
        bin.last_seen = std::max(seen, std::min(opacity_of(depths.high) + bin.last_table, 1.0));
    }

    // A wall: the word is opaque and the input without rounding is not, or the other way about.
    if (near.any && !near.all) {
        double least_there = std::numeric_limits<double>::infinity();
        for (int i = static_cast<int>(std::ceil(low)); i <= std::min(static_cast<int>(high), f.last()); ++i)
            if (f.opaque(i, i).any) least_there = std::min(least_there, f.at(Function::depth, i));
        if (std::isinf(least_there)) least_there = 0;
        bin.wall = portable::exp(-least_there), bin.last_wall = 1;
    }
    if (near.all) bin.opacity = f.opaque(from, to).all ? 1 : bin.opacity;
    if (near.any) bin.seen = bin.last_seen = 1;
    return bin;
}

/// Parts of slabs between two inputs that lie in [from, to], beside slabs of one input there.
void SlabCosts::add_ways(const Plan& plan, const PowerSeriesOfOrder1& pips, const Function& f, double from,
                         double to, InputBin& bin) const {
    const PrefixLookup& p = pips.prefix;
    const EntryLookup& e = p.entries;
    const auto highest = static_cast<double>(f.last());
    const double low = std::max(from - reach_, 0.0), high = std::min(to + reach_, highest);
    const Reach depths = f.over(Function::depth, from, to);
    double color_steep = 0;
    for (std::size_t c = 0; c < 3; ++c) color_steep = std::max(color_steep, f.slope(c, low, high));
    const double steep = f.slope(Function::depth, low, high) + depths.high * color_steep;

    // Rates of the words' rows, an entry, beside what rises there: extinction is straight in a row.
    const double rows = std::ldexp(1.0, p.sub_entry_bits),
                 depth_unit = std::ldexp(rows, -e.extinction_fraction),
                 light_unit = std::ldexp(rows, -plan.specs[Wire::table_moment].format.fraction_bits);
    double off_depth = 0, off_rise = 0, off_light = 0, of_rows = 0;
    bool visible = bin.visible;
    const auto first = static_cast<std::int64_t>(from * rows);
    for (std::int64_t r = first; r + 1 < p.depth.rows() && (r == first || static_cast<double>(r) < to * rows);
         ++r) {
        const auto rise = [&](const Table& table, int column, double unit) {
            return static_cast<double>(table.word(r + 1, column) - table.word(r, column)) * unit;
        };
        const double rate = rise(p.depth, 0, depth_unit),
                     bend = p.curved ? static_cast<double>(p.depth.word(r, 1)) * depth_unit / 2 : 0;
        visible = visible || rate > 0 || bend != 0;
        const std::array<double, 2> place{static_cast<double>(r) / rows,
                                          std::min(static_cast<double>(r + 1) / rows, highest)},
            depth{f.at(Function::depth, place[0]), f.at(Function::depth, place[1])};
        off_depth = std::max({off_depth, std::abs(rate - bend - depth[0]), std::abs(rate + bend - depth[1])});
        off_rise = std::max(off_rise, std::abs(rate - (depth[0] + depth[1]) / 2));
        for (std::size_t c = 0; c < 3; ++c) {
            const std::array<double, 2> color{f.at(c, place[0]), f.at(c, place[1])};
            const double light = (color[0] * depth[0] + color[1] * depth[1]) / 3 +
                                 (color[0] * depth[1] + color[1] * depth[0]) / 6;
            off_light =
                std::max(off_light, std::abs(rise(pips.moment, static_cast<int>(c), light_unit) - light));
            // Of the row's colour to the farther of its ends.
            const double deeper = std::max(depth[0], depth[1]), both = depth[0] + depth[1],
                         farther = both > 0 ? (1 + deeper / both) / 3 : 0;
            of_rows =
                std::max(of_rows, (deeper * farther + steepest_row_ / 4) * std::abs(color[1] - color[0]));
        }
    }
    // The colour divides by straight rises, of which a depth is twice as much at most.
    constexpr double kTwice = 2;
    const double of_depth =
                     rounding_of(1e-300, p.to_depth.rounding) * std::ldexp(1.0, -e.opacity.depth_fraction),
                 of_alpha = unit_of(e.opacity.to_alpha) * std::ldexp(1.0, -e.opacity.alpha_fraction) +
                            off_of_lines(e.opacity),
                 off = off_depth + of_depth + of_alpha,
                 seen = visible ? std::min(opacity_of(depths.high) + off, 1.0) : 0;
    Shares table;
    if (visible || depths.high > 0) {
        const double of_words = std::min(off_depth, depth_unit);
        table[index_of(Wire::table_extinction)] = of_words;
        table[kRowsPay] = off_depth - of_words;
        if (visible) {
            table[index_of(Wire::table_moment)] = kTwice * off_light;
            table[index_of(Wire::table_extinction)] += kTwice * 2 * off_rise;
            table[kRowsPay] += of_rows;
            table[index_of(Wire::slab_depth)] = of_depth;
            table[index_of(Wire::slab_alpha)] = of_alpha;
            table[index_of(Wire::slab_ratio)] =
                seen * rounding_of(1e-300, pips.to_ratio.rounding) * std::ldexp(1.0, -e.color_fraction);
        }
    }
    Shares last = table;
    if (visible)
        last[index_of(Wire::slab_depth)] +=
            rounding_of(1e-300, e.to_shorter.rounding) * std::ldexp(1.0, -e.opacity.depth_fraction);
    last[index_of(Wire::length)] +=
        std::ldexp(1.0, -e.length_fraction) * f.over(Function::depth, low, high).high;

    bin.visible = visible;
    bin.opacity = std::min(bin.opacity, visible ? std::max(opacity_of(depths.low) - off - 0x1p-40, 0.0) : 0);
    // A mean of depths is no less than the opacity of their sum.
    bin.seen = std::max(bin.seen, visible ? depths.high + off : 0);
    bin.last_seen = std::max({bin.last_seen, bin.seen, depths.high + last.sum()});
    bin.steep = std::max(bin.steep, steep), bin.last_steep = std::max(bin.last_steep, steep);
    if (table.sum() > bin.table) bin.of_table = table, bin.table = table.sum();
    if (last.sum() > bin.last_table) bin.of_last_table = last, bin.last_table = last.sum();
}

Costs SlabCosts::costs_of(const InputBin& bin, double error) {
    Costs costs;
    for (std::size_t k = 0; k < kKnots.size(); ++k)
        costs.at[k] =
            not_less((bin.steep * error + bin.table + bin.wall) * (1 + 0x1p-40) - bin.opacity * kKnots[k]);
    costs.at.back() = not_less((bin.last_steep * error + bin.last_table + bin.last_wall) * (1 + 0x1p-40));
    return costs;
}

LitCosts SlabCosts::lit_costs_of(const InputBin& bin, double error) {
    LitCosts costs;
    for (std::size_t k = 1; k < kKnots.size(); ++k)
        costs.at[k - 1] =
            not_less((bin.steep * error + bin.table + bin.wall + bin.seen * kKnots[k]) * (1 + 0x1p-40));
    costs.at.back() = not_less(bin.last_seen);
    return costs;
}

const InputBin* SlabCosts::flat_bin(const CellValues& cell) const {
    if (!cell.flat() || errors_.scaled || (errors_.two_products && cell.high != 0)) return nullptr;
    return &flat_[std::min(static_cast<std::size_t>(cell.low), flat_.size() - 1)];
}

SlabCosts::Bins SlabCosts::bins_of(const CellValues& cell, bool reached) const {
    const double beyond = reached ? reach_ : errors_.beyond();
    const int most = bins() - 1;
    const double low = (cell.low * errors_.scale - beyond) * per_entry_,
                 high = (cell.high * errors_.scale + beyond) * per_entry_;
    const int first = std::clamp(static_cast<int>(std::floor(low)), 0, most);
    return {first, std::clamp(static_cast<int>(std::ceil(high)) - 1, first, most)};
}

bool SlabCosts::may_cost(const CellValues& cell) const {
    return !cost_nothing(bins_of(cell, true));
}

Costs SlabCosts::of(const CellValues& cell) const {
    const double light = light_of(cell), error = errors_.of(cell);
    const InputBin* flat = flat_bin(cell);
    if (flat && !(light > 0)) {
        InputBin bin = *flat;
        bin.wall = bin.last_wall = 0;
        return costs_of(bin, 0);
    }
    const Bins bins = bins_of(cell, error > 0 || light > 0);
    if (cost_nothing(bins)) return {};
    const auto greatest_of = [&](const auto& table, std::size_t m) {
        const auto count = static_cast<unsigned>(bins.last - bins.first + 1);
        const int level = std::bit_width(count) - 1;
        const auto& row = table[m][static_cast<std::size_t>(level)];
        auto all = row[static_cast<std::size_t>(bins.first)];
        all.take(row[static_cast<std::size_t>(bins.last + 1 - (1 << level))]);
        return all;
    };
    if (!(error > 0) && !(light > 0)) return greatest_of(table_, 0);
    std::size_t m = 2;
    while (m + 1 < error_.size() && error_[m] < error) ++m;
    // Convex in the error as well: at most straight between two.
    const auto way = static_cast<float>((error - error_[m - 1]) / (error_[m] - error_[m - 1]));
    const auto between = [&](const auto& table) {
        auto all = greatest_of(table, m - 1);
        const auto far = greatest_of(table, m);
        for (std::size_t i = 0; i < all.at.size(); ++i) {
            const float step = far.at[i] - all.at[i];
            all.at[i] += way * step + (std::abs(all.at[i]) + std::abs(far.at[i])) * 0x1p-21f;
        }
        return all;
    };
    const Costs dark = between(table_);
    return light > 0 ? lit(dark, between(lit_table_), light) : dark;
}

bool SlabCosts::visible(const CellValues& cell) const {
    if (const InputBin* flat = flat_bin(cell)) return flat->visible;
    const Bins bins = bins_of(cell, false);
    return visible_[static_cast<std::size_t>(bins.last) + 1] !=
           visible_[static_cast<std::size_t>(bins.first)];
}

SlabCosts::Decided SlabCosts::decided(const CellValues& cell, double v, bool last) const {
    Decided best;
    const double error = errors_.of(cell), light = light_of(cell);
    double most = -std::numeric_limits<double>::infinity();
    const auto ask = [&](const InputBin& bin, int index) {
        const double wall = error > 0 || light > 0 ? (last ? bin.last_wall : bin.wall) : 0,
                     steep = last ? bin.last_steep : bin.steep, table = last ? bin.last_table : bin.table,
                     seen = last        ? bin.last_seen
                            : light > v ? bin.seen
                                        : bin.opacity;
        const double cost = steep * error + table + wall + seen * light,
                     opacity = last ? 0 : std::min(seen, 1.0);
        if (!(cost - opacity * v > most)) return;
        most = cost - opacity * v;
        best = {cost, opacity, last ? bin.of_last_table : bin.of_table, index};
        best.shares.add(errors_.shares_of(cell), steep);
        if (light_.lit) best.shares.add(light_.shares_of(cell), seen);
        best.shares[kWallsPay] += wall;
    };
    if (const InputBin* flat = flat_bin(cell); flat && !(light > 0)) {
        ask(*flat, static_cast<int>(cell.low * per_entry_));
        return best;
    }
    const Bins bins = bins_of(cell, error > 0 || light > 0);
    if (cost_nothing(bins)) return best;
    for (int i = bins.first; i <= bins.last; ++i) ask(bin_[static_cast<std::size_t>(i)], i);
    return best;
}

}  // namespace squint
