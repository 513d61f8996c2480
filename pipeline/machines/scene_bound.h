// A scene bound: how far any pixel of any picture of a scene can be from the same picture without rounding, whatever
// the view, the projection and the size.  What it proves, and how: docs/guarantees.md#the-scene-bound.
#pragma once

#include "pipeline/machines/certificate.h"
#include "pipeline/plan/plan.h"

#include <nlohmann/json_fwd.hpp>

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace squint {

struct SceneBoundOptions {
    int threads = 0;                    // 0: one a processor
    std::int64_t most_beams = 1 << 18;  // no more are bounded; the result depends on nothing else
    const std::atomic<bool>* cancelled = nullptr;
    std::function<void(double)> progress{};  // gets the part of `most_beams` done; fewer may be enough
};

/// All figures in LSB8 (1/255), each a bound of every pixel of every view.
struct SceneBound {
    double by_entries = 0;  // any sequence of the values in the data, each in the steepest cell of all
    double by_blocks = 0;   // any sequence of the cells
    double by_beams = 0;    // cells in the order in which rays can meet them
    double most = 0;        // the least of them
    std::int64_t beams = 0;
    std::int64_t samples = 0;  // of the longest ray
    Shares shares;             // of `most`, on the beam that decides
    int payer = 0;             // who pays most
    // Where: the block of cells that costs most on that beam, its share, and the place of the function there.
    std::array<std::int64_t, 3> block_first{}, block_last{};
    double block_share = 0;
    double entry = 0;
    std::string hopeless;  // why nothing useful can be proven for every view, in a line; or empty
};
inline constexpr double kUseful = 25.5;  // LSB8, a tenth of full scale: bounds above say little

/// What of a plan has no scene bound, and what is allowed, in a line; empty where it has one.
std::optional<std::string> what_has_no_scene_bound(const Plan& plan);

/// Bounds every view.  Throws InputError for a plan that has no scene bound, and Cancelled.
SceneBound bound_scene(const Plan& plan, const SceneBoundOptions& options = {});

nlohmann::ordered_json json_of(const SceneBound& bound);

}  // namespace squint
