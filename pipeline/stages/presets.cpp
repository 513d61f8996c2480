#include "pipeline/stages/presets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace squint {
namespace {

std::vector<WireFormats> every_wire(const PresetInputs& in) {
    std::vector<WireFormats> all;
    for (const auto& wires : {location_wires(in), interpolation_wires(in), gradient_wires(in),
                              classification_wires(in), shading_wires(in), compositing_wires(in)})
        all.insert(all.end(), wires.begin(), wires.end());
    return all;
}

// The member of WireFormats for a preset; null if the name is unknown.
Spec WireFormats::*preset_member(std::string_view name) {
    if (name == "default") return &WireFormats::standard;
    if (name == "squeeze") return &WireFormats::squeeze;
    if (name == "eight_bit") return &WireFormats::eight_bit;
    if (name == "wide" || rounds_nothing(name)) return &WireFormats::wide;
    return nullptr;
}

}  // namespace

int accumulating_bits(const PresetInputs& in) {
    constexpr int kOfThirtyTwoBits = 15;  // two factors of u1.15 and a sign
    if (in.step >= 0.5 && in.ray_bits <= 12 && !in.faint) return kOfThirtyTwoBits;
    return std::clamp(9 + in.ray_bits, kOfThirtyTwoBits, kMostChosenFractionBits);
}

int wide_accumulating_bits(const PresetInputs& in) {
    return std::clamp(9 + in.ray_bits + 2, 20, kMostChosenFractionBits);
}

int highlight_bits(const PresetInputs& in) {
    int bits = 0;
    while (std::ldexp(64.0, bits) < in.exponent) ++bits;
    return bits;
}

bool preset_specs(std::string_view name, const PresetInputs& inputs, WireSpecs& specs) {
    const auto preset = preset_member(name);
    if (!preset) return false;
    for (const WireFormats& formats : every_wire(inputs)) specs[formats.wire] = formats.*preset;
    return true;
}

std::string preset_table_markdown() {
    constexpr PresetInputs kInputs{.scalar_bits = 12,
                                   .location_bits = 8,
                                   .entry_bits = 12,
                                   .direction_bits = 1,
                                   .ray_bits = 9,
                                   .depth_bits = 3,
                                   .total_depth_bits = 12};
    const std::vector<std::string> presets{"default", "squeeze", "eight_bit", "wide"};
    std::vector<WireSpecs> specs(presets.size());
    std::string table = "| stage | wire | carries |", rule = "|---|---|---|";
    for (std::size_t p = 0; p < presets.size(); ++p) {
        preset_specs(presets[p], kInputs, specs[p]);
        table += " `" + presets[p] + "` |", rule += "---|";
    }
    table += "\n" + rule + "\n";
    for (int w = 0; w < kWires; ++w) {
        const auto wire = static_cast<Wire>(w);
        table += fmt::format("| {} | `{}` | {} |", info(wire).stage, info(wire).name, info(wire).meaning);
        for (const WireSpecs& spec : specs)
            table += fmt::format(" {} {} |", to_string(spec[wire].format), to_string(spec[wire].rounding));
        table += "\n";
    }
    return table;
}

}  // namespace squint
