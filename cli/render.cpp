// squint render: turns a scene into an EXR, a preview and a record.
#include "cli/common.h"
#include "cli/verb.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/preview.h"
#include "core/text.h"
#include "pipeline/audit_record.h"
#include "pipeline/machines/certificate.h"
#include "pipeline/plan_record.h"
#include "pipeline/record.h"
#include "scene/presets.h"
#include "studies/sweep/profile.h"
#include "studies/sweep/report.h"
#include "truth/reference.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <span>
#include <string_view>
#include <utility>

namespace squint::cli {
namespace {

struct RenderArguments {
    SceneArguments scene;
    std::string output, preview, json;  // json: a file, or - for standard output
    std::string reference_output;       // the reference picture, as EXR
    std::string profile, command;       // the page of --profile, and what asked for it
    RenderOptions options;
    std::int64_t max_memory = 0;  // bytes; 0: no limit
    bool reference = false, error = false, exact = false, bound = false, quiet = false,
         scene_reference = false, print_scene = false;
};

using Json = nlohmann::ordered_json;

/// "out.exr" -> "out.0007.exr" for a turntable.
std::string frame_path(const std::string& path, int frame, int frames) {
    if (frames == 1 || path.empty() || path == "-") return path;
    std::filesystem::path numbered(path);
    const std::string extension = numbered.extension().string();
    numbered.replace_extension(fmt::format(".{:04}{}", frame, extension));
    return numbered.string();
}

using Extensions = std::span<const std::string_view>;
constexpr std::string_view kExr[] = {".exr"}, kPreviews[] = {".png", ".jpg", ".jpeg"},
                           kPictures[] = {".exr", ".png", ".jpg", ".jpeg"}, kPages[] = {".html"};

bool ends_in(const std::string& path, Extensions extensions) {
    const std::string extension = std::filesystem::path(path).extension().string();
    return std::find(extensions.begin(), extensions.end(), extension) != extensions.end();
}

/// Refuses at once what would fail after the work.
void check_output(const std::string& path, const char* flag, Extensions extensions) {
    if (path.empty()) return;
    const std::filesystem::path file(path);
    std::error_code ignored;
    if (extensions.size() > 0 && !ends_in(path, extensions) &&
        !std::filesystem::is_character_file(file, ignored))
        throw InputError(
            fmt::format("{} {}: the name must end in {}", flag, path, fmt::join(extensions, ", ")));
    const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
    if (!std::filesystem::is_directory(folder, ignored))
        throw InputError(fmt::format("{}: cannot write: there is no folder {}", path, folder.string()));
    if (access(folder.c_str(), W_OK) != 0 && !std::filesystem::exists(file, ignored))
        throw InputError(fmt::format("{}: cannot write: {}", path, std::strerror(errno)));
}

void refuse_beyond(std::int64_t limit, std::int64_t needed, const std::string& what) {
    if (limit > 0 && needed > limit)
        throw InputError(fmt::format("--max-memory: {} needs {}, allowed: {}", what, text_of_bytes(needed),
                                     text_of_bytes(limit)));
}

std::string share(std::int64_t part, std::int64_t of) {
    if (part == 0) return "-";
    return fmt::format("{:.3g} %", 100 * static_cast<double>(part) / static_cast<double>(of));
}

/// A histogram of bits as digits: powers of ten of the number of values that need so many bits.
std::string magnitudes(const WireStatistics& s, const Format& format) {
    std::string digits;
    for (int b = 0; b <= format.integer_bits + format.fraction_bits; ++b) {
        const std::int64_t count = s.magnitude[static_cast<std::size_t>(b)];
        digits +=
            count == 0 ? '.' : static_cast<char>('0' + std::min(9, static_cast<int>(std::log10(count))));
    }
    return digits;
}

std::string audit_text(const Plan& plan, const RenderStatistics& statistics) {
    std::vector<std::vector<std::string>> rows{{"wire", "format", "count", "min", "max", "inexact", "to zero",
                                                "saturated", "wrapped", "idle", "bits"}};
    const auto add = [&](std::string_view name, const WireStatistics& s, const Format& format) {
        rows.push_back({std::string(name), to_string(format), std::to_string(s.count),
                        fmt::format("{:.6g}", to_real(s.smallest, format)),
                        fmt::format("{:.6g}", to_real(s.largest, format)), share(s.inexact, s.count),
                        share(s.underflowed, s.count), share(s.saturated, s.count), share(s.wrapped, s.count),
                        fmt::format("{}+{}", unused_high_bits(s, format), zero_low_bits(s, format)),
                        magnitudes(s, format)});
    };
    add("voxels", voxel_statistics(*plan.volume), voxel_format(*plan.volume));
    for (std::size_t w = 0; w < statistics.wires.size(); ++w)
        if (statistics.wires[w].count > 0)
            add(kWireInfo[w].name, statistics.wires[w], plan.specs.spec[w].format);
    return table_text(rows) +
           "idle: bits at the top that no value needed, and at the bottom that no value set\n"
           "bits: one place for each number of bits a value needs, from none to all of its format's; a digit "
           "d means 10^d values or more\n";
}

std::string text_of_error(const Comparison& comparison) {
    const Difference& d = comparison.channel("RGB", true);
    if (d.identical) return "identical";
    return fmt::format("{:.1f} dB, largest error {:.2f} of 255", d.psnr.value_or(0), 255 * d.largest);
}

/// " of one pixel in 16"; nothing of every pixel.
std::string one_pixel_in(int every) {
    return every == 1 ? "" : fmt::format(" of one pixel in {}", every * every);
}

std::string error_text(const Errors& errors) {
    std::string text;
    if (errors.against_real)
        text += fmt::format("  rounding, against {}: {} (foreground, linear light)\n",
                            errors.by_floats ? "floats, which err less than a tenth of it" : "double",
                            text_of_error(*errors.against_real));
    for (const StageError& stage : errors.stages)
        text += fmt::format("    {:<16} alone{}: {}\n", stage.stage, one_pixel_in(errors.every),
                            text_of_error(stage.against_real));
    if (errors.against_reference)
        text += fmt::format("  everything, against the reference: {}\n",
                            text_of_error(*errors.against_reference));
    return text;
}

/// The cost of --error: a picture in double, and one for each stage that rounds, or some pixels of them.
std::string price_of_errors(const Plan& plan, const RenderStatistics& statistics, ErrorRays rays) {
    std::ptrdiff_t stages = 0;
    if (!plan.real)
        stages = std::count_if(plan.stages.begin(), plan.stages.end(),
                               [](const StageReport& s) { return s.modelled; });
    const bool is_fast = statistics.path == "lanes";
    const double slower = is_fast ? 40 : 1;  // doubles run in the model; measured
    const int every = rays == ErrorRays::all ? 1 : error_lattice(plan);
    const double pictures = static_cast<double>(stages + 1), of_floats = every > 1 ? 2 : 0;
    return fmt::format("  measuring the error: {} more pictures{}, about {}\n", stages + 1,
                       one_pixel_in(every),
                       text_of_time(statistics.seconds * (pictures * slower / (every * every) + of_floats)));
}

std::string bound_text(const Certificate& c) {
    std::string text = fmt::format(
        "  bound, proven: no pixel is more than {:.4g} LSB8 from the picture without rounding (median "
        "{:.4g}); worst {} at "
        "({}, {})\n",
        c.most, c.median, "RGBA"[c.channel], c.column, c.row);
    std::string why;
    for (std::size_t d = 0; d < kDoubtNames.size(); ++d)
        if (c.undecided[d] > 0)
            why += fmt::format("{}{} {}", why.empty() ? "" : ", ", kDoubtNames[d], c.undecided[d]);
    text += fmt::format("    undecided: {} of {} rays{}; all others {:.4g} LSB8 at most\n", c.undecided_rays,
                        c.rays, why.empty() ? "" : " (" + why + ")", c.most_decided);
    for (const auto& [stage, share] : shares_by_stage(c)) {
        if (share <= 0) continue;
        std::string wires;
        for (int p = 0; p < kWires; ++p)
            if (kWireInfo[static_cast<std::size_t>(p)].stage == stage && c.shares[p] > 0)
                wires += fmt::format("{}{} {:.2g}", wires.empty() ? "  " : ", ", payer_name(p), c.shares[p]);
        text += fmt::format("    {:<16} {:>8.3g}{}\n", stage, share, wires);
    }
    return text;
}

struct Job {
    const RenderArguments& arguments;
    Scene scene;
    std::shared_ptr<const Volume> volume;
    std::string output, preview;  // EXR as asked for, or the default; PNG or JPEG
};

/// Writes the exact integral with the scene in its attributes, but no formats: it has none.
void write_reference(const Job& job, const Plan& plan, const Image& reference, int frame) {
    Attributes attributes = exr_attributes(plan, frame);
    std::erase_if(attributes, [](const auto& item) { return item.first.starts_with("squint.wire."); });
    attributes["squint.reference"] = "the exact integral along each ray";
    write_exr(reference, frame_path(job.arguments.reference_output, frame, job.scene.camera.turntable),
              attributes);
}

/// Renders, writes and reports one picture; returns its record.  `rendering`: of the frame before, whose memory
/// this one takes.  `warned`: what has been warned of; a frame says what is new.
Json render_frame(const Job& job, int frame, Rendering& rendering, std::vector<std::string>& warned) {
    const RenderArguments& a = job.arguments;
    const Plan plan = plan_asked_for(job.scene, job.volume, frame);
    if (a.bound)
        if (const auto obstacle = what_is_not_bounded(plan)) throw InputError("--bound: " + *obstacle);
    const RenderStatistics nothing;
    const std::int64_t needed = memory_of(plan, nothing).total();
    refuse_beyond(a.max_memory, needed, "the scene");

    std::optional<ProgressBar> bar(std::in_place, !a.quiet);
    RenderOptions options = a.options;
    options.cancelled = &interrupted;
    options.audit = a.options.audit || !a.profile.empty();
    if (a.max_memory > 0) options.layout_bytes = a.max_memory - needed;
    options.progress = [&](double part) { (*bar)(part); };
    Errors errors;
    Certificate certificate;
    std::string page;
    {
        const Interruptible here;
        render(plan, options, rendering);
        options.progress = nullptr;
        bar.reset();
        if (a.error || a.exact) {
            const ErrorRays rays = a.exact ? ErrorRays::all : ErrorRays::enough;
            if (!a.quiet) say(price_of_errors(plan, rendering.statistics, rays));
            errors = rounding_errors(plan, rendering.image, options, frame, rays);
        }
        const auto obstacle = a.profile.empty() ? std::nullopt : what_is_not_bounded(plan);
        if (a.bound || (!a.profile.empty() && !obstacle)) {
            ProgressBar proof(!a.quiet, "proof");
            certificate = certify(plan, {.threads = options.threads,
                                         .channels = a.bound && !job.output.empty(),
                                         .known = a.profile.empty(),
                                         .every = a.bound ? 1 : every_for_some_rays(plan),
                                         .cancelled = &interrupted,
                                         .progress = [&](double part) { proof(part); }});
        }
        if (!a.profile.empty()) {
            const sweep::Proof proof = obstacle ? sweep::Proof(*obstacle) : sweep::Proof(certificate);
            page = sweep::report_html(sweep::profile_data(plan, rendering, proof, a.command), "");
        }
        if (a.reference || !a.reference_output.empty()) {
            ProgressBar second(!a.quiet);
            ReferenceOptions exact{.threads = options.threads, .cancelled = &interrupted};
            exact.progress = [&](double part) { second(part); };
            const Image reference = render_reference(plan, exact);
            if (a.reference) errors.against_reference = compare_colors(rendering.image, reference);
            if (!a.reference_output.empty()) write_reference(job, plan, reference, frame);
        }
    }
    const int frames = job.scene.camera.turntable;
    const std::string exr = frame_path(job.output, frame, frames),
                      png = frame_path(job.preview, frame, frames);
    if (!exr.empty()) {
        // The bounds' channels stand beside the picture's while they are written.
        std::vector<Channel>& channels = rendering.image.channels;
        const auto own = static_cast<std::ptrdiff_t>(channels.size());
        for (Channel& channel : certificate.image.channels) channels.push_back(std::move(channel));
        write_exr(rendering.image, exr, exr_attributes(plan, frame));
        channels.erase(channels.begin() + own, channels.end());
    }
    if (!png.empty()) {
        const Vec3& b = job.scene.image.background;
        const double background[3] = {b.x, b.y, b.z};
        write_preview(rendering.image, png, background);
    }
    if (!page.empty()) write_text_whole(frame_path(a.profile, frame, frames), page);
    const bool measured = a.error || a.exact || a.reference;
    const std::size_t warned_before = warned.size();
    for (const std::string& warning : warnings_of(plan, rendering))
        if (std::find(warned.begin(), warned.end(), warning) == warned.end()) warned.push_back(warning);
    if (!a.quiet) {
        const RenderStatistics& s = rendering.statistics;
        say(fmt::format("{}: {}x{} pixels, {} ({}), {:.2f} s, {} samples on {} rays, {} thread{}\n",
                        !exr.empty()             ? exr
                        : !png.empty()           ? png
                        : job.scene.name.empty() ? "built-in scene"
                                                 : job.scene.name,
                        plan.camera.width, plan.camera.height, s.path, s.why, s.seconds,
                        text_of_count(s.samples), text_of_count(s.rays), s.threads,
                        s.threads == 1 ? "" : "s"));
        if (const std::string refined = text_of(s.refined, s.visited); !refined.empty())
            say(fmt::format("  slabs refined: {} of {}\n", refined, text_of_count(s.visited)));
        for (std::size_t w = frame == 0 ? 0 : warned_before; w < warned.size(); ++w)
            say(fmt::format("  warning: {}\n", message_text(warned[w])));
        if (measured) say(error_text(errors));
        if (a.bound) say(bound_text(certificate));
    }
    if (a.options.audit && a.json != "-" && a.profile.empty()) print(audit_text(plan, rendering.statistics));
    Json record = json_of(plan, rendering, measured ? &errors : nullptr, a.options.audit);
    if (a.bound) record["bound"] = json_of(certificate);
    record["frame"] = frame;
    if (frame == 0) record["wires"] = json_of_wires(plan);
    return record;
}

/// The command that makes a film of a turntable's pictures.
std::string film_line(const Job& job) {
    const bool linear = job.preview.empty();
    std::filesystem::path frames(linear ? job.output : job.preview), film = frames;
    const std::string extension = frames.extension().string();
    frames.replace_extension(".%04d" + extension);
    film.replace_extension(".mp4");
    return fmt::format("film: ffmpeg -framerate 25 {}-i '{}' -pix_fmt yuv420p '{}'\n",
                       linear ? "-apply_trc iec61966_2_1 " : "", frames.string(), film.string());
}

std::string default_output(const RenderArguments& a) {
    if (!a.preview.empty() || !a.json.empty() || a.options.audit || !a.profile.empty()) return {};
    return a.scene.file.empty() ? "squint.exr" : std::filesystem::path(a.scene.file).stem().string() + ".exr";
}

int run_on_these_threads(const RenderArguments& a) {
    if (a.scene_reference) return print(scene_reference_markdown()), kDone;
    std::string output = a.output.empty() ? default_output(a) : a.output, preview = a.preview;
    check_output(output, "-o", kPictures);
    check_output(preview, "--preview", kPreviews);
    check_output(a.reference_output, "--reference-output", kExr);
    check_output(a.profile, "--profile", kPages);
    if (a.json != "-") check_output(a.json, "--json", {});
    if (ends_in(output, kPreviews)) {
        if (!preview.empty())
            throw InputError(
                fmt::format("-o {}: a second preview beside --preview {}; allowed: .exr", output, preview));
        preview = std::exchange(output, "");
    }

    Scene scene = read(a.scene);
    if (a.print_scene) {
        std::vector<std::string> unread, warnings;
        load_and_complete(a.scene, scene, unread, warnings, a.max_memory, !a.quiet);
        return print(to_toml(scene)), kDone;
    }
    const bool audited = a.options.audit || !a.profile.empty();
    if (audited && rounds_nothing(scene.precision.preset))
        throw InputError(fmt::format(
            "--audit, --profile: precision.preset is \"{}\", which rounds no wire; allowed: any other preset",
            scene.precision.preset));
    refuse_beyond(a.max_memory, image_bytes(scene),
                  fmt::format("a picture of {}x{} pixels", scene.image.width, scene.image.height));
    std::vector<std::string> notes, warned;  // of formats first
    const auto volume = load_and_complete(a.scene, scene, notes, warned, a.max_memory, !a.quiet);
    const Job job{a, scene, volume, output, preview};
    if (!a.quiet)
        for (const std::string& note : notes) say(fmt::format("  note: {}\n", message_text(note)));

    Json pictures = Json::array();
    Rendering rendering;
    for (int frame = 0; frame < scene.camera.turntable; ++frame)
        pictures.push_back(render_frame(job, frame, rendering, warned));
    if (scene.camera.turntable > 1 && !a.quiet && !(output.empty() && preview.empty())) say(film_line(job));
    if (a.json.empty()) return kDone;
    Json record{{"schema", "squint.render/2"},
                {"version", version()},
                {"scene", json_of_scene(scene)},
                {"volume", json_of(*job.volume)},
                {"real", rounds_nothing(scene.precision.preset)},
                {"wires", pictures[0]["wires"]},
                {"warnings", warned},
                {"notes", notes},
                {"pictures", Json::array()}};
    for (Json& picture : pictures) picture.erase("wires"), record["pictures"].push_back(picture);
    write_json(a.json, record);
    return kDone;
}

int run(const RenderArguments& a) {
    return on_threads_asked_for(a.options.threads, [&] { return run_on_these_threads(a); });
}

void flags(Flags& f, RenderArguments& a) {
    add_scene(f, a.scene);
    f.add("-o,--output", a.output,
          "EXR to write, or PNG or JPEG as --preview does; when left out and nothing else is asked "
          "for, the scene's "
          "name with .exr; a turntable writes OUT.0000.exr and so on")
        .value("OUT.exr|png|jpg");
    f.add("--preview", a.preview, "PNG or JPEG to write: over the background, encoded as sRGB")
        .value("OUT.png|jpg");
    f.add("--print-scene", a.print_scene,
          "Print the scene as TOML, with what was chosen from the data, and stop");
    f.add("--json", a.json,
          "Write a record of the picture (schema squint.render/2): time, samples, path, memory, hash")
        .value("FILE|-");
    f.add("--error", a.error,
          "Measure the error against the same scene in double, and each stage's share; of pictures of more "
          "than "
          "16,000 pixels the shares by some of these, and all by floats where their error does not show");
    f.add("--error-exact", a.exact,
          "As --error, every pixel in double: up to eight more pictures, and slow ones");
    f.add("--bound", a.bound,
          "Prove how far any pixel can be from the same scene without rounding, who pays for it, and which "
          "rays "
          "are undecided; the EXR gets the channels bound.R, bound.G, bound.B, bound.A (docs/guarantees.md)");
    f.add("--reference", a.reference, "Measure the error against the exact integral along each ray");
    f.add("--reference-output", a.reference_output, "Write that integral's picture as EXR").value("OUT.exr");
    f.add("--audit", a.options.audit,
          "Count what every wire carried: least, greatest, inexact, underflowed to zero, saturated, wrapped");
    f.add("--profile", a.profile,
          "Write a page: what every wire carried and can carry, its share of the bound, and the format that "
          "would be enough (docs/guarantees.md)")
        .value("PAGE.html");
    a.command = f.command();
    f.add("--threads", a.options.threads, "Threads; default: one a processor").between(1, 4096).value("N");
    f.add("--tile", a.options.tile, "Pixels on a side of a thread's piece of work")
        .between(1, 65536)
        .value("N")
        .shows_default();
    f.choose("--path", {"auto", "model", "lanes"}, a.options.path,
             "auto, model (one sample at a time) or lanes (SIMD): the same bits");
    f.add("--target", a.options.target, "SIMD target of the lanes; `squint doctor` lists them").value("NAME");
    f.choose("--layout", {std::begin(EnumNames<LayoutRule>::names), std::end(EnumNames<LayoutRule>::names)},
             a.options.layout, "How voxels lie in memory for the lanes: auto, linear or cells");
    f.clear("--no-skip", a.options.skip, "Visit empty space too");
    f.read(
         "--max-memory", [&](const std::string& text) { a.max_memory = size_of(text, "--max-memory"); },
         "Refuse a scene that needs more, as in 2G; mapped files do not count, layouts take what is left")
        .value("SIZE");
    f.add("-q,--quiet", a.quiet, "No progress, no summary");
    f.add("--scene-reference", a.scene_reference, "Print docs/scene.md, every key of a scene, and stop");
}

}  // namespace

namespace verbs {
extern const Verb render{
    .name = "render",
    .heading = "Pictures",
    .help = "Render a scene or a volume to EXR, PNG or JPEG",
    .footer =
        "Examples:\n"
        "  squint render scan.nii.gz -o scan.png\n"
        "  squint render -o head.exr --preview head.png --error\n"
        "  squint render head.toml --set precision.preset=squeeze --set sampling.step=0.5 -o squeeze.exr\n"
        "  squint render head.toml --set 'precision.transparency=u1.8 trn' --audit --json -",
    .describe = described<RenderArguments, flags, run>,
};
}

}  // namespace squint::cli
