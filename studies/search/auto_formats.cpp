#include "studies/search/auto_formats.h"

#include "core/error.h"
#include "pipeline/machines/certificate.h"
#include "pipeline/plan_record.h"
#include "scene/presets.h"
#include "studies/search/by_shares.h"
#include "studies/sweep/cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

namespace squint::search {
namespace {

constexpr double kTermination = 0x1p-12;
constexpr int kMostViews = 8;
// Of the budget, where rays are left out: others may be a little worse.
constexpr double kOfSomeRays = 0.85;
constexpr int kRaises = 12, kTakenBack = 3;

std::string at(const Scene& scene, const char* key) {
    return scene.given_at.contains(key) ? where(scene, key) : key;
}

class Choice {
  public:
    Choice(const Scene& scene, std::shared_ptr<const Volume> volume, const AutoSettings& settings)
        : scene_(scene), volume_(std::move(volume)) {
        scene_.precision.preset = "default";
        int every = 1;
        const bool every_view = scene.precision.guarantee == Guarantee::scene;
        const int frames = every_view ? 1 : std::max(scene_.camera.turntable, 1),
                  views = std::min(frames, kMostViews);
        for (int view = 0; view < views; ++view) {
            frames_.push_back(view * frames / views);
            const Plan plan = make_plan(scene_, volume_, frames_.back());
            if (const auto obstacle = every_view ? what_has_no_scene_bound(plan) : what_is_not_bounded(plan))
                throw InputError(
                    fmt::format("{}: found \"auto\", but {}", at(scene, "precision.preset"), *obstacle));
            if (view == 0) base_ = plan.specs, pictures.least = least_bits(plan);
            if (!every_view)
                every = std::max(every, every_for_some_rays(plan, static_cast<std::size_t>(views)));
            for (const Wire wire : plan.used_wires)
                if (!scene.precision.override_[static_cast<std::size_t>(wire)])
                    bits[wire] = base_[wire].format.fraction_bits;
        }
        pictures.count = frames_.size();
        pictures.plan = [this](const Bits& some, std::size_t i) {
            return make_plan(scene_of(some), volume_, frames_[i]);
        };
        pictures.cost = [this](const Bits& some) {
            return static_cast<double>(sweep::cost_of(pictures.plan(some, 0)).bits());
        };
        pictures.decided_rays = true;
        pictures.certificate = {.threads = settings.threads,
                                .every = every,
                                .undecided = scene.precision.budget / 4,
                                .cancelled = settings.cancelled};
        if (every_view)
            pictures.every_view = {
                .threads = settings.threads, .most_beams = kBeamsOnTheWay, .cancelled = settings.cancelled};
        if (settings.progress)
            pictures.proven = [&settings, proofs = 0,
                               budget = scene.precision.budget](const Proof& proof) mutable {
                settings.progress(fmt::format("formats, proof {}: bound {:.4g} of {:g} LSB8", ++proofs,
                                              proof.most, budget));
            };
    }
    Choice(const Choice&) = delete;
    Choice& operator=(const Choice&) = delete;

    Spec spec(const Bits& some, Wire wire) const {
        Spec spec = base_[wire];
        const auto found = some.find(wire);
        if (found != some.end()) spec.format.fraction_bits = found->second;
        return spec;
    }

    Bits bits;  // of `default`
    Pictures pictures;

  private:
    Scene scene_of(const Bits& some) const {
        Scene scene = scene_;
        for (const auto& item : some)
            scene.precision.override_[static_cast<std::size_t>(item.first)] =
                to_string(spec(some, item.first));
        return scene;
    }

