#include "studies/search/by_certificate.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "pipeline/machines/certificate.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "scene/toml.h"
#include "studies/search/by_shares.h"
#include "studies/sweep/cost.h"
#include "studies/sweep/run_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

namespace squint::search {
namespace {

using sweep::Json;
using sweep::WireEdit;

sweep::SweepFile sweep_of(const Settings& settings) {
    sweep::SweepFile sweep;
    sweep.scenes = settings.scenes, sweep.overrides = settings.overrides;
    return sweep;
}

class ByCertificate {
  public:
    explicit ByCertificate(const Settings& settings)
        : s_(settings), sweep_(sweep_of(settings)), evaluator_(sweep_, "", settings.cancelled) {}

    CertifiedResult run() {
        read();
        sweep::make_run_folder(s_.folder);
        const std::string file = s_.folder + "/formats.toml", record = s_.folder + "/search.json";
        for (const std::string& old : {file, record}) std::filesystem::remove(old);
        const Pictures all = pictures();
        result_.scene = proven(own_, prove(all, own_));
        Bits bits = own_;
        Proof proof;
        if (!reach(all, s_.most_error, kMostRaises, bits, proof)) {
            fail(proof);
            return std::move(result_);
        }
        take_back(all, s_.most_error, kRounds, bits, proof);
        result_.found = proven(bits, proof);
        for (Proven* p : {&result_.scene, &result_.found})
            p->error = measured(p == &result_.found ? bits : own_);
        result_.formats_file = file;
        result_.json = json();
        write_text_whole(file, formats_text(bits));
        write_text_whole(record, sweep::dump(result_.json));
        return std::move(result_);
    }

  private:
    std::size_t scenes() const { return std::max<std::size_t>(sweep_.scenes.size(), 1); }
    const char* guarantee() const { return s_.every_view ? "scene" : "pictures"; }
    std::string name_of_scene(std::size_t i) const {
        return sweep_.scenes.empty() ? "the built-in scene" : sweep_.scenes[i];
    }

    Plan plan_of(std::size_t scene, const Bits& bits, int view) {
        sweep::Point point;
        point.scene = scene;
        for (const auto& [wire, fraction] : bits)
            point.edits.push_back({wire, WireEdit::Part::fraction_bits, fraction, {}});
        sweep::Prepared p = evaluator_.prepare(point);
        if (!p.failure.empty()) throw InputError(p.failure);
        p.scene.camera.turntable = s_.views;
        return make_plan(p.scene, p.volume, view);
    }

    void read() {
        std::set<Wire> used;
        for (std::size_t i = 0; i < scenes(); ++i) {
            const Plan plan = plan_of(i, {}, 0);
            if (const auto obstacle =
                    s_.every_view ? what_has_no_scene_bound(plan) : what_is_not_bounded(plan))
                throw InputError(
                    fmt::format("--guarantee {}: {}: {}", guarantee(), name_of_scene(i), *obstacle));
            if (i == 0)
                preset_ = plan.scene.precision.preset, width_ = plan.camera.width,
                height_ = plan.camera.height;
            if (plan.scene.precision.preset != preset_)
                throw InputError(
                    fmt::format("{}: preset {}, but {} has {}; allowed: one for all, as with --set "
                                "precision.preset=default",
                                name_of_scene(i), plan.scene.precision.preset, name_of_scene(0), preset_));
            for (const Wire wire : plan.used_wires) {
                used.insert(wire);
                const int fraction = plan.specs[wire].format.fraction_bits;
                const auto found = own_.try_emplace(wire, fraction).first;
                found->second = std::max(found->second, fraction);
            }
        }
        for (const Wire wire : s_.wires)
            if (!used.contains(wire))
                throw InputError(fmt::format("--wires: {} carries nothing in {}", info(wire).name,
                                             scenes() > 1 ? "these scenes" : "this scene"));
        result_.wires = s_.wires.empty() ? std::vector<Wire>(used.begin(), used.end()) : s_.wires;
        std::erase_if(own_, [&](const auto& item) {
            return std::find(result_.wires.begin(), result_.wires.end(), item.first) == result_.wires.end();
        });
        result_.pictures = scenes() * static_cast<std::size_t>(s_.views);
        for (int view = 0; view < s_.views; ++view) result_.degrees.push_back(360.0 * view / s_.views);
    }

    // The tally's figure, or none where no word holds these.
    double cost(const Bits& bits) {
        double sum = 0;
        for (std::size_t scene = 0; scene < scenes(); ++scene)
            sum += static_cast<double>(sweep::cost_of(plan_of(scene, bits, 0)).bits());
        return sum / static_cast<double>(scenes());
    }
    Proven proven(const Bits& bits, const Proof& proof) {
        return {plan_of(0, bits, 0).specs, cost(bits), proof.most, 0, proof.rays, proof.undecided};
    }

    static constexpr int kMostRaises = 64, kRounds = 8;

