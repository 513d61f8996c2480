// Speed at equal error: how long each method, and VTK where it was built, takes to come within 40 and 50 dB
// (foreground PSNR) of the reference.  Each runs at ever smaller steps; the cheapest measured run that comes
// near enough counts, without interpolation.  Progress on standard error, JSON on standard output;
// bench/tables.py equal-error makes a table of it, bench/plots.py draws it.
//
//     bench_equal_error [scenes=phantom_128,cthead_translucent,head,figure_5,...] [lit=0] [threads=1]
//                       [contenders=vtk,pc,pi2d,mean,...] [size=800] [every=8] [repeats=3] [coarsest=4]
//                       [finest=0.03125] [all=0]
//
// Scenes: phantom_SIZE, those of configs/bench by name, figure_N of configs/lee_shin, and `head`, which is
// built in.  Contenders: the methods by default, each with its own light; mean, middle, two_point and adaptive are
// PIPS(1) with that rule for light inside a slab.  all=1: every step down to the finest, also past 50 dB.
#include "bench/support/support.h"
#include "core/error.h"
#ifdef SQUINT_HAS_VTK
#include "bench/peers/vtk/vtk_peer.h"
#endif

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <optional>

namespace {

using namespace squint;
using namespace squint::bench;

struct Contender {
    std::string name;
    std::vector<std::string> overrides;
    bool vtk = false;
};

const std::vector<Contender>& contenders() {
    static const std::vector<Contender> all{
#ifdef SQUINT_HAS_VTK
        {"vtk", {}, true},
#endif
        {"pc", {"classification.method=pc"}},
        {"pc_mid", {"classification.method=pc_mid"}},
        {"pi2d", {"classification.method=pi2d"}},
        {"pi1d", {"classification.method=pi1d"}},
        {"pi1d_engel", {"classification.method=pi1d_engel"}},
        {"pips_1", {"classification.method=pips", "classification.order=1"}},
        {"pips_3", {"classification.method=pips", "classification.order=3"}},
        {"leg_2", {"classification.method=leg", "classification.order=2"}},
        {"leg_3", {"classification.method=leg", "classification.order=3"}},
        {"mean", {"classification.method=pips", "shading.inside=mean"}},
        {"middle", {"classification.method=pips", "shading.inside=middle"}},
        {"two_point", {"classification.method=pips", "shading.inside=two_point"}},
        {"adaptive", {"classification.method=pips", "shading.inside=adaptive"}},
    };
    return all;
}
/// Those with these names, in this order; VTK only where it was built.
std::vector<Contender> contenders(const std::vector<std::string>& names) {
    std::vector<Contender> chosen;
    for (const std::string& name : names) {
        const auto found = std::find_if(contenders().begin(), contenders().end(),
                                        [&](const Contender& c) { return c.name == name; });
        if (found != contenders().end())
            chosen.push_back(*found);
        else if (name != "vtk")
            throw InputError(fmt::format("contenders: there is no \"{}\"", name));
    }
    return chosen;
}

struct Point {
    double step = 1, ms = 0, processor_ms = 0, psnr = 0;
};

struct Shot {
    Image image;
    double ms = 0, processor_ms = 0;
};

/// Renders repeatedly with its caches kept: the median time, of the ray cast alone.
template <class R>
Shot median_of(int repeats, R&& render_once) {
    std::vector<double> ms, processor;
    Shot last = render_once();
    for (int i = 0; i < repeats; ++i) {
        const double before = processor_ms();
        last = render_once();
        ms.push_back(last.ms), processor.push_back(processor_ms() - before);
    }
    last.ms = median(ms), last.processor_ms = median(processor);
    return last;
}

Shot shoot(const Contender& contender, const Plan& plan, int threads, int repeats) {
#ifdef SQUINT_HAS_VTK
    if (contender.vtk) {
        VtkPeer peer(plan, threads);
        return median_of(repeats, [&] {
            VtkPeer::Frame frame = peer.render(plan.camera);
            return Shot{std::move(frame.image), frame.cast_ms};
        });
    }
#endif
    (void)contender;
    RenderOptions options;
    options.threads = threads;
    return median_of(repeats, [&] {
        Rendering rendering = render(plan, options);
        return Shot{std::move(rendering.image), 1000 * rendering.statistics.seconds};
    });
}

/// The least time of those within `psnr`; empty if none is.
std::optional<double> ms_at(const std::vector<Point>& points, double psnr, double Point::*time) {
    std::optional<double> least;
    for (const Point& point : points)
        if (point.psnr >= psnr) least = std::min(least.value_or(point.*time), point.*time);
    return least;
}

Json or_null(const std::optional<double>& value) {
    return value ? Json(*value) : Json();
}

Scene scene_of(const std::string& name, bool lit, std::vector<std::string> overrides) {
    if (name.starts_with("phantom_")) return phantom_scene(std::stoll(name.substr(8)), lit, overrides);
    if (!name.starts_with("figure_") && name != "head") return data_scene(name, lit, overrides);
    if (!lit) overrides.push_back("shading.model=none");
    return name == "head"
               ? scene_with(built_in_scene(), overrides)
               : read_scene(fmt::format("{}/configs/lee_shin/{}.toml", SQUINT_SOURCE_DIR, name), overrides);
}

Json run(const std::string& name, bool lit, const Contender& contender, const Settings& settings) {
    const int every = static_cast<int>(settings.number("every"));
    std::vector<Point> points;
    Json list = Json::array();
    // Stop past 50 dB, and where an error grows again (VTK's does).
    for (double step = settings.number("coarsest"); step >= settings.number("finest"); step /= 2) {
        std::vector<std::string> overrides = contender.overrides;
        overrides.push_back(fmt::format("sampling.step={}", step));
        for (const char* side : {"width", "height"})
            overrides.push_back(fmt::format("image.{}={}", side, settings.number("size")));
        const Scene scene = scene_of(name, lit, overrides);
        const Plan plan = make_plan(scene, volume_of(scene));
        const Image reference = thinned_reference(plan, 0, every);
        const Shot shot = shoot(contender, plan, static_cast<int>(settings.number("threads")),
                                static_cast<int>(settings.number("repeats")));
        points.push_back({step, shot.ms, shot.processor_ms, psnr(thinned(shot.image, every), reference)});
        const Point& p = points.back();
        list.push_back({{"step", step}, {"ms", p.ms}, {"processor_ms", p.processor_ms}, {"psnr", p.psnr}});
        std::fputs(fmt::format("{:22} {:5} {:7} step {:<8} {:9.1f} ms  {:6.2f} dB  load {:.1f}\n", name,
                               lit ? "lit" : "unlit", contender.name, step, p.ms, p.psnr, load())
                       .c_str(),
                   stderr);
        if (settings.number("all") != 0) continue;
        if (p.psnr >= 50) break;
        if (points.size() >= 3 && p.psnr < points[points.size() - 2].psnr - 1) break;
    }
    return {{"name", contender.name},
            {"ms_40", or_null(ms_at(points, 40, &Point::ms))},
            {"ms_50", or_null(ms_at(points, 50, &Point::ms))},
            {"processor_ms_40", or_null(ms_at(points, 40, &Point::processor_ms))},
            {"processor_ms_50", or_null(ms_at(points, 50, &Point::processor_ms))},
            {"points", list}};
}

}  // namespace

