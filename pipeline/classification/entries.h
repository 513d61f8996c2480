// What every classification shares: the entries' own table, linear between entries, and the unit that turns
// an optical depth into an opacity.
#ifndef SQUINT_PIPELINE_CLASSIFICATION_ENTRIES_H
#define SQUINT_PIPELINE_CLASSIFICATION_ENTRIES_H

#include "core/portable_math.h"
#include "core/transfer_function.h"
#include "fixedpoint/words.h"
#include "scene/scene.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace squint {

struct TableReport {
    std::string name;
    std::int64_t rows = 0, columns = 0, bytes = 0;
    std::string note;
};
/// What a method has built, and what its builder decided: for `squint plan`.
struct ClassificationReport {
    std::vector<TableReport> tables;
    std::vector<std::string> notes;
    void add(std::string name, const Table& table, std::string note = {}) {
        if (table.rows() > 0)
            tables.push_back({std::move(name), table.rows(), table.columns(),
                              static_cast<std::int64_t>(table.bytes()), std::move(note)});
    }
};

/// Colour and opacity of a slab; the colour is straight or premultiplied, as the method's kPremultiplied
/// says.
template <class W>
struct Slab {
    std::array<W, 3> color;
    W alpha;
};

/// alpha = 1 - exp(-x): a table over x, linear between rows.  Rows are 2^-row_bits apart; beyond the last,
/// opaque to the last bit. Error: 2^(-2 row_bits - 3) from the lines, half a last bit from the table's own
/// words.
struct OpacityUnit {
    Table rows;
    int row_bits = 0;
    int depth_fraction = 0, alpha_fraction = 0;
    Rescale to_alpha;
};

/// A sample in units of table entries: the scalar itself where there is an entry for every level.
struct InputStage {
    bool scaled = false;     // entries are not one level apart
    std::int64_t scale = 0;  // entries per level, raw with scale_fraction
    double scale_exact = 1;
    int scale_fraction = 0;
    bool active = true;
    Rescale to_input;
    std::int64_t highest = 0;  // the last entry

    template <class V>
    void visit(V&& v) {
        v(to_input);
    }
};

/// Where entries stand among inputs.
struct EntrySpacing {
    int input_fraction = 0;
    int last_segment = 0;  // entries - 2
};

/// The sampled transfer function in words.
struct EntryLookup : EntrySpacing {
    enum Column { red, green, blue, alpha };       // of `table`
    enum MatterColumn { extinction, opaque };      // of `matter`
    enum Opaque { entry_is = 1, segment_is = 2 };  // bits of the column `opaque`
    Table table;                                   // what a full step of each entry looks like
    Table matter;                                  // what it is made of
    bool has_opaque = false;
    std::int64_t least_opaque = 0;  // opacity that no full step of an opaque entry falls below
    Rescale to_color, to_alpha;     // lerps between entries
    Rescale to_depth;               // extinction between entries
    Rescale to_shorter;             // times the length of a slab
    int length_fraction = 0;
    std::int64_t one_alpha = 0;
    int color_fraction = 0, alpha_fraction = 0;  // of the straight colour and the opacity that come out
    OpacityUnit opacity;

    template <class V>
    void visit(V&& v) {
        v(table), v(matter), v(to_color), v(to_alpha), v(to_depth), v(to_shorter), v(opacity.rows),
            v(opacity.to_alpha);
    }
    void describe(ClassificationReport& report) const {
        report.add("entries", table, "colour and opacity of every entry");
        report.add("matter", matter, "extinction and opaque of every entry");
        report.add("opacity", opacity.rows, "1 - exp(-x) over the optical depth");
    }
};

/// What a table builder starts from.
struct ClassificationInputs {
    const Entries& entries;
    const WireSpecs& specs;
    const ClassificationSettings& settings;
    double step_world = 1;  // length of a full slab
    int input_fraction = 0;
    bool keeps_exact =
        true;  // unrounded values beside the words: what Real reads of a wire that is not rounded
};

/// The entries in words.  Throws InputError for formats that cannot hold them.
EntryLookup build_entry_lookup(const ClassificationInputs& inputs);
OpacityUnit build_opacity_unit(const WireSpecs& specs);

/// Throws InputError, naming the integer bits it takes, where a wire's format cannot hold `largest`.
void require_range(const WireSpecs& specs, Wire wire, double largest, const char* what);

}  // namespace squint
#endif

#include "pipeline/stages/interpolation.h"
#include "pipeline/stages/location.h"

#include <hwy/highway.h>
#if defined(SQUINT_PIPELINE_CLASSIFICATION_ENTRIES_TARGET) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_CLASSIFICATION_ENTRIES_TARGET
#undef SQUINT_PIPELINE_CLASSIFICATION_ENTRIES_TARGET
#else
#define SQUINT_PIPELINE_CLASSIFICATION_ENTRIES_TARGET
#endif
HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

