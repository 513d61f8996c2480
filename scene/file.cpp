// Reads scene files and `key=value` overrides.  Checks every value where it is given.
#include "core/error.h"
#include "scene/rules.h"
#include "scene/scene.h"
#include "scene/text.h"
#include "scene/toml.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

namespace squint {
namespace {

using Kind = TomlValue::Kind;
using Rows = std::vector<std::vector<double>>;

/// A key for messages, on one line.
std::string bare(const std::string& key) {
    const std::string text = in_quotes(key);
    return text.substr(1, text.size() - 2);
}

/// Stores the values of one file, or of one override, in a scene.
class Reader {
  public:
    /// `file` names the file; empty for an override.
    Reader(Scene& scene, std::string file) : scene_(scene), file_(std::move(file)) {
        visit_scene(scene_, [&](std::string_view key, auto&, std::string_view) { keys_.emplace_back(key); });
    }

    void table(const TomlValue& table, const std::string& prefix) {
        for (const TomlValue& entry : table.items)
            setting(entry, prefix.empty() ? entry.key : prefix + '.' + entry.key);
    }
    void setting(const TomlValue& value, const std::string& key) {
        if (key == "lights") return lights(value);
        bool known = false;
        visit_scene(scene_, [&](std::string_view candidate, auto& setting, std::string_view) {
            if (candidate != key) return;
            known = true;
            assign(value, key, setting);
            note(value, key);
        });
        if (known) return;
        if (!is_section(key)) refuse_name(value, key);
        if (value.kind != Kind::table) refuse(value, key, described(value), "a table of settings");
        table(value, key);
    }

  private:
    // --- Messages --------------------------------------------------------------------------------

    std::string place(int line, int column) const { return fmt::format("{}:{}:{}", file_, line, column); }
    std::string place_of(const TomlValue& value, std::string_view key) const {
        return file_.empty() ? fmt::format("--set {}", key)
                             : fmt::format("{}: {}", place(value.line, value.column), key);
    }
    [[noreturn]] void refuse(const TomlValue& value, std::string_view key, std::string_view found,
                             std::string_view allowed) const {
        throw InputError(fmt::format("{}: found {}{}: {}{}", place_of(value, key), found,
                                     found.ends_with('?') ? " Allowed" : "; allowed", allowed,
                                     optional_ ? ", or \"auto\"" : ""));
    }
    bool is_section(const std::string& key) const {
        return std::any_of(keys_.begin(), keys_.end(),
                           [&](const std::string& k) { return k.starts_with(key + '.'); });
    }

    [[noreturn]] void refuse_name(const TomlValue& entry, const std::string& key) const {
        // The first part of the key that is unknown: of a.b.c on the command line it may be a.
        std::size_t end = key.find('.');
        while (end != std::string::npos && is_section(key.substr(0, end))) end = key.find('.', end + 1);
        const std::string wrong = key.substr(0, end);
        if (std::find(keys_.begin(), keys_.end(), wrong) != keys_.end() || wrong == "lights")
            refuse(entry, key, "a name below " + wrong, wrong + " itself");
        const std::size_t point = wrong.rfind('.');
        const std::string section = point == std::string::npos ? "" : wrong.substr(0, point);
        const std::string name = wrong.substr(point + 1);  // npos + 1 is 0

        std::set<std::string_view> beside;  // names in the same section
        std::string_view elsewhere;         // the same name in another section
        for (const std::string_view known : keys_) {
            if (section.empty())
                beside.insert(section_of(known));
            else if (known.starts_with(section + '.'))
                beside.insert(known.substr(section.size() + 1));
            if (elsewhere.empty() && known.ends_with('.' + name)) elsewhere = known;
        }
        if (section.empty()) beside.insert("lights");
        refuse_name(entry, key, name, section, {beside.begin(), beside.end()}, elsewhere);
    }
    [[noreturn]] void refuse_name(const TomlValue& entry, const std::string& key, const std::string& name,
                                  const std::string& section, const std::vector<std::string_view>& candidates,
                                  std::string_view elsewhere = {}) const {
        std::string_view near = nearest_name(name, candidates);
        if (near.empty()) near = elsewhere;
        throw InputError(fmt::format(
            "{}: unknown setting {}; {}",
            file_.empty() ? "--set " + bare(key) : place(entry.key_line, entry.key_column), in_quotes(name),
            near.empty()
                ? fmt::format("allowed{}: {}", section.empty() ? "" : " in " + section, listed(candidates))
                : fmt::format("did you mean \"{}\"?", near)));
    }
    void note(const TomlValue& value, const std::string& key) {
        scene_.given_at[key] = file_.empty() ? "--set" : place(value.line, value.column);
    }