int main(int argc, char** argv) try {
    const Settings settings(
        argc, argv,
        {{"scenes", has_data() ? "cthead_opaque,cthead_translucent,bonsai_translucent,engine_"
                                 "opaque,engine_translucent,aneurism_opaque"
                               : "phantom_128"},
         {"lit", "0"},
         {"contenders", "vtk,pc,pc_mid,pi2d,pi1d,pi1d_engel,pips_1,pips_3,leg_2,leg_3"},
         {"threads", "1"},
         {"size", "800"},
         {"every", "8"},
         {"repeats", "3"},
         {"coarsest", "4"},
         {"finest", "0.03125"},
         {"all", "0"}});
    print_line({{"machine", machine()}});
    for (const std::string& name : settings.list("scenes"))
        for (const double lit : settings.numbers("lit")) {
            Json scene{{"scene", name}, {"lit", lit != 0}, {"contenders", Json::array()}};
            for (const Contender& contender : contenders(settings.list("contenders"))) try {
                    scene["contenders"].push_back(run(name, lit != 0, contender, settings));
                } catch (const InputError& error) {
                    std::fputs(fmt::format("{}: left out: {}\n", contender.name, error.what()).c_str(),
                               stderr);
                }
            scene["load"] = load();
            print_line({{"case", scene}});
        }
    return 0;
} catch (const InputError& error) {
    std::fputs(fmt::format("{}\n", error.what()).c_str(), stderr);
    return 2;
}
