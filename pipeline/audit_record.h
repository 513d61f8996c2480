// What an audit counted, for tables, records and reports: of every wire, and of the voxels that come in.
#pragma once

#include "core/volume.h"
#include "fixedpoint/audit.h"
#include "fixedpoint/format.h"
#include "pipeline/plan/plan.h"
#include "pipeline/render.h"

#include <nlohmann/json_fwd.hpp>

namespace squint {

/// A volume's voxels, counted as an audit counts a wire's values; their format.
WireStatistics voxel_statistics(const Volume& volume);
Format voxel_format(const Volume& volume);
/// Bits at the top of a format that no value needed, and bits at its bottom that no value set.
int unused_high_bits(const WireStatistics& statistics, const Format& format);
int zero_low_bits(const WireStatistics& statistics, const Format& format);

/// By name: the voxels, then every wire that carried something, with what intervals prove of any picture of the
/// plan (docs/json.md, `audit`).
nlohmann::ordered_json json_of_audit(const Plan& plan, const RenderStatistics& statistics);

}  // namespace squint
