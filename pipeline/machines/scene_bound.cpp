#include "pipeline/machines/scene_bound.h"

#include "core/error.h"
#include "core/parallel.h"
#include "core/portable_math.h"
#include "pipeline/machines/certificate/payers.h"
#include "pipeline/machines/scene_bound/beams.h"
#include "pipeline/plan/ranges.h"
#include "pipeline/render.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <tuple>
#include <vector>

namespace squint {
namespace {

/// kappa and lambda of certificate.h, at their greatest.
CompositingCosts compositing_costs(const Plan& plan, const LightErrors& light) {
    const CompositingStage& s = plan.compositing;
    CompositingCosts costs;
    Shares& shares = costs.shares;
    const double clear = unit_of(s.to_transparency) * last_bit(plan, Wire::transparency),
                 color = unit_of(s.to_color) * last_bit(plan, Wire::color);
    shares[index_of(Wire::transparency)] = clear, shares[index_of(Wire::color)] = color;
    costs.clear = clear, costs.most = light.brightest + light.stage;
    if (s.takes_from_transparency()) {
        // A carried remainder leaves less than a whole last bit to later slabs.
        const double unit = s.form == CompositingForm::w_carry && s.to_contribution.shift > 0
                                ? 1
                                : unit_of(s.to_contribution);
        shares[index_of(Wire::contribution)] = unit * last_bit(plan, Wire::contribution);
        costs.clear += shares[index_of(Wire::contribution)];
    } else {
        shares[index_of(Wire::slab_color)] = unit_of(s.to_slab_color) * last_bit(plan, Wire::slab_color);
        if (s.form == CompositingForm::back_to_front)
            shares[index_of(Wire::color)] += unit_of(s.color_to_code) * last_bit(plan, Wire::color);
    }
    // What T is off by counts with the light behind.
    for (const Wire wire : {Wire::transparency, Wire::contribution})
        shares[index_of(wire)] *= light.brightest;
    costs.each = shares.sum();
    return costs;
}

/// The first wire whose limits values of the scene can pass, or nearly: what limits take is no part of the bound.
std::optional<std::string> what_saturates(const Plan& plan) {
    for (const Wire wire : {Wire::slab_ratio, Wire::slab_alpha, Wire::slab_color, Wire::contribution,
                            Wire::color, Wire::transparency})
        if (std::find(plan.used_wires.begin(), plan.used_wires.end(), wire) != plan.used_wires.end() &&
            plan.specs[wire].format.integer_bits < 1)
            return fmt::format(
                "precision.{}: {} cannot hold 1, and what a limit takes is no part of the bound; allowed: "
                "1 integer bit or more",
                info(wire).name, to_string(plan.specs[wire].format));
    double deepest = 0;
    for (const Entry& entry : plan.entries.entry)
        deepest = std::max(deepest, entry.extinction * full_step(plan));
    const Format& depth = plan.specs[Wire::slab_depth].format;
    if (deepest + 1 >= std::ldexp(1.0, depth.integer_bits) && deepest > 0)
        return fmt::format(
            "precision.slab_depth: {} cannot hold depths up to {:.4g}, and what a limit takes is no part "
            "of the bound; allowed: more integer bits",
            to_string(depth), deepest + 1);
    return {};
}

/// Whether a ray can end early, and leave out up to the threshold.
bool may_terminate(const Plan& plan) {
    const CompositingStage& s = plan.compositing;
    if (s.form == CompositingForm::back_to_front || !(s.threshold_exact > 0)) return false;
    double deepest = 0;
    for (const Entry& entry : plan.entries.entry)
        deepest = std::max(deepest, entry.opaque ? 1e9 : entry.extinction * full_step(plan));
    return (deepest + 0x1p-10) * (most_steps(plan) + 2) >
           -0.9 * portable::log(std::min(s.threshold_exact, 1.0));
}

/// A beam that waits to be cut; the greatest bound first, of equal ones the eldest.
struct Waiting {
    Behind behind;
    std::int64_t serial = 0;
    Beam beam;
    bool operator<(const Waiting& other) const {
        return std::tuple(behind.sum(), -serial) < std::tuple(other.behind.sum(), -other.serial);
    }
};

/// Cuts beams until none with a greater bound is left than the one returned, or enough were cut.
class Search {
  public:
    Search(const Beams& beams, const SceneBoundOptions& options) : beams_(beams), options_(options) {
        std::vector<Beam> first = beams.all();
        add(first);
    }
    Waiting run() {
        constexpr std::int64_t kFirstLook = 4096;
        constexpr std::size_t kTogether = 64;  // of a fixed number, so that threads change nothing
        double before = top();
        for (std::int64_t look = kFirstLook; !waiting_.empty() && used_ < options_.most_beams;) {
            if (options_.cancelled && *options_.cancelled) throw Cancelled{};
            std::vector<Beam> halves;
            while (!waiting_.empty() && halves.size() < 2 * kTogether) {
                for (const Beam& half : beams_.halves(waiting_.top().beam)) halves.push_back(half);
                waiting_.pop();
            }
            add(halves);
            if (options_.progress)
                options_.progress(
                    std::min(static_cast<double>(used_) / static_cast<double>(options_.most_beams), 1.0));
            if (used_ < look) continue;
            if (top() > 0.9 * before && look > kFirstLook) break;
            before = top(), look *= 4;
        }
        return waiting_.empty() ? Waiting{} : waiting_.top();
    }
    std::int64_t used() const { return used_; }

