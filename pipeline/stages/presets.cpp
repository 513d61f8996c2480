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
    if (name == "default" || name == "auto") return &WireFormats::standard;
    for (const std::string_view like_squeeze : {"squeeze", "volumepro", "vizard2", "ultravis"})
        if (name == like_squeeze) return &WireFormats::squeeze;
    if (name == "eight_bit") return &WireFormats::eight_bit;
    if (name == "wide" || rounds_nothing(name)) return &WireFormats::wide;
    return nullptr;
}

// Earlier systems as Squeeze's section 2 describes them; what it does not name is as in its own table.

/// The VolumePro chip: 12 bits throughout.  Numbers from 0 to 1 have 12 fraction bits, so that 1.0 is one.
void make_volumepro(WireSpecs& w) {
    for (const Wire wire : {Wire::lerp_x, Wire::lerp_y, Wire::sample, Wire::gradient_lerp, Wire::gradient})
        w[wire].format.fraction_bits = 0;
    for (const Wire wire :
         {Wire::length, Wire::confidence, Wire::table_color, Wire::table_alpha, Wire::table_extinction,
          Wire::table_moment, Wire::slab_depth, Wire::slab_ratio, Wire::slab_alpha, Wire::slab_color,
          Wire::light, Wire::dot, Wire::power, Wire::material, Wire::intensity, Wire::lit_color,
          Wire::contribution, Wire::color, Wire::transparency})
        w[wire].format.fraction_bits = 12;
}
/// The Vizard II board: 16-bit words in compositing, 16 bits of an opacity and 8 of a colour in the tables.
void make_vizard2(WireSpecs& w) {
    w[Wire::table_color].format = {0, 8, false}, w[Wire::table_alpha].format = {0, 16, false};
}
/// The UltraVis system: data of 8 bits, buffers of colour and transparency of 16.
void make_ultravis(const PresetInputs& in, WireSpecs& w) {
    for (const Wire wire : {Wire::lerp_x, Wire::lerp_y, Wire::sample})
        w[wire].format = {in.scalar_bits, 0, false};
    w[Wire::classification_input].format = {in.entry_bits, 0, false};
    w[Wire::gradient_lerp].format = w[Wire::gradient].format = {in.scalar_bits, 1, true};
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
    if (name == "volumepro") make_volumepro(specs);
    if (name == "vizard2") make_vizard2(specs);
    if (name == "ultravis") make_ultravis(inputs, specs);
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
    const std::vector<std::string> presets{"default", "squeeze",  "eight_bit", "volumepro",
                                           "vizard2", "ultravis", "wide"};
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
