// squint search: the cheapest formats of a scene's wires whose rounding error stays within a bound.
//
// RUN/               a run of a sweep (studies/sweep/run.h) with every picture that was tried
// RUN/formats.toml   the formats found, as a preset file for precision.preset
// RUN/search.json    the figures (docs/sweeps.md, "squint search")
#pragma once

#include "studies/search/word_lengths.h"
#include "studies/sweep/evaluate.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace squint::search {

enum class CostKind { bits, time, table_bytes };
inline constexpr std::string_view kCostNames[] = {"bits", "time", "table-bytes"};
enum class Figure { largest, rms };  // of a picture's error
inline constexpr std::string_view kFigureNames[] = {"max", "rms"};

struct Settings {
    std::vector<std::string> scenes;     // files; empty: the built-in scene
    std::vector<std::string> overrides;  // for every scene
    double most_error = 0;               // LSB8, against the same pipeline in double
    CostKind cost = CostKind::bits;
    Figure figure = Figure::largest;
    bool srgb = false;         // compare colours as a display shows them
    std::vector<Wire> wires;   // empty: all that the scenes use
    bool integer_bits = true;  // search them too; false: they stay as the scenes have them
    bool every_view = false;   // by certificate: prove the bound for all views of every scene
    int views = 2;    // of a full turn of each scene's camera to tune on; as many, and 16 at least, held out
    int repeats = 5;  // of a timed picture
    Options descent{.restarts = 4, .seed = 1};
    std::string folder;   // RUN
    std::string command;  // for the record
    int threads = 0;      // 0: one a processor
    const std::atomic<bool>* cancelled = nullptr;
    std::function<void(const std::string&)> progress;  // a line, now and then
    std::function<void(const std::string&)> note;      // for what a user should know
};

/// Formats, and how they do on the views that decided and on those held out.
struct Candidate {
    std::string name;
    std::vector<Spec> specs;            // of Result::wires
    double bits = 0, table_bytes = 0;   // means over scenes
    double ms = 0;                      // mean over pictures, with CostKind::time
    double error = 0, other_error = 0;  // LSB8; infinite where a picture failed
    std::string failure;
};

struct Result {
    std::vector<Wire> wires;
    Candidate found, scene, squeeze;
    std::vector<Spec> alone;            // what each wire needs while all the others have the most
    std::vector<double> degrees;        // views that decided: tuned on, or held out until formats broke one
    std::vector<double> other_degrees;  // views that decided nothing: `found` holds on all of them
    int sets = 0;                       // of views held out: all but the last broke what was found
    std::vector<double> costs;          // what every descent ended with
    std::size_t trials = 0, pictures = 0,
                computed = 0;  // vectors of formats; pictures that were computed now
    std::string failure;       // why no formats were found; then there is no file
    std::string formats_file;
    sweep::Json json;  // squint.search/1

    /// Were views of this turn drawn at random, as many of them might break `found` although none of
    /// other_degrees does: with 1 - p^n = 95 % another n would have shown it.
    double may_break_percent() const;
};

/// Formats that broke a view held out are raised, cheapest bit first, until they hold on it too, and tried on a
/// set of views that decided nothing: what is written holds on the last set.  Throws InputError where a scene
/// cannot be used, and Cancelled; the pictures tried before that stay, and the same search goes on with them.
Result run_search(const Settings& settings);

}  // namespace squint::search
