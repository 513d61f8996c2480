// Precision presets: a Spec for every wire (docs/conventions.md#presets; the table is in docs/pipeline.md).
#pragma once

#include "scene/scene.h"
#include "scene/wires.h"

#include <string>
#include <string_view>
#include <vector>

namespace squint {

/// What a preset's formats follow: "the word and table sizes follow the data's range, the ray length and the
/// sampling rate".
struct PresetInputs {
    int scalar_bits = 12;       // I of a scalar
    int location_bits = 11;     // I of a location: the longest axis
    int entry_bits = 12;        // I of a classification input: the table's size
    int direction_bits = 1;     // I of |V|
    int ray_bits = 10;          // log2 of the samples on the longest ray, rounded up
    int depth_bits = 4;         // I of the optical depth of one slab
    int total_depth_bits = 12;  // I of the prefix sum of all entries' optical depths, and of any one of them
    double step = 1;            // slab length in voxels
    // What few scenes ask for: without it the formats are those of all others.
    bool faint = false;         // even matter so faint that 15 bits lose it along a ray
    int whole_depth_bits = 0;   // I of the optical depth of one slab where that is 1 or more
    int entry_levels_bits = 0;  // log2 of the levels an entry stands for, rounded up
    int gradient_bits = 0;      // I of the data's range where that is less than the scalar's, else 0
    double exponent = 1;        // of the highlight; 1 where none is lit
};

const std::vector<std::string>& preset_names();

/// Fraction bits that `default` gives what adds up along a ray (opacities, T, C, prefix sums).  15, which
/// 32-bit words multiply, at steps of half a voxel or more and up to 4096 samples; beyond, and where even
/// matter is faint, 9 + log2(samples), which keeps half a last bit at every sample below half an LSB8 of the
/// picture (docs/math.md#b5 and #c6).
int accumulating_bits(const PresetInputs& inputs);

/// The presets that round no wire: `real` in double, `float32` in float.
bool rounds_nothing(std::string_view preset);

/// Fills `specs`; false if the name is unknown.  `real` and `float32` have the formats of `wide`, which say
/// where their raw units stand.
bool preset_specs(std::string_view name, const PresetInputs& inputs, WireSpecs& specs);

/// Every wire of every preset as a Markdown table, for 12-bit scalars, 4096 entries, axes of 256 voxels and a
/// step of one: what docs/pipeline.md holds.
std::string preset_table_markdown();

/// What a preset composites with where the scene does not say.
CompositingForm preset_form(std::string_view name);

}  // namespace squint
