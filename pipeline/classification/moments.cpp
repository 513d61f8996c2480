#include "pipeline/classification/moments.h"

#include "core/error.h"
#include "pipeline/classification/tables/legendre.h"
#include "pipeline/classification/tables/moment_rows.h"
#include "pipeline/classification/tables/power_series.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <utility>

namespace squint {
namespace {

constexpr int kMostRows = kMostEntryRows;
constexpr int kMostDeepRows = 32768;  // where an entry is deeper than 8: 2 rows err by 39 LSB8, 8 by 5
constexpr std::int64_t kMostValues = 8 << 20;

/// One entry of the tables: its depth, and the light of each channel.
struct Step {
    double depth;
    std::array<double, 3> light;
};
std::vector<Step> steps_of(const Entries& entries, bool as_printed) {
    std::vector<Step> steps;
    steps.reserve(entries.entry.size());
    for (std::size_t i = 0; i + 1 < entries.entry.size(); ++i) {
        const Entry &a = entries.entry[i], &b = entries.entry[i + 1];
        const double t0 = a.extinction, t1 = b.extinction;
        Step step{(t0 + t1) / 2, {}};
        if (as_printed) {  // rectangles
            steps.push_back({t0, {a.color.x * t0, a.color.y * t0, a.color.z * t0}});
            continue;
        }
        for (int c = 0; c < 3; ++c)  // exact for linear colour and extinction
            step.light[static_cast<std::size_t>(c)] =
                (2 * a.color[c] * t0 + 2 * b.color[c] * t1 + a.color[c] * t1 + b.color[c] * t0) / 6;
        steps.push_back(step);
    }
    return steps;
}

/// Fills the block of `length` steps from `start` on, in units of the power of two above its depth.  It is
/// write_moment_rows for any rounding, and sets exact values.
void fill_block(MomentSeries& m, const std::vector<Step>& steps, int row, int start, int length, double unit,
                const Spec& spec) {
    const int end = std::min<int>(start + length, static_cast<int>(steps.size()));
    double depth = 0;
    std::array<std::array<double, 3>, kMostMomentOrder> moment{};
    const auto put = [&](int at) {
        m.moments.set(at, 0, depth, spec);
        for (int k = 0; k < m.order; ++k)
            for (int c = 0; c < 3; ++c)
                m.moments.set(at, 1 + 3 * k + c,
                              moment[static_cast<std::size_t>(k)][static_cast<std::size_t>(c)], spec);
    };
    put(row);
    for (int i = start; i < start + length; ++i) {
        if (i < end) {
            const Step& step = steps[static_cast<std::size_t>(i)];
            const double next = depth + step.depth * unit;
            double mean = 1, power = 1;  // of t^k over the step
            for (int k = 0; k < m.order; ++k) {
                if (k > 0) power *= depth, mean = (k * next * mean + power) / (k + 1);
                for (std::size_t c = 0; c < 3; ++c)
                    moment[static_cast<std::size_t>(k)][c] += step.light[c] * unit * mean;
            }
            depth = next;
        }
        put(row + 1 + i - start);
    }
}

/// The power of two just above a block's depth, from sums of two blocks of the level below.  Only where such
/// a sum's last bits decide are its steps added one by one, as the rows are.
class BlockUnits {
  public:
    explicit BlockUnits(const std::vector<Step>& steps) : steps_(steps), sums_(steps.size() + 2) {
        for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] = depth(i) + depth(i + 1);
    }
    double unit(int level, int block) const {
        const double sum = sums_[static_cast<std::size_t>(block)];
        int exponent = 0, above = 0;
        std::frexp(sum * (1 - 0x1p-40), &exponent), std::frexp(sum * (1 + 0x1p-40), &above);
        if (exponent != above) std::frexp(one_by_one(block << level, 2 << level), &exponent);
        return std::ldexp(1.0, -exponent);
    }
    void next_level() {
        for (std::size_t b = 0; 2 * b < sums_.size(); ++b)
            sums_[b] = sums_[2 * b] + (2 * b + 2 < sums_.size() ? sums_[2 * b + 2] : 0);
        sums_.resize((sums_.size() + 1) / 2);
    }

