// A certificate: a bound, for every pixel of one picture, on its distance from the same picture without
// rounding, and the causes of that distance.  What it proves, and how: docs/guarantees.md.
//
// The words of a ray run through the one composition.  Each has a bound on its own error
// (fixedpoint/words/bounded.h), up to the opacity and colour of every slab; then, backwards along the ray,
//
//     C' - C = sum_k T'_k ((alpha'_k - alpha_k)(c_k - G_(k+1)) + alpha'_k (c'_k - c_k)) + kappa_k + lambda_k G_(k+1)
//
// holds exactly, where G_k is what slabs from k on gather without rounding and with T = 1, and kappa and
// lambda are what the step of C and T differs by from the exact step of the words it gets.
#pragma once

#include "core/image.h"
#include "fixedpoint/words/bounded.h"
#include "pipeline/plan/plan.h"

#include <nlohmann/json_fwd.hpp>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace squint {

/// The causes of an error: the wires by their index, then these.
enum Payer : int {
    kRowsPay = kWires,  // tables: straight between rows where the curve bends
    kWallsPay,          // an opaque entry that errors may reach or miss
    kTerminationPays,   // a ray may end a slab earlier or later
    kGradientsPay,      // a gradient that errors may turn into any direction
    kDoublesPay,        // roundings of the doubles of the unrounded picture and of the bound
    kPayers,
};
static_assert(kPayers <= Shares::kElsewhere);
std::string_view payer_name(int payer);

/// Why a ray is undecided: what errors can flip is more than kUndecided of its bound.
enum class Doubt { wall, termination, gradient };
inline constexpr std::array<std::string_view, 3> kDoubtNames{"wall", "termination", "gradient"};
inline constexpr double kUndecided = 0.5;  // LSB8

struct CertificateOptions {
    int threads = 0;        // 0: one a processor
    bool channels = false;  // keep the bound of every pixel
    int payer = -1;         // of the bound of every pixel only this one's share
    // Of compositing, what its roundings took: a bound of this picture alone, not linear in a wire's last bit.
    bool known = false;
    int every = 1;                  // rows and columns: the first of so many
    double undecided = kUndecided;  // of walls and gradients, LSB8
    const std::atomic<bool>* cancelled = nullptr;
    std::function<void(double)> progress{};  // gets the part done, from any thread
};

/// CertificateOptions::every for an answer in seconds: at most kSomeRays rays of so many pictures of the plan's size.
/// Rays of more than 512 samples count by the square of how many more: they take longer, and are alike.
inline constexpr int kSomeRays = 3000;
int every_for_some_rays(const Plan& plan, std::size_t pictures = 1);

/// All figures in LSB8 (1/255).
struct Certificate {
    std::int64_t rays = 0;                 // that meet the volume
    double most = 0, median = 0;           // the greatest of R, G, B and A, over the rays
    double most_decided = 0;               // over the rays that are not undecided
    Shares shares_decided;                 // of `most_decided`
    Shares greatest_decided;               // of each cause alone, over those rays
    int column = 0, row = 0, channel = 0;  // of `most`
    Shares shares;                         // of `most`
    Shares greatest;                       // of each cause alone, over all pixels and channels
    std::array<std::int64_t, kDoubtNames.size()> undecided{};  // rays, by reason
    std::int64_t undecided_rays = 0;                           // for any reason
    Image image;  // bound.R, bound.G, bound.B, bound.A, of 1.0; where asked for
};

/// `shares` by stage, in order, then by the causes behind the wires.
std::vector<std::pair<std::string_view, double>> shares_by_stage(const Certificate& certificate);
nlohmann::ordered_json json_of(const Certificate& certificate);

/// What of a plan cannot be bounded yet, and what is allowed, in a line; empty where all of it can be.
std::optional<std::string> what_is_not_bounded(const Plan& plan);

/// Certifies the plan's picture.  Throws InputError for a plan that cannot be bounded, and Cancelled.
Certificate certify(const Plan& plan, const CertificateOptions& options = {});

}  // namespace squint
