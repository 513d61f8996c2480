// What a plan says about itself, for `squint plan` and for records.
#pragma once

#include "pipeline/plan/plan.h"
#include "pipeline/refined.h"

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace squint {

/// Every table of the plan, as the plan reports them, or else as its stages hold them.
std::vector<TableReport> tables_of(const Plan& plan);

/// The bits of the lanes that run plan.stages[stage]; none where the model runs it.
std::optional<int> lane_bits(const Plan& plan, std::size_t stage);

/// How the scene will be rendered ("lanes" or "model") and why, as `squint render` reports it.
struct PathOf {
    std::string path, why;
};
PathOf path_of(const Plan& plan);

/// What a plan refines, of a lattice of its picture's rays, which the model casts: at most 16 x 16 of them, fewer
/// where rays are long.  Nothing where it refines nothing.
struct RefinedRays {
    std::int64_t rays = 0, slabs = 0;
    RefinedSlabs refined;
};
std::optional<RefinedRays> refined_rays(const Plan& plan);
/// "12 of 3456 slabs looked at twice, ...": what was refined, of so many slabs; empty where nothing was.
std::string text_of(const RefinedSlabs& refined, std::int64_t slabs);

/// The schema squint.plan/2 (docs/json.md).
nlohmann::ordered_json json_of_plan(const Plan& plan);

}  // namespace squint
