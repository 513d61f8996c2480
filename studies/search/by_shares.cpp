#include "studies/search/by_shares.h"

#include "core/error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

namespace squint::search {
namespace {

constexpr int kRounds = 4;

/// ceil(log2(x)) of the 20 leading bits of x: sums that differ in their last places give the same formats.
int bits_for_ratio(double x) {
    int exponent = 0;
    const double part = std::floor(std::frexp(x, &exponent) * 0x1p20) * 0x1p-20;
    return part > 0.5 ? exponent : exponent - 1;
}

int least_of(const std::map<Wire, int>& least, Wire wire) {
    const auto found = least.find(wire);
    return found == least.end() ? 1 : found->second;
}

int most_of(const std::map<Wire, int>& most, Wire wire) {
    const auto found = most.find(wire);
    return found == most.end() ? kMostChosenFractionBits : found->second;
}

}  // namespace

double fixed_part(const Shares& greatest) {
    double sum = greatest[Shares::kElsewhere];
    for (int p = kWires; p < kPayers; ++p) sum += greatest[p];
    return sum;
}

std::map<Wire, int> least_bits(const Plan& plan) {
    // Below, slabs are cut into other pieces than without rounding.
    if (plan.lit && plan.inside.rule == InsideRule::adaptive) return {{Wire::slab_alpha, 15}};
    return {};
}

Bits equal_shares(const Shares& greatest, const Bits& bits, const std::map<Wire, int>& least,
                  double most_error, const std::map<Wire, int>& most) {
    const auto share = [&](Wire wire) { return greatest[static_cast<int>(wire)]; };
    // Walls, rows and termination need not meet in one pixel.
    const double left = std::max(most_error - fixed_part(greatest), most_error / 8);
    int payers = 0;
    for (const auto& item : bits) payers += share(item.first) > 0;
    Bits wanted = bits;
    for (auto& [wire, fraction] : wanted)
        if (share(wire) > 0)
            fraction = std::clamp(fraction + bits_for_ratio(payers * share(wire) / left),
                                  least_of(least, wire), most_of(most, wire));
    return wanted;
}

int Proof::binding() const {
    int most = 0;
    for (int p = 0; p < Shares::kMost; ++p)
        if (worst[p] > worst[most]) most = p;
    return most;
}

Proof prove(const Pictures& pictures, const Bits& bits) {
    Proof proof;
    for (std::size_t i = 0; pictures.every_view && i < pictures.count; ++i) {
        const SceneBound b = bound_scene(pictures.plan(bits, i), *pictures.every_view);
        if (b.most > proof.most) proof.most = b.most, proof.worst = b.shares;
        proof.greatest = greatest(proof.greatest, b.shares);
    }
    for (std::size_t i = 0; !pictures.every_view && i < pictures.count; ++i) {
        const Certificate c = certify(pictures.plan(bits, i), pictures.certificate);
        const bool decided = pictures.decided_rays;
        const double most = decided ? c.most_decided : c.most;
        if (most > proof.most) proof.most = most, proof.worst = decided ? c.shares_decided : c.shares;
        proof.greatest = greatest(proof.greatest, decided ? c.greatest_decided : c.greatest);
        if (c.undecided_rays > 0) proof.of_undecided = std::max(proof.of_undecided, c.most);
        proof.rays += c.rays, proof.undecided += c.undecided_rays;
    }
    if (pictures.proven) pictures.proven(proof);
    return proof;
}

bool reach(const Pictures& pictures, double most_error, int raises, Bits& bits, Proof& proof) {
    proof = prove(pictures, bits);
    for (int round = 0; round < kRounds; ++round) {
        const Bits wanted = equal_shares(proof.greatest, bits, pictures.least, most_error, pictures.most);
        if (wanted == bits) break;
        bits = wanted;
        proof = prove(pictures, bits);
        if (proof.most <= most_error) return true;
    }
    for (int raise = 0; raise < raises; ++raise) {
        if (proof.most <= most_error) return true;
        int* best = nullptr;
        double most = 0;
        for (auto& [wire, fraction] : bits)
            if (fraction < most_of(pictures.most, wire) && proof.worst[static_cast<int>(wire)] > most)
                best = &fraction, most = proof.worst[static_cast<int>(wire)];
        if (!best) break;
        ++*best, proof = prove(pictures, bits);
    }
    return proof.most <= most_error;
}

void take_back(const Pictures& pictures, double most_error, int rounds, Bits& bits, Proof& proof) {
    std::set<Wire> refused;
    for (int round = 0; round < rounds; ++round) {
        const double now = pictures.cost(bits);
        struct Candidate {
            Wire wire;
            double share, saves;
        };
        std::vector<Candidate> candidates;
        for (const auto& [wire, fraction] : bits) {
            if (fraction <= least_of(pictures.least, wire) || refused.contains(wire)) continue;
            Bits fewer = bits;
            --fewer[wire];
            try {
                if (const double saves = now - pictures.cost(fewer); saves > 0)
                    candidates.push_back({wire, std::max(proof.share(wire), 1e-6), saves});
            } catch (const InputError&) {
                refused.insert(wire);
            }
        }
        std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
            return a.saves / a.share > b.saves / b.share;
        });
        double left = most_error - proof.most;
        std::vector<Wire> taken;
        for (const Candidate& c : candidates)
            if (c.share <= left) left -= c.share, taken.push_back(c.wire);
        if (taken.empty()) return;
        for (;;) {
            Bits fewer = bits;
            for (const Wire wire : taken) --fewer[wire];
            const Proof tried = prove(pictures, fewer);
            if (tried.most <= most_error) {
                bits = fewer, proof = tried;
                break;
            }
            // A wire that was exact in these pictures is not any more.
            for (const Wire wire : taken)
                if (taken.size() == 1 || tried.share(wire) > 4 * proof.share(wire)) refused.insert(wire);
            taken.resize(taken.size() / 2);
            if (taken.empty()) break;
        }
    }
}

}  // namespace squint::search
