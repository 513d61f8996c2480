#include "studies/search/by_certificate.h"

#include "core/error.h"
#include "pipeline/machines/certificate.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "studies/search/by_shares.h"
#include "studies/search/result_files.h"
#include "studies/search/scenes.h"
#include "studies/sweep/cost.h"
#include "studies/sweep/run_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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
        : s_(settings), sweep_(sweep_of(settings)), scenes_(sweep_, "", settings.cancelled) {}

    CertifiedResult run() {
        read();
        sweep::make_run_folder(s_.folder);
        remove_result_files(s_.folder);
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
        result_.formats_file = formats_file(s_.folder);
        result_.json = json();
        write_formats(s_.folder, about_formats(), preset_, result_.wires, specs_of(result_.found));
        write_search_record(s_.folder, result_.json);
        return std::move(result_);
    }

  private:
    const char* guarantee() const { return s_.every_view ? "scene" : "pictures"; }

    Plan plan_of(std::size_t scene, const Bits& bits, int view) {
        sweep::Point point;
        point.scene = scene;
        for (const auto& [wire, fraction] : bits)
            point.edits.push_back({wire, WireEdit::Part::fraction_bits, fraction, {}});
        sweep::Prepared p = scenes_.prepared(point);
        p.scene.camera.turntable = s_.views;
        return make_plan(p.scene, p.volume, view);
    }

    void read() {
        std::set<Wire> used;
        for (std::size_t i = 0; i < scenes_.count(); ++i) {
            const Plan plan = plan_of(i, {}, 0);
            if (const auto obstacle =
                    s_.every_view ? what_has_no_scene_bound(plan) : what_is_not_bounded(plan))
                throw InputError(
                    fmt::format("--guarantee {}: {}: {}", guarantee(), scenes_.name(i), *obstacle));
            if (i == 0)
                preset_ = plan.scene.precision.preset, width_ = plan.camera.width,
                height_ = plan.camera.height;
            scenes_.check_preset(i, plan, preset_);
            for (const Wire wire : plan.used_wires) {
                used.insert(wire);
                const int fraction = plan.specs[wire].format.fraction_bits;
                const auto found = own_.try_emplace(wire, fraction).first;
                found->second = std::max(found->second, fraction);
            }
        }
        result_.wires = scenes_.chosen(s_.wires, used);
        std::erase_if(own_, [&](const auto& item) {
            return std::find(result_.wires.begin(), result_.wires.end(), item.first) == result_.wires.end();
        });
        result_.pictures = scenes_.count() * static_cast<std::size_t>(s_.views);
        for (int view = 0; view < s_.views; ++view) result_.degrees.push_back(360.0 * view / s_.views);
    }

    // The tally's figure, or none where no word holds these.
    double cost(const Bits& bits) {
        double sum = 0;
        for (std::size_t scene = 0; scene < scenes_.count(); ++scene)
            sum += static_cast<double>(sweep::cost_of(plan_of(scene, bits, 0)).bits());
        return sum / static_cast<double>(scenes_.count());
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
            all.count = scenes_.count();
            all.plan = [this](const Bits& bits, std::size_t i) { return plan_of(i, bits, 0); };
            all.every_view = {.threads = s_.threads, .most_beams = kBeamsOnTheWay, .cancelled = s_.cancelled};
        }
        all.proven = [this](const Proof& proof) {
            result_.certificates += s_.every_view ? scenes_.count() : result_.pictures;
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
        for (std::size_t scene = 0; scene < scenes_.count(); ++scene)
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

    std::vector<Spec> specs_of(const Proven& p) const {
        std::vector<Spec> specs;
        for (const Wire wire : result_.wires) specs.push_back(p.specs[wire]);
        return specs;
    }
    std::string about_formats() const {
        return s_.every_view
                   ? fmt::format(
                         "# By squint search --guarantee scene: no pixel of any view of {} can err by more "
                         "than\n# {:.4g} LSB8 by rounding, proven.  Nothing is proven of other data.\n"
                         "#   squint plan SCENE --set precision.preset=THIS_FILE --bound\n",
                         scenes_.name(0), result_.found.bound)
                   : fmt::format(
                         "# By squint search --guarantee pictures: no pixel of {} pictures ({} x {} pixels, "
                         "{}) can err by more than\n"
                         "# {:.4g} LSB8 by rounding, proven.  Nothing is proven of other views, sizes or "
                         "data.\n"
                         "#   squint render SCENE --set precision.preset=THIS_FILE --bound\n",
                         result_.pictures, width_, height_, scenes_.name(0), result_.found.bound);
    }
    Json json() {
        const auto proven = [&](const Proven& p) {
            return Json{{"bits", p.bits},
                        {"bound_lsb8", p.bound},
                        {"error_lsb8", p.error},
                        {"rays", p.rays},
                        {"undecided_rays", p.undecided},
                        {"wires", formats_record(result_.wires, specs_of(p))}};
        };
        Json json = begin_record(s_);
        json.update({{"guarantee", guarantee()},
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
    Scenes scenes_;
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
