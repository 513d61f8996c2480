// Runs the composition once for any slab of any ray of a plan: for words that stand for all values of a
// number, which are intervals (ranges.cpp) and tallies (studies/sweep/cost.cpp).  Both ways of each branch
// are taken. Compiled once per SIMD target.
#if defined(SQUINT_PIPELINE_PLAN_ANY_SLAB_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_PIPELINE_PLAN_ANY_SLAB_INL_H
#undef SQUINT_PIPELINE_PLAN_ANY_SLAB_INL_H
#else
#define SQUINT_PIPELINE_PLAN_ANY_SLAB_INL_H
#endif

#include "pipeline/plan/plan.h"
#include "pipeline/plan/ranges.h"

#include "fixedpoint/words/tally.h"
#include "pipeline/slab-inl.h"

#include <hwy/highway.h>

#include <bit>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

/// Any number of a range, on a wire of `width` bits.
inline Range any_word(WordTag<Range>, const Range& range, int) {
    return range;
}
inline Tally any_word(WordTag<Tally>, const Range& range, int width) {
    return tally_of(range, width);
}
inline const Range& range_of(const Range& word) {
    return word;
}
inline const Range& range_of(const Tally& word) {
    return word.proven;
}

/// Any voxel that the volume can hold, at any place, and any sum over a box of them.
template <class W>
struct AnyVoxel {
    W voxel, box_sum;
    Cell<W> cell(const std::array<W, 3>&) const {
        Cell<W> cell;
        cell.corner.fill(voxel);
        return cell;
    }
    Neighbourhood<W> neighbourhood(const std::array<W, 3>&) const {
        Neighbourhood<W> near;
        near.voxel.fill(voxel);
        return near;
    }
    Neighbourhood<W> box_sums(const std::array<W, 3>&) const {
        Neighbourhood<W> near;
        near.voxel.fill(box_sum);
        return near;
    }
    W nears_wall(const WallStage&, const std::array<W, 3>&) const {
        return any_word(WordTag<W>{}, Range{0, 1}, 1);
    }
};

/// One slab, onto any pixel; of a projection, any sample and the ray's end.  The first slab of a ray computes
/// the samples at both its ends; with `neighbours` = 2 a second slab follows, which shares one with the
/// first.
template <class W, class Observer>
void any_slab(const Plan& plan, Observer& observer, int neighbours = 1) {
    const auto up_to = [](std::int64_t high, int width = 0) {
        return any_word(WordTag<W>{}, Range{0, high}, width);
    };
    const auto any_of = [](const Format& f) {
        return any_word(WordTag<W>{}, Range{f.smallest(), f.largest()}, f.width());
    };
    const auto width_of = [&](Wire wire) { return plan.specs[wire].format.width(); };
    const auto most_slabs = static_cast<std::int64_t>(most_steps(plan)) + 2;

    RayWords<W> ray{};
    for (std::size_t a = 0; a < 3; ++a) {
        ray.first[a] = ray.last[a] = up_to(plan.location.limit[a], width_of(Wire::location));
        ray.step[a] = any_of(plan.location.direction.format);
        ray.view[a] = any_of(plan.shading.light_spec.format);
        for (auto& half : ray.half) half[a] = any_of(plan.shading.light_spec.format);
    }
    ray.last_index = up_to(most_slabs);
    ray.last_length = up_to(plan.specs[Wire::length].format.one(), width_of(Wire::length));
    for (const Wire wire : {Wire::direction, Wire::length}) note_wire(WordTag<W>{}, static_cast<int>(wire));

    const Volume& v = *plan.volume;
    constexpr std::int64_t kBox = kBoxSide * kBoxSide * kBoxSide;
    const int box_bits = v.scalar_bits + static_cast<int>(std::bit_width(static_cast<std::uint64_t>(kBox)));
    const AnyVoxel<W> voxels{any_word(WordTag<W>{}, Range{v.smallest, v.largest}, v.scalar_bits),
                             any_word(WordTag<W>{}, Range{kBox * v.smallest, kBox * v.largest}, box_bits)};
    std::visit(
        [&](const auto& method) {
            Slabs slabs(plan, method, voxels, ray, up_to(most_slabs), observer);
            slabs.pixel.transparency = up_to(plan.compositing.unit(), width_of(Wire::transparency));
            const int carried = std::max(plan.compositing.to_contribution.shift, 0);
            if (plan.compositing.form == CompositingForm::w_carry)
                slabs.pixel.remainder = up_to((std::int64_t{1} << carried) - 1, carried);
            for (W& c : slabs.pixel.color) c = any_of(plan.specs[Wire::color].format);
            if (!plan.projection_mode) {
                for (int i = 0; i < neighbours; ++i) slabs.step(up_to(most_slabs - 1));
                return;
            }
            const W scalar = slabs.sample(up_to(most_slabs)).input;
            observer.at(Part::classification);
            ProjectedRay<W> all{scalar, scalar, any_word(WordTag<W>{}, Range{1, most_slabs}, 0),
                                ray.last_length};
            if (plan.scene.compositing.mode == CompositingMode::average) {  // both ends of all slabs
                const auto ends = 2 * static_cast<std::int64_t>(range_of(scalar).high);
                all.kept = up_to(ends * most_slabs) + constant<W>(0);
                all.last_ends = up_to(ends) + constant<W>(0);
            }
            slabs.project(all);
        },
        plan.method);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
