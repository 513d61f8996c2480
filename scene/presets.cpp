#include "scene/presets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace squint {
namespace {

constexpr Spec u(int i, int f, Rounding rounding) {
    return {{i, f, false}, rounding, Overflow::sat};
}
constexpr Spec s(int i, int f, Rounding rounding) {
    return {{i, f, true}, rounding, Overflow::sat};
}
int clip(int bits) {
    return std::clamp(bits, 0, kMostChosenFractionBits);
}
// Fraction bits of a highlight above those that do for exponents up to 64: (N.H)^p errs by p times as much.
int highlight_bits(const PresetInputs& in) {
    int bits = 0;
    while (std::ldexp(64.0, bits) < in.exponent) ++bits;
    return bits;
}

// Squeeze, section 5, to the letter: what it does not name follows from its neighbours.
WireSpecs squeeze(const PresetInputs& in) {
    constexpr Rounding r = Rounding::trn;
    WireSpecs w{};
    w[Wire::location] = u(11, 12, r), w[Wire::direction] = s(1, 12, r), w[Wire::weight] = u(1, 12, r);
    w[Wire::length] = u(1, 15, r);
    w[Wire::lerp_x] = w[Wire::lerp_y] = w[Wire::sample] = u(12, 12, r);
    w[Wire::gradient_lerp] = w[Wire::gradient] = s(12, 12, r), w[Wire::spacing] = u(1, 12, r),
    w[Wire::normal] = s(1, 12, r), w[Wire::confidence] = u(1, 15, r);
    w[Wire::classification_input] = u(12, 0, r);
    w[Wire::table_color] = u(1, 15, r), w[Wire::table_alpha] = u(1, 15, r);
    w[Wire::table_extinction] = u(std::max(9, in.total_depth_bits), 15, r);
    w[Wire::table_moment] = w[Wire::table_extinction];
    w[Wire::slab_depth] = u(4, 15, r), w[Wire::slab_ratio] = u(1, 15, r), w[Wire::slab_alpha] = u(1, 15, r);
    w[Wire::slab_color] = u(1, 15, r);
    w[Wire::light] = s(1, 15, r), w[Wire::dot] = s(1, 15, r), w[Wire::power] = u(1, 16, r),
    w[Wire::material] = u(1, 15, r);
    w[Wire::intensity] = u(1, 15, r), w[Wire::lit_color] = u(1, 15, r);
    w[Wire::contribution] = w[Wire::color] = w[Wire::transparency] = u(1, 15, r);
    return w;
}

// Squeeze's restricted texture-map pipeline: 8-bit words throughout.
WireSpecs eight_bit(const PresetInputs& in) {
    constexpr Rounding r = Rounding::trn;
    WireSpecs w = squeeze(in);
    w[Wire::weight] = u(1, 8, r),
    w[Wire::lerp_x] = w[Wire::lerp_y] = w[Wire::sample] = u(in.scalar_bits, 0, r);
    w[Wire::classification_input] = u(in.entry_bits, 0, r);
    w[Wire::gradient_lerp] = w[Wire::gradient] = s(in.scalar_bits, 1, r), w[Wire::normal] = s(1, 7, r);
    w[Wire::table_color] = w[Wire::table_alpha] = u(0, 8, r);
    for (const Wire wire : {Wire::slab_ratio, Wire::slab_alpha, Wire::slab_color, Wire::contribution,
                            Wire::color, Wire::transparency, Wire::lit_color, Wire::intensity, Wire::material,
                            Wire::power, Wire::confidence})
        w[wire] = u(1, 8, r);
    w[Wire::light] = w[Wire::dot] = s(1, 8, r), w[Wire::slab_depth] = u(4, 8, r);
    return w;
}

// Squeeze's widths where its corrected analysis holds, rounded to even, and the direction as a wire of its
// own.  Lerp levels are cut so that every exact product fits a 32-bit word: 12 bits of weight leave the
// middle levels 19 - I bits.
WireSpecs standard(const PresetInputs& in) {
    constexpr Rounding r = Rounding::rnd_conv;
    // Halves up where lerp(a, b, w) = lerp(b, a, 1 - w) must hold (to even, it does not), and in the tables'
    // lerps and quotients, where a half is rare: one addition where halves to even take four operations
    // (docs/decisions/0002).
    constexpr Rounding up = Rounding::rnd;
    const int scalar = in.scalar_bits, weight = scalar <= 12 ? 12 : 10;
    const int level = 31 - scalar - weight;  // fraction bits of a middle level: I + level + weight <= 31
    // Weak gradients want fraction bits; a difference of scalars, halved, has one bit less than they.
    const int range = in.gradient_bits > 0 ? in.gradient_bits : scalar;
    const int gradient = std::min(12, 32 - range - weight);
    const int sum = accumulating_bits(in);
    const int sharp = highlight_bits(in);
    WireSpecs w{};
    w[Wire::location] = u(in.location_bits, clip(31 - in.location_bits), r);
    w[Wire::direction] = s(in.direction_bits, w[Wire::location].format.fraction_bits, r);
    // 2^-10 of a step that is 1 deep is a quarter of an LSB8.
    w[Wire::weight] = u(1, weight, up), w[Wire::length] = u(1, clip(9 + in.whole_depth_bits), r);
    w[Wire::lerp_x] = w[Wire::lerp_y] = u(scalar, level, up),
    w[Wire::sample] = u(scalar, std::min(12, 24 - scalar), up);
    w[Wire::gradient_lerp] = w[Wire::gradient] = s(range, gradient, r), w[Wire::spacing] = u(1, 12, r);
    w[Wire::normal] = s(1, 15 + sharp, r), w[Wire::confidence] = u(1, 15, r);
    w[Wire::classification_input] = u(in.entry_bits, clip(8 + in.entry_levels_bits), up);
    w[Wire::table_color] = u(1, 15, r), w[Wire::table_alpha] = u(1, sum, r);
    // One entry's depth times an input's 8 fraction bits fits 32, too, where the sums' 15 bits do.
    const int depth = sum > 15 ? sum + 1 : std::min(20, 23 - in.depth_bits);
    w[Wire::table_extinction] = w[Wire::table_moment] =
        u(in.total_depth_bits, std::min(depth, clip(31 - in.total_depth_bits)), r);
    // A full step's depth, before a shorter slab takes its part of it: all of it must fit.  Deep steps take
    // their integer bits from two spare fraction bits first, which 32-bit lanes multiply as before.
    const int deep = std::max(4, in.depth_bits);
    w[Wire::slab_depth] = u(deep, clip(std::max(sum + 7 - deep, sum + 1)), up);
    w[Wire::slab_ratio] = u(1, 15, up), w[Wire::slab_alpha] = w[Wire::slab_color] = u(1, sum, up);
    w[Wire::light] = s(1, 14 + sharp, r), w[Wire::dot] = s(1, 15 + sharp, r),
    w[Wire::power] = u(1, 15 + sharp, r), w[Wire::material] = u(1, 14, r);
    w[Wire::intensity] = u(1, 14, r), w[Wire::lit_color] = u(1, sum, r);
    w[Wire::contribution] = w[Wire::color] = w[Wire::transparency] = u(1, sum, r);
    return w;
}

// Wide enough that rounding vanishes: fraction bits of tables and compositing at least 9 + log2(samples per
// ray).
WireSpecs wide(const PresetInputs& in) {
    constexpr Rounding r = Rounding::rnd_conv;
    const int f = std::clamp(9 + in.ray_bits + 2, 20, kMostChosenFractionBits);
    WireSpecs w = standard(in);
    w[Wire::location] = u(in.location_bits, 24, r), w[Wire::direction] = s(in.direction_bits, 24, r),
    w[Wire::weight] = u(1, 20, r);
    w[Wire::length] = u(1, 22, r);
    w[Wire::lerp_x] = w[Wire::lerp_y] = w[Wire::sample] =
        u(in.scalar_bits, std::min(20, 30 - in.scalar_bits), r);
    w[Wire::gradient_lerp] = w[Wire::gradient] = s(in.scalar_bits, 16, r), w[Wire::spacing] = u(1, 20, r),
    w[Wire::normal] = s(1, clip(20 + highlight_bits(in)), r), w[Wire::confidence] = u(1, 20, r);
    w[Wire::classification_input] =
        u(in.entry_bits, clip(std::min(18 + in.entry_levels_bits, 31 - in.entry_bits)), r);
    w[Wire::table_extinction] = w[Wire::table_moment] = u(in.total_depth_bits, 24, r),
    w[Wire::slab_depth] = u(std::max(5, in.depth_bits), 24, r);
    for (const Wire wire :
         {Wire::table_color, Wire::table_alpha, Wire::slab_ratio, Wire::slab_alpha, Wire::slab_color,
          Wire::lit_color, Wire::contribution, Wire::color, Wire::transparency})
        w[wire] = u(1, f, r);
    w[Wire::light] = w[Wire::dot] = s(1, clip(20 + highlight_bits(in)), r);
    w[Wire::power] = u(1, clip(20 + highlight_bits(in)), r);
    w[Wire::material] = w[Wire::intensity] = u(1, 20, r);
    return w;
}

}  // namespace

const std::vector<std::string>& preset_names() {
    static const std::vector<std::string> names{"default", "squeeze", "eight_bit", "wide", "real", "float32"};
    return names;
}

int accumulating_bits(const PresetInputs& in) {
    constexpr int kOfThirtyTwoBits = 15;  // two factors of u1.15 and a sign
    if (in.step >= 0.5 && in.ray_bits <= 12 && !in.faint) return kOfThirtyTwoBits;
    return std::clamp(9 + in.ray_bits, kOfThirtyTwoBits, kMostChosenFractionBits);
}

bool rounds_nothing(std::string_view preset) {
    return preset == "real" || preset == "float32";
}

bool preset_specs(std::string_view name, const PresetInputs& inputs, WireSpecs& specs) {
    if (name == "default") return specs = standard(inputs), true;
    if (name == "squeeze") return specs = squeeze(inputs), true;
    if (name == "eight_bit") return specs = eight_bit(inputs), true;
    if (name == "wide" || rounds_nothing(name)) return specs = wide(inputs), true;
    return false;
}

CompositingForm preset_form(std::string_view name) {
    if (name == "squeeze") return CompositingForm::equation_9;
    if (name == "eight_bit") return CompositingForm::unit255_shift;
    return CompositingForm::w;
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
