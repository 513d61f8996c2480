// Formats from certificates: a wire's share of a bound halves with each bit, so that one certificate says how many
// bits every wire needs.
//
// For n payers the fewest bits, where all bits cost alike, give each an equal share of what walls, termination and
// tables leave of the bound:
//
//     F' = F + ceil(log2(n share / left)),
//
// from each wire's greatest share over all pixels.  Then bits that the tally says are dear are taken back,
// where the certificates do not need them.
#pragma once

#include "pipeline/machines/certificate.h"
#include "pipeline/machines/scene_bound.h"
#include "pipeline/plan/plan.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>

namespace squint::search {

using Bits = std::map<Wire, int>;  // of the fraction

/// What the certificates of all pictures say, of all rays or of those that are decided.  LSB8.
struct Proof {
    double most = 0;
    double of_undecided = 0;  // the greatest bound of the others, where there are any
    Shares greatest, worst;   // over all pictures; of the pixel with the greatest bound
    std::int64_t rays = 0, undecided = 0;

    double share(Wire wire) const { return greatest[static_cast<int>(wire)]; }
    /// Who pays most in the pixel with the greatest bound.
    int binding() const;
};

/// The pictures that formats are for.
struct Pictures {
    std::size_t count = 1;
    std::function<Plan(const Bits&, std::size_t)> plan;  // throws InputError where no word holds them
    std::function<double(const Bits&)> cost;             // the tally's; throws alike
    std::map<Wire, int> least;                           // fraction bits that a wire keeps
    std::map<Wire, int> most;                            // and is given
    bool decided_rays = false;  // prove nothing of rays that hang on a wall or on a gradient's direction
    CertificateOptions certificate;
    std::optional<SceneBoundOptions> every_view;  // bound all views of `count` scenes, not their pictures
    std::function<void(const Proof&)> proven;     // hears every proof; may be empty
};

/// The fraction bits above, of wires that have `bits` and pay `greatest`, for a bound of `most_error` LSB8.  A wire
/// that pays nothing keeps its own.
Bits equal_shares(const Shares& greatest, const Bits& bits, const std::map<Wire, int>& least,
                  double most_error, const std::map<Wire, int>& most = {});
/// What no wire's bits can take away.
double fixed_part(const Shares& greatest);

/// Beams of each scene bound on the way: the bound of formats that are found is as good as theirs.
inline constexpr std::int64_t kBeamsOnTheWay = 1 << 14;

/// What a plan's certificates ask of formats.
std::map<Wire, int> least_bits(const Plan& plan);

Proof prove(const Pictures& pictures, const Bits& bits);

/// Finds bits under which the bound holds: equal shares, then the greatest payer's bits one by one, at most
/// `raises` of them.  Returns whether it does; `bits` and `proof` are the nearest otherwise.
bool reach(const Pictures& pictures, double most_error, int raises, Bits& bits, Proof& proof);

/// Takes back bits while certificates allow: of every wire whose share may double, the dearest for its share
/// first.
void take_back(const Pictures& pictures, double most_error, int rounds, Bits& bits, Proof& proof);

}  // namespace squint::search
