// The command line: the only file that includes CLI11 (18 s to compile).
#include "cli/arguments.h"

#include "cli/manual.h"
#include "cli/shelf.h"
#include "core/error.h"
#include "pipeline/record.h"
#include "scene/scene.h"
#include "scene/toml.h"
#include "studies/sweep/sweep_file.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>
#include <map>
#include <tuple>
#include <utility>

namespace squint::cli {
namespace {

template <class Number>
Number number_of(const std::string& text, const char* flag, const char* allowed) {
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size())
        throw InputError(fmt::format("{}: found \"{}\"; allowed: {}", flag, text, allowed));
    return value;
}

/// "512x256" -> two numbers; the scene checks their range.
std::pair<int, int> pair_of(const std::string& text, char separator, const char* flag, const char* allowed) {
    const std::size_t at = text.find(separator);
    if (at == std::string::npos)
        throw InputError(fmt::format("{}: found \"{}\"; allowed: {}", flag, text, allowed));
    return {number_of<int>(text.substr(0, at), flag, allowed),
            number_of<int>(text.substr(at + 1), flag, allowed)};
}

/// "800M" -> bytes.
std::int64_t size_of(const std::string& text, const std::string& flag) {
    constexpr const char* kAllowed = "a number above 0 with K, M, G or T, as in 500M";
    std::string digits = text;
    if (!digits.empty() && digits.back() == 'B') digits.pop_back();
    int shift = 0;
    if (!digits.empty())
        if (const auto unit = std::string_view("KMGT").find(digits.back()); unit != std::string_view::npos)
            shift = 10 * (static_cast<int>(unit) + 1), digits.pop_back();
    const auto value = number_of<std::int64_t>(digits, flag.c_str(), kAllowed);
    if (value < 1 || value > (std::int64_t{1} << (62 - shift)))
        throw InputError(fmt::format("{}: found \"{}\"; allowed: {}", flag, text, kAllowed));
    return value << shift;
}

/// `job`: the heading under which help lists the verb.
CLI::App& add_verb(CLI::App& app, const char* job, const char* name, const char* help) {
    return *app.add_subcommand(name, help)->group(job);
}

void add_json_flag(CLI::App& verb, bool& json) {
    verb.add_flag("--json", json, "Print JSON");
}

void add_set(CLI::App& verb, std::vector<std::string>& overrides, const char* help) {
    verb.add_option_function<std::string>(
            "--set", [&](const std::string& text) { overrides.push_back(text); }, help)
        ->trigger_on_parse()
        ->type_name("KEY=VALUE");
}

void add_size(CLI::App& verb, std::vector<std::string>& overrides) {
    verb.add_option_function<std::string>(
            "--size",
            [&](const std::string& text) {
                const auto [width, height] = pair_of(text, 'x', "--size", "WIDTHxHEIGHT, as in 800x600");
                overrides.push_back(fmt::format("image.width={}", width));
                overrides.push_back(fmt::format("image.height={}", height));
            },
            "Pixels; the same as setting image.width and image.height")
        ->trigger_on_parse()
        ->type_name("WxH");
}

/// The value of an enumeration for one of its names, which CLI11 has checked.
template <class E, std::size_t n>
E named(const std::string_view (&names)[n], const std::string& name) {
    return static_cast<E>(std::find(names, names + n, name) - names);
}

void add_series(CLI::App& verb, std::vector<std::string>& overrides) {
    verb.add_option_function<std::string>(
            "--series", [&](const std::string& text) { overrides.push_back("volume.series=" + text); },
            "Of a DICOM folder with several series: which, counted from 1")
        ->trigger_on_parse()
        ->type_name("N");
}

void add_scene(CLI::App& verb, SceneArguments& scene) {
    verb.add_option("scene", scene.file,
                    "Scene file (TOML), @NAME of one that comes with squint, or a volume or folder of "
                    "slices, which makes "
                    "a scene of its own; the built-in scene when left out")
        ->type_name("SCENE.toml|VOLUME");
    add_series(verb, scene.overrides);
    add_set(verb, scene.overrides, "Set any key of the scene; may be repeated, the last wins");
    add_size(verb, scene.overrides);
}

void add_render(CLI::App& app, RenderArguments& a) {
    CLI::App& verb = add_verb(app, "Pictures", "render", "Render a scene or a volume to EXR, PNG or JPEG");
    add_scene(verb, a.scene);
    verb.add_option("-o,--output", a.output,
                    "EXR to write, or PNG or JPEG as --preview does; when left out and nothing else is asked "
                    "for, the scene's "
                    "name with .exr; a turntable writes OUT.0000.exr and so on")
        ->type_name("OUT.exr|png|jpg");
    verb.add_option("--preview", a.preview, "PNG or JPEG to write: over the background, encoded as sRGB")
        ->type_name("OUT.png|jpg");
    verb.add_flag("--print-scene", a.print_scene,
                  "Print the scene as TOML, with what was chosen from the data, and stop");
    verb.add_option(
            "--json", a.json,
            "Write a record of the picture (schema squint.render/2): time, samples, path, memory, hash")
        ->type_name("FILE|-");
    verb.add_flag("--error", a.error,
                  "Measure the error against the same scene in double, and each stage's share: up to eight "
                  "more pictures");
    verb.add_flag(
        "--bound", a.bound,
        "Prove how far any pixel can be from the same scene without rounding, who pays for it, and which "
        "rays "
        "are undecided; the EXR gets the channels bound.R, bound.G, bound.B, bound.A (docs/guarantees.md)");
    verb.add_flag("--reference", a.reference, "Measure the error against the exact integral along each ray");
    verb.add_option("--reference-output", a.reference_output, "Write that integral's picture as EXR")
        ->type_name("OUT.exr");
    verb.add_flag(
        "--audit", a.options.audit,
        "Count what every wire carried: least, greatest, inexact, underflowed to zero, saturated, wrapped");
    verb.add_option("--threads", a.options.threads, "Threads; default: one a processor")
        ->check(CLI::Range(1, 4096))
        ->type_name("N");
    verb.add_option("--tile", a.options.tile, "Pixels on a side of a thread's piece of work")
        ->check(CLI::Range(1, 65536))
        ->type_name("N")
        ->capture_default_str();
    static const std::map<std::string, Path> paths{
        {"auto", Path::automatic}, {"model", Path::model}, {"lanes", Path::lanes}};
    verb.add_option_function<std::string>(
            "--path", [&](const std::string& name) { a.options.path = paths.at(name); },
            "auto, model (one sample at a time) or lanes (SIMD): the same bits")
        ->check(CLI::IsMember({"auto", "model", "lanes"}))
        ->type_name("NAME");
    verb.add_option("--target", a.options.target, "SIMD target of the lanes; `squint doctor` lists them")
        ->type_name("NAME");
    static const std::map<std::string, LayoutRule> layouts{
        {"auto", LayoutRule::automatic}, {"linear", LayoutRule::linear}, {"cells", LayoutRule::cells}};
    verb.add_option_function<std::string>(
            "--layout", [&](const std::string& name) { a.options.layout = layouts.at(name); },
            "How voxels lie in memory for the lanes: auto, linear or cells")
        ->check(CLI::IsMember({"auto", "linear", "cells"}))
        ->type_name("NAME");
    verb.add_flag_function(
        "--no-skip", [&](std::int64_t) { a.options.skip = false; }, "Visit empty space too");
    verb.add_option_function<std::string>(
            "--max-memory", [&](const std::string& text) { a.max_memory = size_of(text, "--max-memory"); },
            "Refuse a scene that needs more, as in 2G; mapped files do not count, layouts take what is left")
        ->type_name("SIZE");
    verb.add_flag("-q,--quiet", a.quiet, "No progress, no summary");
    verb.add_flag("--scene-reference", a.scene_reference,
                  "Print docs/scene.md, every key of a scene, and stop");
    verb.footer(
        "Examples:\n"
        "  squint render scan.nii.gz -o scan.png\n"
        "  squint render -o head.exr --preview head.png --error\n"
        "  squint render head.toml --set precision.preset=squeeze --set sampling.step=0.5 -o squeeze.exr\n"
        "  squint render head.toml --set 'precision.transparency=u1.8 trn' --audit --json -");
}

void add_plan(CLI::App& app, PlanArguments& a) {
    CLI::App& verb = add_verb(
        app, "What happens inside", "plan",
        "Say what a scene exercises: stages, wires, formats, words, tables, and what is left out and why");
    add_scene(verb, a.scene);
    verb.add_flag("--brief", a.brief, "A line a stage: its wires and their formats");
    add_json_flag(verb, a.json);
    verb.footer("Example:\n  squint plan head.toml --set precision.preset=squeeze");
}

void add_pixel(CLI::App& app, PixelArguments& a) {
    CLI::App& verb =
        add_verb(app, "What happens inside", "pixel", "Show every wire of one pixel's ray, sample by sample");
    verb.add_option("scene_x_y", a.words,
                    "Scene file (built-in when left out), column from the left, row from the top")
        ->type_name("[SCENE.toml] X Y")
        ->required();
    add_set(verb, a.scene.overrides, "Set any key of the scene; may be repeated, the last wins");
    add_size(verb, a.scene.overrides);
    verb.add_option_function<std::string>(
            "--samples",
            [&](const std::string& text) {
                constexpr const char* kAllowed = "FIRST:LAST, as in 10:12";
                a.samples = pair_of(text, ':', "--samples", kAllowed);
                if (a.samples.first < 0 || a.samples.second < a.samples.first)
                    throw InputError(fmt::format("--samples: found \"{}\"; allowed: {}", text, kAllowed));
            },
            "Only these samples, counted from 0, both ends included")
        ->type_name("A:B");
    add_json_flag(verb, a.json);
    verb.callback([&a] {
        const std::vector<std::string>& words = a.words;
        if (words.size() < 2 || words.size() > 3)
            throw InputError(fmt::format(
                "pixel: {} words given; allowed: [SCENE.toml] X Y, as in squint pixel head.toml 256 100",
                words.size()));
        if (words.size() == 3) a.scene.file = words[0];
        a.column = number_of<int>(words[words.size() - 2], "pixel: X", "a column, 0 at the left");
        a.row = number_of<int>(words[words.size() - 1], "pixel: Y", "a row, 0 at the top");
    });
    verb.footer("Example:\n  squint pixel head.toml 256 100 --samples 10:12");
}

void add_number(CLI::App& app, NumberArguments& a) {
    CLI::App& verb = add_verb(app, "What happens inside", "number", "Calculate in fixed-point formats");
    verb.add_option("words", a.words,
                    "RESULT NUMBER, or RESULT OPERATION OPERAND...; standard input when left out")
        ->type_name("");
    add_json_flag(verb, a.json);
    verb.footer(
        "RESULT is a format with a rounding (trn, trn_zero, rnd, rnd_conv) and an overflow rule (sat, wrap), "
        "as in\n"
        "u1.15 trn sat; what is left out is rnd_conv and sat.  Signed formats begin with s.\n"
        "OPERATION is add or +, sub or -, mul or *, madd (a b c: a b + c), lerp (a b w: a + w (b - a)).\n"
        "An OPERAND is a format and a number; the format may be left out where it is the one before.  A "
        "number is\n"
        "decimal (0.7, -1e-3), a raw integer (#22938) or raw hexadecimal (0x599a).  A decimal is first "
        "rounded to its\n"
        "operand's format.  The operation is exact, and its result is quantised once.\n"
        "\n"
        "Examples:\n"
        "  squint number u1.15 0.7\n"
        "  squint number u1.15 trn mul u1.15 0.7 0.7\n"
        "  squint number s4.4 rnd wrap add u4.4 15.5 u1.8 0.75\n"
        "  squint number u12.4 lerp u12.0 100 200 u1.12 0.25\n"
        "  squint number u1.8 madd '#128' '#255' '#1'\n"
        "  printf 'u1.15 0.7\\nu0.8 mul 0.5 0.5\\n' | squint number");
}

void add_compare(CLI::App& app, CompareArguments& a) {
    CLI::App& verb =
        add_verb(app, "Pictures", "compare", "Compare two pictures; exit code 1 when a bound fails");
    CLI::Option* const first = verb.add_option("a", a.a, "Picture")->required()->type_name("A");
    CLI::Option* const second = verb.add_option("b", a.b, "Picture to compare with")->type_name("B");
    verb.add_option("--diff", a.diff, "Write A - B: an EXR with its signs, or a PNG of its size")
        ->type_name("OUT");
    verb.add_option("--gain", a.gain, "Multiply the difference in --diff")->type_name("NUMBER");
    verb.add_option_function<std::string>(
            "--transfer", [&](const std::string& name) { a.srgb = name == "srgb"; },
            "linear, or srgb: encode R, G and B first")
        ->check(CLI::IsMember({"linear", "srgb"}))
        ->type_name("NAME");
    verb.add_option("--max-error,--fail-above", a.fail_above,
                    "Fail when any error is larger, in 1/255 of full scale")
        ->check(CLI::NonNegativeNumber)
        ->type_name("LSB8");
    verb.add_option("--min-psnr", a.min_psnr, "Fail when the PSNR over the foreground is lower")
        ->type_name("DB");
    CLI::Option* const json =
        verb.add_option("--json", a.json,
                        "Write the figures as JSON; without a file to standard output, in place of "
                        "the table")
            ->expected(0, 1)
            ->type_name("FILE|-");
    verb.callback([&verb, &a, first, second, json] {
        if (json->count() > 0 && second->count() == 0 && !a.json.empty()) {
            // A word after a bare --json is a picture.
            const std::vector<CLI::Option*> order = verb.parse_order();
            const auto at = [&](const CLI::Option* option) {
                return std::find(order.begin(), order.end(), option);
            };
            a.b = at(json) < at(first) ? std::exchange(a.a, a.json) : a.json;
            a.json = "-";
        }
        if (a.b.empty())
            throw InputError("compare: one picture given; allowed: two; see squint compare --help");
        if (json->count() > 0 && a.json.empty()) a.json = "-";
    });
    verb.footer(
        "Different sizes or channels and values that are not finite fail, always.\n\n"
        "Example:\n  squint compare fixed.exr real.exr --min-psnr 60 --diff diff.exr");
}

void add_info(CLI::App& app, InfoArguments& a) {
    CLI::App& verb =
        add_verb(app, "Volumes", "info", "Describe a volume: size, type, spacing, range, histogram");
    verb.add_option("volume", a.volume, "Volume file, folder of slices, or a procedural volume by name")
        ->type_name("VOLUME");
    add_series(verb, a.overrides);
    add_set(verb, a.overrides, "Set a volume.* key: what a raw file does not say");
    add_json_flag(verb, a.json);
    verb.footer(
        "Examples:\n"
        "  squint info head.nrrd\n"
        "  squint info head.raw --set volume.dims=[256,256,113] --set volume.type=u16\n"
        "  squint info phantom");
}

void add_volume(CLI::App& app, VolumeArguments& a) {
    CLI::App& verb = add_verb(app, "Volumes", "volume", "Write a volume of any kind as NRRD");
    verb.add_option("volume", a.volume, "A procedural volume by name, a volume file or a folder of slices")
        ->required()
        ->type_name("NAME|FILE");
    add_series(verb, a.overrides);
    verb.add_option("-o,--output", a.output, "NRRD to write")->required()->type_name("OUT.nrrd");
    add_set(verb, a.overrides, "Set a volume.* key");
    verb.add_option_function<std::string>(
            "--dims",
            [&](const std::string& text) {
                std::string list = text;
                std::replace(list.begin(), list.end(), 'x', ',');
                a.overrides.push_back("volume.dims=[" + list + "]");
            },
            "Voxels, as in 64 or 64x64x32")
        ->trigger_on_parse()
        ->type_name("N|XxYxZ");
    verb.add_option_function<std::string>(
            "--bits", [&](const std::string& text) { a.overrides.push_back("volume.bits=" + text); },
            "Bits of a procedural or float volume")
        ->trigger_on_parse()
        ->type_name("N");
    verb.footer("Example:\n  squint volume marschner_lobb --dims 64 --bits 8 -o ml.nrrd");
}

void add_doctor(CLI::App& app, DoctorArguments& a) {
    CLI::App& verb = add_verb(app, "This program", "doctor",
                              "Check this installation: libraries, SIMD targets, threads, a test picture");
    add_json_flag(verb, a.json);
    verb.footer("Example:\n  squint doctor");
}

void add_hard(CLI::App& app, HardArguments& a) {
    CLI::App& verb =
        add_verb(app, "What happens inside", "hard",
                 "Classify hard transfer functions with every method: errors against the exact integral");
    verb.add_option("scenes", a.scenes,
                    "Scene files, and folders of them; default: the cases of configs/hard")
        ->type_name("SCENE.toml|FOLDER");
    add_set(verb, a.overrides, "Set a key of every scene; may be repeated, the last wins");
    verb.add_option("--views", a.views,
                    "Whole pictures instead of slabs, from so many sides: words against the same in double")
        ->check(CLI::Range(1, 1000))
        ->type_name("N");
    verb.add_option("--sizes", a.sizes, "Pixels a side of these pictures")
        ->check(CLI::Range(1, 4096))
        ->delimiter(',')
        ->type_name("N,...")
        ->default_str("16,24");
    add_json_flag(verb, a.json);
    verb.footer(
        "Examples:\n  squint hard\n  squint hard configs/hard/spike.toml --set precision.preset=wide\n"
        "  squint hard --views 64");
}

void add_table(CLI::App& app, TableArguments& a) {
    CLI::App& verb =
        add_verb(app, "What happens inside", "table", "Write the tables of a scene's classification method");
    add_scene(verb, a.scene);
    verb.add_option("-o,--output", a.output,
                    "pi2d: EXR, row = front, column = back; the others: CSV, a row an entry, raw words")
        ->required()
        ->type_name("OUT.exr|OUT.csv");
    verb.footer("Example:\n  squint table head.toml --set classification.method=pi2d -o table.exr");
}

void add_sweep(CLI::App& app, SweepArguments& a) {
    CLI::App& verb = add_verb(app, "Choosing formats", "sweep",
                              "Render every point of a sweep file and measure its error, time and bits");
    verb.add_option("files", a.files, "Sweep file; with --collect the folders to join")
        ->required()
        ->type_name("SWEEP.toml");
    verb.add_option("-o,--output", a.output,
                    "Folder for the results; points that are there are not computed again")
        ->type_name("RUN")
        ->capture_default_str();
    add_set(verb, a.overrides, "Set any key of the scene at every point; an axis of that key still wins");
    verb.add_option_function<std::string>(
            "--shard",
            [&](const std::string& text) {
                constexpr const char* kAllowed = "I/N, as in 1/4, with I from 1 to N";
                std::tie(a.shard, a.shards) = pair_of(text, '/', "--shard", kAllowed);
                if (a.shard < 1 || a.shards < a.shard)
                    throw InputError(fmt::format("--shard: found \"{}\"; allowed: {}", text, kAllowed));
            },
            "Compute only every N-th point, beginning with the I-th")
        ->type_name("I/N");
    verb.add_flag("--collect", a.collect, "Join the folders of shards into one");
    verb.add_flag("--dry-run", a.dry_run, "Print an estimate of the time and the points, and stop");
    verb.add_flag("--redo", a.redo, "Compute points again that are there");
    verb.add_option("--threads", a.threads,
                    "Points at a time; threads of a point that is timed; default: one a processor")
        ->check(CLI::Range(1, 4096))
        ->type_name("N");
    verb.add_flag("--json-lines", a.json_lines,
                  "Print the record of each point as it is finished, a line each");
    verb.add_flag("-q,--quiet", a.quiet, "No progress, no summary");
    verb.footer(
        "A killed run goes on where it was when the same command is given again.  Exit code 3: some points "
        "failed.\n\n"
        "A sweep file, bits.toml (docs/sweeps.md has every key; @sweeps/section5 and others come with "
        "squint):\n"
        "  scene = \"head.toml\"               # left out: the built-in scene\n"
        "  [base]                            # any key of a scene, for every point\n"
        "  image.width = 128\n"
        "  image.height = 128\n"
        "  [[axis]]                          # a key and its values\n"
        "  key = \"sampling.step\"\n"
        "  values = [1, 0.5]\n"
        "  [[axis]]                          # wires, and one part of their formats\n"
        "  wires = [\"color\", \"transparency\"]\n"
        "  fraction_bits = { from = 8, to = 15 }\n\n"
        "Examples:\n"
        "  squint sweep bits.toml -o bits && squint report bits\n"
        "  squint sweep @sweeps/compositing -o run && squint report run -o report.html\n"
        "  squint sweep head.toml --dry-run --set image.width=256 --set image.height=256\n"
        "  squint sweep head.toml --shard 2/8 -o piece2; squint sweep --collect piece* -o run");
}

void add_report(CLI::App& app, ReportArguments& a) {
    CLI::App& verb =
        add_verb(app, "Choosing formats", "report", "Write what a sweep found as one page, or as numbers");
    verb.add_option("run", a.run, "The folder that squint sweep filled")->required()->type_name("RUN");
    verb.add_option("-o,--output", a.output,
                    "File to write; default: RUN/report.html for the page, standard output for numbers")
        ->type_name("FILE");
    verb.add_option("--format", a.format, "html, csv, json or markdown")
        ->check(CLI::IsMember({"html", "csv", "json", "markdown"}))
        ->type_name("NAME")
        ->capture_default_str();
    verb.add_option(
            "--max-error", a.max_error,
            "The report's first line names the cheapest point within this RMSE, in 1/255 of full scale; a "
            "search has its own bound")
        ->check(CLI::PositiveNumber)
        ->type_name("LSB8")
        ->capture_default_str();
    verb.add_option_function<std::string>(
            "--pictures",
            [&](const std::string& text) { a.most_picture_bytes = size_of(text, "--pictures"); },
            "Room for pictures in the page; what does not fit is kept coarser; default: 24M")
        ->type_name("SIZE");
    verb.footer(
        "The page needs no network and no server: open it from the disk, or send it.\n\n"
        "Example:\n  squint report run -o report.html; squint report run --format csv > run.csv");
}

void add_search(CLI::App& app, SearchArguments& a) {
    CLI::App& verb = add_verb(app, "Choosing formats", "search",
                              "Find the cheapest formats that keep a scene's rounding error under a bound");
    search::Settings& s = a.settings;
    verb.add_option("scenes", s.scenes,
                    "Scene files, one set of formats for all; the built-in scene when left out")
        ->type_name("SCENE.toml");
    verb.add_option("--max-error", s.most_error,
                    "The bound, in 1/255 of full scale, against the same pipeline in double")
        ->required()
        ->check(CLI::PositiveNumber)
        ->type_name("LSB8");
    verb.add_option_function<std::string>(
            "--cost",
            [&](const std::string& name) { s.cost = named<search::CostKind>(search::kCostNames, name); },
            "What to make small: bits (words and multipliers, docs/sweeps.md), time (of a picture, on this "
            "machine) or table-bytes; default: bits")
        ->check(CLI::IsMember({"bits", "time", "table-bytes"}))
        ->type_name("NAME");
    verb.add_option_function<std::string>(
            "--figure",
            [&](const std::string& name) { s.figure = named<search::Figure>(search::kFigureNames, name); },
            "What is bounded: max, the greatest error of any pixel, or rms over the foreground; default: max")
        ->check(CLI::IsMember({"max", "rms"}))
        ->type_name("NAME");
    verb.add_option_function<std::string>(
            "--transfer", [&](const std::string& name) { s.srgb = name == "srgb"; },
            "linear, or srgb: bound the colours as a display shows them; default: linear")
        ->check(CLI::IsMember({"linear", "srgb"}))
        ->type_name("NAME");
    verb.add_option_function<std::vector<std::string>>(
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
        ->delimiter(',')
        ->type_name("NAME,...");
    verb.add_flag_function(
        "--keep-integer-bits", [&](std::int64_t) { s.integer_bits = false; },
        "Search fraction bits only: ranges stay as the scene's preset has them");
    verb.add_option("--views", s.views,
                    "Views of a full turn to tune on; as many others, 16 at least, are held out")
        ->check(CLI::Range(1, 1000))
        ->type_name("N")
        ->capture_default_str();
    verb.add_option(
            "--guarantee", a.guarantee,
            "What the formats are held to: views, formats that a held-out view breaks are never written; or "
            "pictures, no pixel of the --views pictures can err by more, proven (docs/guarantees.md); "
            "default: views")
        ->check(CLI::IsMember({"views", "pictures"}))
        ->type_name("NAME");
    verb.add_option("--restarts", s.descent.restarts,
                    "Times that the search starts again from a random place below")
        ->check(CLI::Range(0, 10000))
        ->type_name("N")
        ->capture_default_str();
    verb.add_option("--seed", s.descent.seed, "Of the restarts")->type_name("N")->capture_default_str();
    verb.add_option("-o,--output", s.folder,
                    "Folder for formats.toml, search.json and the trail: a run that squint report takes; "
                    "pictures that are there are not rendered again")
        ->type_name("RUN")
        ->capture_default_str();
    add_set(verb, s.overrides, "Set any key of every scene; may be repeated, the last wins");
    add_size(verb, s.overrides);
    verb.add_option("--threads", s.threads,
                    "Pictures at a time; threads of a picture that is timed; default: one a processor")
        ->check(CLI::Range(1, 4096))
        ->type_name("N");
    add_json_flag(verb, a.json);
    verb.add_flag("-q,--quiet", a.quiet, "No progress, no summary");
    verb.footer(
        "The same scenes, settings and seed give the same formats, but where time is the cost.  Where no "
        "formats "
        "keep the bound it ends with 1 and writes none.\n\n"
        "Example:\n"
        "  squint search head.toml --size 128x128 --max-error 1 -o found\n"
        "  squint render head.toml --set precision.preset=$PWD/found/formats.toml && squint report found");
}

void add_reproduce(CLI::App& app, ReproduceArguments& a) {
    CLI::App& verb = add_verb(app, "Studies", "reproduce",
                              "Make the figures and tables of the papers beside the papers' own numbers");
    verb.add_option("paper", a.paper, "squeeze, lee_shin, guetat, or all; what there is when left out")
        ->type_name("PAPER");
    verb.add_option("figure", a.figure, "One figure or table; all but the timed ones when left out")
        ->type_name("FIGURE");
    verb.add_option("-o,--output", a.output,
                    "Folder for pictures and tables; what is there already is not made again")
        ->type_name("FOLDER")
        ->capture_default_str();
    verb.add_option("--data", a.data, "Folder of the real volumes; default: SQUINT_DATA of the environment")
        ->type_name("FOLDER");
    verb.add_flag("--timed", a.timed, "The tables that measure time, too");
    add_set(verb, a.overrides, "Set any key of every scene; may be repeated, the last wins");
    add_size(verb, a.overrides);
    verb.add_option("--threads", a.threads, "Threads; default: one a processor")
        ->check(CLI::Range(1, 4096))
        ->type_name("N");
    add_json_flag(verb, a.json);
    verb.add_flag("-q,--quiet", a.quiet, "No progress");
    verb.footer(
        "Examples:\n  squint reproduce\n  squint reproduce lee_shin figure_5\n"
        "  squint reproduce guetat --data ~/volumes -o guetat");
}

struct HelpArguments {
    std::string verb, form;
    bool list = false;
};
void add_help(CLI::App& app, HelpArguments& a) {
    CLI::App& verb = add_verb(app, "This program", "help", "Show this help, or a verb's");
    verb.add_option("verb", a.verb, "A verb")->type_name("VERB");
    verb.add_option("--form", a.form,
                    "As a man page (of squint, of a verb, of a scene's keys) or as a shell's completion")
        ->check(CLI::IsMember(std::vector<std::string>(std::begin(kManualForms), std::end(kManualForms))))
        ->type_name("NAME");
    verb.add_flag("--list", a.list,
                  "List the scenes and sweeps that come with squint: @lee_shin/figure_5 and others");
    verb.footer(
        "Examples:\n  squint help render\n  squint help render --form man | man -l -\n"
        "  source <(squint help --form bash)");
}

/// The command as a shell would accept it.
std::string command_text(int argc, char** argv) {
    std::string text = "squint";
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        const bool plain =
            !word.empty() && word.find_first_of(" '\"$&;()[]{}*?<>|\\`!#~\n\t") == std::string::npos;
        text += ' ';
        if (plain) {
            text += word;
            continue;
        }
        text += '\'';
        for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
        text += '\'';
    }
    return text;
}

std::vector<std::string> flags_of(const CLI::App& verb) {
    std::vector<std::string> names;
    for (const CLI::Option* option : verb.get_options())
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    return names;
}

/// "unknown WHAT "NAME"; did you mean ...?", or the list of names.
std::string unknown(const char* what, const std::string& name, const std::vector<std::string>& names) {
    const std::vector<std::string_view> candidates(names.begin(), names.end());
    const std::string_view near = nearest_name(name, candidates);
    return fmt::format(
        "unknown {} {}; {}", what, in_quotes(name),
        near.empty() ? "allowed: " + listed(candidates) : fmt::format("did you mean \"{}\"?", near));
}

/// CLI11's message on one line, with where help is.  Names a misspelt word before a missing one.
std::string message_of(const CLI::App& verb, const CLI::ParseError& error) {
    std::string message = error.what();
    for (const std::string& word : verb.remaining())
        if (word.starts_with("--")) {
            const std::string flag = word.substr(0, word.find('='));
            const std::vector<std::string> flags = flags_of(verb);
            const std::string_view near = nearest_name(flag, {flags.begin(), flags.end()});
            message = fmt::format("unknown flag {}{}", in_quotes(flag),
                                  near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near));
            break;
        }
    std::replace(message.begin(), message.end(), '\n', ' ');
    while (!message.empty() && (message.back() == ' ' || message.back() == '.')) message.pop_back();
    return fmt::format("{}: {}; see squint {} --help", verb.get_name(), message, verb.get_name());
}

