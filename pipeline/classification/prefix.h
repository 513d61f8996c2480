// Shared by pre-integrated methods: the prefix sum T of the entries' optical depths, and opaque prediction.
// Lee & Shin, equation 8 and section 4.2, as corrected (docs/classification.md).
#pragma once

#include "pipeline/classification/entries.h"
#include "pipeline/classification/tables/exact_series.h"

#include <memory>

namespace squint {

/// T at every entry, for one full step per unit of the coordinate, and the nearest opaque entries.  Between
/// entries T is computed exactly, with as many fraction bits as that takes; only the slab's depth is
/// rounded.
struct PrefixLookup {
    EntryLookup entries;
    Table depth;                 // T[i]; where `curved`, also the change of extinction up to the next row
    int sub_entry_bits = 0;      // 2^bits rows an entry
    bool curved = false;         // T bends between rows, because extinction is linear there
    std::int64_t total = 0;      // the last T; rounding a bend may exceed it by part of a last bit
    std::int64_t most_rise = 0;  // the most that T rises from row to row
    Rescale to_depth;            // slab's depth: (T(b) - T(f)) / |s_b - s_f|
    Rescale to_shorter;          // times the slab's length
    Rescale to_wall;             // the colour in front of a wall over the wall's
    Approximation straight;      // of T, where it does not bend
    bool predicts = false;
    bool as_printed =
        false;    // sums by rectangles; P serves ascending slabs, strictly, and d is not shortened
    Table walls;  // up, down: the nearest opaque entry at or above, at or below; absent if none is opaque

    template <class V>
    void visit(V&& v) {
        entries.visit(v), v(depth), v(to_depth), v(to_shorter), v(to_wall), v(walls);
    }
    /// Fraction bits of a place between two rows, which T gains there.
    int place_bits() const { return entries.input_fraction - sub_entry_bits; }
    int gained_bits() const { return curved ? 2 * place_bits() + 1 : place_bits(); }
    void describe(ClassificationReport& report) const {
        entries.describe(report);
        report.add("T", depth,
                   curved ? "prefix sum of the entries' optical depths, and their bend"
                          : "prefix sum of the entries' optical depths");
        report.add(straight);
        report.add("walls", walls, "nearest opaque entry above and below");
        if (as_printed)
            report.notes.push_back(
                "as printed: sums by rectangles, the series at every depth, and opaque prediction for "
                "ascending "
                "slabs alone, which misses an opaque end and keeps the whole slab's length");
        if (entries.has_opaque)
            report.notes.push_back(predicts
                                       ? "opaque prediction: the first opaque entry on a slab's way ends it"
                                       : "no opaque prediction, as asked: thin opaque surfaces are lost");
    }
};

/// Whether the errors of the paper are asked for, and the method is the paper's.
bool is_as_printed(const ClassificationSettings& settings);

/// The most that any of the first columns of prefix sums rises from row to row.
std::int64_t most_rise_of(const Table& sums, int columns);
PrefixLookup build_prefix_lookup(const ClassificationInputs& inputs, int sub_entry_bits = 0);

/// log2 of the sub-entries an entry needs so that a colour constant inside them errs by kInsideEntry at most
/// along the longest ray, as far as `most_rows` rows and the input's fraction bits allow; and what is lost.
EntryRows rows_for_color(const ClassificationInputs& inputs, int most_rows);
inline constexpr double kInsideEntry = 2.0 / 255;

/// PIPS(n) or LEG(n), as the settings ask, without rounding.
std::shared_ptr<const preintegration::ExactSeries> exact_series_of(const ClassificationInputs& inputs);

/// Shared by methods with premultiplied colours.
struct PremultipliedRules {
    Rescale to_product;  // a straight colour times an opacity
    Rescale to_scaled;   // a colour times another opacity over its own
    int finer = 0;       // fraction bits of slab_color above slab_alpha's
    std::int64_t one_color = 0;

    template <class V>
    void visit(V&& v) {
        v(to_product), v(to_scaled);
    }
};
PremultipliedRules build_premultiplied_rules(const WireSpecs& specs);

}  // namespace squint
