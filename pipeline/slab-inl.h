// The composition of the stages: the only place where their order stands.
//
//     volume -> location -> interpolation -> gradient -> classification -> shading -> compositing -> pixel
//
// A template over the word, the classification, the source of voxels and an observer.  A machine runs it:
// the golden model, its audit and traces (machines/model/), intervals (plan/ranges.cpp), the tally of
// hardware (studies).  A branch on a comparison asks any(): intervals take both ways.  Compiled once per
// SIMD target.
#if defined(SQUINT_PIPELINE_SLAB_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_SLAB_INL_H
#undef SQUINT_PIPELINE_SLAB_INL_H
#else
#define SQUINT_PIPELINE_SLAB_INL_H
#endif

#include "pipeline/slab.h"

#include "pipeline/classification/methods-inl.h"
#include "pipeline/from_volume-inl.h"
#include "pipeline/plan/plan.h"
#include "pipeline/stages/compositing-inl.h"
#include "pipeline/stages/gradient-inl.h"
#include "pipeline/stages/inside-inl.h"
#include "pipeline/stages/interpolation-inl.h"
#include "pipeline/stages/location-inl.h"
#include "pipeline/stages/projection-inl.h"
#include "pipeline/stages/shading-inl.h"

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// One where the cell at a position holds a wall, else zero.
template <class Voxels, class W>
HWY_INLINE W nears_wall(const Voxels& voxels, const WallStage& walls, const CellPosition<W>& at) {
    return voxels.nears_wall(walls, at.cell);
}
/// A slab that was looked at twice, or the same at one look.
template <class W, class Mask>
HWY_INLINE Slab<W> either(const Mask& twice, const Slab<W>& looked, const Slab<W>& once) {
    Slab<W> slab;
    for (std::size_t c = 0; c < 3; ++c) slab.color[c] = select(twice, looked.color[c], once.color[c]);
    slab.alpha = select(twice, looked.alpha, once.alpha);
    return slab;
}

/// Stage 3: a raw gradient turned from the mean of those about its place.
template <class W, class Voxels>
std::array<W, 3> exaggerated_gradient(const Plan& plan, Voxels& voxels, const std::array<W, 3>& cell,
                                      const std::array<W, 3>& weight, const std::array<W, 3>& gradient) {
    const GradientStage& boxes = plan.box_gradient;
    const Neighbourhood<W> sums = voxels.box_sums(cell);
    std::array<W, 3> mean;
    for (int axis = 0; axis < 3; ++axis)
        mean[static_cast<std::size_t>(axis)] =
            to_world(boxes, voxel_difference(boxes, sums, weight, axis), axis);
    return exaggerated(plan.gradient, boxes, gradient, mean);
}

/// The mean along a ray (trapezoid rule), rounded once: each slab counts its ends' mean, by its length.
template <class W>
HWY_INLINE W average_of(const Plan& plan, const ProjectedRay<W>& ray) {
    const W full = constant<W>(std::int64_t{1} << plan.location.length_fraction);
    const W last = divisor<W>(ray.last_length);
    const W length = (ray.slabs - constant<W>(1)) * full + last;
    return within(quotient(ray.kept * full + ray.last_ends * last, shift_left(length, 1), plan.to_average), 0,
                  plan.input.highest);
}

/// Ends a projection: the ray's value is classified and composited as one slab.
template <class W, class M, class Observer>
Accumulated<W> projected(const Plan& plan, const M& method, const ProjectedRay<W>& ray, Accumulated<W> pixel,
                         Observer& observer) {
    observer.at(Part::classification);
    const W scalar =
        plan.scene.compositing.mode == CompositingMode::average ? average_of(plan, ray) : ray.kept;
    const Slab<W> slab =
        classify(method, scalar, scalar, constant<W>(std::int64_t{1} << plan.location.length_fraction));
    observer.at(Part::compositing);
    const Accumulated<W> before = pixel;
    composite(plan.compositing, pixel, slab.color, slab.alpha);
    observer.composited(slab, before, pixel);
    return pixel;
}

