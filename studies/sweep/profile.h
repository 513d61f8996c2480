// The profile of a picture: what each wire carries, what it can carry, who pays for the picture's error, and which
// formats would be enough.  The data of a page of the report (`squint render --profile`).
#pragma once

#include "pipeline/machines/certificate.h"
#include "pipeline/plan/plan.h"
#include "pipeline/render.h"

#include <nlohmann/json.hpp>

#include <string>
#include <variant>

namespace squint::sweep {

/// What certifies the picture, or why nothing does.
using Proof = std::variant<Certificate, std::string>;

/// An audit (json_of_audit) and, where a certificate is there, for each wire
///
///     share_lsb8   its greatest share of the bound, over the rays that are decided
///     enough       a format: the integer bits that intervals ask for, at most today's;
///                  the fraction bits with which all wires together keep precision.budget by equal shares
///                  (studies/search/by_shares.h); a wire that was exact loses the bits that no value set.
///
/// `enough` is an estimate from one certificate: precision.preset = "auto" searches from it and proves the result.
nlohmann::ordered_json profile_of(const Plan& plan, const RenderStatistics& statistics, const Proof& proof);

/// The report's data (docs/sweeps.md) of one picture: `mode` is "profile".
nlohmann::ordered_json profile_data(const Plan& plan, const Rendering& rendering, const Proof& proof,
                                    const std::string& command);

}  // namespace squint::sweep
