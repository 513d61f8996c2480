// Makes a figure or table of a paper: its pictures as EXR and PNG, its measurements beside the paper's
// numbers, in a folder that an interrupted run continues.
#pragma once

#include "studies/reproduce/figures.h"

#include <nlohmann/json_fwd.hpp>

#include <atomic>
#include <functional>
#include <string>
#include <vector>

namespace squint::reproduce {

struct Settings {
    std::string folder;                  // of the paper: a figure has one of its own in it
    std::vector<std::string> overrides;  // key=value, over the figure's own
    int threads = 0;
    std::function<std::string(const std::string&)> scene_file;  // "@lee_shin/figure_5" -> a path
    std::function<void(const std::string& what, int done, int of)> progress;
    std::function<void(double)> part;  // of the picture being made, from any thread
    const std::atomic<bool>* cancelled = nullptr;
};

/// One measurement.
struct Row {
    std::string what, unit;
    std::vector<double> ours, paper;  // infinite: two pictures are the same
    std::string refused;              // why there is none, or empty
};
struct Result {
    std::vector<Row> rows;
    std::vector<std::string> files;  // in the folder
    std::vector<std::string>
        notes;               // what is missing, what stands in for it, what this program does not have
    int made = 0, kept = 0;  // items made now, and found made before
};

/// Makes what is missing or was made by another program or scene.  What a plan refuses, or for which data is
/// missing, is a row or a note that says so.  Throws InputError where it cannot write, and Cancelled.
Result make(const Paper& paper, const Figure& figure, const Settings& settings);

/// results.json: schema squint.reproduce/1 (docs/json.md).
nlohmann::ordered_json json_of(const Paper& paper, const Figure& figure, const Result& result);
/// The rows as a Markdown table, and as CSV.
std::string markdown_of(const Paper& paper, const Figure& figure, const Result& result);
std::string csv_of(const Result& result);

}  // namespace squint::reproduce