/// What a place on a ray has: a scalar, a gradient, light.  These are stages 1, 2, 3 and 5, which know
/// no method of classification, and are compiled once a word.
template <class W, class Voxels, class Observer = const Silent>
class Places {
  public:
    Places(const Plan& plan, const Voxels& voxels, const RayWords<W>& ray, Observer& observer)
        : plan_(plan), voxels_(voxels), ray_(ray), observer_(observer) {}

    /// Stages 1 and 2: sample k of the ray.
    Sample<W> sample(W k) const {
        observer_.at(Part::location);
        return sample_at({locate(plan_.location, ray_, k, 0), locate(plan_.location, ray_, k, 1),
                          locate(plan_.location, ray_, k, 2)});
    }

    /// Stage 3: the raw gradient at a sample, which two slabs share; computed once.
    const std::array<W, 3>& gradient_of(Sample<W>& sample) const {
        if (!sample.has_gradient) sample.gradient = gradient_at(sample), sample.has_gradient = true;
        return sample.gradient;
    }

  protected:
    // The raw gradient at `part` 2^-bits of the way from one sample to the other.
    std::array<W, 3> gradient_between(const Sample<W>& front, const Sample<W>& back, int part,
                                      int bits) const {
        observer_.at(Part::location);
        Sample<W> sample;
        sample.location = location_between(plan_.inside, front.location, back.location, part, bits);
        sample.position = position_of(sample.location);
        return gradient_at(sample);
    }
    // Stages 1 and 2 there.
    Sample<W> sample_between(const Sample<W>& front, const Sample<W>& back, int part, int bits) const {
        observer_.at(Part::location);
        return sample_at(location_between(plan_.inside, front.location, back.location, part, bits));
    }

    // Stage 2 at a location.
    Sample<W> sample_at(const std::array<W, 3>& location) const {
        Sample<W> sample = scalar_at(location);
        observer_.at(Part::input);
        sample.input = classification_input(plan_.input, sample.scalar);
        return sample;
    }
    Sample<W> scalar_at(const std::array<W, 3>& location) const {
        Sample<W> sample;
        sample.location = location;
        sample.position = position_of(location);
        observer_.at(Part::interpolation);
        sample.scalar =
            interpolate(plan_.interpolation, voxels_.cell(sample.position.cell), sample.position.weight);
        return sample;
    }

    CellPosition<W> position_of(const std::array<W, 3>& location) const {
        CellPosition<W> position = cell_position(plan_.location, location);
        // A place inside a cell is at most 1: intervals cannot see that.
        for (W& w : position.weight) w = within(w, 0, std::int64_t{1} << plan_.interpolation.weight_bits);
        return position;
    }

