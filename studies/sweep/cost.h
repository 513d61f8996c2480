// What formats cost in hardware or in tables: bits of words, operations and tables, bytes fetched.  A run of
// the composition over a tallying word (fixedpoint/words/tally.h) counts them, by the rules of
// docs/sweeps.md; nothing is timed.
#pragma once

#include "fixedpoint/words/tally.h"
#include "pipeline/plan/plan.h"
#include "pipeline/slab.h"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace squint::sweep {

/// Sums of bits: each operation counts the product of its operands' widths.
inline std::int64_t operation_bits(const Bill& bill) {
    return bill.multiplier_bits() + bill.divider_bits() + bill.rounding_bits();
}

/// A part of a stage.
struct PartCost {
    Part part{};
    std::string what;
    Bill bill;   // of one slab on its dearest path
    Bill taken;  // of all slabs of Cost::taken together, on the paths that they take
};
struct StageCost {
    std::string stage;
    std::vector<Wire> wires;  // those that the scene uses
    std::int64_t word_bits = 0;
    std::vector<PartCost> parts;
    Bill bill, taken;  // of all parts
    WordNeeds needs;   // of the model's exact results
};

struct Cost {
    std::vector<StageCost> stages;  // those that are modelled
    std::int64_t word_bits = 0;
    Bill bill;  // of one slab on its dearest path
    // The slabs of some rays of the picture, and what they take together.
    struct Taken {
        std::int64_t rays = 0, slabs = 0;
        Bill bill;
    };
    std::optional<Taken> taken;
    std::int64_t table_bits = 0;    // at the width of each wire
    std::int64_t table_bytes = 0;   // as this program stores them
    std::int64_t pixel_bits = 0;    // of the compositing buffer, for C and T
    std::int64_t buffer_bytes = 0;  // for all pixels
    double voxel_bytes = 0, lit_voxel_bytes = 0,
           entry_bytes = 0;  // fetched per sample, per lit sample, from tables

    /// The figure that searches minimise: the widths of all wires, and what the operations of one slab take.
    std::int64_t bits() const { return word_bits + operation_bits(bill); }
};

Cost cost_of(const Plan& plan);
/// The same, with what the slabs of a picture take: those of at most `most_rays` x `most_rays` rays, evenly spaced.
/// The sample between two slabs counts to the one that is computed first; a ray's first slab has both its ends.
/// The plan rounds: !plan.real.
Cost cost_of_picture(const Plan& plan, int most_rays);

nlohmann::ordered_json json_of(const Cost& cost);

}  // namespace squint::sweep