    // --- Values, by the type of the setting ------------------------------------------------------

    void assign(const TomlValue& value, std::string_view key, std::string& setting) {
        const auto words = words_of(key);
        if (value.kind != Kind::string)
            refuse(value, key, described(value),
                   allowed_text<std::remove_reference_t<decltype(setting)>>(key));
        const bool known = std::find(words.begin(), words.end(), value.text) != words.end();
        const bool file = key == "precision.preset" && value.text.find_first_of("./$") != std::string::npos;
        if (!words.empty() && !known && !file && !(value.text.empty() && may_be_empty(key)))
            refuse_word(value, key, words, allowed_text<std::remove_reference_t<decltype(setting)>>(key));
        setting = value.text;
        if (file_.empty()) forget_rivals(key, setting);
    }
    template <class E>
    requires std::is_enum_v<E>
    void assign(const TomlValue& value, std::string_view key, E& setting) {
        const auto names = names_of<E>();
        if (value.kind != Kind::string)
            refuse(value, key, described(value),
                   allowed_text<std::remove_reference_t<decltype(setting)>>(key));
        const auto name = std::find(names.begin(), names.end(), value.text);
        if (name == names.end())
            refuse_word(value, key, names, allowed_text<std::remove_reference_t<decltype(setting)>>(key));
        setting = static_cast<E>(name - names.begin());
    }
    [[noreturn]] void refuse_word(const TomlValue& value, std::string_view key,
                                  const std::vector<std::string_view>& words,
                                  const std::string& allowed) const {
        const std::string_view near = nearest_name(value.text, words);
        refuse(value, key,
               in_quotes(value.text) + (near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)),
               allowed);
    }
    void assign(const TomlValue& value, std::string_view key, bool& setting) {
        if (value.kind != Kind::boolean)
            refuse(value, key, described(value),
                   allowed_text<std::remove_reference_t<decltype(setting)>>(key));
        setting = value.flag;
    }
    void assign(const TomlValue& value, std::string_view key, double& setting) {
        if (!is_number(value, key) || (key == "volume.scale" && value.number == 0))
            refuse(value, key, described(value),
                   allowed_text<std::remove_reference_t<decltype(setting)>>(key));
        setting = value.number;
    }
    template <class I>
    requires std::is_integral_v<I>
    void assign(const TomlValue& value, std::string_view key, I& setting) {
        if (value.kind != Kind::integer || !is_number(value, key))
            refuse(value, key, described(value),
                   allowed_text<std::remove_reference_t<decltype(setting)>>(key));
        setting = static_cast<I>(value.integer);
    }
    void assign(const TomlValue& value, std::string_view key, Vec3& setting) {
        if (value.kind != Kind::list || value.items.size() != 3 || !are_numbers(value, key))
            refuse(value, key, described(value),
                   allowed_text<std::remove_reference_t<decltype(setting)>>(key));
        setting = Vec3(value.items[0].number, value.items[1].number, value.items[2].number);
    }
    template <class T>
    void assign(const TomlValue& value, std::string_view key, std::optional<T>& setting) {
        if (value.kind == Kind::string && value.text == "auto") return setting.reset();
        T given{};
        optional_ = true;
        assign(value, key, given);
        if constexpr (std::is_same_v<T, std::string>) check_spec(value, key);
        optional_ = false;
        setting = given;
    }
    void assign(const TomlValue& value, std::string_view key, std::vector<double>& setting) {
        check_list(value, key, allowed_text<std::remove_reference_t<decltype(setting)>>(key));
        setting.clear();
        for (const TomlValue& item : value.items) setting.push_back(item.number);
        if (value.kind != Kind::list) setting.assign(3, value.number);
        if (key == "volume.window" && setting.size() == 2 && !(setting[0] < setting[1]))
            refuse(value, key, described(value), "two numbers, the first below the second");
    }
    void assign(const TomlValue& value, std::string_view key, std::vector<std::int64_t>& setting) {
        check_list(value, key, allowed_text<std::remove_reference_t<decltype(setting)>>(key));
        setting.clear();
        for (const TomlValue& item : value.items) {
            if (item.kind != Kind::integer)
                refuse(item, key, described(item),
                       allowed_text<std::remove_reference_t<decltype(setting)>>(key));
            setting.push_back(item.integer);
        }
        if (value.kind == Kind::number)
            refuse(value, key, described(value),
                   allowed_text<std::remove_reference_t<decltype(setting)>>(key));
        if (value.kind == Kind::integer) setting.assign(3, value.integer);
        if (setting.size() == 1) setting.assign(3, std::int64_t{setting[0]});
    }
    void assign(const TomlValue& value, std::string_view key, Rows& setting) {
        const std::string allowed = allowed_text<std::remove_reference_t<decltype(setting)>>(key);
        const std::size_t columns = key.ends_with("points") ? 5 : key.ends_with("color") ? 4 : 2;
        if (value.kind != Kind::list) refuse(value, key, described(value), allowed);
        Rows rows;
        for (const TomlValue& row : value.items) {
            const auto is_bad = [](const TomlValue& v) {
                return (v.kind != Kind::integer && v.kind != Kind::number) || !std::isfinite(v.number);
            };
            if (row.kind != Kind::list || row.items.size() != columns ||
                std::any_of(row.items.begin(), row.items.end(), is_bad))
                refuse(row, key, described(row), allowed);
            std::vector<double> numbers;
            for (const TomlValue& item : row.items) numbers.push_back(item.number);
            for (std::size_t i = 1; i < columns; ++i)
                if (numbers[i] < 0 || numbers[i] > 1)
                    refuse(row.items[i], key, described(row.items[i]), allowed);
            if (!rows.empty() && numbers[0] < rows.back()[0])
                refuse(row, key, fmt::format("value {} after {}", numbers[0], rows.back()[0]), allowed);
            rows.push_back(std::move(numbers));
        }
        setting = std::move(rows);
        if (file_.empty() && !setting.empty()) forget_rivals(key, "list");
    }