    // Stage 3 at a sample: the raw gradient, per smallest voxel spacing.
    std::array<W, 3> gradient_at(const Sample<W>& sample) const {
        const GradientStage& s = plan_.gradient;
        std::array<W, 3> gradient;
        Neighbourhood<W> near;
        if (s.rule != GradientRule::central_samples) near = voxels_.neighbourhood(sample.position.cell);
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            W component;
            if (s.rule == GradientRule::central_samples) {
                const W ahead = scalar_beside(sample, axis, true),
                        behind = scalar_beside(sample, axis, false);
                observer_.at(Part::gradient);
                component = sample_difference(s, ahead, behind);
            } else {
                observer_.at(Part::gradient);
                component = voxel_difference(s, near, sample.position.weight, axis);
            }
            gradient[a] = to_world(s, component, axis);
        }
        if (!s.exaggerated.wanted) return gradient;
        observer_.at(Part::gradient);
        return exaggerated_gradient(plan_, voxels_, sample.position.cell, sample.position.weight, gradient);
    }
    W scalar_beside(const Sample<W>& sample, int axis, bool ahead) const {
        observer_.at(Part::location);
        std::array<W, 3> location = sample.location;
        const auto a = static_cast<std::size_t>(axis);
        location[a] = beside(plan_.location, location[a], axis, ahead);
        return scalar_at(location).scalar;
    }

    // Lights a slab or a piece of one by one raw gradient; a slab's normal is that of its first piece.
    void light_with(const std::array<W, 3>& gradient, Slab<W>& slab, bool is_first = true) const {
        observer_.at(Part::normal);
        const std::array<W, 3> normal = normalise(plan_.gradient, gradient);
        const W certain = plan_.gradient.fades ? confidence(plan_.gradient, gradient) : constant<W>(0);
        if (is_first) observer_.lit(normal);
        observer_.at(Part::shading);
        shade(plan_.shading, ray_, normal, slab.alpha, slab.color, certain);
    }
    // Lights a slab by the gradients at one or two places between its ends.
    void light_places(const std::array<W, 3>& at_front, const std::array<W, 3>& at_back,
                      const LightPlaces<W>& places, Slab<W>& slab) const {
        const auto gradient_there = [&](W way) {
            observer_.at(Part::gradient);
            return gradient_up_to(plan_.inside, at_front, at_back, way);
        };
        Slab<W> far = slab;
        light_with(gradient_there(places.near), slab);
        if (plan_.inside.rule == InsideRule::centroid) return;
        light_with(gradient_there(places.far), far, false);
        observer_.at(Part::shading);
        slab.color = light_of_places(plan_.inside, slab.color, far.color, places.share);
    }
    // Lights a slab between two raw gradients, where its tables say where its light lies.
    void light_fading(const std::array<W, 3>& at_front, const std::array<W, 3>& at_back,
                      const FadingLight<W>& light, Slab<W>& slab) const {
        observer_.at(Part::gradient);
        const std::array<std::array<W, 3>, 2> gradient{
            gradient_up_to(plan_.inside, at_front, at_back, constant<W>(0)),
            gradient_up_to(plan_.inside, at_front, at_back, light.end)};
        observer_.at(Part::normal);
        const FadingNormals<W> ends = fading_normals(plan_.gradient, gradient);
        observer_.lit(ends.normal[0]);
        observer_.at(Part::shading);
        shade_fading(plan_.shading, ray_, ends.normal, ends.certain, light, slab.color);
    }

    const Plan& plan_;
    const Voxels& voxels_;
    const RayWords<W>& ray_;
    Observer& observer_;
};

/// Takes the slabs of one ray, one after the other, through all stages to its pixel.  `slabs`: their number.
template <class W, class M, class Voxels, class Observer = const Silent>
class Slabs : public Places<W, Voxels, Observer> {
    using Places = HWY_NAMESPACE::Places<W, Voxels, Observer>;
    using Places::gradient_of, Places::gradient_between, Places::sample_between, Places::position_of,
        Places::light_with, Places::light_fading;
    using Places::plan_, Places::voxels_, Places::ray_, Places::observer_;

  public:
    using Places::sample;
    Accumulated<W> pixel;  // gathered so far

    Slabs(const Plan& plan, const M& method, const Voxels& voxels, const RayWords<W>& ray, W slabs,
          Observer& observer)
        : Places(plan, voxels, ray, observer),
          pixel(nothing_yet<W>(plan.compositing)),
          method_(method),
          last_(slabs - constant<W>(1)),
          backwards_(plan.compositing.form == CompositingForm::back_to_front) {}

    /// Computes slab k.  Slabs come in order, or from the last where compositing runs backwards: neighbours
    /// that need both ends compute the sample between them once.
    void step(W k) {
        observer_.slab(k);
        take_samples(k);
        const W full = constant<W>(std::int64_t{1} << plan_.location.length_fraction);
        composite_slab(front_, back(), select(k == last_, ray_.last_length, full));
    }

    /// Leaves out slabs that are transparent.
    void pass() { carries_ = false; }

    /// Whether slabs behind this one can still be seen.
    auto goes_on() const { return HWY_NAMESPACE::goes_on(plan_.compositing, pixel); }

    /// Ends a projection.
    void project(const ProjectedRay<W>& ray) { pixel = projected(plan_, method_, ray, pixel, observer_); }

  private:
    void take_samples(W k) {
        observer_.at(Part::location);
        if constexpr (!M::kNeedsBack) {
            front_ = sample(k);
        } else if (backwards_) {
            back_ = carries_ ? front_ : sample(k + constant<W>(1));
            front_ = sample(k);
        } else {
            front_ = carries_ ? back_ : sample(k);
            back_ = sample(k + constant<W>(1));
        }
        carries_ = true;
    }
    Sample<W>& back() { return M::kNeedsBack ? back_ : front_; }

