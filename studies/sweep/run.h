// A run: the folder that a sweep fills, a file for every point.
//
// RUN/sweep.json            the points in order, each by its hash, and the command
// RUN/points/HASH.json      the record of a point, renamed into place when it is complete
// RUN/pictures/HASH.png     its preview; .values for reports; .exr where asked for
// RUN/baselines/KEY.exr     pictures that points are compared with
// RUN/runs/*.json           one for each time the program worked here: machine, command, counts
#pragma once

#include "studies/sweep/evaluate.h"

#include <atomic>
#include <functional>
#include <string>
#include <vector>

namespace squint::sweep {

struct Progress {
    std::string doing;                            // "baselines" or "points"
    std::size_t done = 0, total = 0, failed = 0;  // points of this call
    double seconds = 0;                           // since `doing` changed
};

struct RunOptions {
    std::string folder;
    int shard = 1, shards = 1;  // points i with i % shards == shard - 1
    int threads = 0;            // 0: one per processor
    bool redo = false;          // compute points again that exist
    std::string command;        // for the record
    const std::atomic<bool>* cancelled = nullptr;
    std::function<void(const Progress&)> progress;  // from any thread, one call at a time
    std::function<void(const Json&)> finished;      // gets each new record; one call at a time
    std::function<void(const std::string&)> note;   // gets what a user should know
};

struct RunSummary {
    std::size_t points = 0;    // of this shard
    std::size_t distinct = 0;  // distinct ones among them
    std::size_t reused = 0, computed = 0, failed = 0;
    std::size_t other_program = 0;  // reused, but made by another build of the program
    std::string first_failure;      // why the first failed point failed
    double seconds = 0;
};

/// Computes the points that are missing.  Throws InputError when the sweep or the folder cannot be used, and
/// Cancelled; records finished before stay.
RunSummary run_sweep(const SweepFile& sweep, const RunOptions& options);

/// What run_sweep() would do and how long it would take, from one trial point.
struct Forecast {
    std::size_t points = 0, distinct = 0, missing = 0, baselines = 0;
    double seconds_a_point = 0, seconds_a_baseline = 0, seconds = 0;
    std::vector<std::string> lines;  // one a point: its hash and values
};
Forecast forecast(const SweepFile& sweep, const RunOptions& options);

/// Joins pieces of one sweep in options.folder, and returns how many of its points are missing.  Throws
/// InputError when pieces belong to different sweeps or disagree on a picture.
struct Collected {
    std::size_t points = 0, distinct = 0, missing = 0, failed = 0, copied = 0;
};
Collected collect(const std::vector<std::string>& pieces, const std::string& folder);

/// A label, given as TOML, as JSON: a number or a text.
Json value_of_label(const std::string& label);

/// Reads and parses a JSON file.  Throws InputError.
Json read_json(const std::string& path);

}  // namespace squint::sweep