    void assign(const TomlValue& value, std::string_view key, ValueRange& setting) {
        ValueRange range;
        range.of_data = value.kind == Kind::string && value.text == "data";
        for (const TomlValue& item : value.items) range.ends.push_back(item.number);
        const bool two = range.ends.size() == 2 && are_numbers(value, key) && range.ends[0] < range.ends[1];
        if (!range.of_data && (value.kind != Kind::list || (!two && !range.ends.empty())))
            refuse(value, key, described(value), allowed_text<ValueRange>(key));
        setting = std::move(range);
    }

    bool is_number(const TomlValue& value, std::string_view key) const {
        return (value.kind == Kind::integer || value.kind == Kind::number) && std::isfinite(value.number) &&
               limits_of(key).hold(value.number);
    }
    bool are_numbers(const TomlValue& list, std::string_view key) const {
        return std::all_of(list.items.begin(), list.items.end(),
                           [&](const TomlValue& v) { return is_number(v, key); });
    }
    /// Checks the length of a list, or an empty list; one number is allowed where three equal ones may be
    /// written so.
    void check_list(const TomlValue& value, std::string_view key, const std::string& allowed) const {
        const auto counts = counts_of(key);
        const bool list = value.kind == Kind::list && are_numbers(value, key) &&
                          (value.items.empty() ||
                           std::find(counts.begin(), counts.end(), value.items.size()) != counts.end());
        const bool one = value.kind != Kind::list && counts[0] == 1 && is_number(value, key);
        if (!list && !one) refuse(value, key, described(value), allowed);
    }
    void check_spec(const TomlValue& value, std::string_view key) const {
        Spec spec;
        if (const std::string wrong = parse_spec(value.text, spec); !wrong.empty())
            refuse(value, key, in_quotes(value.text), allowed_text<std::string>(key));
    }

