// Every wire of the pipeline, named once.  A wire is a place where an exact value is quantised to a Spec.
#pragma once

#include "fixedpoint/format.h"

#include <array>
#include <cstddef>
#include <string_view>

namespace squint {

enum class Wire : int {
    location,  // stage 1
    direction,
    weight,
    length,
    lerp_x,  // stage 2
    lerp_y,
    sample,
    gradient_lerp,  // stage 3
    gradient,
    spline,
    spacing,
    normal,
    exaggeration,
    confidence,
    classification_input,  // stage 4
    table_color,
    table_alpha,
    table_extinction,
    table_moment,
    slab_depth,
    slab_ratio,
    slab_alpha,
    slab_color,
    light,  // stage 5
    dot,
    power,
    material,
    intensity,
    lit_color,
    contribution,  // stage 6
    color,
    transparency,
};
inline constexpr int kWires = static_cast<int>(Wire::transparency) + 1;

/// What a wire is called in scenes, records and messages, the stage that quantises it, and what it carries.
struct WireInfo {
    std::string_view name;
    std::string_view stage;
    std::string_view meaning;
};
/// In the order of the enumeration.
inline constexpr std::array<WireInfo, kWires> kWireInfo{{
    {"location", "sample location", "sample position in voxels, per axis"},
    {"direction", "sample location", "step vector V in voxels, per axis"},
    {"weight", "sample location", "interpolation weight: the location's fraction"},
    {"length", "sample location", "length of a slab in steps: one, but for a ray's last"},
    {"lerp_x", "interpolation", "first lerp level"},
    {"lerp_y", "interpolation", "second lerp level"},
    {"sample", "interpolation", "third lerp level: the interpolated scalar"},
    {"gradient_lerp", "gradient", "first and second lerp level of a gradient"},
    {"gradient", "gradient", "raw gradient, levels per smallest voxel spacing"},
    {"spline", "gradient", "weights of four voxels, of shading.gradient cubic_spline"},
    {"spacing", "gradient", "smallest voxel spacing over the axis's own"},
    {"normal", "gradient", "normalised gradient"},
    {"exaggeration", "gradient", "shading.exaggeration"},
    {"confidence", "gradient", "length of a gradient over shading.gradient_floor, 1 at most"},
    {"classification_input", "classification", "scalar in table entries"},
    {"table_color", "classification", "colours of the entries"},
    {"table_alpha", "classification", "opacities of the entries, for one full step"},
    {"table_extinction", "classification",
     "optical depths of the entries and their prefix sums, for one full step"},
    {"table_moment", "classification", "prefix sums of colour over depth"},
    {"slab_depth", "classification", "optical depth of a slab"},
    {"slab_ratio", "classification", "colour of a slab over its opacity"},
    {"slab_alpha", "classification", "opacity of a slab"},
    {"slab_color", "classification", "premultiplied colour of a slab"},
    {"light", "shading", "light and half vectors"},
    {"dot", "shading", "N.L and N.H clamped to [0,1]"},
    {"power", "shading", "(N.H)^p and every squaring on the way"},
    {"material", "shading", "ka, kd, ks"},
    {"intensity", "shading", "ka + kd sum N.L, and ks sum (N.H)^p, clamped to [0,1]"},
    {"lit_color", "shading", "premultiplied colour after shading"},
    {"contribution", "compositing", "w = alpha T, the sample's share of the pixel"},
    {"color", "compositing", "C, the colour of what lies in front so far"},
    {"transparency", "compositing", "T, what passes of the light from behind (A in forms with opacity)"},
}};

/// A Spec for every wire.
struct WireSpecs {
    std::array<Spec, kWires> spec;
    constexpr Spec& operator[](Wire w) { return spec[static_cast<std::size_t>(w)]; }
    constexpr const Spec& operator[](Wire w) const { return spec[static_cast<std::size_t>(w)]; }
    constexpr bool operator==(const WireSpecs&) const = default;
};

constexpr const WireInfo& info(Wire w) {
    return kWireInfo[static_cast<std::size_t>(w)];
}

}  // namespace squint
