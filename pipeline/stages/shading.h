// Stage 5: shading.  Slab colour (1.F), opacity (1.F), normal (s1.F) -> lit colour (1.F).
// Phong and Blinn-Phong: Squeeze, equations 10 and 11, as docs/conventions.md#light defines them:
//
//     C = alpha (c (ka + kd sum max(0, N.L)) + ks sum max(0, N.H)^p)
#pragma once

#include "fixedpoint/words.h"
#include "pipeline/stages/location.h"
#include "scene/scene.h"

#include <array>

namespace squint {

struct StageInputs;

/// shading.inside nlpi: the normal between two is kept at length one by a quadratic (Guetat et al. 2010, equation
/// 8 in Bernstein form).
struct KeptLength {
    static constexpr int kRowBits = 8, kArcBits = 13;
    bool wanted = false;
    bool held = false;  // to the opacity: ka + kd + ks is one at most
    Table arc;          // 2 / cos a - 1 over N_f.N_b = cos 2a in [0, 1]; errs by 4e-6 between its rows
    int row_bits = 0;
    Rescale to_turn, to_arc, to_between;
};

/// Constants of Gooch's model, for the cool side and the warm one: raw in the material format, and
/// exact.
struct GoochTones {
    bool cool_to_light = false;
    std::array<std::int64_t, 2> share{};  // of the matter's colour
    std::array<std::array<std::int64_t, 2>, 3> tone{};
    std::array<double, 2> share_exact{};
    std::array<std::array<double, 2>, 3> tone_exact{};
    Rescale to_faded, to_side;
};

/// All of the stage but its table: what kernels copy, so that nothing they store can change it.
struct ShadingConstants {
    ShadingModel model = ShadingModel::none;
    PowerRule power = PowerRule::squaring;
    int lights = 0;
    bool premultiplied = false;  // of the slab's colour; then alpha weighs the highlight, too
    int color_fraction = 0;      // of the slab's colour
    int finer_than_alpha = 0;    // its fraction bits above alpha's, if premultiplied
    bool white = true;           // every light is white, so one sum serves all three colours
    bool two_sided = false;
    bool fades = false;         // confidence weighs what lights add to ambient light
    bool half_per_ray = false;  // perspective, or Phong's reflected view: words come with each ray
    int light_fraction = 0, normal_fraction = 0, dot_fraction = 0, power_fraction = 0, intensity_fraction = 0,
        material_fraction = 0;
    std::array<std::array<std::int64_t, 3>, kMostLights> light{}, half{},
        color{};                                         // raw; color in the material format
    std::array<std::int64_t, kMostLights> light_view{};  // Phong: L.V, in the dot's format, orthographic
    std::int64_t ka = 0, kd = 0, ks = 0;                 // raw, in the material format
    std::array<double, 3> material{};                    // the same, exact
    std::array<std::array<double, 3>, kMostLights> light_exact{}, half_exact{}, color_exact{};
    bool active = true;  // Real: constants rounded or exact
    double exponent = 1;
    int squarings = 0;
    std::int64_t parabola_slope = 0;  // 2 times (exponent + 1) / 2: keeps the lobe's energy; one fraction bit
    int power_table_bits = 0;
    GoochTones gooch;
    KeptLength kept;
    Rescale to_light_view;  // Phong: L.V
    Rescale to_dot, to_reflected, to_power_input, to_power, to_power_lerp, to_fall, to_diffuse_sum,
        to_specular_sum, to_faded, to_diffuse, to_specular, to_lit;
    Rescale to_light;  // per-ray half and view vectors on their way to words
    Spec light_spec;
};

struct ShadingStage : ShadingConstants {
    Table power_table;  // power rule `table`: 2^b + 1 rows over the dot's range

    template <class V>
    void visit(V&& v) {
        for (Rescale* r :
             {&to_light_view, &to_dot, &to_reflected, &to_power_input, &to_power, &to_power_lerp, &to_fall,
              &to_diffuse_sum, &to_specular_sum, &to_faded, &to_diffuse, &to_specular, &to_lit, &to_light})
            v(*r);
        v(gooch.to_faded), v(gooch.to_side), v(power_table);
        v(kept.arc), v(kept.to_turn), v(kept.to_arc), v(kept.to_between);
    }
    /// Whether each ray has words of its own.
    bool needs_ray() const { return half_per_ray || model == ShadingModel::phong; }
};
/// Builds the stage's constants.  Throws InputError for an exponent that its power rule cannot have, and for
/// an unsigned wire in a lit scene.
ShadingStage build_shading(const StageInputs& in);

}  // namespace squint
