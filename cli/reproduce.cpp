// squint reproduce: figures and tables of the papers, made again.
#include "studies/reproduce/reproduce.h"

#include "cli/common.h"
#include "cli/shelf.h"
#include "cli/verb.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/text.h"
#include "pipeline/record.h"
#include "scene/toml.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <utility>

namespace squint::cli {
namespace {

struct ReproduceArguments {
    std::string paper, figure;  // empty: all of them; both empty: what there is is listed
    std::string output = "reproduced", data;
    std::vector<std::string> overrides;
    int threads = 0;
    bool timed = false, json = false, quiet = false;
};

using namespace squint::reproduce;
using Json = nlohmann::ordered_json;

std::vector<Paper> all_papers() {
    std::vector<Paper> all;
    for (const std::string& file : papers()) all.push_back(read_paper(file));
    if (all.empty()) throw InputError("reproduce: this program has no folder configs/reproduce beside it");
    return all;
}

/// What a figure takes, or that it measures time and takes it.
std::string time_of(const Figure& figure) {
    return (figure.timed ? "timed, " : "") + text_of_time(figure.seconds);
}

int list(const std::vector<Paper>& papers, bool as_json) {
    if (as_json) {
        Json json{{"schema", "squint.reproduce/1"}, {"version", version()}, {"papers", Json::array()}};
        for (const Paper& paper : papers) {
            Json figures = Json::array();
            for (const Figure& f : paper.figures)
                figures.push_back(
                    {{"figure", f.name}, {"title", f.title}, {"seconds", f.seconds}, {"timed", f.timed}});
            json["papers"].push_back({{"paper", paper.name}, {"title", paper.title}, {"figures", figures}});
        }
        return print_json(json), kDone;
    }
    std::string text;
    for (const Paper& paper : papers) {
        text += fmt::format("{}: {}\n", paper.name, paper.title);
        std::vector<std::vector<std::string>> rows;
        for (const Figure& f : paper.figures) rows.push_back({f.name, time_of(f), f.title});
        text += table_text(rows, "  ") + "\n";
    }
    return print(text +
                 "Times on two cores.  squint reproduce PAPER [FIGURE] makes them; PAPER may be all.\n"),
           kDone;
}

const Paper& paper_named(const std::vector<Paper>& papers, const std::string& name) {
    const auto found =
        std::find_if(papers.begin(), papers.end(), [&](const Paper& p) { return p.name == name; });
    if (found != papers.end()) return *found;
    std::vector<std::string_view> names;
    for (const Paper& p : papers) names.push_back(p.name);
    throw InputError(fmt::format("reproduce: no paper {}; allowed: all, {}", in_quotes(name), listed(names)));
}
const Figure& figure_named(const Paper& paper, const std::string& name) {
    if (const Figure* figure = paper.find(name)) return *figure;
    std::vector<std::string_view> names;
    for (const Figure& f : paper.figures) names.push_back(f.name);
    throw InputError(
        fmt::format("reproduce: {} has no {}; allowed: {}", paper.name, in_quotes(name), listed(names)));
}

struct Order {
    const Paper* paper;
    const Figure* figure;
};
std::vector<Order> orders_of(const std::vector<Paper>& papers, const ReproduceArguments& a) {
    std::vector<Order> orders;
    const auto add_all = [&](const Paper& paper) {
        for (const Figure& figure : paper.figures) {
            if (!figure.timed || a.timed)
                orders.push_back({&paper, &figure});
            else if (!a.quiet)
                say(fmt::format(
                    "{} {}: left out, it measures time and takes {}; --timed, or its name, makes it\n",
                    paper.name, figure.name, text_of_time(figure.seconds)));
        }
    };
    if (a.paper == "all") {
        if (!a.figure.empty())
            throw InputError("reproduce: a figure of all papers; allowed: PAPER FIGURE, or all");
        for (const Paper& paper : papers) add_all(paper);
        return orders;
    }
    const Paper& paper = paper_named(papers, a.paper);
    if (a.figure.empty())
        add_all(paper);
    else
        orders.push_back({&paper, &figure_named(paper, a.figure)});
    return orders;
}

class Progress {
  public:
    Progress(bool wanted, std::string figure) : line_(wanted), figure_(std::move(figure)) {}
    void begin(const std::string& what, int done, int of) {
        const std::lock_guard lock(mutex_);
        text_ = fmt::format("{}: {} ({} of {})", figure_, what, done + 1, of);
        line_.show(text_);
    }
    void part(double part) {
        const std::lock_guard lock(mutex_);
        if (line_.due()) line_.show(fmt::format("{}, {:.0f} %", text_, 100 * part));
    }
    void clear() const { line_.clear(); }

