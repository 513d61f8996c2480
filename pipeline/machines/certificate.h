// A certificate: for every pixel of one picture a bound on its distance from the same picture without rounding, and who
// pays for it.  What it proves and how: docs/guarantees.md.
//
// A ray's words run through the one composition, each with a bound on its own error (fixedpoint/words/bounded.h) up to
// opacity and colour of every slab; then, backwards along the ray,
//
//     C' - C = sum_k T'_k ((alpha'_k - alpha_k)(c_k - G_(k+1)) + alpha'_k (c'_k - c_k)) + kappa_k + lambda_k G_(k+1)
//
// exactly, with G_k what is gathered from slab k on where nothing is rounded and T = 1, and kappa, lambda what the step
// of C and T differs by from the exact step of the words it is given.
#pragma once

#include "core/image.h"
#include "fixedpoint/words/bounded.h"
#include "pipeline/plan/plan.h"

#include <nlohmann/json_fwd.hpp>

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace squint {

/// Who pays: the wires by their index, then these.
enum Payer : int {
    kRowsPay = kWires,  // tables: what is straight between their rows bends
    kWallsPay,          // an opaque entry that errors may reach or miss
    kTerminationPays,   // a ray that may end a slab earlier or later
    kDoublesPay,        // roundings of the unrounded picture's own doubles, and of the bound's
    kPayers,
};
static_assert(kPayers <= Shares::kElsewhere);
std::string_view payer_name(int payer);

/// Why a ray is undecided: what errors can flip makes more than kUndecided of its bound.
enum class Doubt { wall, termination };
inline constexpr std::array<std::string_view, 2> kDoubtNames{"wall", "termination"};
inline constexpr double kUndecided = 0.5;  // LSB8

struct CertificateOptions {
    int threads = 0;        // 0: one a processor
    bool channels = false;  // keep the bound of every pixel
    int payer = -1;         // of the bound of every pixel only this one's share
    const std::atomic<bool>* cancelled = nullptr;
};

/// All in LSB8 (1/255).
struct Certificate {
    std::int64_t rays = 0;                 // that meet the volume
    double most = 0, median = 0;           // the greatest of R, G, B and A, over the rays
    double most_decided = 0;               // over the rays that are not undecided
    int column = 0, row = 0, channel = 0;  // of `most`
    Shares shares;                         // of `most`
    Shares greatest;                       // of every payer alone, over all pixels and channels
    std::array<std::int64_t, kDoubtNames.size()> undecided{};  // rays, by reason
    std::int64_t undecided_rays = 0;                           // for any reason
    Image image;  // bound.R, bound.G, bound.B, bound.A, of 1.0; where asked for
};

/// `shares` by stage, in their order, then by what stands behind the wires.
std::vector<std::pair<std::string_view, double>> shares_by_stage(const Certificate& certificate);
nlohmann::ordered_json json_of(const Certificate& certificate);

/// What of a plan is not bounded yet, and what is allowed, in one line; empty where everything is.
std::optional<std::string> what_is_not_bounded(const Plan& plan);

/// The certificate of the plan's picture.  Throws InputError for what is not bounded, and Cancelled.
Certificate certify(const Plan& plan, const CertificateOptions& options = {});

}  // namespace squint
