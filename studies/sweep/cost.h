// What a scene's formats would cost in hardware or in a table: bits of words, of operations and of tables, bytes
// fetched.  Counted by a run of the composition over a word that tallies (fixedpoint/words/tally.h), by the rules
// in docs/sweeps.md; nothing here is timed.
#pragma once

#include "fixedpoint/words/tally.h"
#include "pipeline/plan/plan.h"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace squint::sweep {

/// Bits of what is counted: of every operation the product of its operands' widths.
inline std::int64_t operation_bits(const Bill& bill) {
    return bill.multiplier_bits() + bill.divider_bits() + bill.rounding_bits();
}

struct StageCost {
    std::string stage;
    std::vector<Wire> wires;  // those that this scene uses
    std::int64_t word_bits = 0;
    std::vector<std::pair<std::string, Bill>>
        parts;        // of the stage, with what one slab takes on its dearest path
    Bill bill;        // of all of them
    WordNeeds needs;  // of the model's exact results
};

struct Cost {
    std::vector<StageCost> stages;  // the modelled ones
    std::int64_t word_bits = 0;
    Bill bill;                      // of one slab on its dearest path
    std::int64_t table_bits = 0;    // at the widths of the wires
    std::int64_t table_bytes = 0;   // as this program holds them
    std::int64_t pixel_bits = 0;    // of the compositing buffer: C and T
    std::int64_t buffer_bytes = 0;  // for all pixels
    double voxel_bytes = 0, lit_voxel_bytes = 0,
           entry_bytes = 0;  // fetched per sample, per lit one, from tables

    /// The figure that searches make small: widths of all wires, and what one slab's operations take.
    std::int64_t bits() const { return word_bits + operation_bits(bill); }
};

Cost cost_of(const Plan& plan);

nlohmann::ordered_json json_of(const Cost& cost);

}  // namespace squint::sweep
