#include "pipeline/classification/pi2d.h"

#include "core/error.h"
#include "pipeline/classification/tables/fade_table.h"
#include "pipeline/classification/tables/pi2d_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace squint {
namespace {

// Walls that prediction finds are left out of the table: there they are as translucent as other entries.
Entries without_walls(Entries entries, bool predicts) {
    if (predicts)
        for (Entry& entry : entries.entry) entry.opaque = false;
    return entries;
}

// Doubles in [0, 1] as words of a Spec.
struct Encode {
    Spec color, alpha;
    bool fits_u16;  // rnd_conv words of at most 16 bits: encoded with SIMD

    Encode(const Spec& c, const Spec& a) : color(c), alpha(a) {
        const auto plain = [](const Spec& s) {
            return s.rounding == Rounding::rnd_conv && s.format.one() <= s.format.largest() &&
                   s.format.one() <= 0xffff;
        };
        fits_u16 = plain(c) && plain(a);
    }
    std::int64_t largest() const {
        return std::max(std::min(color.format.one(), color.format.largest()),
                        std::min(alpha.format.one(), alpha.format.largest()));
    }
    void operator()(int channel, std::span<const double> values, std::span<std::uint16_t> words) const {
        const Spec& spec = channel < 3 ? color : alpha;
        if (fits_u16) return preintegration::EncodeU16{spec.format.fraction_bits}(channel, values, words);
        one_by_one(spec, values, words);
    }
    void operator()(int channel, std::span<const double> values, std::span<std::uint32_t> words) const {
        one_by_one(channel < 3 ? color : alpha, values, words);
    }
    void operator()(int channel, std::span<const double> values, std::span<double> raw) const {
        const double one = static_cast<double>((channel < 3 ? color : alpha).format.one());
        for (std::size_t i = 0; i < values.size(); ++i) raw[i] = values[i] * one;
    }

  private:
    template <class Word>
    static void one_by_one(const Spec& spec, std::span<const double> values, std::span<Word> words) {
        const Spec saturating{spec.format, spec.rounding, Overflow::sat};
        for (std::size_t i = 0; i < values.size(); ++i)
            words[i] = static_cast<Word>(quantise_real(values[i], saturating));
    }
};

template <class Word>
void fill(const Entries& entries, int size, double length, bool self_attenuation, const Encode& encode,
          std::span<Word> words) {
    if (self_attenuation) return preintegration::build_pi2d_words<Word>(entries, size, length, words, encode);
    const std::vector<double> cell =
        preintegration::build_pi2d_without_self_attenuation(entries, size, length).cell;
    for (std::size_t i = 0; i < cell.size(); ++i)
        encode(static_cast<int>(i % 4), std::span(&cell[i], 1), words.subspan(i, 1));
}

// Between nodes d apart in depth and dc in colour, very short slabs lie on the diagonal of the table: there
// the bilinear lookup errs by d^2 / 16 in opacity and by d dc / 6 in colour.
double lost_between_nodes(const ClassificationInputs& in, int size) {
    const auto place = [&](int node) {
        return node * static_cast<double>(in.entries.size() - 1) / (size - 1);
    };
    double worst = 0;
    for (int node = 0; node + 1 < size; ++node) {
        const double s = place(node), t = place(node + 1);
        const double a = preintegration::extinction_at(in.entries, s) * in.step_world,
                     b = preintegration::extinction_at(in.entries, t) * in.step_world;
        const Vec3 swing = preintegration::color_at(in.entries, t) - preintegration::color_at(in.entries, s);
        const double d = std::abs(b - a),
                     color = std::max({std::abs(swing.x), std::abs(swing.y), std::abs(swing.z)});
        worst = std::max(worst, std::min(lost_along_ray(std::max(d * d / 16, d * color / 6), std::min(a, b),
                                                        in.longest_ray),
                                         255.0));
    }
    return worst;
}

// The words of build_fades' tables, and the doubles for when nothing is rounded.
std::vector<CellTable> build_fade_cells(const Entries& entries, int size, double length, bool linear,
                                        const Encode& encode) {
    constexpr int kMostNodes = 1024;
    if (size > kMostNodes)
        throw InputError(
            fmt::format("classification.table_size: {} nodes a side, but shading.inside = \"{}\" has tables "
                        "of {} at most",
                        size, linear ? "linear" : "nlpi", kMostNodes));
    const std::vector<std::vector<double>> built = preintegration::build_fades(entries, size, length, linear);
    std::vector<CellTable> tables;
    for (std::size_t t = 0; t < built.size(); ++t) {
        CellTable& table = tables.emplace_back(size, encode.largest());
        table.wire = static_cast<int>(Wire::slab_color),
        table.alpha_wire = static_cast<int>(Wire::slab_alpha);
        for (std::size_t i = 0; i < built[t].size(); ++i) {
            const int channel = static_cast<int>(i % 4);
            if (table.is_narrow())
                encode(channel, std::span(&built[t][i], 1), table.narrow().subspan(i, 1));
            else
                encode(channel, std::span(&built[t][i], 1), table.wide().subspan(i, 1));
        }
        table.exact_from([=] {
            std::vector<double> raw = preintegration::build_fades(entries, size, length, linear)[t];
            for (std::size_t i = 0; i < raw.size(); ++i)
                encode(static_cast<int>(i % 4), std::span<const double>(&raw[i], 1), std::span(&raw[i], 1));
            return raw;
        });
    }
    return tables;
}

}  // namespace

