// One ray, from the volume to a pixel: the table of contents of the pipeline.  Written over a word W and a
// classification M.
#pragma once

#include "pipeline/plan/plan.h"

#include "pipeline/classification/methods-inl.h"
#include "pipeline/stages/compositing-inl.h"
#include "pipeline/stages/gradient-inl.h"
#include "pipeline/stages/interpolation-inl.h"
#include "pipeline/stages/location-inl.h"
#include "pipeline/stages/ray_setup-inl.h"
#include "pipeline/stages/shading-inl.h"

#include <algorithm>
#include <array>
#include <optional>

namespace squint {

/// What one ray leaves behind.
template <class W>
struct Pixel {
    Accumulated<W> gathered;
    std::int64_t samples = 0;  // slabs composited
    std::optional<double>
        first_hit;  // distance from the ray's origin to the first slab that is not transparent, world
    double weighted_distance = 0, weight = 0;  // sum of w z and of w
    std::array<W, 3> first_normal{};
};

/// Called before each sample and slab, for traces.
struct NoObserver {
    void sample(std::int64_t) {}
    void slab(std::int64_t) {}
};

}  // namespace squint

#include <hwy/highway.h>
HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// Fetching is apart from arithmetic: stages receive voxels, they do not index the volume.
template <class W>
Cell<W> fetch_cell(const Volume& volume, const std::array<W, 3>& cell) {
    const Index3 p(to_index(cell[0]), to_index(cell[1]), to_index(cell[2]));
    Cell<W> corners;
    for (int i = 0; i < 8; ++i)
        corners.corner[static_cast<std::size_t>(i)] = constant<W>(volume.at(
            std::min(p.x + (i & 1), volume.dims.x - 1), std::min(p.y + (i >> 1 & 1), volume.dims.y - 1),
            std::min(p.z + (i >> 2), volume.dims.z - 1)));
    return corners;
}
template <class W>
Neighbourhood<W> fetch_neighbourhood(const Volume& volume, const std::array<W, 3>& cell) {
    const Index3 p(to_index(cell[0]), to_index(cell[1]), to_index(cell[2]));
    const auto inside = [](std::int64_t i, std::int64_t n) { return std::clamp<std::int64_t>(i, 0, n - 1); };
    Neighbourhood<W> n;
    for (int i = 0; i < 64; ++i)
        n.voxel[static_cast<std::size_t>(i)] = constant<W>(
            volume.at(inside(p.x + (i & 3) - 1, volume.dims.x), inside(p.y + (i >> 2 & 3) - 1, volume.dims.y),
                      inside(p.z + (i >> 4) - 1, volume.dims.z)));
    return n;
}

/// Stages 1 and 2 at a location: where it is, and the scalar there.
template <class W>
struct Sample {
    std::array<W, 3> location;
    CellPosition<W> position;
    W scalar;  // sample
    W input;   // in table entries
};
template <class W>
Sample<W> sample_at(const Plan& plan, const std::array<W, 3>& location) {
    Sample<W> sample;
    sample.location = location;
    sample.position = cell_position(plan.location, location);
    sample.scalar = interpolate(plan.interpolation, fetch_cell(*plan.volume, sample.position.cell),
                                sample.position.weight);
    sample.input = classification_input(plan.input, sample.scalar);
    return sample;
}
template <class W>
Sample<W> sample_number(const Plan& plan, const RayWords<W>& ray, std::int64_t k) {
    const W number = constant<W>(k);
    return sample_at(
        plan, std::array<W, 3>{locate(plan.location, ray, number, 0), locate(plan.location, ray, number, 1),
                               locate(plan.location, ray, number, 2)});
}

/// Stage 3 at a sample: the raw gradient, per smallest voxel spacing.
template <class W>
std::array<W, 3> gradient_at(const Plan& plan, const Sample<W>& sample) {
    const GradientStage& s = plan.gradient;
    std::array<W, 3> gradient;
    Neighbourhood<W> near;
    if (s.rule != GradientRule::central_samples)
        near = fetch_neighbourhood(*plan.volume, sample.position.cell);
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        W component;
        if (s.rule == GradientRule::central_samples) {
            const auto scalar_beside = [&](bool ahead) {
                std::array<W, 3> p = sample.location;
                p[a] = beside(plan.location, p[a], axis, ahead);
                const CellPosition<W> position = cell_position(plan.location, p);
                return interpolate(plan.interpolation, fetch_cell(*plan.volume, position.cell),
                                   position.weight);
            };
            component = sample_difference(s, scalar_beside(true), scalar_beside(false));
        } else {
            component = voxel_difference(s, near, sample.position.weight, axis);
        }
        gradient[a] = to_world(s, component, axis);
    }
    return gradient;
}

/// The normal of a slab: of its sample, or of the mean of its two ends' gradients.
template <class W>
std::array<W, 3> slab_normal(const Plan& plan, const Sample<W>& front, const Sample<W>* back) {
    std::array<W, 3> gradient = gradient_at(plan, front);
    if (back) {
        const std::array<W, 3> other = gradient_at(plan, *back);
        for (std::size_t a = 0; a < 3; ++a) gradient[a] = gradient[a] + other[a];
    }
    return normalise(plan.gradient, gradient);
}

