#include "pipeline/plan/ranges.h"

#include "core/error.h"
#include "pipeline/classification/methods-inl.h"
#include "pipeline/stages/compositing-inl.h"
#include "pipeline/stages/gradient-inl.h"
#include "pipeline/stages/interpolation-inl.h"
#include "pipeline/stages/location-inl.h"
#include "pipeline/stages/shading-inl.h"

#include <fmt/format.h>

#include <algorithm>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;

// Runs one stage over ranges and gives the widths it met.
template <class F>
WordNeeds needs_of(F&& run) {
    Range::needs = {};
    run();
    return Range::needs;
}

Range up_to(std::int64_t high) {
    return {0, high};
}
Range format_range(const Format& f) {
    return {f.smallest(), f.largest()};
}

// Wires that no value of this scene can saturate or wrap need no limits.
struct LeaveOutLimits {
    std::uint64_t limited;
    void operator()(Rescale& r) const { r.limits = r.wire < 0 || (limited >> r.wire & 1); }
    void operator()(Table&) const {}
    void operator()(CellTable&) const {}
};

// Limits that meanings rule out where ranges cannot.
void leave_out_proven_limits(Plan& plan, const Slab<Range>& slab) {
    // A location is clamped to the box, and its format holds the box.
    if (!plan.location.to_location.wraps) plan.location.to_location.limits = false;
    // A part of a cell is one at most.
    plan.location.to_weight.limits = false;
    // Form w: w = q(alpha T) <= T for alpha <= 1, so T never falls below 0.  c w rounds to w at most for c <=
    // 1, so C, a sum of such shares, never passes the sum of all w, which is 1 - T.  (Lit colours may
    // pass 1.)
    CompositingStage& s = plan.compositing;
    const Format& color = plan.specs[Wire::color].format;
    const auto within_unit = [](const Range& x, int fraction) {
        return x.low >= 0 && x.high <= std::int64_t{1} << fraction;
    };
    const bool unit_slab = within_unit(slab.alpha, s.alpha_fraction) &&
                           std::all_of(slab.color.begin(), slab.color.end(),
                                       [&](const Range& c) { return within_unit(c, s.color_fraction); });
    s.of_units = unit_slab;
    if (s.form == CompositingForm::w && !s.premultiplied && unit_slab &&
        s.contribution_fraction == s.transparency_fraction && color.integer_bits >= 1 &&
        color.fraction_bits == s.contribution_fraction)
        s.to_color.limits = s.to_color_sum.limits = s.to_transparency.limits = false;
}

}  // namespace

void choose_words(Plan& plan) {
    const Volume& v = *plan.volume;
    const Range voxel{v.smallest, v.largest};
    const auto whole_steps = static_cast<std::int64_t>(most_steps(plan)) + 2;
    std::array<WordNeeds, 6> needs;
    Range::limited = 0;

    RayWords<Range> ray{};
    for (std::size_t a = 0; a < 3; ++a) {
        ray.first[a] = ray.last[a] = up_to(plan.location.limit[a]);
        ray.step[a] = format_range(plan.location.direction.format);
        ray.view[a] = format_range(plan.shading.light_spec.format);
        for (auto& half : ray.half) half[a] = format_range(plan.shading.light_spec.format);
    }
    ray.last_index = up_to(whole_steps), ray.last_length = up_to(plan.specs[Wire::length].format.one());

    std::array<Range, 3> location;
    CellPosition<Range> position;
    needs[0] = needs_of([&] {
        for (int a = 0; a < 3; ++a)
            location[static_cast<std::size_t>(a)] = locate(plan.location, ray, up_to(whole_steps), a);
        position = cell_position(plan.location, location);
        for (Range& w : position.weight) w = within(w, 0, std::int64_t{1} << plan.interpolation.weight_bits);
    });
    Range sample, input;
    needs[1] = needs_of([&] {
        Cell<Range> cell;
        cell.corner.fill(voxel);
        sample = interpolate(plan.interpolation, cell, position.weight);
    });
    plan.input_needs = needs_of([&] { input = classification_input(plan.input, sample); });
    std::array<Range, 3> normal{};
    if (plan.lit) {
        std::array<Range, 3> gradient;
        plan.gradient_needs = needs_of([&] {
            Neighbourhood<Range> near;
            near.voxel.fill(voxel);
            for (int axis = 0; axis < 3; ++axis) {
                Range& g = gradient[static_cast<std::size_t>(axis)];
                g = plan.gradient.rule == GradientRule::central_samples
                        ? sample_difference(plan.gradient, sample, sample)
                        : voxel_difference(plan.gradient, near, position.weight, axis);
                g = to_world(plan.gradient, g, axis);
                if (plan.needs_back) g = g + g;
            }
        });
        plan.normal_needs = needs_of([&] { normal = normalise(plan.gradient, gradient); });
        needs[2] = plan.gradient_needs;
        needs[2].merge(plan.normal_needs);
    }
    Slab<Range> slab;
    needs[3] = needs_of([&] {
        if (plan.scene.compositing.mode == CompositingMode::average && plan.projection_mode)
            input = input + quotient(input * up_to(whole_steps), up_to(whole_steps), plan.to_average);
        input = within(input, 0, plan.input.highest);
        slab = std::visit([&](const auto& m) { return classify(m, input, input, ray.last_length); },
                          plan.method);
    });
    if (plan.lit) needs[4] = needs_of([&] { shade(plan.shading, ray, normal, slab.alpha, slab.color); });
    needs[5] = needs_of([&] {
        Accumulated<Range> pixel = nothing_yet<Range>(plan.compositing);
        pixel.transparency = up_to(plan.compositing.unit());
        for (Range& c : pixel.color) c = format_range(plan.specs[Wire::color].format);
        composite(plan.compositing, pixel, slab.color, slab.alpha);
    });

    WordNeeds all = plan.input_needs;
    for (std::size_t i = 0; i < 6; ++i) {
        plan.stages[i].needs = needs[i];
        all.merge(needs[i]);
        if (needs[i].result_bits > 127)
            throw InputError(
                fmt::format("precision: the stage '{}' needs a word of {} bits or more with these formats, "
                            "and there are 127: narrow {}",
                            kStages[i], needs[i].result_bits, plan.stages[i].why));
    }
    plan.word_bits = all.result_bits <= 63 ? 64 : 128;
    visit_stages(plan, LeaveOutLimits{Range::limited});
    leave_out_proven_limits(plan, slab);
}

}  // namespace squint