  private:
    double top() const { return waiting_.empty() ? 0 : waiting_.top().behind.sum(); }
    void add(const std::vector<Beam>& beams) {
        std::vector<std::optional<Behind>> bounds(beams.size());
        in_parallel(beams.size(), [&](std::size_t i) { bounds[i] = beams_.bound(beams[i]); });
        for (std::size_t i = 0; i < beams.size(); ++i)
            if (bounds[i]) waiting_.push({*bounds[i], serial_++, beams[i]});
        used_ += static_cast<std::int64_t>(beams.size());
    }

    const Beams& beams_;
    const SceneBoundOptions& options_;
    std::priority_queue<Waiting> waiting_;
    std::int64_t used_ = 0, serial_ = 0;
};

/// The most of `samples` samples, each any of what was found.
Behind any_sequence(const Beams& beams, const CostBlocks::Found& found, std::int64_t samples) {
    Behind behind;
    behind.slabs = static_cast<double>(found.costs.last());
    for (std::int64_t i = 0; i < samples; ++i) beams.step(behind, found, false);
    return behind;
}

/// Who pays on a beam: walks it once more, cell by cell.
struct Paid {
    Shares slabs, compositing;
    std::array<std::int64_t, 3> block{};  // of kBlock cells
    double of_block = 0, entry = 0;
};
constexpr std::int64_t kBlock = 8;

class Ledger {
  public:
    Ledger(const Beams& beams, const CostBlocks& blocks, const SlabCosts& costs,
           const CompositingCosts& compositing, bool lit)
        : beams_(beams), blocks_(blocks), costs_(costs), compositing_(compositing), lit_(lit) {}

    Paid of(const Beam& beam) {
        beams_.walk(beam, [&](const CellBox& cells, std::int64_t samples, bool surely) {
            const CostBlocks::Found found = blocks_.in(cells);
            const Most most = most_of(cells);
            for (std::int64_t i = 0; i < samples; ++i) take(found, most, surely);
        });
        const auto first = std::max_element(at_.begin(), at_.end(), [](const auto& a, const auto& b) {
            return a.second.cost < b.second.cost;
        });
        if (first != at_.end())
            paid_.block = first->first, paid_.of_block = first->second.cost,
            paid_.entry = first->second.entry;
        return paid_;
    }

  private:
    struct Most {
        SlabCosts::Decided slab, last;
        std::array<std::int64_t, 3> cell{}, last_cell{};
    };
    struct Block {
        double cost = 0, dearest = 0, entry = 0;
    };

