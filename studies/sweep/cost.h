// What a scene's formats would cost in hardware or in a table: bits of words, of multipliers and of tables,
// bytes fetched.  Counted from the plan by the rules in docs/sweeps.md; nothing here is timed.
#pragma once

#include "pipeline/plan/plan.h"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace squint::sweep {

/// `count` multipliers of a bits by b bits, per sample.
struct Multiplier {
    std::string what;
    int count = 0, a = 0, b = 0;
    std::int64_t bits() const { return std::int64_t{count} * a * b; }
};

struct StageCost {
    std::string stage;
    std::vector<Wire> wires;  // those that this scene uses
    std::int64_t word_bits = 0;
    std::vector<Multiplier> multipliers;
    std::int64_t multiplier_bits = 0;
    WordNeeds needs;  // of the model's exact results
};

struct Cost {
    std::vector<StageCost> stages;  // the modelled ones
    std::int64_t word_bits = 0, multiplier_bits = 0;
    std::int64_t table_bits = 0;    // at the widths of the wires
    std::int64_t table_bytes = 0;   // as this program holds them
    std::int64_t pixel_bits = 0;    // of the compositing buffer: C and T
    std::int64_t buffer_bytes = 0;  // for all pixels
    double voxel_bytes = 0, lit_voxel_bytes = 0,
           entry_bytes = 0;  // fetched per sample, per lit one, from tables

    /// The figure that searches make small: widths of all wires, and of every multiplier the product of its
    /// operands' widths.
    std::int64_t bits() const { return word_bits + multiplier_bits; }
};

Cost cost_of(const Plan& plan);

/// The wires that carry anything in this plan.
std::vector<Wire> used_wires(const Plan& plan);

nlohmann::ordered_json json_of(const Cost& cost);

}  // namespace squint::sweep