    // Stages 4, 3 and 5, 6: one slab between two samples, or a part of it.
    void composite_slab(Sample<W>& front, Sample<W>& back, W length) {
        observer_.at(Part::classification);
        Slab<W> slab = classify(method_, front.input, back.input, length);
        const W zero = constant<W>(0),
                twice = plan_.walls.looks_twice ? wants_second_look(front, back, slab) : zero;
        const bool looks = plan_.walls.looks_twice && any(zero < twice);
        const Slab<W> looked = looks ? look_twice(front, back, length) : slab;
        if (plan_.lit && any((zero < slab.alpha) & (twice == zero))) light(front, back, length, slab);
        slab = either(zero < twice, looked, slab);
        observer_.at(Part::compositing);
        const Accumulated<W> before = pixel;
        composite(plan_.compositing, pixel, slab.color, slab.alpha);
        observer_.composited(slab, before, pixel);
    }

    // One where a slab that met no wall has one in a cell on its way: at its ends, or half-way.
    W wants_second_look(const Sample<W>& front, const Sample<W>& back, const Slab<W>& slab) const {
        const W zero = constant<W>(0);
        const auto open = slab.alpha < constant<W>(plan_.inside.one_alpha);
        if (!any(open)) return zero;
        const auto near = [&](const CellPosition<W>& p) { return nears_wall(voxels_, plan_.walls, p); };
        W wall = max(near(front.position), near(back.position));
        if (any(wall == zero)) {
            observer_.at(Part::location);
            wall = max(
                wall, near(position_of(location_between(plan_.inside, front.location, back.location, 1, 1))));
        }
        return select(open, wall, zero);
    }
    // Stages 1 to 5 once more: a slab in pieces between samples inside it, joined.
    Slab<W> look_twice(const Sample<W>& front, const Sample<W>& back, W length) const {
        observer_.looked_twice();
        return slab_in_pieces(front, back, length, kSecondLookBits,
                              [&](int i) { return sample_between(front, back, i, kSecondLookBits).input; });
    }

    // Stages 3 and 5: lights what is visible of a slab, with one normal or in pieces, as shading.inside says.
    void light(Sample<W>& front, Sample<W>& back, W length, Slab<W>& slab) const {
        const InsideStage& inside = plan_.inside;
        if (inside.rule == InsideRule::front) return light_with(gradient_of(front), slab);
        if (inside.rule == InsideRule::middle) return light_with(gradient_between(front, back, 1, 1), slab);
        const std::array<W, 3>&at_front = gradient_of(front), &at_back = gradient_of(back);
        if constexpr (requires { method_.prefix; }) {
            if constexpr (requires { method_.fades; } || !M::kPremultiplied)
                if (lights_fade(inside.rule))
                    return light_fading(at_front, at_back,
                                        fading_light_of(front.input, back.input, length, slab), slab);
            if (lights_at_places(inside.rule))
                return light_places(at_front, at_back, front.input, back.input, length, slab);
        }
        observer_.at(Part::gradient);
        const std::array<W, 3> sum = sum_of_ends(at_front, at_back);
        if (inside.rule == InsideRule::mean) return light_with(sum, slab);
        const W zero = constant<W>(0);
        observer_.at(Part::normal);
        const auto worth_it = !(slab.alpha < constant<W>(inside.least_cut));
        const W cuts = select(worth_it, cuts_between(at_front, at_back), zero);
        Slab<W> whole = slab;
        if (any(cuts == zero)) light_with(sum, whole);
        slab.color = whole.color;
        for (int bits = 1; bits <= kMostCuts; ++bits) {
            const auto so_many = cuts == constant<W>(bits);
            if (!any(so_many)) continue;
            observer_.cut(bits);
            const Slab<W> joined = slab_in_pieces(front, back, length, bits, [&](int i) {
                return input_between(inside, front.input, back.input, i, bits);
            });
            for (std::size_t c = 0; c < 3; ++c)
                slab.color[c] = select(so_many, joined.color[c], slab.color[c]);
        }
    }