  private:
    double depth(std::size_t i) const { return i < steps_.size() ? steps_[i].depth : 0; }
    double one_by_one(int start, int length) const {
        double total = 0;
        for (int i = start; i < start + length; ++i) total += depth(static_cast<std::size_t>(i));
        return total;
    }
    const std::vector<Step>& steps_;
    std::vector<double> sums_;
};

/// Steps as the vector code takes them.
MomentSteps side_by_side(const std::vector<Step>& steps, int order) {
    MomentSteps result{order, 1 + 3 * order <= 8 ? 8 : MomentSteps::kPadded, {}};
    result.number.resize(steps.size() * static_cast<std::size_t>(result.padded));
    double* to = result.number.data();
    for (const Step& step : steps) {
        to[0] = step.depth;
        for (int k = 0; k < order; ++k) std::copy(step.light.begin(), step.light.end(), to + 1 + 3 * k);
        to += result.padded;
    }
    return result;
}

int level_count(int steps) {
    return static_cast<int>(std::bit_width(static_cast<unsigned>(steps - 1))) + 1;
}
/// Writes the rows of all blocks of a level.
int level_rows(int steps, int level) {
    return (steps / (1 << level) + 1) * ((2 << level) + 1);
}
std::int64_t all_rows(int steps) {
    std::int64_t rows = 0;
    for (int l = 0; l < level_count(steps); ++l) rows += level_rows(steps, l);
    return rows;
}

void fill_moments(MomentSeries& m, const Entries& fine, const Spec& spec, bool keeps_exact) {
    const std::vector<Step> steps = steps_of(fine, m.prefix.as_printed);
    const int count = static_cast<int>(steps.size()), columns = 1 + 3 * m.order;
    const int levels = level_count(count);
    m.levels = Table(levels, 1);
    int rows = 0;
    for (int l = 0; l < levels; ++l) {
        m.levels.set_raw(l, 0, rows);
        rows += level_rows(count, l);
    }
    if (std::int64_t{rows} * columns > kMostValues)
        throw InputError(fmt::format(
            "classification.order: moments of order {} over {} entries take {} MiB of words, and {} are "
            "allowed: take pips of order 1, or fewer transfer_function.entries",
            m.order, fine.size(), std::int64_t{rows} * columns >> 18, kMostValues >> 18));
    m.moments = Table(rows, columns, keeps_exact);
    const bool in_vectors = !keeps_exact && spec.rounding == Rounding::rnd_conv;
    const MomentSteps many = in_vectors ? side_by_side(steps, m.order) : MomentSteps{};
    std::unique_ptr<std::int32_t[]> words;
    if (in_vectors)
        words = std::make_unique_for_overwrite<std::int32_t[]>(static_cast<std::size_t>(rows * columns) +
                                                               MomentSteps::kPadded);
    BlockUnits units(steps);
    std::size_t row = 0;
    for (int l = 0; l < levels; ++l, units.next_level())
        for (int block = 0; block <= count >> l; ++block) {
            const int length = 2 << l, start = block << l, end = std::min(start + length, count);
            const double unit = units.unit(l, block);
            if (in_vectors) {
                std::int32_t* const first = words.get() + row * static_cast<std::size_t>(columns);
                write_moment_rows(many, start, end, unit, spec.format.fraction_bits, first);
                std::int32_t* const last = first + (end - start) * columns;
                for (int i = end; i < start + length; ++i)
                    std::copy_n(last, columns, last + (i + 1 - end) * columns);
            } else {
                fill_block(m, steps, static_cast<int>(row), start, length, unit, spec);
            }
            row += static_cast<std::size_t>(length) + 1;
        }
    if (in_vectors) m.moments.take(std::move(words));
}

/// g_j(x), j >= 1: the weight of L_j in the straight colour.
double legendre_weight_over_opacity(int j, double x) {
    if (x <= 0) return 0;
    return (j % 2 ? -1 : 1) * (2 * j + 1) * preintegration::legendre_weight(j, x) /
           preintegration::legendre_weight(0, x);
}
double power_series_weight(int order, int j, double x) {
    // sum_k (-x)^k / k! m_k over sum_k (-x)^k / (k+1)!, with m_k = sum_j L_j (2j+1) k!^2 / ((k-j)! (k+j+1)!).
    const auto factorial = [](int n) {
        double product = 1;
        for (int i = 2; i <= n; ++i) product *= i;
        return product;
    };
    double above = 0, below = 0, power = 1;
    for (int k = 0; k < order; ++k, power *= -x) {
        below += power / factorial(k + 1);
        if (k >= j) above += power * (2 * j + 1) * factorial(k) / (factorial(k - j) * factorial(k + j + 1));
    }
    return below == 0 ? std::copysign(1e6, above) : above / below;  // at a pole: any word's limit
}

Table computed_weights(int order, bool legendre, double deepest, int row_bits, const Spec& spec) {
    const int rows = static_cast<int>(std::ceil(std::ldexp(deepest, row_bits))) + 2;
    Table weights(rows, order - 1);
    weights.wire = static_cast<int>(Wire::slab_ratio);
    for (int i = 0; i < rows; ++i) {
        const double x = std::ldexp(i, -row_bits);
        for (int j = 1; j < order; ++j)
            weights.set(i, j - 1,
                        legendre ? legendre_weight_over_opacity(j, x) : power_series_weight(order, j, x),
                        spec);
    }
    return weights;
}

void fill_weights(MomentSeries& m, bool legendre, double deepest) {
    const Spec spec{{5, m.weight_fraction, true}, Rounding::rnd_conv, Overflow::sat};
    // They do not depend on the transfer function, and copies share rows: the last few are kept.
    struct Kept {
        int order, row_bits;
        bool legendre;
        double deepest;
        Spec spec;
        Table weights;
    };
    static thread_local std::vector<Kept> kept;
    const auto found = std::find_if(kept.begin(), kept.end(), [&](const Kept& k) {
        return k.order == m.order && k.row_bits == m.row_bits && k.legendre == legendre &&
               k.deepest == deepest && k.spec == spec;
    });
    if (found == kept.end()) {
        if (kept.size() == 4) kept.erase(kept.begin());
        kept.push_back({m.order, m.row_bits, legendre, deepest, spec,
                        computed_weights(m.order, legendre, deepest, m.row_bits, spec)});
        m.weights = kept.back().weights;
    } else {
        m.weights = found->weights;
    }
    m.to_weight = Rescale(m.weight_fraction + m.depth_fraction - m.row_bits, spec);
}

static_assert(orders_of(Method::leg).most == preintegration::kMostLegendre &&
              orders_of(Method::pips).most == preintegration::kMostMoments);
void check_order(const ClassificationSettings& settings) {
    const int order = settings.order_or_least();
    const Orders orders = orders_of(settings.method);
    if (order < orders.least || order > orders.most)
        throw InputError(fmt::format("classification.order: {} is not an order of {}, which has {} to {}",
                                     order, name_of(settings.method), orders.least, orders.most));
}

}  // namespace