    Scene scene_;
    std::shared_ptr<const Volume> volume_;
    std::vector<int> frames_;
    WireSpecs base_;
};

// Stages that no lanes of 32 bits hold, and the bits that they need.
struct WideStages {
    std::vector<std::string_view> names;
    int bits = 0;
};
WideStages wide_stages(const Plan& plan) {
    WideStages wide;
    for (std::size_t stage = 0; stage < kStages.size(); ++stage) {
        if (lane_bits(plan, stage).value_or(32) == 32) continue;
        wide.names.push_back(kStages[stage]);
        wide.bits += plan.stages[stage].needs.lane_bits + plan.stages[stage].needs.wide_bits;
    }
    return wide;
}
/// Takes bits from wires of stages that 32-bit lanes would hold without them, and gives others what the budget then
/// asks for: kept where the tally does not rise.
void narrow(Pictures pictures, double aim, Bits& bits, Proof& proof) {
    constexpr int kMostSteps = 8;
    const WideStages before = wide_stages(pictures.plan(bits, 0));
    if (before.names.empty()) return;
    Bits fewer = bits;
    int left = before.bits;
    for (int step = 0; left > 0 && step < kMostSteps; ++step) {
        std::optional<Wire> best;
        double least = 0;
        for (const auto& [wire, fraction] : fewer) {
            const bool near = wire == Wire::slab_alpha || std::find(before.names.begin(), before.names.end(),
                                                                    info(wire).stage) != before.names.end();
            if (!near || fraction <= 1) continue;
            Bits one_less = fewer;
            --one_less[wire];
            if (wide_stages(pictures.plan(one_less, 0)).bits >= left) continue;
            const double share = std::ldexp(proof.share(wire), bits[wire] - fraction);
            if (!best || share < least) best = wire, least = share;
        }
        if (!best) return;
        pictures.most[*best] = --fewer[*best];
        left = wide_stages(pictures.plan(fewer, 0)).bits;
    }
    // What those wires will pay at least.
    double alone = fixed_part(proof.greatest);
    for (const auto& [wire, fraction] : pictures.most)
        alone = std::max(alone, std::ldexp(proof.share(wire), bits[wire] - fraction));
    if (left > 0 || alone > aim) return;
    Proof proven;
    if (!reach(pictures, aim, kRaises, fewer, proven)) return;
    take_back(pictures, aim, kTakenBack, fewer, proven);
    if (pictures.cost(fewer) <= pictures.cost(bits)) bits = fewer, proof = proven;
}
std::string lanes_of(const Plan& plan) {
    const WideStages wide = wide_stages(plan);
    if (wide.names.empty()) return "all stages in 32-bit lanes";
    return fmt::format("64-bit lanes for {}", fmt::join(wide.names, ", "));
}

}  // namespace

AutoFormats choose_formats(Scene& scene, const std::shared_ptr<const Volume>& volume,
                           const AutoSettings& settings) {
    AutoFormats result;
    if (scene.precision.preset != "auto" || has_all_formats(scene.precision)) return result;
    const double budget = scene.precision.budget;
    if (const SamplingSettings none;
        !scene.given_at.contains("sampling.termination") && scene.sampling.termination == none.termination) {
        scene.sampling.termination = kTermination;
        result.notes.push_back(
            "precision auto: sampling.termination is 2^-12, for 2^-10 alone may be 0.25 LSB8");
    }

    Choice choice(scene, volume, settings);
    Bits bits = choice.bits;
    Proof proof;
    const double aim = budget * (choice.pictures.certificate.every > 1 ? kOfSomeRays : 1);
    result.within = reach(choice.pictures, aim, kRaises, bits, proof);
    if (result.within) {
        take_back(choice.pictures, aim, kTakenBack, bits, proof);
        narrow(choice.pictures, aim, bits, proof);
    }
    for (int w = 0; w < kWires; ++w) {
        auto& own = scene.precision.override_[static_cast<std::size_t>(w)];
        if (!own) own = to_string(choice.spec(bits, static_cast<Wire>(w)));
    }

    result.bound = proof.most, result.rays = proof.rays;
    result.one_in = choice.pictures.certificate.every;
    result.bits = choice.pictures.cost(bits), result.bits_of_default = choice.pictures.cost(choice.bits);
    if (choice.pictures.every_view)
        result.notes.push_back(fmt::format(
            "precision auto: no pixel of any view errs by more than {:.3g} LSB8 by rounding (budget {:g}); "
            "{:.0f} bits by the tally, `default` has {:.0f}; {}",
            proof.most, budget, result.bits, result.bits_of_default,
            lanes_of(choice.pictures.plan(bits, 0))));
    else
        result.notes.push_back(fmt::format(
            "precision auto: no decided ray of {} errs by more than {:.3g} LSB8 by rounding (budget {:g}){}; "
            "{:.0f} bits by the "
            "tally, `default` has {:.0f}; {}",
            proof.rays, proof.most, budget,
            result.one_in > 1
                ? fmt::format(", one row and column in {}: --bound certifies all", result.one_in)
                : "",
            result.bits, result.bits_of_default, lanes_of(choice.pictures.plan(bits, 0))));
    result.undecided = proof.undecided;
    if (proof.undecided > 0)
        result.warnings.push_back(
            fmt::format("precision.budget: {} of {} rays hang on a wall or on the direction of a gradient "
                        "that errors may flip, by up to "
                        "{:.3g} LSB8, whatever the formats; --bound counts them{}",
                        proof.undecided, proof.rays, proof.of_undecided,
                        scene.shading.gradient_floor > 0 || scene.lights.empty()
                            ? ""
                            : ", shading.gradient_floor ends the latter"));
    if (!result.within)
        result.warnings.push_back(
            fmt::format("precision.budget: found {:g}, but the nearest formats have a bound of {:.3g} LSB8, "
                        "of which {} makes {:.3g}",
                        budget, proof.most, payer_name(proof.binding()), proof.worst[proof.binding()]));
    return result;
}

}  // namespace squint::search
