// Writes scenes as records and TOML; finds where settings were given; expands paths; has the built-in scene.
#include "scene/scene.h"

#include "core/error.h"
#include "scene/text.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>

namespace squint {

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
    scene.volume.procedural = "phantom";  // 128^3 of 12 bits unless said otherwise
    // The phantom's matter, as levels of 0 to 4095: skin 655, tissue 1310, bone 2252, brain 2948, vessels
    // 3849.
    scene.transfer_function.points = {
        {300, 0.95, 0.55, 0.35, 0},      {560, 0.95, 0.55, 0.35, 0.045},  {800, 0.95, 0.45, 0.28, 0.045},
        {1000, 0.85, 0.30, 0.20, 0.003}, {1500, 0.85, 0.30, 0.20, 0.003}, {1700, 1.00, 0.93, 0.78, 0},
        {2150, 1.00, 0.93, 0.78, 0.12},  {2400, 1.00, 0.93, 0.78, 0.12},  {2650, 0.80, 0.70, 0.70, 0.001},
        {3200, 0.90, 0.05, 0.04, 0.001}, {3450, 0.90, 0.03, 0.03, 0.6},   {4095, 0.90, 0.03, 0.03, 0.6},
    };
    scene.transfer_function.unit_distance = 1;
    scene.classification.method = Method::pips;  // post-classification draws rings on the skull
    scene.camera.height = 132;                   // the head fills the picture
    scene.lights = {{.direction = Vec3(-0.2, -1, 0.9)}};
    scene.shading = {.ka = 0.3, .kd = 0.8, .ks = 0.3};
    return scene;
}

}  // namespace squint