    Pictures pictures() {
        Pictures all;
        all.count = result_.pictures;
        const auto views = static_cast<std::size_t>(s_.views);
        all.plan = [this, views](const Bits& bits, std::size_t i) {
            return plan_of(i / views, bits, static_cast<int>(i % views));
        };
        all.cost = [this](const Bits& bits) { return cost(bits); };
        all.least = least_bits(plan_of(0, {}, 0));
        all.certificate = {.threads = s_.threads, .cancelled = s_.cancelled};
        if (s_.every_view) {
            all.count = scenes();
            all.plan = [this](const Bits& bits, std::size_t i) { return plan_of(i, bits, 0); };
            all.every_view = {.threads = s_.threads, .most_beams = kBeamsOnTheWay, .cancelled = s_.cancelled};
        }
        all.proven = [this](const Proof& proof) {
            result_.certificates += s_.every_view ? scenes() : result_.pictures;
            for (const Wire wire : result_.wires)
                if (proof.worst[static_cast<int>(wire)] > proof.worst[static_cast<int>(result_.binding)])
                    result_.binding = wire;
            if (s_.progress)
                s_.progress(fmt::format("{} {}; bound {:.4g} of {:.4g} LSB8", result_.certificates,
                                        s_.every_view ? "scene bounds" : "certificates", proof.most,
                                        s_.most_error));
        };
        return all;
    }
    void fail(const Proof& proof) {
        const int binding = proof.binding();
        result_.failure = fmt::format(
            "--max-error: found {:g}, but the nearest formats have a bound of {:.4g} LSB8, of which {} makes "
            "{:.4g}{}; "
            "allowed: more than that",
            s_.most_error, proof.most, payer_name(binding), proof.worst[binding],
            binding == kTerminationPays ? " (sampling.termination, 2^-10 of 255 is 0.25)" : "");
    }

    double measured(const Bits& bits) {
        double most = 0;
        for (std::size_t scene = 0; scene < scenes(); ++scene)
            for (int view = 0; view < s_.views; ++view) {
                const Plan plan = plan_of(scene, bits, view);
                RenderOptions options;
                options.threads = s_.threads, options.cancelled = s_.cancelled;
                const Comparison c =
                    compare_colors(render(plan, options).image, render(real_plan(plan, view), options).image);
                for (const Difference& d : c.all) most = std::max(most, 255 * d.largest);
            }
        return most;
    }

    std::string formats_text(const Bits& bits) const {
        std::string text =
            s_.every_view
                ? fmt::format(
                      "# By squint search --guarantee scene: no pixel of any view of {} can err by more "
                      "than\n# {:.4g} LSB8 by rounding, proven.  Nothing is proven of other data.\n"
                      "#   squint plan SCENE --set precision.preset=THIS_FILE --bound\n"
                      "[precision]\npreset = \"{}\"\n",
                      name_of_scene(0), result_.found.bound, preset_)
                : fmt::format(
                      "# By squint search --guarantee pictures: no pixel of {} pictures ({} x {} pixels, {}) "
                      "can err "
                      "by more than\n"
                      "# {:.4g} LSB8 by rounding, proven.  Nothing is proven of other views, sizes or data.\n"
                      "#   squint render SCENE --set precision.preset=THIS_FILE --bound\n"
                      "[precision]\npreset = \"{}\"\n",
                      result_.pictures, width_, height_, name_of_scene(0), result_.found.bound, preset_);
        for (const auto& item : bits)
            text += fmt::format("{} = \"{}\"\n", info(item.first).name,
                                to_string(result_.found.specs[item.first]));
        return text;
    }
    Json json() {
        const auto proven = [&](const Proven& p) {
            Json json{{"bits", p.bits}, {"bound_lsb8", p.bound},         {"error_lsb8", p.error},
                      {"rays", p.rays}, {"undecided_rays", p.undecided}, {"wires", Json::object()}};
            for (const Wire wire : result_.wires)
                json["wires"][std::string(info(wire).name)] = to_string(p.specs[wire]);
            return json;
        };
        Json json{{"schema", "squint.search/1"}};
        json.update(sweep::program_record());
        json.update({{"command", s_.command},
                     {"scenes", sweep_.scenes},
                     {"max_error_lsb8", s_.most_error},
                     {"guarantee", guarantee()},
                     {"degrees", result_.degrees},
                     {"certificates", result_.certificates},
                     {"preset", preset_},
                     {"binding", info(result_.binding).name},
                     {"found", proven(result_.found)},
                     {"scene", proven(result_.scene)}});
        return json;
    }

    const Settings& s_;
    sweep::SweepFile sweep_;
    sweep::Evaluator evaluator_;
    std::string preset_;
    Bits own_;
    int width_ = 0, height_ = 0;
    CertifiedResult result_;
};

}  // namespace

CertifiedResult run_by_certificate(const Settings& settings) {
    return ByCertificate(settings).run();
}

}  // namespace squint::search
