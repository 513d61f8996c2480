// What a run found: one self-contained page, or numbers for programs and papers.
#pragma once

#include "studies/sweep/evaluate.h"

#include <array>
#include <cstdint>
#include <string>

namespace squint::sweep {

/// The bound of an answer where none is asked for: half an LSB8, which 8-bit output loses anyway.
inline constexpr double kHalfLsb8 = 0.5;

/// What of a point's cost a report tells.
inline constexpr std::array kCostFigures{"bits",
                                         "word_bits",
                                         "multiplier_bits",
                                         "divider_bits",
                                         "rounding_bits",
                                         "constant_multiplier_bits",
                                         "lookups",
                                         "lookup_bits",
                                         "mean_bits",
                                         "mean_multiplier_bits",
                                         "mean_divider_bits",
                                         "mean_rounding_bits",
                                         "mean_constant_multiplier_bits",
                                         "mean_lookups",
                                         "mean_lookup_bits",
                                         "table_bits",
                                         "table_bytes",
                                         "pixel_bits",
                                         "buffer_bytes",
                                         "voxel_bytes_per_sample",
                                         "voxel_bytes_per_lit_sample",
                                         "entry_bytes_per_sample"};

/// All data of a report but pictures (docs/sweeps.md, "The report's data").  Its answer is the cheapest point
/// within `most_error` LSB8 or a search's own bound.  Throws InputError when `run` is no run.
Json report_data(const std::string& run, double most_error = kHalfLsb8);

/// The wires in their order, by stage; data["stages"].
Json wires_by_stage();

/// A line a point: its axes, then its figures.
std::string report_csv(const Json& data);
std::string report_markdown(const Json& data);

/// The page.  Pictures take at most `most_picture_bytes`: baselines and points of the Pareto front first, in
/// full; the others in full or coarser, as room allows.  No `run`: no pictures.
std::string report_html(const Json& data, const std::string& run, std::int64_t most_picture_bytes = 24 << 20);

}  // namespace squint::sweep