    Most most_of(const CellBox& cells) const {
        Most most;
        double best = 0;
        // Blocks cost more than the cells that a beam can meet: beside what they come to, light would pay nothing.
        const double v = lit_ ? paid_.slabs.sum() : behind_.slabs;
        const std::vector<CellValues> of = blocks_.values(cells);
        std::size_t i = 0;
        for (std::int64_t z = cells.first[2]; z <= cells.last[2]; ++z)
            for (std::int64_t y = cells.first[1]; y <= cells.last[1]; ++y)
                for (std::int64_t x = cells.first[0]; x <= cells.last[0]; ++x) {
                    const CellValues& values = of[i++];
                    const SlabCosts::Decided here = costs_.decided(values, v, false);
                    if (const double net = here.cost - here.opacity * v; net > best)
                        best = net, most.slab = here, most.cell = {x, y, z};
                    if (!blocks_.at_a_face(x, y, z)) continue;
                    const SlabCosts::Decided last = costs_.decided(values, v, true);
                    if (last.cost > most.last.cost) most.last = last, most.last_cell = {x, y, z};
                }
        return most;
    }
    void take(const CostBlocks::Found& found, const Most& most, bool surely) {
        const double before = behind_.slabs;
        beams_.step(behind_, found, surely);
        if (found.visible) {
            paid_.compositing.add(compositing_.shares, 1);
            paid_.compositing[index_of(Wire::transparency)] += compositing_.clear * before;
        }
        if (most.last.cost > before + most.slab.cost) {
            paid_.slabs = {}, at_.clear();
            return charge(most.last, most.last_cell);
        }
        if (most.slab.cost <= 0) return;
        charge(most.slab, most.cell);
    }
    void charge(const SlabCosts::Decided& slab, const std::array<std::int64_t, 3>& cell) {
        for (auto& block : at_) block.second.cost *= 1 - slab.opacity;
        paid_.slabs = paid_.slabs.scaled(1 - slab.opacity) + slab.shares;
        Block& block = at_[{cell[0] / kBlock, cell[1] / kBlock, cell[2] / kBlock}];
        block.cost += slab.cost;
        if (slab.cost > block.dearest) block.dearest = slab.cost, block.entry = costs_.entry_of(slab.bin);
    }