template <class W>
HWY_INLINE W classification_input(const InputStage& s, W sample) {
    if (s.scaled) sample = sample * constant<W>(s.scale);
    return clamp(quantise(sample, s.to_input), constant<W>(0), constant<W>(s.highest));
}
template <RealWord W>
HWY_INLINE W classification_input(const InputStage& s, W sample) {
    if (s.scaled) sample = sample * stage_constant<W>(s.scale, s.scale_exact, s.scale_fraction, s.active);
    return clamp(quantise(sample, s.to_input), constant<W>(0), constant<W>(s.highest));
}

template <class W>
HWY_INLINE W opacity_of_depth(const OpacityUnit& unit, W depth) {
    const int fraction = unit.depth_fraction - unit.row_bits;
    const W row = min(floor_shift(depth, fraction), constant<W>(unit.rows.rows() - 2));
    const W rest = min(depth - shift_left(row, fraction), constant<W>(std::int64_t{1} << fraction));
    return quantise(
        blend(gather(unit.rows, row, 0), gather(unit.rows, row + constant<W>(1), 0), rest, fraction),
        unit.to_alpha);
}
/// 1 - exp(-x) for x >= 0 in float32: -x = n ln 2 + r, |r| <= ln 2 / 2, exp(r) - 1 by its series to r^7,
/// which is 2^-26 of r off at most.
template <RealWord W>
HWY_INLINE W one_minus_exp(W x) {
    const auto k = [](double value) { return W::from(value); };
    const W y = k(0) - min(x, k(80));  // opaque to the last bit, and 2^n in range
    const W n = floor_shift(y * k(1.44269504088896341) + k(0.5), 0);
    // ln 2 in two parts, the first with bits to spare for n.
    const W r = (y - n * k(0x1.62ep-1)) - n * k(0x1.0bfbe8e7bcd5ep-15);
    const W tail =
        k(1.0 / 6) + r * (k(1.0 / 24) + r * (k(1.0 / 120) + r * (k(1.0 / 720) + r * k(1.0 / 5040))));
    const W grown = r + r * r * (k(0.5) + r * tail), unit = whole_power_of_two(n);
    return (k(1) - unit) - unit * grown;
}
inline Real<double> one_minus_exp(Real<double> x) {
    return {-portable::expm1(-x.v)};
}
/// Without rounding: the function itself, where its result is not rounded either.
template <RealWord W>
HWY_INLINE W opacity_of_depth(const OpacityUnit& unit, W depth) {
    Rescale raw = unit.to_alpha;
    raw.shift = 0;
    return quantise(shift_left(one_minus_exp(shift_left(depth, -unit.depth_fraction)), unit.alpha_fraction),
                    raw);
}

/// Where an input stands between two entries.
template <class W>
struct EntryPosition {
    W entry, fraction;
};
template <class W>
HWY_INLINE EntryPosition<W> entry_position(const EntrySpacing& e, W input) {
    const W entry = min(floor_shift(input, e.input_fraction), constant<W>(e.last_segment));
    return {entry, min(input - shift_left(entry, e.input_fraction),
                       constant<W>(std::int64_t{1} << e.input_fraction))};
}

/// One where a position is opaque: on an opaque entry, or between two (CONVENTIONS.md).
template <class W>
HWY_INLINE auto is_opaque(const EntryLookup& e, const EntryPosition<W>& at) {
    const W zero = constant<W>(0), one = constant<W>(std::int64_t{1} << e.input_fraction);
    const W here = gather(e.matter, at.entry, EntryLookup::opaque);
    const W next = gather(e.matter, at.entry + constant<W>(1), EntryLookup::opaque);
    const W entry_bit = here - shift_left(floor_shift(here, 1), 1),
            next_bit = next - shift_left(floor_shift(next, 1), 1);
    return (constant<W>(1) < here) | ((at.fraction == zero) & (zero < entry_bit)) |
           ((at.fraction == one) & (zero < next_bit));
}

/// The function at one point, for a slab of `length` steps (post-classification; every method where both ends
/// are equal).
template <class W>
HWY_INLINE Slab<W> classify_point(const EntryLookup& e, W input, W length) {
    const EntryPosition<W> at = entry_position(e, input);
    const W full = constant<W>(std::int64_t{1} << e.length_fraction);
    Slab<W> slab;
    const std::array<W, 4> between =
        lerp_rows(e.table, at.entry, at.fraction, e.input_fraction, e.to_color, e.to_alpha);
    slab.color = {between[0], between[1], between[2]};
    slab.alpha = between[EntryLookup::alpha];
    const bool may_be_opaque = e.has_opaque && any(!(slab.alpha < constant<W>(e.least_opaque)));
    const auto shorter = length < full;
    if (any(shorter)) {
        const W next = gather(e.matter, at.entry + constant<W>(1), EntryLookup::extinction);
        const W full_depth = quantise(
            blend(gather(e.matter, at.entry, EntryLookup::extinction), next, at.fraction, e.input_fraction),
            e.to_depth);
        const W depth = quantise(full_depth * length, e.to_shorter);
        slab.alpha = select(shorter, opacity_of_depth(e.opacity, depth), slab.alpha);
    }
    if (may_be_opaque) slab.alpha = select(is_opaque(e, at), constant<W>(e.one_alpha), slab.alpha);
    return slab;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