FlagText text_of(const CLI::Option& option) {
    FlagText flag{{},
                  "",
                  option.get_expected_min() == 0 && option.get_expected_max() > 0,
                  {},
                  option.get_description()};
    for (const std::string& name : option.get_snames()) flag.names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) flag.names.push_back("--" + name);
    if (option.get_positional()) flag.names.push_back(option.get_name());
    if (option.get_items_expected_max() == 0) return flag;
    // CLI11 joins a value's name and its check: "NAME:{auto,model,lanes}".
    const std::string type = option.get_type_name();
    const std::size_t colon = type.find(':'),
                      open = type.find('{', colon == std::string::npos ? type.size() : colon);
    flag.value = type.substr(0, colon);
    if (open != std::string::npos) {
        std::string word;
        for (const char c : type.substr(open + 1))
            if (c == ',' || c == '}')
                flag.choices.push_back(std::exchange(word, ""));
            else
                word += c;
    }
    return flag;
}

VerbText text_of(const CLI::App& app) {
    VerbText verb{app.get_name(), app.get_group(), app.get_description(), app.get_footer(), {}, {}};
    for (const CLI::Option* option : app.get_options())
        (option->get_positional() ? verb.words : verb.flags).push_back(text_of(*option));
    return verb;
}

std::vector<const CLI::App*> verbs_of(const CLI::App& app) {
    return app.get_subcommands([](const CLI::App*) { return true; });
}

