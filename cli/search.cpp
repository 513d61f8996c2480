// squint search: finds the cheapest formats within an error; writes a preset file and a run.
#include "studies/search/search.h"
#include "cli/common.h"
#include "cli/shelf.h"
#include "cli/verb.h"
#include "core/error.h"
#include "studies/search/by_certificate.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>

namespace squint::cli {
namespace {

struct SearchArguments {
    search::Settings settings;
    std::string guarantee = "views";
    bool json = false, quiet = false;
};

using search::Candidate;

std::string text_of_error(double error) {
    return std::isfinite(error) ? fmt::format("{:.4g}", error) : "none";
}

std::string summary(const search::Settings& s, const search::Result& r) {
    const char* figure = s.figure == search::Figure::largest ? "greatest" : "rms";
    std::string text = fmt::format(
        "{} error of at most {:g} LSB8{} on {} views of a turn; held out: {} more; {} formats tried, {} "
        "pictures\n",
        figure, s.most_error, s.srgb ? " on an sRGB display" : "", r.degrees.size(), r.other_degrees.size(),
        r.trials, r.pictures);
    std::vector<std::vector<std::string>> rows{{"", "bits", "table bytes", "error", "held out"}};
    const bool timed = s.cost == search::CostKind::time;
    if (timed) rows[0].insert(rows[0].begin() + 1, "ms");
    for (const Candidate* c : {&r.found, &r.scene, &r.squeeze}) {
        rows.push_back({c->name, fmt::format("{:.0f}", c->bits), fmt::format("{:.0f}", c->table_bytes),
                        text_of_error(c->error), text_of_error(c->other_error)});
        if (timed) rows.back().insert(rows.back().begin() + 1, fmt::format("{:.3g}", c->ms));
    }
    text += table_text(rows) + "\n";
    rows = {{"wire", "found", "as the scene says", "Squeeze's table", "alone"}};
    for (std::size_t w = 0; w < r.wires.size(); ++w)
        rows.push_back({std::string(info(r.wires[w]).name), to_string(r.found.specs[w].format),
                        to_string(r.scene.specs[w].format), to_string(r.squeeze.specs[w].format),
                        to_string(r.alone[w].format)});
    text += table_text(rows) + "\n";
    for (const Candidate* c : {&r.found, &r.scene, &r.squeeze})
        if (!c->failure.empty()) text += fmt::format("{}: {}\n", c->name, c->failure);
    text += fmt::format("found: {:.1f} % {} Squeeze's table in bits, with an error of {} against its {}\n",
                        std::abs(100 * (1 - r.found.bits / r.squeeze.bits)),
                        r.found.bits <= r.squeeze.bits ? "below" : "above", text_of_error(r.found.error),
                        text_of_error(r.squeeze.error));
    const std::size_t views = r.other_degrees.size();
    if (r.sets > 1)
        text += fmt::format("{} views held out broke what was found on fewer: raised until they held\n",
                            (static_cast<std::size_t>(r.sets) - 1) * views);
    text += fmt::format(
        "guarantee: views; none of {} that decided nothing is over the bound ({:.4g} LSB8 inside); no proof: "
        "were "
        "views drawn at random, {:.0f} % might be (19 times in 20 no more)\n",
        views, s.most_error - r.found.other_error, r.may_break_percent());
    return text + fmt::format("{}: squint render {}--set precision.preset={}\n", r.formats_file,
                              s.scenes.empty() ? "" : s.scenes[0] + " ",
                              std::filesystem::absolute(r.formats_file).string());
}

std::string summary(const search::Settings& s, const search::CertifiedResult& r) {
    std::string text =
        s.every_view ? fmt::format("bound of at most {:g} LSB8, proven for every view; {} scene bounds\n",
                                   s.most_error, r.certificates)
                     : fmt::format("bound of at most {:g} LSB8, proven for {} pictures; {} certificates\n",
                                   s.most_error, r.pictures, r.certificates);
    std::vector<std::vector<std::string>> rows{{"", "bits", "bound", "measured", "undecided rays"}};
    const auto row = [&](const char* name, const search::Proven& p) {
        rows.push_back({name, fmt::format("{:.0f}", p.bits), text_of_error(p.bound), text_of_error(p.error),
                        fmt::format("{} of {}", p.undecided, p.rays)});
    };
    row("found", r.found), row("as the scene says", r.scene);
    text += table_text(rows) + "\n";
    rows = {{"wire", "found", "as the scene says"}};
    for (const Wire wire : r.wires)
        rows.push_back({std::string(info(wire).name), to_string(r.found.specs[wire].format),
                        to_string(r.scene.specs[wire].format)});
    text += table_text(rows) + "\n";
    text += s.every_view ? fmt::format(
                               "guarantee: scene; no pixel of any view errs by more than {:.4g} LSB8 by "
                               "rounding; nothing is proven of other data\n",
                               r.found.bound)
                         : fmt::format(
                               "guarantee: pictures; no pixel of these {} errs by more than {:.4g} LSB8 by "
                               "rounding; nothing is "
                               "proven of other views, sizes or data\n",
                               r.pictures, r.found.bound);
    return text + fmt::format("{}: squint render {}--set precision.preset={}\n", r.formats_file,
                              s.scenes.empty() ? "" : s.scenes[0] + " ",
                              std::filesystem::absolute(r.formats_file).string());
}

/// What a search ends with: its summary or record, or why there is none.
template <class Result>
int told(const SearchArguments& a, const search::Settings& settings, const Result& result) {
    if (!result.failure.empty()) return say(fmt::format("squint: {}\n", result.failure)), kComparisonFailed;
    if (a.json)
        print_json(result.json);
    else if (!a.quiet)
        print(summary(settings, result));
    return kDone;
}

int run_on_these_threads(const SearchArguments& a) {
    search::Settings settings = a.settings;
    for (std::string& scene : settings.scenes) scene = file_of(scene);
    settings.cancelled = &interrupted;
    StatusLine line(!a.quiet);
    settings.progress = [&](const std::string& text) { line.show(text); };
    settings.note = [&](const std::string& note) {
        if (!a.quiet) line.clear(), say(fmt::format("note: {}\n", note));
    };
    const Interruptible here;
    if (a.guarantee != "views") {
        settings.every_view = a.guarantee == "scene";
        if (settings.cost != search::CostKind::bits || settings.figure != search::Figure::largest ||
            settings.srgb)
            throw InputError("--guarantee " + a.guarantee +
                             ": bounds are of the greatest error in linear light, and bits are what "
                             "is made few; allowed: without --cost, --figure and --transfer");
        const search::CertifiedResult result = run_by_certificate(settings);
        line.clear();
        return told(a, settings, result);
    }
    const search::Result result = run_search(settings);
    line.clear();
    return told(a, settings, result);
}

int run(const SearchArguments& a) {
    return on_threads_asked_for(a.settings.threads, [&] { return run_on_these_threads(a); });
}

void flags(Flags& f, SearchArguments& a) {
    search::Settings& s = a.settings;
    s.folder = "found", s.command = f.command();
    f.add("scenes", s.scenes, "Scene files, one set of formats for all; the built-in scene when left out")
        .value("SCENE.toml");
    f.add("--max-error", s.most_error,
          "The bound, in 1/255 of full scale, against the same pipeline in double")
        .required()
        .positive()
        .value("LSB8");
    f.choose("--cost", {std::begin(search::kCostNames), std::end(search::kCostNames)}, s.cost,
             "What to make small: bits (words and multipliers, docs/sweeps.md), time (of a picture, on this "
             "machine) or table-bytes; default: bits");
    f.choose(
        "--figure", {std::begin(search::kFigureNames), std::end(search::kFigureNames)}, s.figure,
        "What is bounded: max, the greatest error of any pixel, or rms over the foreground; default: max");
    f.choose("--transfer", {"linear", "srgb"}, s.srgb,
             "linear, or srgb: bound the colours as a display shows them; default: linear");
    f.read_list(
         "--wires",
         [&](const std::vector<std::string>& names) {
             for (const std::string& name : names) {
                 Wire wire{};
                 if (!sweep::find_wire(name, wire))
                     throw InputError(fmt::format(
                         "--wires: found \"{}\"; allowed: wires as docs/scene.md, [precision], lists them",
                         name));
                 if (std::find(s.wires.begin(), s.wires.end(), wire) == s.wires.end())
                     s.wires.push_back(wire);
             }
         },
         "Search only these; default: every wire that the scenes use")
        .separated_by_commas()
        .value("NAME,...");
    f.clear("--keep-integer-bits", s.integer_bits,
            "Search fraction bits only: ranges stay as the scene's preset has them");
    f.add("--views", s.views, "Views of a full turn to tune on; as many others, 16 at least, are held out")
        .between(1, 1000)
        .value("N")
        .shows_default();
    f.add("--guarantee", a.guarantee,
          "What the formats are held to: views, formats that a held-out view breaks are never written; or "
          "pictures, no pixel of the --views pictures can err by more, proven; or scene, no pixel of any "
          "view (docs/guarantees.md); default: views")
        .one_of({"views", "pictures", "scene"})
        .value("NAME");
    f.add("--restarts", s.descent.restarts, "Times that the search starts again from a random place below")
        .between(0, 10000)
        .value("N")
        .shows_default();
    f.add("--seed", s.descent.seed, "Of the restarts").value("N").shows_default();
    f.add("-o,--output", s.folder,
          "Folder for formats.toml, search.json and the trail: a run that squint report takes; "
          "pictures that are there are not rendered again")
        .value("RUN")
        .shows_default();
    add_set(f, s.overrides, "Set any key of every scene; may be repeated, the last wins");
    add_size(f, s.overrides);
    f.add("--threads", s.threads,
          "Pictures at a time; threads of a picture that is timed; default: one a processor")
        .between(1, 4096)
        .value("N");
    add_json_flag(f, a.json);
    f.add("-q,--quiet", a.quiet, "No progress, no summary");
}

}  // namespace

namespace verbs {
extern const Verb search{
    .name = "search",
    .heading = "Choosing formats",
    .help = "Find the cheapest formats that keep a scene's rounding error under a bound",
    .footer =
        "The same scenes, settings and seed give the same formats, but where time is the cost.  Where no "
        "formats "
        "keep the bound it ends with 1 and writes none.\n\n"
        "Example:\n"
        "  squint search head.toml --size 128x128 --max-error 1 -o found\n"
        "  squint render head.toml --set precision.preset=$PWD/found/formats.toml && squint report found",
    .describe = described<SearchArguments, flags, run>,
};
}

}  // namespace squint::cli