    const Beams& beams_;
    const CostBlocks& blocks_;
    const SlabCosts& costs_;
    const CompositingCosts& compositing_;
    bool lit_;
    Behind behind_;
    Paid paid_;
    std::map<std::array<std::int64_t, 3>, Block> at_;
};

/// Why a bound is of no use, by its greatest payer.
std::string why_hopeless(const SceneBound& b, bool lit) {
    if (b.most <= kUseful) return {};
    const std::string where =
        fmt::format("cells {} {} {} to {} {} {}, entry {:.4g}", b.block_first[0], b.block_first[1],
                    b.block_first[2], b.block_last[0], b.block_last[1], b.block_last[2], b.entry);
    const std::string_view payer = payer_name(b.payer);
    if (b.payer == kWallsPay)
        return fmt::format(
            "walls: an error can reach or miss an opaque entry ({}), so nothing useful holds for every view",
            where);
    constexpr std::array<std::string_view, 3> kOfPlace{"sample location", "interpolation", "classification"};
    const bool steep = b.payer < kWires && (info(static_cast<Wire>(b.payer)).stage == kOfPlace[0] ||
                                            info(static_cast<Wire>(b.payer)).stage == kOfPlace[1] ||
                                            b.payer == index_of(Wire::classification_input));
    if (steep)
        return fmt::format(
            "steep: {}steep cells meet a steep part of the function, and {} pays ({}), so nothing useful "
            "holds for every view{}",
            lit ? "weak gradients turn, or " : "", payer, where,
            lit ? "; a greater shading.gradient_floor may help" : "");
    return fmt::format("{} pays most ({}), and nothing useful holds for every view", payer, where);
}

}  // namespace

std::optional<std::string> what_has_no_scene_bound(const Plan& plan) {
    if (plan.real)
        return fmt::format("precision.preset {} rounds nothing; allowed: any other preset", plan.real_name());
    const bool pips = std::holds_alternative<PowerSeriesOfOrder1>(plan.method);
    if (!pips && !std::holds_alternative<PostClassification>(plan.method))
        return fmt::format(
            "classification.method {} has no scene bound yet; allowed: pc, pc_mid, and pips of order 1",
            name_of(plan.scene.classification.method));
    if (pips && plan.entries.any_opaque())
        return "opaque entries have no scene bound with classification.method pips, whose slabs they cut; "
               "allowed: pc, pc_mid";
    if (plan.scene.classification.as_printed)
        return "classification.as_printed has no scene bound; allowed: false";
    if (plan.interpolation.nearest)
        return "sampling.interpolation nearest jumps from voxel to voxel; allowed: trilinear";
    const CompositingForm form = plan.compositing.form;
    if (form == CompositingForm::straight || plan.compositing.is_unit255())
        return fmt::format(
            "compositing.form {} has no scene bound yet; allowed: w, w_carry, equation_9, alpha, "
            "back_to_front",
            name_of(form));
    if (plan.lit)
        if (auto obstacle = what_light_is_not_bounded(plan)) return obstacle;
    return what_saturates(plan);
}

SceneBound bound_scene(const Plan& plan, const SceneBoundOptions& options) {
    if (const auto obstacle = what_has_no_scene_bound(plan)) throw InputError("--bound: " + *obstacle);
    const SampleErrors errors = sample_errors(plan);
    const double range = plan.volume->largest - plan.volume->smallest;
    const CellValues steepest{0, std::max(range, 1.0), 3 * range};
    const LightErrors light = light_errors(plan, errors);
    const SlabCosts costs(plan, errors, light, errors.of(steepest));
    const CompositingCosts compositing = compositing_costs(plan, light);
    const double termination =
        !plan.projection_mode && may_terminate(plan) ? light.brightest * plan.compositing.threshold_exact : 0;

    SceneBound b;
    b.samples = static_cast<std::int64_t>(most_steps(plan)) + 1;
    on_threads(options.threads, [&] {
        const CostBlocks blocks(plan, errors, light, costs);
        const Beams beams(plan, errors, blocks, compositing);
        const auto in_lsb8 = [&](const Behind& behind) {
            // Slabs come to what matter shines at most; the roundings of compositing may take a pixel beyond full scale.
            const double sum = behind.sum() + termination;
            return 255 * (sum * (1 + 0x1p-20) + 0x1p-36);
        };
        const CellValues whole = blocks.whole();
        if (plan.projection_mode) {
            // An extreme, or a mean, errs by no more than the samples do: one slab of any value in the data.
            CostBlocks::Found found{costs.of(whole), costs.visible(whole)};
            found.costs.at.back() = 0;
            const Behind behind = any_sequence(beams, found, 1);
            b.most = b.by_entries = b.by_blocks = b.by_beams = in_lsb8(behind);
            const SlabCosts::Decided slab = costs.decided(whole, 0, false);
            b.shares = compositing.shares.scaled(255);
            b.shares.add(slab.shares, 255);
            b.shares[kDoublesPay] += 255 * 0x1p-36;
            for (int p = 0; p < Shares::kMost; ++p)
                if (b.shares[p] > b.shares[b.payer]) b.payer = p;
            b.block_first = blocks.cells().first, b.block_last = blocks.cells().last;
            b.block_share = 255 * slab.cost, b.entry = costs.entry_of(slab.bin);
            return;
        }
        b.by_entries = in_lsb8(any_sequence(beams, {costs.of(whole), costs.visible(whole)}, b.samples));
        b.by_blocks = in_lsb8(any_sequence(beams, blocks.all(), b.samples));
        Search search(beams, options);
        const Waiting decides = search.run();
        b.beams = search.used();
        b.by_beams = in_lsb8(decides.behind);
        b.most = std::min({b.by_entries, b.by_blocks, b.by_beams});

        const Paid paid = Ledger(beams, blocks, costs, compositing, plan.lit).of(decides.beam);
        // Blocks cost more than the cells that a beam can meet: so much more by all causes of a slab.
        const double other = paid.compositing.sum() + termination + 0x1p-36, slabs = paid.slabs.sum();
        b.shares = paid.compositing.scaled(255);
        b.shares[kTerminationPays] += 255 * termination;
        b.shares[kDoublesPay] += 255 * 0x1p-36;
        const double scale = slabs > 0 ? std::max(b.most - 255 * other, 0.0) / slabs : 0;
        b.shares.add(paid.slabs, scale);
        for (int p = 0; p < Shares::kMost; ++p)
            if (b.shares[p] > b.shares[b.payer]) b.payer = p;
        for (std::size_t a = 0; a < 3; ++a) {
            b.block_first[a] = paid.block[a] * kBlock;
            b.block_last[a] = std::min(b.block_first[a] + kBlock - 1, blocks.cells().last[a]);
        }
        b.block_share = paid.of_block * scale, b.entry = paid.entry;
    });
    b.hopeless = why_hopeless(b, plan.lit);
    return b;
}

nlohmann::ordered_json json_of(const SceneBound& b) {
    using Json = nlohmann::ordered_json;
    Json payers = Json::object();
    for (int p = 0; p < Shares::kMost; ++p)
        if (b.shares[p] > 0) payers[std::string(payer_name(p))] = b.shares[p];
    Json json{{"of", "every pixel of every view, projection and size"},
              {"most_lsb8", b.most},
              {"by_entries_lsb8", b.by_entries},
              {"by_blocks_lsb8", b.by_blocks},
              {"by_beams_lsb8", b.by_beams},
              {"beams", b.beams},
              {"samples", b.samples},
              {"payers_lsb8", payers},
              {"decides",
               {{"payer", std::string(payer_name(b.payer))},
                {"first_cell", b.block_first},
                {"last_cell", b.block_last},
                {"share_lsb8", b.block_share},
                {"entry", b.entry}}}};
    if (!b.hopeless.empty()) json["hopeless"] = b.hopeless;
    return json;
}

}  // namespace squint
