#include "pipeline/plan/ranges.h"

#include "core/error.h"
#include "pipeline/slab-inl.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;

// Keeps what the composition needs, part by part, and the slab that it composited.
class Ledger : public Silent {
  public:
    std::array<WordNeeds, kParts> needs;
    Slab<Range> last{};  // composited

    Ledger() { Range::needs = {}; }
    void at(Part part) {
        close();
        part_ = part;
    }
    void close() {
        if (part_) needs[static_cast<std::size_t>(*part_)].merge(Range::needs);
        Range::needs = {};
    }
    void composited(const Slab<Range>& s, const Accumulated<Range>&, const Accumulated<Range>&) { last = s; }

  private:
    std::optional<Part> part_;
};

// Anything that a volume holds, wherever it is.
struct AnyVoxel {
    Range voxel;
    Cell<Range> cell(const std::array<Range, 3>&) const {
        Cell<Range> cell;
        cell.corner.fill(voxel);
        return cell;
    }
    Neighbourhood<Range> neighbourhood(const std::array<Range, 3>&) const {
        Neighbourhood<Range> near;
        near.voxel.fill(voxel);
        return near;
    }
};

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
    const auto most_slabs = static_cast<std::int64_t>(most_steps(plan)) + 2;
    Range::limited = 0;

    RayWords<Range> ray{};
    for (std::size_t a = 0; a < 3; ++a) {
        ray.first[a] = ray.last[a] = up_to(plan.location.limit[a]);
        ray.step[a] = format_range(plan.location.direction.format);
        ray.view[a] = format_range(plan.shading.light_spec.format);
        for (auto& half : ray.half) half[a] = format_range(plan.shading.light_spec.format);
    }
    ray.last_index = up_to(most_slabs), ray.last_length = up_to(plan.specs[Wire::length].format.one());

    // Any slab of any ray, onto whatever the slabs before it have left.
    Ledger ledger;
    const AnyVoxel voxels{{plan.volume->smallest, plan.volume->largest}};
    std::visit(
        [&](const auto& method) {
            Slabs slabs(plan, method, voxels, ray, up_to(most_slabs), ledger);
            slabs.pixel.transparency = up_to(plan.compositing.unit());
            for (Range& c : slabs.pixel.color) c = format_range(plan.specs[Wire::color].format);
            if (!plan.projection_mode) {
                slabs.step(up_to(most_slabs - 1));
                return;
            }
            Range scalar = slabs.sample(up_to(most_slabs)).input;
            ledger.at(Part::classification);
            if (plan.scene.compositing.mode == CompositingMode::average)
                scalar = noted({0, scalar.high * most_slabs});  // a sum of so many
            slabs.project(scalar, up_to(most_slabs));
        },
        plan.method);
    ledger.close();
    const auto needs_of = [&](Part part) { return ledger.needs[static_cast<std::size_t>(part)]; };
    plan.input_needs = needs_of(Part::input);
    plan.gradient_needs = needs_of(Part::gradient), plan.normal_needs = needs_of(Part::normal);
    std::array<WordNeeds, 6> needs;
    for (int part = 0; part < kParts; ++part)
        if (const auto p = static_cast<Part>(part); p != Part::input)
            needs[stage_index(p)].merge(needs_of(p));

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
    leave_out_proven_limits(plan, ledger.last);
}

}  // namespace squint
