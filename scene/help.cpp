// Writes --help and docs/scene.md from the list of settings.
#include "scene/rules.h"
#include "scene/text.h"

#include <algorithm>
#include <array>

namespace squint {
namespace {

constexpr std::string_view kLightsHelp =
    "[[lights]] tables, at most 8; \"headlight\" for one headlight; none: unlit";

}  // namespace

std::string scene_help() {
    std::vector<std::array<std::string, 3>> rows;
    const Scene defaults;
    visit_scene(defaults, [&](std::string_view key, const auto& setting, std::string_view help) {
        if (key == "shading.model") rows.push_back({"lights", "[]", std::string(kLightsHelp)});
        rows.push_back({std::string(key), is_absent(setting) ? "" : text_of(setting), std::string(help)});
    });
    std::size_t key_width = 0, default_width = 0;
    for (const auto& [key, value, help] : rows)
        key_width = std::max(key_width, key.size()), default_width = std::max(default_width, value.size());
    std::string text;
    for (const auto& [key, value, help] : rows)
        text += fmt::format("{:<{}}  {:<{}}  {}\n", key, key_width, value, default_width, help);
    return text;
}

namespace {

constexpr std::string_view kReferenceHead = R"(# Scene files, key by key

<!-- Written by `squint render --scene-reference > docs/scene.md`; do not edit. -->

A scene is a TOML file that says everything that decides a picture. Every key can also be set on the command line, and the
value given last wins:

    squint render head.toml --set sampling.step=0.5 --set classification.method=pips --set 'precision.sample=u12.8 rnd'

- Values on the command line are written as in TOML; a bare word or a path needs no quotes. A list or a table works too:
  `--set 'lights=[{headlight=true}]'`. Of settings that exclude each other (`volume.file` and `volume.procedural`; the ways to
  give a transfer function) the one given last replaces the others. A preset or Slicer's file then brings its own
  `unit_distance`, unless one was given with `--set` before it.
- `"auto"` takes a setting without a default below back to what it is when left out.
- Paths (`volume.file`, `transfer_function.file`, `precision.preset`) are relative to the scene file's folder, also when given
  on the command line; without a scene file they are relative to the current folder. `${NAME}` is replaced from the
  environment. Records keep the path as written.
- A file is UTF-8 without control characters but tabs and line breaks.
- An error is one line: `head.toml:7:1: unknown setting "sampel"; did you mean "sample"?`

What the words mean is in the pages on the pipeline; the least scene is this:

    [transfer_function]
    unit_distance = 1.0          # an alpha below is that of one world unit of matter
    points = [
        # value   r    g    b   alpha
        [ 1000, 1.0, 0.9, 0.8, 0.0],
        [ 1200, 1.0, 0.9, 0.8, 0.3],
    ]
)";

constexpr std::pair<std::string_view, std::string_view> kSections[] = {
    {"volume", "Where the voxels come from: one of `file` and `procedural`."},
    {"transfer_function",
     "Exactly one of `points`, `color` with `opacity`, `preset`, `file`. Values are in the volume's own "
     "units (HU for CT where "
     "declared). Colour and alpha are linear between points and constant outside. `unit_distance` is "
     "required, but for "
     "presets and Slicer's files (`.vp`, `.vp.json`), which bring one; 0 stands for theirs."},
    {"camera", "What is left out is chosen so that the whole volume is in the picture."},
    {"image", ""},
    {"sampling", ""},
    {"clip", "Rays are cut to this box before they are sampled."},
    {"shading", "Used where there is at least one light."},
    {"classification", ""},
    {"compositing", ""},
    {"output", "Channels beside R, G, B, A."},
    {"precision",
     "A preset gives every wire its spec: a format, a rounding (`trn`, `trn_zero`, `rnd`, `rnd_conv`) and an "
     "overflow rule "
     "(`sat`, `wrap`), as in `\"u1.15 rnd_conv sat\"`. A wire's own line replaces the parts it names. A "
     "preset file is TOML with one table, `[precision]`: a built-in `preset` and wires; the scene's wires "
     "lie over it."},
};

std::string cell(std::string text) {
    for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, "\\");
    return text;
}

constexpr std::string_view kTableHead = "| key | default | allowed | meaning |\n|---|---|---|---|\n";

template <class T>
std::string allowed_cell(std::string_view key) {
    // The page describes a wire's Spec above its table.
    return std::is_same_v<T, std::optional<std::string>> ? "a spec" : allowed_text<T>(key);
}

template <class T>
std::string table_row(std::string_view key, std::string_view name, const T& setting, std::string_view help) {
    return fmt::format("| `{}` | {} | {} | {} |\n", name,
                       is_absent(setting) ? "" : "`" + text_of(setting) + "`", cell(allowed_cell<T>(key)),
                       cell(std::string(help)));
}

std::string lights_reference() {
    std::string text = fmt::format(
        "\n## [[lights]]\n\nA table for each directional light, at most {}. `lights = \"headlight\"` stands "
        "for one headlight, "
        "`lights = []` for none: the scene is unlit.\n\n{}",
        kMostLights, kTableHead);
    const Light light;
    visit_light(light, [&](std::string_view name, const auto& setting, std::string_view help) {
        text += table_row("lights." + std::string(name), name, setting, help);
    });
    return text;
}

}  // namespace

std::string scene_reference_markdown() {
    std::string text(kReferenceHead);
    std::string section;
    const Scene defaults;
    visit_scene(defaults, [&](std::string_view key, const auto& setting, std::string_view help) {
        if (section_of(key) != section) {
            section = section_of(key);
            if (section == "shading") text += lights_reference();
            text += fmt::format("\n## [{}]\n\n", section);
            for (const auto& [name, about] : kSections)
                if (name == section && !about.empty()) text += fmt::format("{}\n\n", about);
            text += kTableHead;
        }
        text += table_row(key, name_in_section(key), setting, help);
    });
    return text;
}

}  // namespace squint