/// The end of a projection: what is left of a ray's samples (their extreme, or their sum) is classified as
/// one.
template <class W, class M>
Pixel<W> projected(const Plan& plan, const M& method, W scalar, std::int64_t slabs) {
    Pixel<W> pixel;
    pixel.gathered = nothing_yet<W>(plan.compositing);
    if (plan.scene.compositing.mode == CompositingMode::average)
        scalar = quotient(scalar, constant<W>(slabs), plan.to_average);
    const Slab<W> slab =
        classify(method, scalar, scalar, constant<W>(std::int64_t{1} << plan.location.length_fraction));
    composite(plan.compositing, pixel.gathered, slab.color, slab.alpha);
    pixel.samples = slabs;
    return pixel;
}

/// MIP, MinIP, average: one scalar stands for the ray.
template <class W, class M>
Pixel<W> project_ray(const Plan& plan, const M& method, const RayWords<W>& words, const RaySetup& ray) {
    if (ray.slabs == 0) {
        Pixel<W> pixel;
        pixel.gathered = nothing_yet<W>(plan.compositing);
        return pixel;
    }
    const CompositingMode mode = plan.scene.compositing.mode;
    W scalar = sample_number(plan, words, 0).input;
    for (std::int64_t k = 1; k < ray.slabs; ++k) {
        const W next = sample_number(plan, words, k).input;
        scalar = mode == CompositingMode::mip     ? max(scalar, next)
                 : mode == CompositingMode::minip ? min(scalar, next)
                                                  : scalar + next;
    }
    return projected(plan, method, scalar, ray.slabs);
}

/// Adds a visible slab k to a pixel's depths: its front, seen by the share T lost there.
template <class W>
void note_depth(const Plan& plan, double entry_distance, std::int64_t k, W before, W after, bool backwards,
                Pixel<W>& pixel) {
    const double z = entry_distance + static_cast<double>(k) * plan.step_world;
    const double t0 = to_double(before), t1 = to_double(after);
    if (backwards) {
        const double clear = t0 > 0 ? t1 / t0 : 1;
        pixel.weighted_distance = pixel.weighted_distance * clear + z * (1 - clear);
        pixel.weight = pixel.weight * clear + (1 - clear);
    } else {
        pixel.weighted_distance += z * (t0 - t1);
        pixel.weight += t0 - t1;
    }
    if (!pixel.first_hit || backwards) pixel.first_hit = z;
}

/// volume -> location -> interpolation -> gradient -> classification -> shading -> compositing -> pixel.
template <class W, class M, class Observer = NoObserver>
Pixel<W> cast_ray(const Plan& plan, const M& method, const RaySetup& ray, Observer&& observer = {}) {
    const RayWords<W> words = ray_words<W>(plan, ray);
    if (plan.projection_mode) return project_ray<W>(plan, method, words, ray);
    Pixel<W> pixel;
    pixel.gathered = nothing_yet<W>(plan.compositing);
    const bool backwards = plan.compositing.form == CompositingForm::back_to_front;
    const W full_step = constant<W>(std::int64_t{1} << plan.location.length_fraction);

    Sample<W> front, back;
    bool met = false;  // something visible
    for (std::int64_t i = 0; i < ray.slabs; ++i) {
        const std::int64_t k = backwards ? ray.slabs - 1 - i : i;
        observer.slab(k);

        // Stages 1 and 2.  A slab's back is the next one's front.
        if (M::kNeedsBack && backwards) {
            if (i == 0)
                back = sample_number(plan, words, k + 1);
            else
                back = front;
            front = sample_number(plan, words, k);
        } else if (M::kNeedsBack) {
            front = i == 0 ? sample_number(plan, words, 0) : back;
            back = sample_number(plan, words, k + 1);
        } else {
            front = back = sample_number(plan, words, k);
        }

        // Stage 4.
        const W length = k == ray.slabs - 1 ? words.last_length : full_step;
        Slab<W> slab = classify(method, front.input, back.input, length);
        const bool visible = constant<W>(0) < slab.alpha;

        // Stages 3 and 5, where something is to be seen.
        if (plan.lit && visible) {
            const std::array<W, 3> normal = slab_normal(plan, front, M::kNeedsBack ? &back : nullptr);
            shade(plan.shading, words, normal, slab.alpha, slab.color);
            if (!met || backwards) pixel.first_normal = normal;
        }
        met = met || visible;

        // Stage 6.
        const Accumulated<W> before = pixel.gathered;
        composite(plan.compositing, pixel.gathered, slab.color, slab.alpha);
        ++pixel.samples;
        if (visible && plan.wants_depth)
            note_depth(plan, ray.entry_distance, k, transparency(plan.compositing, before),
                       transparency(plan.compositing, pixel.gathered), backwards, pixel);
        if (!backwards && !goes_on(plan.compositing, pixel.gathered)) break;
    }
    return pixel;
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
