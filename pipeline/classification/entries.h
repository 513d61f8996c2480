// What every classification shares: the entries' own table, linear between entries, and the unit that turns
// an optical depth into an opacity.
#pragma once

#include "core/portable_math.h"
#include "core/transfer_function.h"
#include "fixedpoint/words.h"
#include "scene/scene.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace squint {

struct StageInputs;

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
/// The stage's constants.  Throws InputError where its wire cannot hold the last entry.
InputStage build_input(const StageInputs& in);

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
