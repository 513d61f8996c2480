// squint hard: scenes with transfer functions that are hard to classify, each with every method: the error of
// one slab against the exact integral, or of whole pictures against the same in double, or why the method is
// refused.
#include "cli/common.h"
#include "cli/verb.h"
#include "core/error.h"
#include "truth/picture_check.h"
#include "truth/slab_check.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>

namespace squint::cli {
namespace {

struct HardArguments {
    std::vector<std::string> scenes;  // files and folders
    std::vector<std::string> overrides;
    int views = 0;  // 0: slabs alone, no pictures
    std::vector<int> sizes{16, 24};
    bool json = false;
};

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// The scenes of configs/hard, built into the program: name, text.
constexpr std::pair<const char*, const char*> kCases[] = {
#include "hard_cases.inc"
};

struct Case {
    std::string name;
    Scene scene;
};

/// The scene files given, and those in folders, sorted by name.
std::vector<std::string> files_of(const std::vector<std::string>& names) {
    std::vector<std::string> scenes;
    for (const std::string& name : names) {
        if (!fs::is_directory(name)) {
            scenes.push_back(name);
            continue;
        }
        std::vector<std::string> found;
        for (const auto& entry : fs::directory_iterator(name))
            if (entry.path().extension() == ".toml") found.push_back(entry.path().string());
        std::sort(found.begin(), found.end());
        if (found.empty()) throw InputError(name + ": no .toml scene in this folder");
        scenes.insert(scenes.end(), found.begin(), found.end());
    }
    return scenes;
}

std::vector<Case> cases_of(const HardArguments& a) {
    std::vector<Case> cases;
    if (a.scenes.empty())
        for (const auto& [name, text] : kCases)
            cases.push_back({name, parse_scene(text, std::string(name) + ".toml", "", a.overrides)});
    for (const std::string& file : files_of(a.scenes))
        cases.push_back({fs::path(file).stem().string(), read({file, a.overrides})});
    return cases;
}

struct Outcome {
    SlabCheck check;
    PictureCheck pictures;
    std::string refused;             // the reason, or empty
    std::vector<std::string> notes;  // what the tables' builder decided
};
Outcome outcome_of(const HardArguments& a, Scene scene, const NamedMethod& method,
                   const std::shared_ptr<const Volume>& volume) {
    scene.classification.method = method.method, scene.classification.order = method.order;
    Outcome outcome;
    try {
        if (a.views > 0) {
            outcome.pictures = check_pictures(scene, volume, a.views, a.sizes);
            return outcome;
        }
        const Plan plan = plan_asked_for(scene, volume);
        outcome.check = check_slabs(plan), outcome.notes = plan.notes;
    } catch (const InputError& error) {
        outcome.refused = error.what();
    }
    return outcome;
}

std::string cell_of(const HardArguments& a, const Outcome& outcome) {
    if (!outcome.refused.empty()) return "refused";
    if (a.views > 0) return fmt::format("{:.2f}", outcome.pictures.largest);
    return fmt::format("{:.2f}{}", std::max(outcome.check.largest_color, outcome.check.largest_alpha),
                       outcome.check.beyond ? "!" : "");
}
Json json_of(const HardArguments& a, const Outcome& outcome) {
    if (!outcome.refused.empty()) return {{"refused", outcome.refused}};
    const PictureCheck& p = outcome.pictures;
    if (a.views > 0)
        return {
            {"rounding_lsb8", p.largest}, {"view", p.view}, {"size", p.size}, {"pixel", {p.column, p.row}}};
    return {{"slabs", outcome.check.slabs},
            {"color_lsb8", outcome.check.largest_color},
            {"alpha_lsb8", outcome.check.largest_alpha},
            {"outside_0_C_alpha_1", outcome.check.beyond},
            {"notes", outcome.notes}};
}

int run(const HardArguments& a) {
    const std::vector<NamedMethod> methods = every_method();
    std::vector<std::vector<std::string>> rows{{"scene"}};
    for (const NamedMethod& method : methods) rows[0].push_back(method.name);
    Json json = Json::object();
    std::string remarks;
    int beyond = 0;
    const std::vector<Case> cases = cases_of(a);
    StatusLine line(true);
    for (const auto& [name, scene] : cases) {
        std::vector<std::string> notes;
        const auto volume = load(scene, notes);
        rows.push_back({name});
        for (const NamedMethod& method : methods) {
            line.show(
                fmt::format("{}, {}: scene {} of {}", name, method.name, rows.size() - 1, cases.size()));
            const Outcome outcome = outcome_of(a, scene, method, volume);
            rows.back().push_back(cell_of(a, outcome));
            json[name][method.name] = json_of(a, outcome);
            beyond += outcome.check.beyond;
            if (!outcome.refused.empty())
                remarks += fmt::format("{}, {}: {}\n", name, method.name, outcome.refused);
            for (const std::string& note : outcome.notes)
                if (note.find("redirected") != std::string::npos)
                    remarks += fmt::format("{}: {}\n", name, note);
        }
    }
    line.clear();
    if (a.json) {
        print_json({{"schema", "squint.hard/1"}, {"scenes", json}});
    } else {
        const std::string head =
            a.views > 0
                ? fmt::format(
                      "Largest error of any pixel's colour or opacity, words against the same in double, in "
                      "LSB8: {} views, {} pixels a side\n\n",
                      a.views, fmt::join(a.sizes, " and "))
                : "Largest error of one slab against the exact integral, colour or opacity, in LSB8 (! "
                  "outside 0 <= C <= alpha <= 1)\n\n";
        print(head + table_text(rows) + (remarks.empty() ? "" : "\n" + remarks));
    }
    return beyond ? kComparisonFailed : kDone;
}

void flags(Flags& f, HardArguments& a) {
    f.add("scenes", a.scenes, "Scene files, and folders of them; default: the cases of configs/hard")
        .value("SCENE.toml|FOLDER");
    add_set(f, a.overrides, "Set a key of every scene; may be repeated, the last wins");
    f.add("--views", a.views,
          "Whole pictures instead of slabs, from so many sides: words against the same in double")
        .between(1, 1000)
        .value("N");
    f.add("--sizes", a.sizes, "Pixels a side of these pictures")
        .between(1, 4096)
        .separated_by_commas()
        .value("N,...")
        .shows_default("16,24");
    add_json_flag(f, a.json);
}

}  // namespace

namespace verbs {
extern const Verb hard{
    .name = "hard",
    .heading = "What happens inside",
    .help = "Classify hard transfer functions with every method: errors against the exact integral",
    .footer =
        "Examples:\n  squint hard\n  squint hard configs/hard/spike.toml --set precision.preset=wide\n"
        "  squint hard --views 64",
    .describe = described<HardArguments, flags, run>,
};
}

}  // namespace squint::cli
