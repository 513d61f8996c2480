// What every classification shares: the table of entries, linear between them, and the unit that turns an
// optical depth into an opacity.
#pragma once

#include "core/portable_math.h"
#include "core/transfer_function.h"
#include "fixedpoint/words.h"
#include "scene/scene.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace squint {

struct StageInputs;

struct TableReport {
    std::string name;
    std::int64_t rows = 0, columns = 0, bytes = 0;
    std::string note;
};
/// The error of an approximation in tables: at most `lsb8` of 255 in all, along the scene's longest ray.
struct Approximation {
    std::string of;
    double lsb8 = 0;
};
/// The error allowed to an approximation where memory permits: a quarter of an LSB8 along the longest ray.
inline constexpr double kMayBeLeftOut = 0.25;

/// The tables of a method and the choices of its builder, for `squint plan`.
struct ClassificationReport {
    std::vector<TableReport> tables;
    std::vector<std::string> notes;
    std::vector<Approximation> approximations;
    void add(const Approximation& a) {
        if (a.lsb8 > 0) approximations.push_back(a);
    }
    void add(std::string name, const Table& table, std::string note = {}) {
        if (table.rows() > 0)
            tables.push_back({std::move(name), table.rows(), table.columns(),
                              static_cast<std::int64_t>(table.bytes()), std::move(note)});
    }
};

/// Colour and opacity of a slab.  The colour is straight or premultiplied, as the method's kPremultiplied
/// says.
template <class W>
struct Slab {
    std::array<W, 3> color;
    W alpha;
};

/// Where a slab's light lies along it: parts of its premultiplied colours and of its opacity (white) that sum to
/// them, by Bernstein polynomials of degree count - 1 of the way from its front to `end`.
template <class W>
struct FadingLight {
    int count;
    std::array<std::array<W, 4>, 4> part;
    W end;  // 1.kWayBits of the slab's way: where a wall ends it, or all of it
};
/// Fraction bits of a way along a slab.
inline constexpr int kWayBits = 12;

/// alpha = 1 - exp(-x): a table over x with rows 2^-row_bits apart, linear between them; beyond the last
/// row, opaque to the last bit.  The lines err by 2^(-2 row_bits - 3), the table's words by half a last
/// bit.
struct OpacityUnit {
    Table rows;
    int row_bits = 0;
    int depth_fraction = 0, alpha_fraction = 0;
    double longest_ray = 1;  // steps
    Rescale to_alpha;

    /// The error of the lines between rows.
    Approximation error() const;
};

/// A sample in units of table entries: the scalar itself where every level has an entry.
struct InputStage {
    bool scaled = false;     // whether entries and levels differ
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
/// Builds the stage's constants.  Throws InputError where its wire cannot hold the last entry.
InputStage build_input(const StageInputs& in);

/// How entries and table rows divide the range of inputs.
struct EntrySpacing {
    int input_fraction = 0;
    int last_segment = 0;  // entries - 2
    int row_bits = 0;      // 2^bits rows an entry, where the opacity of a step bends between entries
};

/// The sampled transfer function as words.
struct EntryLookup : EntrySpacing {
    enum Column { red, green, blue, alpha };       // of `table`
    enum MatterColumn { extinction, opaque };      // of `matter`
    enum Opaque { entry_is = 1, segment_is = 2 };  // bits of the column `opaque`
    Table table;                                   // a full step at each entry: one row, or several
    Table matter;                                  // extinction and opaqueness of each entry
    bool has_opaque = false;
    std::int64_t least_opaque = 0;  // no full step of an opaque entry has less opacity
    Rescale to_color, to_alpha;     // lerps between entries
    Rescale to_depth;               // extinction between entries
    Rescale to_shorter;             // times a slab's length
    int length_fraction = 0;
    std::int64_t one_alpha = 0;
    int color_fraction = 0, alpha_fraction = 0;  // of the straight colour and the opacity that result
    int table_color_fraction = 0, extinction_fraction = 0;  // of the tables' words
    OpacityUnit opacity;
    Approximation bend;  // of a step's opacity, between rows

    template <class V>
    void visit(V&& v) {
        v(table), v(matter), v(to_color), v(to_alpha), v(to_depth), v(to_shorter), v(opacity.rows),
            v(opacity.to_alpha);
    }
    void describe(ClassificationReport& report) const {
        report.add("entries", table,
                   row_bits ? fmt::format("colour and opacity, {} rows an entry", 1 << row_bits)
                            : "colour and opacity of every entry");
        report.add("matter", matter, "extinction and opaque of every entry");
        report.add("opacity", opacity.rows, "1 - exp(-x) over the optical depth");
        report.add(bend);
        report.add(opacity.error());
    }
};

/// What the builder of a method's tables gets.
struct ClassificationInputs {
    const Entries& entries;
    const WireSpecs& specs;
    const ClassificationSettings& settings;
    double step_world = 1;  // length of a full slab
    int input_fraction = 0;
    bool keeps_exact =
        true;  // keep exact values beside the words: Real reads them of a wire that it does not round
    double longest_ray = 1;  // in steps: errors of one sign add up over it
    std::optional<InsideRule> inside =
        std::nullopt;  // linear, nlpi: pi2d's tables hold where light lies in a slab
};

/// The most that a ray can lose, of 255, where each of its slabs errs by `error` of optical depth and is at
/// least `least` deep: m error e^(-m least) at its worst number of slabs m <= longest.
double lost_along_ray(double error, double least, double longest);

/// log2 of the rows an entry needs so that the opacity of a step, linear between rows, loses at most
/// kMayBeLeftOut along the longest ray, as far as the input's fraction bits and kMostEntryRows allow; and the
/// loss that is left.
struct EntryRows {
    int bits = 0;
    double lsb8 = 0;
};
EntryRows rows_for_opacity(const ClassificationInputs& inputs);
inline constexpr int kMostEntryRows = 8192;  // larger tables outgrow the caches by far

/// Builds the entries' words.  Throws InputError for formats that cannot hold them.
EntryLookup build_entry_lookup(const ClassificationInputs& inputs);
OpacityUnit build_opacity_unit(const WireSpecs& specs, double longest_ray = 1);

/// Throws InputError naming the integer bits needed, where the format of a wire cannot hold `largest`.
void require_range(const WireSpecs& specs, Wire wire, double largest, const char* what);

}  // namespace squint
