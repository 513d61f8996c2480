// A sweep file: a scene, the axes along which it changes, and what is measured at each point.  docs/sweeps.md
// describes the format.
#pragma once

#include "scene/wires.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace squint::sweep {

/// A change of one part of a wire's Spec; the other parts stay as they are at the point.
struct WireEdit {
    enum class Part { fraction_bits, fraction_offset, integer_bits, integer_offset, rounding, overflow };
    Wire wire{};
    Part part{};
    int number = 0;    // of bits
    std::string text;  // the name of a rounding or overflow rule
    bool operator==(const WireEdit&) const = default;
};

/// One value of an axis.
struct Choice {
    std::string label;                   // as TOML: a number, or a text in quotes
    std::vector<std::string> overrides;  // key=value
    std::vector<WireEdit> edits;
};

struct Axis {
    std::string name;
    std::vector<Choice> choices;
    bool cross = false;  // combined with every point even in mode one_at_a_time
    std::string at;      // "sweep.toml:7:1", the beginning of a message
};

/// [wires]: an axis for every wire, in the order of the literature on word lengths: each wire's fraction
/// bits, each one's integer bits, each one's rounding, then all together.
struct WireAxes {
    bool present = false;
    std::vector<Wire> wires;  // empty: the wires that the scene uses
    std::vector<int> fraction_bits, fraction_offset, integer_bits, integer_offset;
    std::vector<std::string> rounding;
    bool together = true;
};

enum class Mode { product, one_at_a_time, random };

/// What is measured at a point.
struct Measure {
    bool real = true;        // against the same pipeline in double: rounding alone
    bool reference = false;  // against the exact integral: all errors
    bool srgb = false;       // also colour differences as a display shows them
    bool ssim = true;
    bool mean_cost = true;  // what the samples of the picture cost, beside the dearest
    // Ranges, saturation, wrap and stuck T: one more render, audited.  Absent: of base points alone.
    std::optional<bool> audit;
    bool conservation = false;  // |C + T - 1| with white colours and no light: one more render
    int repeats = 0;            // timed renders of a point, alone on the machine; 0: untimed
    int threads = 0;            // of a timed render; 0: one per processor
    bool exr = false;           // keep every picture as an EXR
    int picture_size = 128;     // pixels a side of the pictures for the report; 0: none
};

/// A picture with which points are compared: the point's own scene with these settings.
struct Baseline {
    std::string name;
    std::vector<std::string> overrides;
};

struct SweepFile {
    std::string name, folder, text;  // path as given, its folder, what it holds
    std::string title, note;
    std::vector<std::string> scenes;     // paths as written; empty: the built-in scene
    std::vector<std::string> overrides;  // of [base], then of the command line
    std::vector<Axis> axes;
    WireAxes wires;
    Mode mode = Mode::product;
    std::int64_t samples = 0;  // for mode random
    std::uint64_t seed = 1;
    Measure measure;
    std::vector<Baseline> baselines;
};

/// Reads a sweep file.  Throws InputError `file:line:column: what, what was found, what is allowed`.
SweepFile read_sweep(const std::string& path, const std::vector<std::string>& overrides = {});
SweepFile parse_sweep(std::string_view text, const std::string& name, const std::string& folder,
                      const std::vector<std::string>& overrides = {});

/// The path of scene `i`, relative to the sweep file's folder; empty for the built-in scene.
std::string scene_path(const SweepFile& sweep, std::size_t i);

/// The wire of that name, or none.
bool find_wire(std::string_view name, Wire& wire);

}  // namespace squint::sweep