ProgramText program_text(const CLI::App& app) {
    ProgramText program{app.get_description(), app.get_footer(), version(), text_of(app).flags, {}};
    for (const CLI::App* verb : verbs_of(app)) program.verbs.push_back(text_of(*verb));
    return program;
}

/// `all`: the program's help.
std::string help_text(const CLI::App& app, const std::string& all, const HelpArguments& a) {
    if (a.list) {
        std::string names;
        for (const std::string& name : shelf()) names += name + "\n";
        return names;
    }
    const std::vector<const CLI::App*> verbs = verbs_of(app);
    const auto verb =
        std::find_if(verbs.begin(), verbs.end(), [&](const CLI::App* v) { return v->get_name() == a.verb; });
    if (!a.verb.empty() && verb == verbs.end()) {
        std::vector<std::string> names;
        for (const CLI::App* each : verbs) names.push_back(each->get_name());
        throw InputError("help: " + unknown("verb", a.verb, names));
    }
    if (!a.form.empty()) return manual(program_text(app), a.form, a.verb);
    return a.verb.empty() ? all : (*verb)->help("squint");
}

}  // namespace

Arguments parse(int argc, char** argv) {
    CLI::App app("Fixed-point volume ray casting with every bit of every stage a setting.", "squint");
    app.set_version_flag("--version", "squint " + version());
    app.require_subcommand(0, 1);
    RenderArguments render;
    PlanArguments plan;
    PixelArguments pixel;
    NumberArguments number;
    CompareArguments compare;
    InfoArguments info;
    VolumeArguments volume;
    DoctorArguments doctor;
    HardArguments hard;
    TableArguments table;
    SweepArguments sweep;
    ReportArguments report;
    SearchArguments search;
    ReproduceArguments reproduce;
    search.settings.folder = "found";
    add_render(app, render);
    add_compare(app, compare);
    add_plan(app, plan);
    add_pixel(app, pixel);
    add_table(app, table);
    add_number(app, number);
    add_hard(app, hard);
    add_sweep(app, sweep);
    add_search(app, search);
    add_report(app, report);
    add_reproduce(app, reproduce);
    add_info(app, info);
    add_volume(app, volume);
    add_doctor(app, doctor);
    HelpArguments help;
    add_help(app, help);
    app.footer(
        "`squint VERB --help` has every flag and an example; `squint render --scene-reference` every key of "
        "a scene.\n"
        "Exit codes: 0 done, 1 a comparison failed, 2 usage or input, 3 some points failed, 70 internal "
        "error, 130 interrupted.\n\n"
        "Example:\n  squint render -o out.exr --preview out.png");

    const std::string all = app.help();  // taken now: after parsing, CLI11 would print the verb's help
    if (argc < 2) return Text{all};

    const auto chosen = [&]() -> std::string {
        const auto verbs = app.get_subcommands();
        return verbs.empty() ? "" : verbs[0]->get_name();
    };
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        return Text{chosen().empty() ? all : app.get_subcommands()[0]->help("squint")};
    } catch (const CLI::CallForVersion&) {
        return Text{"squint " + version() + "\n"};
    } catch (const CLI::ParseError& error) {
        if (!chosen().empty()) throw InputError(message_of(*app.get_subcommands()[0], error));
        const std::vector<std::string> words = app.remaining();
        std::vector<std::string> names = flags_of(app);
        const bool flag = !words.empty() && words[0].starts_with('-');
        if (!flag) {
            names.clear();
            for (const CLI::App* each : verbs_of(app)) names.push_back(each->get_name());
        }
        throw InputError((words.empty() ? error.what() : unknown(flag ? "flag" : "verb", words[0], names)) +
                         std::string("; squint help lists them"));
    }
    const std::string verb = chosen();
    if (verb == "render") return render;
    if (verb == "plan") return plan;
    if (verb == "pixel") return pixel;
    if (verb == "number") return number;
    if (verb == "compare") return compare;
    if (verb == "info") return info;
    if (verb == "volume") return volume;
    if (verb == "doctor") return doctor;
    if (verb == "hard") return hard;
    if (verb == "table") return table;
    if (verb == "sweep") return sweep.command = command_text(argc, argv), sweep;
    if (verb == "report") return report;
    if (verb == "search") return search.settings.command = command_text(argc, argv), search;
    if (verb == "reproduce") return reproduce;
    if (verb == "help") return Text{help_text(app, all, help)};
    throw InputError("no verb given; squint help lists them");
}

}  // namespace squint::cli