  private:
    StatusLine line_;
    std::string figure_, text_;
    std::mutex mutex_;
};

Result made(const Order& order, const ReproduceArguments& a) {
    const auto& [paper, figure] = order;
    const std::string name = paper->name + " " + figure->name;
    if (!a.quiet && figure->seconds >= 60)
        say(fmt::format("{}: about {} on two cores\n", name, text_of_time(figure->seconds)));
    Progress progress(!a.quiet, name);
    Settings settings;
    settings.folder = a.output + "/" + paper->name;
    settings.overrides = a.overrides, settings.threads = a.threads;
    settings.scene_file = [](const std::string& scene) { return file_of(scene); };
    settings.progress = [&](const std::string& what, int done, int of) { progress.begin(what, done, of); };
    settings.part = [&](double part) { progress.part(part); };
    settings.cancelled = &interrupted;
    const Interruptible here;
    Result result = make(*paper, *figure, settings);
    progress.clear();
    if (!a.quiet)
        say(fmt::format("{}: {} made, {} there already, in {}/{}\n", name, result.made, result.kept,
                        settings.folder, figure->name));
    return result;
}

int run_on_these_threads(const ReproduceArguments& a) {
    if (!a.data.empty()) setenv("SQUINT_DATA", a.data.c_str(), 1);
    const std::vector<Paper> papers = all_papers();
    if (a.paper.empty()) return list(papers, a.json);
    Json all = Json::array();
    bool some_failed = false;
    for (const Order& order : orders_of(papers, a)) {
        const Result result = made(order, a);
        const std::string folder = fmt::format("{}/{}/{}", a.output, order.paper->name, order.figure->name);
        const std::string page = markdown_of(*order.paper, *order.figure, result);
        const Json json = json_of(*order.paper, *order.figure, result);
        write_text_whole(folder + "/results.md", page);
        write_text_whole(folder + "/results.csv", csv_of(result));
        write_json(folder + "/results.json", json);
        for (const Row& row : result.rows) some_failed = some_failed || !row.refused.empty();
        if (a.json)
            all.push_back(json);
        else
            print(page + "\n");
    }
    if (a.json) print_json(all);
    return some_failed ? kSomeFailed : kDone;
}

int run(const ReproduceArguments& a) {
    return on_threads_asked_for(a.threads, [&] { return run_on_these_threads(a); });
}

void flags(Flags& f, ReproduceArguments& a) {
    f.add("paper", a.paper, "squeeze, lee_shin, guetat, or all; what there is when left out").value("PAPER");
    f.add("figure", a.figure, "One figure or table; all but the timed ones when left out").value("FIGURE");
    f.add("-o,--output", a.output, "Folder for pictures and tables; what is there already is not made again")
        .value("FOLDER")
        .shows_default();
    f.add("--data", a.data, "Folder of the real volumes; default: SQUINT_DATA of the environment")
        .value("FOLDER");
    f.add("--timed", a.timed, "The tables that measure time, too");
    add_set(f, a.overrides, "Set any key of every scene; may be repeated, the last wins");
    add_size(f, a.overrides);
    f.add("--threads", a.threads, "Threads; default: one a processor").between(1, 4096).value("N");
    add_json_flag(f, a.json);
    f.add("-q,--quiet", a.quiet, "No progress");
}

}  // namespace

namespace verbs {
extern const Verb reproduce{
    .name = "reproduce",
    .heading = "Studies",
    .help = "Make the figures and tables of the papers beside the papers' own numbers",
    .footer =
        "Examples:\n  squint reproduce\n  squint reproduce lee_shin figure_5\n"
        "  squint reproduce guetat --data ~/volumes -o guetat",
    .describe = described<ReproduceArguments, flags, run>,
};
}

}  // namespace squint::cli
