// What a run found, as one self-contained page or as numbers for programs and papers.
#pragma once

#include "studies/sweep/evaluate.h"

#include <cstdint>
#include <string>

namespace squint::sweep {

/// What an answer's bound is where nobody asks for another: half an LSB8, which 8-bit output loses anyway.
inline constexpr double kHalfLsb8 = 0.5;

/// Everything that a report says, but its pictures (docs/sweeps.md, "The report's data"); its answer is the
/// cheapest point within `most_error` LSB8, or a search's own.  Throws InputError when `run` is no run of a sweep.
Json report_data(const std::string& run, double most_error = kHalfLsb8);

/// One line a point: its axes, then its figures.
std::string report_csv(const Json& data);
std::string report_markdown(const Json& data);

/// The page.  `most_picture_bytes` bounds the pictures in it: first the baselines and the points of the
/// Pareto front in full, the rest in full or coarser, as room allows.
std::string report_html(const Json& data, const std::string& run, std::int64_t most_picture_bytes = 24 << 20);

/// One line that says why there is no page in this build; empty where there is.
std::string why_no_page();

}  // namespace squint::sweep