void PreIntegrated2D::describe(ClassificationReport& report) const {
    prefix.describe(report);
    report.tables.push_back(
        {"cells", cells.size(), cells.size(), static_cast<std::int64_t>(cells.bytes()),
         fmt::format("colour and opacity over both ends, {} bits a word, {}", cells.is_narrow() ? 16 : 32,
                     self_attenuation ? "with self-attenuation" : "without self-attenuation")});
    for (const CellTable& fade : fades)
        report.tables.push_back({"fades", fade.size(), fade.size(), static_cast<std::int64_t>(fade.bytes()),
                                 "where a slab's light lies along it"});
    report.add(between_nodes);
    if (cells.size() < entries)
        report.notes.push_back(
            fmt::format("pi2d: {} nodes for {} entries: what is narrower than {} entries is blurred",
                        cells.size(), entries, (entries - 2) / (cells.size() - 1) + 1));
}

PreIntegrated2D PreIntegrated2D::build(const ClassificationInputs& in) {
    const Spec color = in.specs[Wire::slab_color], alpha = in.specs[Wire::slab_alpha];
    PreIntegrated2D m;
    m.prefix = build_prefix_lookup(in);
    m.premultiplied = build_premultiplied_rules(in.specs);
    m.nearest = in.settings.lookup == TableLookup::nearest;
    m.self_attenuation = in.settings.method == Method::pi2d;
    m.entries = in.entries.size();
    const int size = in.settings.table_size;
    m.between_nodes = {"cells between their nodes", lost_between_nodes(in, size)};
    const Encode encode(color, alpha);
    const Entries entries = without_walls(in.entries, m.prefix.predicts);
    m.cells = CellTable(size, encode.largest());
    m.cells.wire = static_cast<int>(Wire::slab_color);
    m.cells.alpha_wire = static_cast<int>(Wire::slab_alpha);
    const double length = in.step_world;
    const bool attenuated = m.self_attenuation;
    if (m.cells.is_narrow())
        fill<std::uint16_t>(entries, size, length, attenuated, encode, m.cells.narrow());
    else
        fill<std::uint32_t>(entries, size, length, attenuated, encode, m.cells.wide());
    m.cells.exact_from([=] {
        std::vector<double> raw(static_cast<std::size_t>(size) * static_cast<std::size_t>(size) * 4);
        fill<double>(entries, size, length, attenuated, encode, raw);
        return raw;
    });
    if (in.inside == InsideRule::linear || in.inside == InsideRule::nlpi)
        m.fades = build_fade_cells(entries, size, length, in.inside == InsideRule::linear, encode);
    m.to_way = Rescale(0, Spec{{1, kWayBits, false}, Rounding::rnd, Overflow::sat});
    m.to_way.divides = true;
    // Weights are as fine as the input, or finer by as many bits as a node has entries; products of 16-bit
    // nodes and quotients stay within 32-bit lanes.
    m.scaled = size != m.entries;
    const int integer = static_cast<int>(std::bit_width(static_cast<unsigned>(size - 1)));
    const int finer = static_cast<int>(std::bit_width(static_cast<unsigned>((m.entries - 1) / (size - 1))));
    const int most = m.cells.is_narrow() ? std::min(14, m.scaled ? 22 - integer : 14) : 20;
    m.node_fraction = m.scaled ? std::clamp(in.input_fraction + finer, std::min(8, most), most)
                               : std::min(in.input_fraction, most);
    m.to_node =
        Rescale(in.input_fraction, Spec{{integer, m.node_fraction, false}, Rounding::rnd, Overflow::sat});
    m.to_node.divides = m.scaled;
    m.to_color =
        Rescale(color.format.fraction_bits + m.node_fraction, color, static_cast<int>(Wire::slab_color));
    m.to_alpha =
        Rescale(alpha.format.fraction_bits + m.node_fraction, alpha, static_cast<int>(Wire::slab_alpha));
    return m;
}

}  // namespace squint