    // --- Lights ----------------------------------------------------------------------------------

    void lights(const TomlValue& value) {
        constexpr std::string_view kAllowed = "[[lights]] tables, \"headlight\", or [] for none";
        std::vector<Light> lights;
        if (value.kind == Kind::string && value.text == "headlight")
            lights.push_back({.headlight = true});
        else if (value.kind != Kind::list)
            refuse(value, "lights", described(value), kAllowed);
        if (value.items.size() > static_cast<std::size_t>(kMostLights))
            refuse(value, "lights", fmt::format("{} lights", value.items.size()),
                   fmt::format("at most {}", kMostLights));
        for (const TomlValue& item : value.items) {
            if (item.kind != Kind::table) refuse(item, "lights", described(item), kAllowed);
            lights.push_back(light(item));
        }
        scene_.lights = std::move(lights);
        note(value, "lights");
    }
    Light light(const TomlValue& table) {
        Light light;
        for (const TomlValue& entry : table.items) {
            std::vector<std::string_view> names;
            bool known = false;
            visit_light(light, [&](std::string_view name, auto& setting, std::string_view) {
                names.push_back(name);
                if (name != entry.key) return;
                known = true;
                assign(entry, "lights." + entry.key, setting);
            });
            if (!known) refuse_name(entry, "lights", entry.key, "lights", names);
            if (entry.key == "direction" && light.direction == Vec3(0, 0, 0))
                refuse(entry, "lights.direction", described(entry), "three numbers [x, y, z], not all zero");
        }
        return light;
    }

    // --- Of settings that exclude each other, the one given last wins -----------------------------

    void forget_rivals(std::string_view key, std::string_view given) {
        if (given.empty()) return;
        if (key == "volume.procedural") scene_.volume.file.clear();
        if (key == "volume.file") scene_.volume.procedural.clear();
        const auto beside = {"transfer_function.color_space", "transfer_function.map"};
        if (!key.starts_with("transfer_function.") ||
            std::find(beside.begin(), beside.end(), key) != beside.end())
            return;
        auto& tf = scene_.transfer_function;
        const std::string_view name = name_in_section(key);
        if (name != "points") tf.points.clear();
        if (name != "color" && name != "opacity") tf.color.clear(), tf.opacity.clear();
        if (name != "preset") tf.preset.clear();
        if (name != "file") tf.file.clear();
        // A preset and a .vp file bring their own unit_distance: one given for another function does not
        // apply.
        const auto unit = scene_.given_at.find("transfer_function.unit_distance");
        if (name != "file" || function_file(given) != FunctionFile::paraview) tf.map.clear();
        if ((name == "preset" || brings_unit_distance(function_file(given))) &&
            (unit == scene_.given_at.end() || unit->second != "--set"))
            tf.unit_distance = 0;
    }

