// The maths of compositing.h, over any word; compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_STAGES_COMPOSITING_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_STAGES_COMPOSITING_INL_H
#undef SQUINT_PIPELINE_STAGES_COMPOSITING_INL_H
#else
#define SQUINT_PIPELINE_STAGES_COMPOSITING_INL_H
#endif

#include "pipeline/stages/compositing.h"

#include "core/rays-inl.h"
#include "fixedpoint/quotients-inl.h"
#include "fixedpoint/unrolled-inl.h"

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

template <class W>
HWY_INLINE Accumulated<W> nothing_yet(const CompositingStage& s) {
    const W zero = constant<W>(0);
    return {{zero, zero, zero},
            constant<W>(s.form == CompositingForm::alpha ? 0 : s.unit()),
            constant<W>(s.first_remainder())};
}
/// Without rounding there is no remainder.
template <RealWord W>
HWY_INLINE Accumulated<W> nothing_yet(const CompositingStage& s) {
    const W zero = constant<W>(0);
    return {{zero, zero, zero},
            constant<W>(s.form == CompositingForm::alpha ? 0 : s.unit()),
            constant<W>(s.to_contribution.active ? s.first_remainder() : 0)};
}

/// w = alpha T of form w, rounded.
template <class W>
HWY_INLINE W rounded_contribution(const CompositingStage& s, W alpha, W transparency) {
    return quantised_product(alpha, transparency, s.to_contribution);
}
/// w = alpha T, rounded; in w_carry floored, with the remainder of earlier slabs added and the new one kept.
template <class W>
HWY_INLINE W contribution(const CompositingStage& s, W alpha, Accumulated<W>& pixel) {
    if (s.form == CompositingForm::w) return rounded_contribution(s, alpha, pixel.transparency);
    const W sum = alpha * pixel.transparency + pixel.remainder;
    const W w = quantise(sum, s.to_contribution);
    const int shift = std::max(s.to_contribution.shift, 0);
    if (shift > 0) pixel.remainder = within(sum - shift_left(w, shift), 0, (std::int64_t{1} << shift) - 1);
    return w;
}

/// The transparency of all that was gathered.
template <class W>
HWY_INLINE W transparency(const CompositingStage& s, const Accumulated<W>& pixel) {
    return s.form == CompositingForm::alpha ? constant<W>(s.unit()) - pixel.transparency : pixel.transparency;
}

/// R G B A of a pixel: where fixed point meets float.  Over a real word of core/rays-inl.h.
template <class D>
HWY_INLINE std::array<D, 4> color_of(const CompositingStage& s, const Accumulated<D>& pixel) {
    const double unit = static_cast<double>(s.unit());
    const D t = s.form == CompositingForm::alpha ? D(unit) - pixel.transparency : pixel.transparency;
    const Divisor of_color(static_cast<double>(s.color_unit()));
    const D alpha = D(1) - t / Divisor(unit);
    const D share = s.form == CompositingForm::straight ? alpha : D(1);
    return {pixel.color[0] / of_color * share, pixel.color[1] / of_color * share,
            pixel.color[2] / of_color * share, alpha};
}

/// Whether a ray continues: T >= threshold.
template <class W>
HWY_INLINE auto goes_on(const CompositingStage& s, const Accumulated<W>& pixel) {
    return !(transparency(s, pixel) < constant<W>(s.threshold));
}
template <RealWord W>
HWY_INLINE auto goes_on(const CompositingStage& s, const Accumulated<W>& pixel) {
    return !(transparency(s, pixel) < W::from(s.threshold_exact * static_cast<double>(s.unit())));
}

