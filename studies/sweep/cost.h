// What formats cost in hardware or in tables: bits of words, operations and tables, bytes fetched.  A run of
// the composition over a tallying word (fixedpoint/words/tally.h) counts them, by the rules of
// docs/sweeps.md; nothing is timed.
#pragma once

#include "fixedpoint/words/tally.h"
#include "pipeline/plan/plan.h"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace squint::sweep {

/// Sums of bits: each operation counts the product of its operands' widths.
inline std::int64_t operation_bits(const Bill& bill) {
    return bill.multiplier_bits() + bill.divider_bits() + bill.rounding_bits();
}

struct StageCost {
    std::string stage;
    std::vector<Wire> wires;  // those that the scene uses
    std::int64_t word_bits = 0;
    std::vector<std::pair<std::string, Bill>> parts;  // of the stage: what one slab takes on its dearest path
    Bill bill;                                        // of all parts
    WordNeeds needs;                                  // of the model's exact results
};

struct Cost {
    std::vector<StageCost> stages;  // those that are modelled
    std::int64_t word_bits = 0;
    Bill bill;                      // of one slab on its dearest path
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

nlohmann::ordered_json json_of(const Cost& cost);

}  // namespace squint::sweep