    Scene& scene_;
    std::string file_;
    bool optional_ = false;  // the setting being assigned may also be "auto"
    std::vector<std::string> keys_;
};

// --- What only several settings together can show ------------------------------------------------

[[noreturn]] void refuse(const Scene& scene, std::string_view key, std::string_view found,
                         std::string_view allowed) {
    throw InputError(fmt::format("{}: found {}; allowed: {}", where(scene, key), found, allowed));
}

void check_transfer_function(const Scene& scene) {
    const auto& tf = scene.transfer_function;
    std::vector<std::string_view> given;
    if (!tf.points.empty()) given.push_back("points");
    if (!tf.color.empty() || !tf.opacity.empty()) given.push_back("color with opacity");
    if (!tf.preset.empty()) given.push_back("preset");
    if (!tf.file.empty()) given.push_back("file");
    constexpr std::string_view kOne = "exactly one of points, color with opacity, preset, file";
    if (given.size() > 1)
        refuse(scene, "transfer_function", fmt::format("{} and {}", given[0], given[1]), kOne);
    for (const std::string_view list : {"points", "color", "opacity"})
        if (const std::string key = fmt::format("transfer_function.{}", list);
            given.empty() && scene.given_at.contains(key))
            refuse(scene, key, "an empty list", kOne);
    if (given.empty() && !scene.volume.file.empty()) return;  // the data bring one
    if (given.empty()) refuse(scene, "transfer_function", "none", kOne);
    if (tf.color.empty() != tf.opacity.empty())
        refuse(scene, tf.color.empty() ? "transfer_function.opacity" : "transfer_function.color",
               tf.color.empty() ? "no color" : "no opacity", "color and opacity together");
    if (!tf.file.empty() && function_file(tf.file) == FunctionFile::unknown)
        refuse(scene, "transfer_function.file", in_quotes(tf.file),
               "a ParaView colour map (.json), a Slicer volume property (.vp, .vp.json) or an ImageVis3D "
               "function "
               "(.1dt)");
    if (!tf.map.empty() && function_file(tf.file) != FunctionFile::paraview)
        refuse(scene, "transfer_function.map", in_quotes(tf.map), "a name beside a ParaView file (.json)");
    const bool brings_unit = !tf.preset.empty() || brings_unit_distance(function_file(tf.file));
    if (tf.unit_distance == 0 && !brings_unit)
        refuse(scene, "transfer_function.unit_distance",
               scene.given_at.contains("transfer_function.unit_distance") ? "0" : "none",
               "a number above 0, the world units of matter that an alpha is given for");
}

void check_together(const Scene& scene) {
    const auto& volume = scene.volume;
    if (volume.file.empty() == volume.procedural.empty())
        refuse(scene, "volume", volume.file.empty() ? "neither file nor procedural" : "file and procedural",
               "one of them");
    check_transfer_function(scene);
    const auto& clip = scene.clip;
    if (clip.low && clip.high)
        for (int axis = 0; axis < 3; ++axis)
            if (!((*clip.low)[axis] < (*clip.high)[axis]))
                refuse(scene, "clip.high",
                       fmt::format("{} along {}, but clip.low has {}", (*clip.high)[axis], "xyz"[axis],
                                   (*clip.low)[axis]),
                       "a corner above clip.low along each axis");
    if (scene.camera.up && *scene.camera.up == Vec3(0, 0, 0))
        refuse(scene, "camera.up", "[0, 0, 0]", "three numbers [x, y, z], not all zero");
}

void apply_override(Scene& scene, const std::string& text) {
    const std::size_t equals = text.find('=');
    std::string key = text.substr(0, equals);
    key.erase(0, key.find_first_not_of(' '));
    key.erase(key.find_last_not_of(' ') + 1);
    const std::string head = "--set " + (key.empty() ? std::string("=") : bare(key));
    if (equals == std::string::npos || key.empty())
        throw InputError(head + ": found no value; allowed: key=value");
    std::string written = text.substr(equals + 1);
    written.erase(0, written.find_first_not_of(" \t"));
    written.erase(written.find_last_not_of(" \t\n") + 1);
    if (written.empty())
        throw InputError(head + ": found no value; allowed: a value as in TOML (\"\" for an empty text)");
    TomlValue value;
    try {
        const TomlValue whole = parse_toml("value = " + written, head);
        if (whole.items.size() != 1) throw InputError(head + ": found more than one value; allowed: one");
        value = whole.items[0];
    } catch (const InputError& error) {
        // A bare word or a path; a text that begins like TOML is TOML.
        const auto plain = [](char c) { return static_cast<unsigned char>(c) >= 0x20 && c != 0x7f; };
        if (std::string_view("[{\"'").find(written[0]) != std::string_view::npos ||
            !std::all_of(written.begin(), written.end(), plain))
            throw InputError(
                fmt::format("{}: found {}, which is not a value; allowed: a value as in TOML, or a bare word",
                            head, in_quotes(written)));
        value.kind = Kind::string;
        value.text = written;
    }
    Reader(scene, "").setting(value, key);
}

bool is_preset_file(const std::string& preset) {
    return std::find(std::begin(kPrecisionPresets), std::end(kPrecisionPresets), preset) ==
           std::end(kPrecisionPresets);
}

/// Merges wires: "rnd" over "u1.12 trn" gives "u1.12 rnd"; a part absent above is taken from below.
std::optional<std::string> merged(const std::optional<std::string>& under,
                                  const std::optional<std::string>& over) {
    std::string format, rounding, overflow;
    std::istringstream words(under.value_or("") + ' ' + over.value_or(""));
    for (std::string word; words >> word;) {
        Rounding r{};
        Overflow o{};
        (parse_rounding(word, r).empty()   ? rounding
         : parse_overflow(word, o).empty() ? overflow
                                           : format) = word + ' ';
    }
    std::string text = format + rounding + overflow;
    if (text.empty()) return std::nullopt;
    text.pop_back();
    return text;
}

Scene scene_from(const TomlValue& table, const std::string& name, const std::string& folder,
                 const std::vector<std::string>& overrides) {
    Scene scene;
    scene.name = name;
    scene.folder = folder;
    Reader(scene, name).table(table, "");
    // A file replaces the default volume.
    if (!scene.volume.file.empty() && !scene.given_at.contains("volume.procedural"))
        scene.volume.procedural.clear();
    return scene_with(std::move(scene), overrides);
}

}  // namespace

