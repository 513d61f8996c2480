#include "pipeline/plan/ranges.h"

#include "core/error.h"
#include "pipeline/plan/any_slab-inl.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;

// Records the needs of the composition, part by part, and the slab that it composited.
class Ledger : public Silent {
  public:
    std::array<WordNeeds, kParts> needs;
    Slab<Range> last{};  // the one composited

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

// Wires that no value of this scene can saturate or wrap need no limits.
struct LeaveOutLimits {
    std::uint64_t limited;
    void operator()(Rescale& r) const { r.limits = r.wire < 0 || (limited >> r.wire & 1); }
    void operator()(Table&) const {}
    void operator()(CellTable&) const {}
};

// Drops limits that meaning rules out where intervals cannot.
void leave_out_proven_limits(Plan& plan, const Slab<Range>& slab) {
    // A location is clamped to the box, which its format holds.
    if (!plan.location.to_location.wraps) plan.location.to_location.limits = false;
    // A place inside a cell is at most 1.
    plan.location.to_weight.limits = false;
    // The difference of two places in the box.
    for (Rescale& r : plan.inside.to_location) r.limits = false;
    // Form w: w = q(alpha T) <= T for alpha <= 1, so T never falls below 0.  c w rounds to at most w for c <=
    // 1, so C, the sum of such shares, never exceeds the sum of all w, which is 1 - T.  (Lit colours may
    // exceed 1.)
    CompositingStage& s = plan.compositing;
    const Format& color = plan.specs[Wire::color].format;
    const auto within_unit = [](const Range& x, int fraction) {
        return x.low >= 0 && x.high <= std::int64_t{1} << fraction;
    };
    const bool unit_slab = within_unit(slab.alpha, s.alpha_fraction) &&
                           std::all_of(slab.color.begin(), slab.color.end(),
                                       [&](const Range& c) { return within_unit(c, s.color_fraction); });
    s.of_units = unit_slab;
    // Where c is premultiplied it is at most alpha, unless it is lit, and c T rounds to at most w where both
    // keep the same bits.
    const bool shares_within_w = s.premultiplied
                                     ? !plan.lit && s.form == CompositingForm::w &&
                                           plan.specs[Wire::slab_alpha].format.integer_bits >= 1 &&
                                           s.color_fraction >= s.alpha_fraction &&
                                           color.fraction_bits == s.contribution_fraction &&
                                           s.to_color.rounding == s.to_contribution.rounding
                                     : color.fraction_bits >= s.contribution_fraction;
    if (s.takes_from_transparency() && unit_slab && s.contribution_fraction == s.transparency_fraction &&
        color.integer_bits >= 1 && shares_within_w)
        s.to_color.limits = s.to_color_sum.limits = s.to_transparency.limits = false;
}

}  // namespace

void choose_words(Plan& plan) {
    Range::limited = Range::used = 0;
    Ledger ledger;
    any_slab<Range>(plan, ledger);
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
                            "and there are 127: narrow its wires",
                            kStages[i], needs[i].result_bits));
    }
    plan.word_bits = all.result_bits <= 63 ? 64 : 128;
    static_assert(kWires <= 64);
    plan.used_wires.clear();
    for (int w = 0; w < kWires; ++w)
        if (Range::used >> w & 1) plan.used_wires.push_back(static_cast<Wire>(w));
    visit_stages(plan, LeaveOutLimits{Range::limited});
    leave_out_proven_limits(plan, ledger.last);
}

std::map<int, Range> proven_ranges(const Plan& plan) {
    std::map<int, Range> ranges;
    Range::of_wires = &ranges;
    Silent observer;
    any_slab<Range>(plan, observer);
    Range::of_wires = nullptr;
    // Behind a ray's last slab a sample may lie a step beyond the box, before it is clamped: affine() leaves that out.
    ranges.erase(static_cast<int>(Wire::location));
    return ranges;
}

}  // namespace squint
