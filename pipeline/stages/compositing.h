// Stage 6: compositing.  Slab colour and opacity (1.F) -> pixel C and T (1.F).  Squeeze, sections 3 and 4.1.
//
//     w               w = q(alpha T);  T -= w;  C += c w       the default: C + T = 1 for white, one multiply fewer
//     w_carry         w = floor((alpha T + r) / 2^F), r the remainder, carried to the next slab;  T -= w;  C += c w,
//                     in 29 bits: ours, docs/compositing.md.  What rounding costs A does not grow with the slabs
//     equation_9      C += C_s T;  T = q(T (1 - alpha))        Squeeze, equation 9
//     alpha           C += C_s (1 - A);  A += q((1 - A) alpha) front to back with opacity
//     back_to_front   C = C_s + q(C (1 - alpha))               Squeeze, equation 6
//     straight        C = q((C A + c (A' - A)) / A'), A = 1 - T, T as in equation 9: the buffer holds the straight
//                     colour, a division a slab (section 4.1.2.1)
//     unit255_*       1.0 is 2^F - 1: a bare shift loses one in 256 at every product, Blinn's multiply
//                     (equation 1) does not
#pragma once

#include "fixedpoint/words.h"
#include "scene/scene.h"

#include <algorithm>
#include <array>

namespace squint {

struct StageInputs;

struct CompositingStage {
    CompositingForm form = CompositingForm::w;
    bool premultiplied = false;  // the slab's colour is
    int alpha_fraction = 0, color_fraction = 0, contribution_fraction = 0, transparency_fraction = 0;
    int sum_fraction = 0;                       // of C
    int numerator_fraction = 0;                 // straight: of both terms of C A', less T's
    bool of_units = false;                      // proven: slabs' colours and opacities lie in 0 to 1
    Rescale to_contribution;                    // alpha T
    Rescale to_transparency;                    // T - w, T (1 - alpha), or (1 - A) alpha
    Rescale to_color;                           // a product before it is added to C
    Rescale to_color_sum, to_transparency_sum;  // sums: they only limit
    Rescale to_slab_color;                      // c alpha, for forms that need it premultiplied
    Rescale alpha_to_code, color_to_code;       // 1.0 as 2^F - 1
    std::int64_t threshold = 0;                 // a ray ends where T is below this raw number
    double threshold_exact = 0;

    template <class V>
    void visit(V&& v) {
        for (Rescale* r : {&to_contribution, &to_transparency, &to_color, &to_color_sum, &to_transparency_sum,
                           &to_slab_color, &alpha_to_code, &color_to_code})
            v(*r);
    }
    bool is_unit255() const {
        return form == CompositingForm::unit255_shift || form == CompositingForm::unit255_blinn;
    }
    /// The forms of w = alpha T.
    bool takes_from_transparency() const {
        return form == CompositingForm::w || form == CompositingForm::w_carry;
    }
    /// w_carry: a pixel's first remainder, half of w's last bit in units of alpha T.
    std::int64_t first_remainder() const {
        return form == CompositingForm::w_carry && to_contribution.shift > 0
                   ? std::int64_t{1} << (to_contribution.shift - 1)
                   : 0;
    }
    std::int64_t unit() const { return (std::int64_t{1} << transparency_fraction) - (is_unit255() ? 1 : 0); }
    std::int64_t color_unit() const { return is_unit255() ? unit() : std::int64_t{1} << sum_fraction; }
};
/// Builds the stage's constants.  Throws InputError where the transparency's wire cannot hold one.
CompositingStage build_compositing(const StageInputs& in);

/// Form w_carry: gives the wire `color` all bits of the products that it adds, as far as a 32-bit lane has
/// room; nothing is ever multiplied by C.
void keep_sums_exact(const Scene& scene, WireSpecs& specs);
/// The form with which a scene is composited: its own, or its preset's.
CompositingForm form_of(const Scene& scene);

/// The state of a pixel: what it has gathered so far.  In the alpha form T holds alpha.
template <class W>
struct Accumulated {
    std::array<W, 3> color;
    W transparency;
    W remainder{};  // w_carry: the part of alpha T below w's last bit
};

}  // namespace squint
