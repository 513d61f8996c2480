// Stage 4 of points between paired rows in lanes, and stage 6 with it where nothing stands between the two.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_points.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/all_lanes-inl.h"
#include "fixedpoint/words/unit_lanes-inl.h"
#include "pipeline/classification/methods-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/slabs-inl.h"
#include "pipeline/stages/compositing-inl.h"
#include "pipeline/stages/default_facts.h"

#include <array>
#include <string>
#include <variant>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

using L = Lanes<std::int32_t, KnownRescales::halves_up>;

void classify_paired_points(const Plan& plan, int steps, lanes::Samples& samples) {
    const PairedPoints<L> points(plan);
    const Unseen<L> unseen(plan);
    const L zero = constant<L>(0);
    for (int at = 0; at < steps * lanes::kRays; at += static_cast<int>(L::count())) {
        const L input = load<L>(samples.input.v + at), length = load<L>(samples.length.v + at);
        store_slab(
            unseen.holds(input, input) ? Slab<L>{{zero, zero, zero}, zero} : points.classify(input, length),
            at, samples);
    }
}

#if HWY_ARCH_X86 && HWY_TARGET <= HWY_SSE4
using Parts = UnitParts<L>;

HWY_INLINE Parts load_parts(const lanes::Word* from) {
    Parts parts;
    for_parts<L>([&](std::size_t i) SQUINT_WRITTEN_OUT { parts[i] = load<L>(from + i * L::count()); });
    return parts;
}
HWY_INLINE void store_parts(const Parts& parts, lanes::Word* to) {
    for_parts<L>([&](std::size_t i) SQUINT_WRITTEN_OUT { store(parts[i], to + i * L::count()); });
}

/// Colours and opacities stay in registers, and are composited in 16 bits.
void classify_and_composite_points(const Plan& plan, const lanes::RayPacket& packet, int steps,
                                   const lanes::Samples& samples, lanes::PixelPacket& pixels) {
    using U = UnitLanes;
    CompositingStage stage = plan.compositing;
    UnitCompositing::assume(stage);
    const PairedPoints<L> points(plan);
    const Unseen<L> unseen(plan);
    const U zero = constant<U>(0), one = constant<U>(1);
    for (int r = 0; r < lanes::kRays; r += static_cast<int>(U::count())) {
        const auto units = [&](const lanes::Row& row) { return units_of<L>(load_parts(row.v + r)); };
        Accumulated<U> pixel{{units(pixels.color[0]), units(pixels.color[1]), units(pixels.color[2])},
                             units(pixels.transparency)};
        Parts left = load_parts(packet.slabs.v + r);  // slabs of each ray, of this batch's
        for (L& slabs : left)
            slabs = clamp(slabs - constant<L>(samples.first), constant<L>(0), constant<L>(lanes::kSteps));
        const U slabs = units_of<L>(left);
        U count = zero;
        UnitMask active = zero < units(pixels.active);
        for (int step = 0; step < steps; ++step) {
            active = active & (constant<U>(step) < slabs);
            if (!any(active)) break;
            count = count + only(active, one);
            const int at = step * lanes::kRays + r;
            const Parts input = load_parts(samples.input.v + at), length = load_parts(samples.length.v + at);
            bool seen = false;
            for_parts<L>([&](std::size_t i)
                             SQUINT_WRITTEN_OUT { seen |= !unseen.holds(input[i], input[i]); });
            if (!seen) continue;
            std::array<Parts, 3> color;
            Parts opacity;
            for_parts<L>([&](std::size_t i) SQUINT_WRITTEN_OUT {
                const Slab<L> slab = points.classify(input[i], length[i]);
                for_three([&](std::size_t c) SQUINT_WRITTEN_OUT { color[c][i] = slab.color[c]; });
                opacity[i] = slab.alpha;
            });
            // Transparent slabs change nothing: those of rays that have ended, too.
            const U alpha = only(active, units_of<L>(opacity));
            take_contribution(stage, pixel,
                              {units_of<L>(color[0]), units_of<L>(color[1]), units_of<L>(color[2])},
                              rounded_contribution(stage, alpha, pixel.transparency));
            active = active & goes_on(stage, pixel);
        }
        for_three([&](std::size_t c) SQUINT_WRITTEN_OUT {
            store_parts(words_of<L>(pixel.color[c]), pixels.color[c].v + r);
        });
        store_parts(words_of<L>(pixel.transparency), pixels.transparency.v + r);
        Parts counted = words_of<L>(count);
        for (std::size_t i = 0; i < counted.size(); ++i)
            counted[i] = counted[i] + load<L>(pixels.samples.v + r + i * L::count());
        store_parts(counted, pixels.samples.v + r);
        store_parts(words_of<L>(only(active, one)), pixels.active.v + r);
    }
}

constexpr auto kClassifyComposite = &classify_and_composite_points;
#else
constexpr decltype(lanes::StageKernels::classify_composite) kClassifyComposite = nullptr;
#endif

}  // namespace

void point_kernels_of(const Plan& plan, const lanes::StageWays& ways, lanes::StageKernels& kernels) {
    if (!std::holds_alternative<PostClassification>(plan.method)) return;
    const std::string name = "classify." + std::string(name_of(plan.scene.classification.method));
    const std::string missing = PairedPoints<L>::missing(plan, ways.classification);
    kernels.chose(lanes::Segment::classify, missing.empty() ? name + ".paired" : name, missing);
    if (!missing.empty()) return;
    kernels.classify = &classify_paired_points;
    const OutputSettings& output = plan.scene.output;
    const bool noted = plan.wants_depth || output.depth || output.normals;
    if (!kClassifyComposite || noted || !UnitCompositing::hold(plan.compositing) ||
        !lanes::why_not_narrow(ways.compositing, KnownRescales::nothing).empty())
        return;
    kernels.classify_composite = kClassifyComposite;
    kernels.chose(lanes::Segment::classify_composite, "classify+composite.unit15");
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void point_kernels(std::int64_t target, const Plan& plan, const StageWays& ways, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, point_kernels_of, plan, ways, kernels)
}
}  // namespace squint::lanes
#endif
