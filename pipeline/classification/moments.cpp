#include "pipeline/classification/moments.h"

#include "core/error.h"
#include "pipeline/preintegration/leg.h"
#include "pipeline/preintegration/pips.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace squint {
namespace {

constexpr int kMostRows = 8192;  // sub-entries: above, the tables outgrow the caches by far
constexpr std::int64_t kMostValues = 8 << 20;
constexpr int kInverseBits = 24;

/// One entry of the tables: its depth, and its light in every channel.
struct Step {
    double depth;
    std::array<double, 3> light;
};
std::vector<Step> steps_of(const Entries& entries) {
    std::vector<Step> steps;
    for (std::size_t i = 0; i + 1 < entries.entry.size(); ++i) {
        const Entry &a = entries.entry[i], &b = entries.entry[i + 1];
        const double t0 = a.extinction, t1 = b.extinction;
        Step step{(t0 + t1) / 2, {}};
        for (int c = 0; c < 3; ++c)  // exact for linear colour and extinction
            step.light[static_cast<std::size_t>(c)] =
                (2 * a.color[c] * t0 + 2 * b.color[c] * t1 + a.color[c] * t1 + b.color[c] * t0) / 6;
        steps.push_back(step);
    }
    return steps;
}

/// Fills the block of 2^(level + 1) steps from `start` on, in units of its own depth's power of two.
void fill_block(MomentSeries& m, const std::vector<Step>& steps, int row, int start, int length,
                const Spec& spec) {
    const int end = std::min<int>(start + length, static_cast<int>(steps.size()));
    double total = 0;
    for (int i = start; i < end; ++i) total += steps[static_cast<std::size_t>(i)].depth;
    int exponent = 0;
    std::frexp(total, &exponent);
    const double unit = std::ldexp(1.0, -exponent);
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

void fill_moments(MomentSeries& m, const Entries& fine, const Spec& spec) {
    const std::vector<Step> steps = steps_of(fine);
    const int count = static_cast<int>(steps.size());
    const int levels = static_cast<int>(std::bit_width(static_cast<unsigned>(count - 1))) + 1;
    m.levels = Table(levels, 1);
    int rows = 0;
    for (int l = 0; l < levels; ++l) {
        m.levels.set_raw(l, 0, rows);
        rows += (count / (1 << l) + 1) * ((2 << l) + 1);
    }
    if (std::int64_t{rows} * (1 + 3 * m.order) > kMostValues)
        throw InputError(fmt::format(
            "classification.order: moments of order {} over {} entries take {} MiB of words, and {} are "
            "allowed: take pips of order 1, or fewer transfer_function.entries",
            m.order, fine.size(), std::int64_t{rows} * (1 + 3 * m.order) >> 18, kMostValues >> 18));
    m.moments = Table(rows, 1 + 3 * m.order);
    for (int l = 0; l < levels; ++l)
        for (int block = 0; block <= count >> l; ++block) {
            const int row = static_cast<int>(m.levels.word(l, 0)) + block * ((2 << l) + 1);
            fill_block(m, steps, row, block << l, 2 << l, spec);
        }
}

/// g_j(x), j >= 1: what L_j is multiplied with for the straight colour.
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
    return above / below;
}

void fill_weights(MomentSeries& m, bool legendre, double deepest) {
    const Spec spec{{5, m.weight_fraction, true}, Rounding::rnd_conv, Overflow::sat};
    const int rows = static_cast<int>(std::ceil(std::ldexp(deepest, m.row_bits))) + 2;
    m.weights = Table(rows, m.order - 1);
    m.weights.wire = static_cast<int>(Wire::slab_ratio);
    for (int i = 0; i < rows; ++i) {
        const double x = std::ldexp(i, -m.row_bits);
        for (int j = 1; j < m.order; ++j)
            m.weights.set(i, j - 1,
                          legendre ? legendre_weight_over_opacity(j, x) : power_series_weight(m.order, j, x),
                          spec);
    }
    m.to_weight = Rescale(m.weight_fraction + m.depth_fraction - m.row_bits, spec);
}

void check_order(const ClassificationSettings& settings, int first, int last) {
    if (settings.order < first || settings.order > last)
        throw InputError(fmt::format("classification.order: {} is not an order of {}, which has {} to {}",
                                     settings.order, name_of(settings.method), first, last));
}

}  // namespace