void MomentSeries::describe(ClassificationReport& report) const {
    prefix.describe(report);
    report.add("moments", moments,
               fmt::format("overlapped levels of depth and {} moments a channel, {} sub-entr{} an entry",
                           order, 1 << sub_entry_bits, sub_entry_bits ? "ies" : "y"));
    report.add("weights", weights, "of the Legendre moments over the optical depth");
    report.add(rows_of_color);
    report.notes.push_back(note);
}

MomentSeries MomentSeries::build(const ClassificationInputs& in) {
    const bool legendre = in.settings.method == Method::leg;
    check_order(in.settings);
    MomentSeries m;
    m.prefix = build_prefix_lookup(in);
    m.order = in.settings.order_or_least();
    m.splits = legendre;
    const Spec moment = in.specs[Wire::table_moment], ratio = in.specs[Wire::slab_ratio],
               depth = in.specs[Wire::slab_depth], alpha = in.specs[Wire::slab_alpha];

    // Sub-entries where a single entry is deep.
    const double deepest = preintegration::deepest_entry(in.entries, in.step_world);
    const int wanted = deepest <= 1 ? 0 : deepest <= 8 ? 2 : 3;
    const EntryRows for_color = rows_for_color(in, kMostRows);
    m.sub_entry_bits = std::min(std::max(wanted, for_color.bits), in.input_fraction);
    const int most_rows = wanted == 3 ? kMostDeepRows : kMostRows;
    const auto too_many = [&] {
        const int steps = (in.entries.size() - 1) << m.sub_entry_bits;
        return in.entries.size() << m.sub_entry_bits > most_rows ||
               all_rows(steps) * (1 + 3 * m.order) > kMostValues;
    };
    while (m.sub_entry_bits > 0 && too_many()) --m.sub_entry_bits;
    m.rows_of_color = {"a colour constant in a sub-entry",
                       std::ldexp(for_color.lsb8, for_color.bits - m.sub_entry_bits)};
    Entries between;
    if (m.sub_entry_bits) between = preintegration::subdivided(in.entries, 1 << m.sub_entry_bits);
    const Entries& fine = m.sub_entry_bits ? between : in.entries;

    // The words of moments have the wire's bits, at most 28, so that products fit 64-bit lanes.
    const int wire = static_cast<int>(Wire::table_moment);
    m.word_fraction = std::clamp(moment.format.integer_bits + moment.format.fraction_bits, 8, 28);
    const Spec word{{1, m.word_fraction, false}, moment.rounding, Overflow::sat};
    fill_moments(m, fine, word, in.keeps_exact);
    m.moments.wire = wire;
    m.to_part = Rescale(m.word_fraction + in.input_fraction - m.sub_entry_bits, word, wire);
    m.to_product = Rescale(2 * m.word_fraction, word, wire);
    m.to_mean = Rescale(m.word_fraction + kInverseBits, word, wire);
    m.to_share = Rescale(0, word, wire);
    for (std::size_t k = 0; k < m.inverse.size(); ++k)
        m.inverse[k] = static_cast<std::int64_t>(
            std::floor(std::ldexp(1.0, kInverseBits) / (static_cast<double>(k) + 1) + 0.5));

    // Weights, and the depth up to which they are good.
    m.depth_fraction = depth.format.fraction_bits;
    m.row_bits = std::min(10, m.depth_fraction);
    constexpr double kAsPrinted = 16;  // deep: there the weights have nearly reached those of any depth
    const bool as_printed = m.prefix.as_printed;
    const double limit = as_printed ? std::ldexp(1.0, depth.format.integer_bits)
                         : legendre ? preintegration::legendre_split_depth(m.order)
                                    : preintegration::trusted_depth(m.order);
    m.limit = quantise_real(limit, {depth.format, Rounding::rnd, Overflow::sat});
    fill_weights(m, legendre, as_printed ? std::min(limit, kAsPrinted) : legendre ? 8 : limit);
    const int ratio_wire = static_cast<int>(Wire::slab_ratio);
    m.to_ratio = Rescale(m.word_fraction + m.weight_fraction, ratio, ratio_wire);
    const preintegration::ColorRange range = preintegration::color_range(in.entries);
    const Spec nearest{ratio.format, Rounding::rnd, Overflow::sat};
    for (int c = 0; c < 3; ++c) {
        m.lowest[static_cast<std::size_t>(c)] = quantise_real(range.low[c], nearest);
        m.highest[static_cast<std::size_t>(c)] = quantise_real(range.high[c], nearest);
        if (as_printed)  // no clamp but the word's own limits
            m.lowest[static_cast<std::size_t>(c)] = 0,
            m.highest[static_cast<std::size_t>(c)] = ratio.format.largest();
    }

    // How deep slabs are cut.
    const Spec extinction = in.specs[Wire::table_extinction];
    m.to_cut = Rescale(extinction.format.fraction_bits, {extinction.format, Rounding::trn, Overflow::sat});
    m.to_piece = Rescale(2 * alpha.format.fraction_bits, alpha, static_cast<int>(Wire::slab_alpha));
    m.to_whole = Rescale(ratio.format.fraction_bits, ratio, ratio_wire);

    if (as_printed) {
        m.note = fmt::format(
            "PIPS({}) as printed: no depth is redirected, and no colour is limited but by its word", m.order);
        return m;
    }
    if (legendre) {
        m.note = fmt::format(
            "LEG({}): overlapped level tables of {} bits, which do not cancel; {} sub-entries an entry (the "
            "deepest is {:.3g} deep); slabs deeper than {} are cut in {}",
            m.order, m.word_fraction, 1 << m.sub_entry_bits, deepest, limit, kPieces);
    } else {
        const preintegration::Verdict verdict =
            preintegration::judge_power_series(in.entries, m.order, in.step_world);
        m.note = verdict.action == preintegration::Verdict::Action::redirect
                     ? verdict.reason
                     : fmt::format(
                           "PIPS({}): overlapped level tables of {} bits, which do not cancel; slabs "
                           "deeper than {} take PIPS(1)",
                           m.order, m.word_fraction, limit);
    }
    if (in.keeps_exact) m.exact = exact_series_of(in);
    return m;
}

}  // namespace squint