    FadingLight<W> fading_light_of(W front, W back, W length, const Slab<W>& slab) const {
        observer_.at(Part::classification);
        if constexpr (requires { method_.fades; })
            return fading_light(method_, front, back, length, slab);
        else
            return fading_light_of_quarters(plan_.inside, method_, front, back, length, slab);
    }
    void light_places(const std::array<W, 3>& at_front, const std::array<W, 3>& at_back, W front, W back,
                      W length, Slab<W>& slab) const {
        observer_.at(Part::classification);
        Places::light_places(at_front, at_back,
                             places_of_light(plan_.inside, method_.prefix, front, back, length), slab);
    }

    // A slab from 2^bits pieces, lit if light falls on it; input_at(i): between pieces i - 1 and i.
    template <class InputAt>
    Slab<W> slab_in_pieces(const Sample<W>& front, const Sample<W>& back, W length, int bits,
                           const InputAt& input_at) const {
        const InsideStage& inside = plan_.inside;
        PieceLight<W> sum = no_piece<W>(inside);
        W near = front.input, near_length = constant<W>(0);
        bool seen = false;  // whether something of the slab is visible
        for (int i = 1; i <= 1 << bits; ++i) {
            observer_.at(Part::classification);
            const bool last = i == 1 << bits;
            const W far = last ? back.input : input_at(i);
            observer_.at(Part::classification);
            const W far_length = last ? length : length_up_to(inside, length, i, bits);
            Slab<W> piece = classify(method_, near, far, far_length - near_length);
            if (any(constant<W>(0) < piece.alpha)) {
                if (plan_.lit)
                    light_with(for_pieces(inside, plan_.gradient,
                                          gradient_between(front, back, 2 * i - 1, bits + 1)),
                               piece, !seen);
                seen = true;
                add_piece(inside, sum, piece.color, piece.alpha);
            }
            near = far, near_length = far_length;
        }
        observer_.at(plan_.lit ? Part::shading : Part::classification);
        return {color_of_pieces(inside, sum), opacity_of_pieces(inside, sum)};
    }

    const M& method_;
    W last_;
    bool backwards_;
    bool carries_ = false;  // front_ and back_ hold the samples of the last slab
    Sample<W> front_, back_;
};

/// Knows of no transparent slabs.
struct NothingClear {
    constexpr std::int64_t operator()(std::int64_t) const { return 0; }
};

/// Casts a ray of `count` slabs through the volume; it ends where nothing behind can be seen.  Returns how many
/// went through the stages.  clear_from(k): how many slabs from k on, in either direction, are known to be
/// transparent: they count as composited.
template <class W, class M, class Voxels, class Observer, class ClearFrom = NothingClear>
std::int64_t cast_ray(const Plan& plan, const M& method, const Voxels& voxels, const RayWords<W>& ray,
                      std::int64_t count, Observer& observer, Pixel<W>& pixel,
                      const ClearFrom& clear_from = {}) {
    Slabs<W, M, Voxels, Observer> slabs(plan, method, voxels, ray, constant<W>(count), observer);
    std::int64_t visited = 0;
    pixel.samples = 0;
    if (plan.projection_mode) {
        if (count > 0) {
            const CompositingMode mode = plan.scene.compositing.mode;
            const bool average = mode == CompositingMode::average;
            W front = slabs.sample(constant<W>(0)).input;
            ProjectedRay<W> all{average ? constant<W>(0) : front, constant<W>(0), constant<W>(count),
                                ray.last_length};
            for (std::int64_t k = 0; k < count; ++k) {
                const W back = slabs.sample(constant<W>(k + 1)).input;
                const W ends = merge_samples(mode, front, back);
                W& to = average && k == count - 1 ? all.last_ends : all.kept;
                to = merge_samples(mode, to, ends);
                front = back;
            }
            slabs.project(all);
        }
        visited = pixel.samples = count;
    } else {
        const bool backwards = plan.compositing.form == CompositingForm::back_to_front;
        while (pixel.samples < count) {
            const std::int64_t k = backwards ? count - 1 - pixel.samples : pixel.samples;
            if (const std::int64_t clear = clear_from(k); clear > 0) {
                pixel.samples = std::min(pixel.samples + clear, count);
                slabs.pass();
                continue;
            }
            slabs.step(constant<W>(k));
            ++pixel.samples, ++visited;
            if (!backwards && !slabs.goes_on()) break;
        }
    }
    pixel.gathered = slabs.pixel;
    return visited;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
