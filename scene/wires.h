// Every wire of the pipeline, named once.  A wire is a place where an exact value is quantised to a Spec.
#pragma once

#include "fixedpoint/format.h"

#include <array>
#include <cstddef>
#include <string_view>

namespace squint {

enum class Wire : int {
    location,              // 1  sample position in voxels, per axis
    direction,             //    step vector V in voxels, per axis
    weight,                //    interpolation weight: the location's fraction, 1.0 exists
    length,                //    length of a slab in steps: one, but for a ray's last slab
    lerp_x,                // 2  first lerp level
    lerp_y,                //    second lerp level
    sample,                //    third lerp level: the interpolated scalar
    gradient_lerp,         // 3  first and second lerp level of a gradient
    gradient,              //    raw gradient, levels per smallest voxel spacing
    spacing,               //    smallest voxel spacing over the axis's own
    normal,                //    normalised gradient
    confidence,            //    min(1, |gradient| / shading.gradient_floor)
    classification_input,  // 4  the scalar in table entries
    table_color,           //    colours of the entries
    table_alpha,           //    opacities of the entries for one full step
    table_extinction,      //    optical depths: per entry and their prefix sums, for one full step
    table_moment,          //    prefix sums X_k of colour over depth
    slab_depth,            //    optical depth of a slab
    slab_ratio,            //    colour of a slab over its opacity
    slab_alpha,            //    opacity of a slab
    slab_color,            //    premultiplied colour of a slab
    light,                 // 5  light and half vectors
    dot,                   //    N.L and N.H, clamped to [0,1]
    power,                 //    (N.H)^p and every squaring on the way
    material,              //    ka, kd, ks
    intensity,             //    ka + kd sum N.L, and ks sum (N.H)^p, clamped to [0,1]
    lit_color,             //    premultiplied colour after shading
    contribution,          // 6  w = alpha T, the sample's share of the pixel
    color,                 //    C
    transparency,          //    T (alpha in the alpha form)
};
inline constexpr int kWires = static_cast<int>(Wire::transparency) + 1;

struct WireInfo {
    std::string_view name;
    std::string_view stage;
    std::string_view meaning;
};
inline constexpr std::array<WireInfo, kWires> kWireInfo{{
    {"location", "sample location", "sample position in voxels"},
    {"direction", "sample location", "step vector V in voxels"},
    {"weight", "sample location", "interpolation weight"},
    {"length", "sample location", "length of a slab in steps"},
    {"lerp_x", "interpolation", "first lerp level"},
    {"lerp_y", "interpolation", "second lerp level"},
    {"sample", "interpolation", "interpolated scalar"},
    {"gradient_lerp", "gradient", "first and second lerp level of a gradient"},
    {"gradient", "gradient", "raw gradient, levels per smallest spacing"},
    {"spacing", "gradient", "smallest spacing over the axis's own"},
    {"normal", "gradient", "normalised gradient"},
    {"confidence", "gradient", "length of a gradient over shading.gradient_floor, 1 at most"},
    {"classification_input", "classification", "scalar in table entries"},
    {"table_color", "classification", "colours of the entries"},
    {"table_alpha", "classification", "opacities of the entries"},
    {"table_extinction", "classification", "optical depths and their prefix sums"},
    {"table_moment", "classification", "prefix sums of colour over depth"},
    {"slab_depth", "classification", "optical depth of a slab"},
    {"slab_ratio", "classification", "colour of a slab over its opacity"},
    {"slab_alpha", "classification", "opacity of a slab"},
    {"slab_color", "classification", "premultiplied colour of a slab"},
    {"light", "shading", "light and half vectors"},
    {"dot", "shading", "N.L and N.H clamped to [0,1]"},
    {"power", "shading", "(N.H)^p and its squarings"},
    {"material", "shading", "ka, kd, ks"},
    {"intensity", "shading", "diffuse and specular sums clamped to [0,1]"},
    {"lit_color", "shading", "premultiplied lit colour"},
    {"contribution", "compositing", "w = alpha T"},
    {"color", "compositing", "C"},
    {"transparency", "compositing", "T"},
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
