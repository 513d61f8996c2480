// Precision presets: the formats that each gives every wire (docs/conventions.md#presets; table:
// docs/pipeline.md). Each stage lists its own wires, beside its constants.
#pragma once

#include "fixedpoint/format.h"
#include "scene/presets.h"
#include "scene/wires.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace squint {

/// What a preset's formats depend on: "the word and table sizes follow the data's range, the ray length and
/// the sampling rate".
struct PresetInputs {
    int scalar_bits = 12;       // I of a scalar
    int location_bits = 11;     // I of a location: the longest axis
    int entry_bits = 12;        // I of a classification input: the table's size
    int direction_bits = 1;     // I of |V|
    int ray_bits = 10;          // log2 of the samples on the longest ray, rounded up
    int depth_bits = 4;         // I of the optical depth of one slab
    int total_depth_bits = 12;  // I of all entries' optical depths summed, and of any one of them
    double step = 1;            // slab length in voxels
    // Few scenes need these; without them formats are those of all others.
    bool faint = false;         // 15 bits lose matter along a ray even where it is even
    int whole_depth_bits = 0;   // I of the optical depth of one slab where that is 1 or more
    int entry_levels_bits = 0;  // log2 of the levels an entry stands for, rounded up
    int gradient_bits = 0;      // I of the data's range where that is less than the scalar's; else 0
    double exponent = 1;        // of the highlight; 1 where there is none
};

/// The formats of a wire, by preset.
struct WireFormats {
    Wire wire;
    Spec standard;   // `default`: Squeeze's widths where its corrected analysis holds; 32-bit words
    Spec squeeze;    // Squeeze, section 5, to the letter; its neighbours decide what it does not name
    Spec eight_bit;  // Squeeze's restricted texture-map pipeline: 8-bit words throughout
    Spec wide;       // so wide that rounding vanishes
};

// The wires of each stage, in the file that builds its constants.
std::vector<WireFormats> location_wires(const PresetInputs& in);
std::vector<WireFormats> interpolation_wires(const PresetInputs& in);
std::vector<WireFormats> gradient_wires(const PresetInputs& in);
std::vector<WireFormats> classification_wires(const PresetInputs& in);
std::vector<WireFormats> shading_wires(const PresetInputs& in);
std::vector<WireFormats> compositing_wires(const PresetInputs& in);

/// Fills `specs`; returns false if the name is unknown.  `real` and `float32` get the formats of `wide`,
/// which define their raw units.
bool preset_specs(std::string_view name, const PresetInputs& inputs, WireSpecs& specs);

/// Every wire of every preset as the Markdown table of docs/pipeline.md: for 12-bit scalars, 4096 entries,
/// axes of 256 voxels and a step of one.
std::string preset_table_markdown();

// ------------------------------------------------------------------------ what several stages say

constexpr Spec unsigned_spec(int integer_bits, int fraction_bits, Rounding rounding) {
    return {{integer_bits, fraction_bits, false}, rounding, Overflow::sat};
}
constexpr Spec signed_spec(int integer_bits, int fraction_bits, Rounding rounding) {
    return {{integer_bits, fraction_bits, true}, rounding, Overflow::sat};
}
/// Fraction bits, clamped to those that exist.
constexpr int held(int bits) {
    return std::clamp(bits, 0, kMostChosenFractionBits);
}

/// The roundings of `default`: halves to even; but halves up where lerp(a, b, w) = lerp(b, a, 1 - w) must
/// hold (to even, it does not), and in tables' lerps and quotients, where a half is rare: that is one
/// addition, to even is four operations (docs/decisions/0002).
inline constexpr Rounding kToEven = Rounding::rnd_conv, kHalvesUp = Rounding::rnd;

/// Fraction bits of a weight in `default`.
constexpr int weight_bits(const PresetInputs& in) {
    return in.scalar_bits <= 12 ? 12 : 10;
}

/// Fraction bits that `default` gives to what adds up along a ray (opacities, T, C, prefix sums): 15, which
/// 32-bit words multiply, at steps of half a voxel or more and up to 4096 samples.  Beyond, and for matter
/// that is faint, 9 + log2(samples): half a last bit at every sample then stays below half an LSB8 of the
/// picture (docs/math.md#b5 and #c6).
int accumulating_bits(const PresetInputs& inputs);

/// The same in `wide`, for tables and compositing: at least 9 + log2(samples per ray).
int wide_accumulating_bits(const PresetInputs& inputs);

/// Extra fraction bits of highlights with exponents above 64: (N.H)^p errs by p times as much as N.H.
int highlight_bits(const PresetInputs& inputs);

}  // namespace squint