void MomentSeries::describe(ClassificationReport& report) const {
    prefix.describe(report);
    report.add("moments", moments,
               fmt::format("overlapped levels of depth and {} moments a channel, {} sub-entr{} an entry",
                           order, 1 << sub_entry_bits, sub_entry_bits ? "ies" : "y"));
    report.add("weights", weights, "of the Legendre moments over the optical depth");
    report.notes.push_back(note);
}

MomentSeries build_moment_series(const ClassificationInputs& in) {
    const bool legendre = in.settings.method == Method::leg;
    check_order(in.settings, 2, legendre ? preintegration::kMostLegendre : preintegration::kMostMoments);
    MomentSeries m;
    m.prefix = build_prefix_lookup(in);
    m.order = in.settings.order;
    m.splits = legendre;
    const Spec moment = in.specs[Wire::table_moment], ratio = in.specs[Wire::slab_ratio],
               depth = in.specs[Wire::slab_depth], alpha = in.specs[Wire::slab_alpha];

    // Sub-entries where one entry alone is deep.
    const double deepest = preintegration::deepest_entry(in.entries, in.step_world);
    const int wanted = deepest <= 1 ? 0 : deepest <= 8 ? 2 : 3;
    m.sub_entry_bits = std::min(std::max(wanted, sub_entry_bits_for_color(in, kMostRows)), in.input_fraction);
    while (m.sub_entry_bits > 0 && in.entries.size() << m.sub_entry_bits > kMostRows) --m.sub_entry_bits;
    const Entries fine =
        m.sub_entry_bits ? preintegration::subdivided(in.entries, 1 << m.sub_entry_bits) : in.entries;

    // Words of the moments: as many bits as the wire has, at most 28, so that products fit 64-bit lanes.
    const int wire = static_cast<int>(Wire::table_moment);
    m.word_fraction = std::clamp(moment.format.integer_bits + moment.format.fraction_bits, 8, 28);
    const Spec word{{1, m.word_fraction, false}, moment.rounding, Overflow::sat};
    fill_moments(m, fine, word);
    m.moments.wire = wire;
    m.resolved = std::int64_t{1} << (m.word_fraction - std::max(0, m.word_fraction - 10) / m.order);
    m.to_part = Rescale(m.word_fraction + in.input_fraction - m.sub_entry_bits, word, wire);
    m.to_product = Rescale(2 * m.word_fraction, word, wire);
    m.to_mean = Rescale(m.word_fraction + kInverseBits, word, wire);
    m.to_share = Rescale(0, word, wire);
    for (std::size_t k = 0; k < m.inverse.size(); ++k)
        m.inverse[k] = static_cast<std::int64_t>(
            std::floor(std::ldexp(1.0, kInverseBits) / (static_cast<double>(k) + 1) + 0.5));

    // Weights, and the depth up to which they hold.
    m.depth_fraction = depth.format.fraction_bits;
    m.row_bits = std::min(10, m.depth_fraction);
    const double limit =
        legendre ? preintegration::legendre_split_depth(m.order) : preintegration::trusted_depth(m.order);
    m.limit = quantise_real(limit, {depth.format, Rounding::rnd, Overflow::sat});
    fill_weights(m, legendre, legendre ? 8 : limit);
    const int ratio_wire = static_cast<int>(Wire::slab_ratio);
    m.to_ratio = Rescale(m.word_fraction + m.weight_fraction, ratio, ratio_wire);
    const preintegration::ColorRange range = preintegration::color_range(in.entries);
    const Spec nearest{ratio.format, Rounding::rnd, Overflow::sat};
    for (int c = 0; c < 3; ++c) {
        m.lowest[static_cast<std::size_t>(c)] = quantise_real(range.low[c], nearest);
        m.highest[static_cast<std::size_t>(c)] = quantise_real(range.high[c], nearest);
    }

    // Cutting deep slabs.
    const Spec extinction = in.specs[Wire::table_extinction];
    m.to_cut = Rescale(extinction.format.fraction_bits, {extinction.format, Rounding::trn, Overflow::sat});
    m.to_piece = Rescale(2 * alpha.format.fraction_bits, alpha, static_cast<int>(Wire::slab_alpha));
    m.to_whole = Rescale(ratio.format.fraction_bits, ratio, ratio_wire);

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
    return m;
}

}  // namespace squint