/// x y where 1.0 is 2^F - 1: a bare shift, or Blinn's exact rounding of x y / (2^F - 1) (Squeeze, equation
/// 1).
template <class W>
HWY_INLINE W unit_product(const CompositingStage& s, W x, W y) {
    const int bits = s.transparency_fraction;
    if (s.form == CompositingForm::unit255_shift) return floor_shift(x * y, bits);
    const W sum = x * y + constant<W>(std::int64_t{1} << (bits - 1));
    return floor_shift(sum + floor_shift(sum, bits), bits);
}
/// Without rounding both are the product itself.
template <RealWord W>
HWY_INLINE W unit_product(const CompositingStage& s, W x, W y) {
    return x * y / constant<W>(s.unit());
}

/// Adds a slab of contribution w to a pixel: C + c w (C + c T of a premultiplied colour), T - w.
template <class W>
HWY_INLINE void take_contribution(const CompositingStage& s, Accumulated<W>& pixel,
                                  const std::array<W, 3>& color, W w) {
    W& t = pixel.transparency;
    for_three([&](std::size_t c) SQUINT_WRITTEN_OUT {
        const W share = quantised_product(color[c], s.premultiplied ? t : w, s.to_color);
        pixel.color[c] = quantise(pixel.color[c] + share, s.to_color_sum);
    });
    const int finer = std::max(s.contribution_fraction - s.transparency_fraction, 0);
    const int coarser = std::max(s.transparency_fraction - s.contribution_fraction, 0);
    t = quantise(shift_left(t, finer) - shift_left(w, coarser), s.to_transparency);
}

/// Composites one slab onto a pixel.
template <class W>
HWY_INLINE void composite(const CompositingStage& s, Accumulated<W>& pixel, std::array<W, 3> color, W alpha) {
    const W one = constant<W>(std::int64_t{1} << s.transparency_fraction);
    W& t = pixel.transparency;
    if (s.takes_from_transparency()) {
        const W w = contribution(s, alpha, pixel);
        return take_contribution(s, pixel, color, w);
    }
    if (s.form == CompositingForm::straight) {
        const W before = one - t;
        const W next =
            quantise(t * (constant<W>(std::int64_t{1} << s.alpha_fraction) - alpha), s.to_transparency);
        const W after = divisor<W>(one - next);
        const W share = s.premultiplied ? t : max(t - next, constant<W>(0));
        for_three([&](std::size_t c) SQUINT_WRITTEN_OUT {
            const W kept = shift_left(pixel.color[c] * before, s.numerator_fraction - s.sum_fraction);
            const W added = shift_left(color[c] * share, s.numerator_fraction - s.color_fraction);
            pixel.color[c] = divide(kept + added, after, s.to_color);
        });
        t = next;
        return;
    }
    if (!s.premultiplied)
        for (W& c : color) c = quantise(c * alpha, s.to_slab_color);
    if (s.is_unit255()) {
        const W unit = constant<W>(s.unit());
        const W code = quantise(alpha * unit, s.alpha_to_code);
        for (std::size_t c = 0; c < 3; ++c)
            pixel.color[c] =
                quantise(pixel.color[c] + unit_product(s, quantise(color[c] * unit, s.color_to_code), t),
                         s.to_color_sum);
        t = unit_product(s, t, max(unit - code, constant<W>(0)));
        note_wire(WordTag<W>{}, static_cast<int>(Wire::transparency));
        return;
    }
    const W clear = constant<W>(std::int64_t{1} << s.alpha_fraction) - alpha;
    for (std::size_t c = 0; c < 3; ++c) {
        W& sum = pixel.color[c];
        if (s.form == CompositingForm::back_to_front)
            sum = quantise(quantise(sum * clear, s.to_color) + quantise(color[c], s.color_to_code),
                           s.to_color_sum);
        else
            sum = quantise(
                sum + quantise(color[c] * (s.form == CompositingForm::alpha ? one - t : t), s.to_color),
                s.to_color_sum);
    }
    if (s.form == CompositingForm::alpha)
        t = quantise(t + quantise((one - t) * alpha, s.to_transparency), s.to_transparency_sum);
    else
        t = quantise(t * clear, s.to_transparency);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
