// After a sweep of wires one at a time: one more point that measures all the formats it found at once.
#pragma once

#include "studies/sweep/run_folder.h"

#include <functional>
#include <string>
#include <vector>

namespace squint::sweep {

/// The axis of those points, its one value, and the bound in LSB8 (the default of a report).
inline constexpr const char* kTogether = "together";
inline constexpr const char* kTogetherValue = "all first formats within half an LSB8";
inline constexpr double kFirstWithin = 0.5;

/// For each base point of `entries` (mode one_at_a_time, all measured), a point where every wire has its
/// first format: the last one, from the most fraction bits down, whose RMSE of colour stays within
/// kFirstWithin.  None where fewer than two wires change.  `record_of` maps a hash to its record.
std::vector<Point> first_formats_together(const std::vector<ListedPoint>& entries,
                                          const std::function<Json(const std::string&)>& record_of,
                                          const std::string& against);

}  // namespace squint::sweep
