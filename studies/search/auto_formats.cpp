#include "studies/search/auto_formats.h"

#include "core/error.h"
#include "pipeline/machines/certificate.h"
#include "pipeline/plan/ranges.h"
#include "scene/presets.h"
#include "studies/search/by_shares.h"
#include "studies/sweep/cost.h"

#include <fmt/format.h>

#include <algorithm>

namespace squint::search {
namespace {

constexpr double kTermination = 0x1p-12;
constexpr int kMostViews = 8;
constexpr std::int64_t kMostRays = 3000;  // of all certificates of a set of formats
// Rays of more samples count by the square of how many more: they take longer, and are alike.
constexpr double kLongRay = 512;
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
        double longer = 1;  // than kLongRay
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
            longer = std::max(longer, most_steps(plan) / kLongRay);
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
                                .every = 1,
                                .undecided = scene.precision.budget / 4,
                                .cancelled = settings.cancelled};
        if (every_view)
            pictures.every_view = {
                .threads = settings.threads, .most_beams = kBeamsOnTheWay, .cancelled = settings.cancelled};
        else
            while (static_cast<double>(rays()) * longer * longer > kMostRays) ++pictures.certificate.every;
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
    std::int64_t rays() const {
        const int every = pictures.certificate.every;
        const auto along = [&](int pixels) { return std::int64_t{(pixels + every - 1) / every}; };
        return along(scene_.image.width) * along(scene_.image.height) *
               static_cast<std::int64_t>(pictures.count);
    }
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
    if (result.within) take_back(choice.pictures, aim, kTakenBack, bits, proof);
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
            "{:.0f} bits by the tally, `default` has {:.0f}",
            proof.most, budget, result.bits, result.bits_of_default));
    else
        result.notes.push_back(fmt::format(
            "precision auto: no decided ray of {} errs by more than {:.3g} LSB8 by rounding (budget {:g}){}; "
            "{:.0f} bits by the "
            "tally, `default` has {:.0f}",
            proof.rays, proof.most, budget,
            result.one_in > 1
                ? fmt::format(", one row and column in {}: --bound certifies all", result.one_in)
                : "",
            result.bits, result.bits_of_default));
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
