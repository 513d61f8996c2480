// Scene -> texts: records, TOML, help and the reference page; paths and the built-in scene.
#include "pipeline/scene.h"

#include "core/error.h"
#include "pipeline/scene_rules.h"
#include "pipeline/toml.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>

namespace squint {
namespace {

template <class E>
requires std::is_enum_v<E> std::string text_of(E value) {
    return toml_text(name_of(value));
}
template <class I>
requires(std::is_integral_v<I>) std::string text_of(I value) {
    if constexpr (std::is_same_v<I, bool>)
        return toml_text(value);
    else
        return toml_text(static_cast<std::int64_t>(value));
}
std::string text_of(double value) {
    return toml_text(value);
}
std::string text_of(const std::string& value) {
    return toml_text(std::string_view(value));
}
std::string text_of(const Vec3& v) {
    return fmt::format("[{}, {}, {}]", toml_text(v.x), toml_text(v.y), toml_text(v.z));
}
std::string text_of(const Light& light);
template <class T>
std::string text_of(const std::vector<T>& list) {
    std::string text = "[";
    for (const T& item : list) text += (text.size() > 1 ? ", " : "") + text_of(item);
    return text + "]";
}
template <class T>
std::string text_of(const std::optional<T>& value) {
    return value ? text_of(*value) : "\"auto\"";
}

std::string text_of(const Light& light) {
    std::string text;
    visit_light(light, [&](std::string_view name, const auto& setting, std::string_view) {
        text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", name, text_of(setting));
    });
    return "{ " + text + " }";
}

template <class T>
bool is_absent(const T&) {
    return false;
}
template <class T>
bool is_absent(const std::optional<T>& value) {
    return !value;
}

std::string_view section_of(std::string_view key) {
    return key.substr(0, key.find('.'));
}
std::string_view name_in_section(std::string_view key) {
    return key.substr(key.find('.') + 1);
}

constexpr std::string_view kLightsHelp =
    "[[lights]] tables, at most 8; \"headlight\" for one headlight; none: unlit";

}  // namespace

// --- Records -------------------------------------------------------------------------------------

std::vector<std::pair<std::string, std::string>> resolved(const Scene& scene) {
    std::vector<std::pair<std::string, std::string>> record;
    visit_scene(scene, [&](std::string_view key, const auto& setting, std::string_view) {
        if (key == "shading.model") record.emplace_back("lights", text_of(scene.lights));
        record.emplace_back(key, text_of(setting));
    });
    return record;
}

bool operator==(const Scene& a, const Scene& b) {
    return resolved(a) == resolved(b);
}

std::string to_toml(const Scene& scene) {
    std::string text;
    std::string section;
    visit_scene(scene, [&](std::string_view key, const auto& setting, std::string_view) {
        if (is_absent(setting)) return;
        if (key == "shading.model")
            for (const Light& light : scene.lights) {
                text += "\n[[lights]]\n";
                visit_light(light, [&](std::string_view name, const auto& value, std::string_view) {
                    text += fmt::format("{} = {}\n", name, text_of(value));
                });
            }
        if (section_of(key) != section) {
            section = section_of(key);
            text += fmt::format("{}[{}]\n", text.empty() ? "" : "\n", section);
        }
        text += fmt::format("{} = {}\n", name_in_section(key), text_of(setting));
    });
    return text;
}

// --- Help and the reference page -----------------------------------------------------------------

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
  give a transfer function) the one given last replaces the others. A preset or a `.vp` file then brings its own
  `unit_distance`, unless one was given with `--set` before it.
- `"auto"` takes a setting without a default below back to what it is when left out.
- Paths (`volume.file`, `transfer_function.file`, `precision.preset`) are relative to the scene file's folder, also when given
  on the command line; without a scene file they are relative to the current folder. `${NAME}` is replaced from the
  environment. Records keep the path as written.
- A file holds printable ASCII, tabs and line breaks; other characters are written `\u00e9` in strings.
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
     "presets and `.vp` files, which bring one; 0 stands for theirs."},
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
    // A wire's Spec is described above its table.
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

// --- Places and paths ----------------------------------------------------------------------------

std::string where(const Scene& scene, std::string_view key) {
    const auto given = scene.given_at.find(key);
    if (given != scene.given_at.end())
        return given->second == "--set" ? fmt::format("--set {}", key)
                                        : fmt::format("{}: {}", given->second, key);
    return fmt::format("{}: {}", scene.name.empty() ? "scene" : scene.name, key);
}

std::string expand_path(const std::string& text, const std::string& folder, const std::string& setting) {
    std::string path;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t start = text.find("${", at);
        path += text.substr(at, start - at);
        if (start == std::string::npos) break;
        const std::size_t end = text.find('}', start);
        if (end == std::string::npos)
            throw InputError(fmt::format("{}: found {}, where ${{ is not closed; allowed: ${{NAME}}", setting,
                                         in_quotes(text)));
        const std::string name = text.substr(start + 2, end - start - 2);
        const char* value = std::getenv(name.c_str());
        if (value == nullptr || *value == '\0')
            throw InputError(
                fmt::format("{}: found {}, but the variable {} is not set; allowed: variables that are, as "
                            "in {}=FOLDER squint ...",
                            setting, in_quotes(text), name, name));
        path += value;
        at = end + 1;
    }
    if (path.empty() || folder.empty() || std::filesystem::path(path).is_absolute()) return path;
    return (std::filesystem::path(folder) / path).string();
}

VolumeSource volume_source(const Scene& scene) {
    VolumeSource source = scene.volume;
    source.file = expand_path(source.file, scene.folder, where(scene, "volume.file"));
    return source;
}

// --- The built-in scene --------------------------------------------------------------------------

Scene built_in_scene() {
    Scene scene;
    scene.name = "built-in scene";
    scene.volume.procedural = "phantom";
    scene.volume.dims = {128, 128, 128};
    scene.volume.bits = 12;
    // The phantom's matter, in levels of 0 to 4095: skin 655, tissue 1310, bone 2252, brain 2948, vessels
    // 3849.
    scene.transfer_function.points = {
        {300, 0.90, 0.62, 0.48, 0},      {600, 0.90, 0.62, 0.48, 0.03},   {800, 0.85, 0.50, 0.38, 0.03},
        {1000, 0.80, 0.40, 0.32, 0.004}, {1500, 0.80, 0.40, 0.32, 0.004}, {1700, 0.95, 0.90, 0.78, 0},
        {2150, 0.95, 0.90, 0.78, 0.10},  {2400, 0.95, 0.90, 0.78, 0.10},  {2650, 0.80, 0.70, 0.70, 0.001},
        {3200, 0.85, 0.10, 0.08, 0.001}, {3450, 0.85, 0.06, 0.05, 0.6},   {4095, 0.85, 0.06, 0.05, 0.6},
    };
    scene.transfer_function.unit_distance = 1;
    scene.camera.projection = Projection::perspective;
    scene.lights = {{.direction = Vec3(-0.5, -1, 0.9)}};
    return scene;
}

}  // namespace squint