Scene parse_scene(std::string_view text, const std::string& name, const std::string& folder,
                  const std::vector<std::string>& overrides) {
    return scene_from(parse_toml(text, name), name, folder, overrides);
}

Scene read_scene(const std::string& path, const std::vector<std::string>& overrides) {
    return scene_from(read_toml(path), path, std::filesystem::path(path).parent_path().string(), overrides);
}

Scene scene_with(Scene base, const std::vector<std::string>& overrides) {
    for (const std::string& text : overrides) apply_override(base, text);
    check_together(base);
    return base;
}

PrecisionSettings resolved_precision(const Scene& scene) {
    PrecisionSettings precision = scene.precision;
    if (!is_preset_file(precision.preset)) return precision;
    const std::string at = where(scene, "precision.preset");
    const std::string path = expand_path(precision.preset, scene.folder, at);
    const TomlValue table = read_toml(path);
    for (const TomlValue& entry : table.items)
        if (entry.key != "precision")
            throw InputError(fmt::format("{}:{}:{}: found {}; allowed in a preset file: [precision] only",
                                         path, entry.key_line, entry.key_column, in_quotes(entry.key)));
    Scene under;
    Reader(under, path).table(table, "");
    if (is_preset_file(under.precision.preset))
        throw InputError(
            fmt::format("{}: precision.preset: found {}; allowed in a preset file: a built-in preset", path,
                        in_quotes(under.precision.preset)));
    precision.preset = under.precision.preset;
    if (!scene.given_at.contains("precision.budget")) precision.budget = under.precision.budget;
    for (std::size_t i = 0; i < precision.override_.size(); ++i)
        precision.override_[i] = merged(under.precision.override_[i], precision.override_[i]);
    return precision;
}

}  // namespace squint
