#include "studies/sweep/sweep_file.h"

#include "core/error.h"
#include "scene/scene.h"
#include "scene/toml.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>

namespace squint::sweep {
namespace {

using Kind = TomlValue::Kind;
constexpr std::size_t kMostValues = 100'000;  // on an axis

class Reader {
  public:
    explicit Reader(SweepFile& sweep) : sweep_(sweep) {
        visit_scene(settings_of_,
                    [&](std::string_view key, const auto&, std::string_view) { keys_.emplace_back(key); });
        keys_.emplace_back("lights");
    }

    void read(const TomlValue& whole) {
        only(whole, {"title", "note", "scene", "scenes", "mode", "samples", "seed", "base", "axis", "wires",
                     "measure", "baselines"});
        if (const auto* v = whole.find("title")) sweep_.title = text(*v);
        if (const auto* v = whole.find("note")) sweep_.note = text(*v);
        if (const auto* v = whole.find("scene")) sweep_.scenes.push_back(text(*v));
        if (const auto* v = whole.find("scenes"))
            for (const TomlValue& item : list(*v)) sweep_.scenes.push_back(text(item));
        if (const auto* v = whole.find("base")) settings(*v, "", sweep_.overrides);
        if (const auto* v = whole.find("measure")) measure(*v);
        if (const auto* v = whole.find("baselines")) baselines(*v);
        if (const auto* v = whole.find("axis"))
            for (const TomlValue& item : list(*v)) axis(item);
        if (const auto* v = whole.find("wires")) wires(*v);
        mode(whole);
    }

  private:
    [[noreturn]] void refuse(const TomlValue& v, const std::string& what, std::string_view allowed) const {
        throw InputError(fmt::format("{}: {}; allowed: {}", place(v), what, allowed));
    }
    std::string place(const TomlValue& v) const {
        const bool keyed = v.key_line > 0;
        return fmt::format("{}:{}:{}", sweep_.name, keyed ? v.key_line : v.line,
                           keyed ? v.key_column : v.column);
    }
    [[noreturn]] void wrong(const TomlValue& v, std::string_view allowed) const {
        refuse(v, fmt::format("{}found {}", v.key.empty() ? "" : v.key + ": ", described(v)), allowed);
    }
    void only(const TomlValue& table, const std::vector<std::string_view>& names) const {
        if (table.kind != Kind::table) wrong(table, "a table");
        for (const TomlValue& entry : table.items)
            if (std::find(names.begin(), names.end(), entry.key) == names.end()) {
                const auto near = nearest_name(entry.key, names);
                throw InputError(fmt::format("{}: unknown setting {}{}", place(entry), in_quotes(entry.key),
                                             near.empty() ? "; allowed: " + listed(names)
                                                          : fmt::format("; did you mean \"{}\"?", near)));
            }
    }

    const std::string& text(const TomlValue& v) const {
        if (v.kind != Kind::string) wrong(v, "a text in quotes");
        return v.text;
    }
    bool flag(const TomlValue& v) const {
        if (v.kind != Kind::boolean) wrong(v, "true or false");
        return v.flag;
    }
    std::int64_t whole(const TomlValue& v, std::int64_t low, std::int64_t high) const {
        if (v.kind != Kind::integer || v.integer < low || v.integer > high)
            wrong(v, fmt::format("a whole number from {} to {}", low, high));
        return v.integer;
    }
    const std::vector<TomlValue>& list(const TomlValue& v) const {
        if (v.kind != Kind::list || v.items.empty()) wrong(v, "a list with at least one value");
        if (v.items.size() > kMostValues) wrong(v, fmt::format("at most {} values", kMostValues));
        return v.items;
    }
    static bool is_number(const TomlValue& v) { return v.kind == Kind::integer || v.kind == Kind::number; }

    void known(const TomlValue& v, const std::string& key) const {
        const std::vector<std::string_view> names(keys_.begin(), keys_.end());
        if (std::find(names.begin(), names.end(), key) != names.end()) return;
        const auto near = nearest_name(key, names);
        throw InputError(fmt::format(
            "{}: unknown setting {}{}", place(v), in_quotes(key),
            near.empty() ? "; docs/scene.md lists them" : fmt::format("; did you mean \"{}\"?", near)));
    }

    // Flattens tables, nested or with dotted keys, to key=value.
    void settings(const TomlValue& v, const std::string& prefix, std::vector<std::string>& out) const {
        if (v.kind != Kind::table) wrong(v, "a table of settings");
        for (const TomlValue& entry : v.items) {
            const std::string key = prefix.empty() ? entry.key : prefix + "." + entry.key;
            if (entry.kind == Kind::table)
                settings(entry, key, out);
            else
                known(entry, key), out.push_back(key + "=" + toml_text(entry));
        }
    }

    // A list, or { from, to, step } or { from, to, factor } with both ends included.
    std::vector<TomlValue> values(const TomlValue& v) const {
        if (v.kind != Kind::table) return list(v);
        only(v, {"from", "to", "step", "factor"});
        const TomlValue *from = v.find("from"), *to = v.find("to"), *step = v.find("step"),
                        *factor = v.find("factor");
        if (!from || !to || !is_number(*from) || !is_number(*to) || (step && factor) ||
            (step && !is_number(*step)) || (factor && !is_number(*factor)))
            wrong(v, "numbers { from, to, step } or { from, to, factor }");
        const bool integers = from->kind == Kind::integer && to->kind == Kind::integer &&
                              (!step || step->kind == Kind::integer) &&
                              (!factor || factor->kind == Kind::integer);
        const double by = step ? step->number : factor ? factor->number : 1;
        const double a = from->number, b = to->number;
        if (factor ? !(by > 0 && by != 1 && a > 0 && b > 0 && (by > 1) == (b > a || a == b))
                   : !(by != 0 && (by > 0 ? b >= a : b <= a)))
            wrong(v, "a step or factor that leads from `from` to `to`");
        std::vector<TomlValue> out;
        for (std::size_t i = 0;; ++i) {
            const auto n = static_cast<double>(i);
            const double x = factor ? a * std::pow(by, n) : a + n * by;
            const double slack = 1e-9 * std::abs(by) * (factor ? std::abs(b) : 1);
            if (by > 0 && (!factor || by > 1) ? x > b + slack : x < b - slack) break;
            if (out.size() == kMostValues) wrong(v, fmt::format("at most {} values", kMostValues));
            TomlValue item;
            item.kind = integers ? Kind::integer : Kind::number;
            item.number = x, item.integer = integers ? std::llround(x) : 0;
            if (integers) item.number = static_cast<double>(item.integer);
            item.line = v.line, item.column = v.column;
            out.push_back(std::move(item));
        }
        return out;
    }

    std::vector<Wire> wire_list(const TomlValue& v) const {
        std::vector<Wire> out;
        const auto add = [&](const TomlValue& item) {
            const std::string& name = text(item);
            if (Wire wire{}; find_wire(name, wire)) return out.push_back(wire);
            const std::size_t before = out.size();
            for (int w = 0; w < kWires; ++w)
                if (kWireInfo[static_cast<std::size_t>(w)].stage == name) out.push_back(static_cast<Wire>(w));
            if (out.size() > before) return;
            std::vector<std::string_view> names;
            for (const WireInfo& wire : kWireInfo) names.push_back(wire.name);
            const auto near = nearest_name(name, names);
            throw InputError(fmt::format("{}: no wire or stage {}; {}", place(item), in_quotes(name),
                                         near.empty() ? "docs/scene.md, [precision], lists them"
                                                      : fmt::format("did you mean \"{}\"?", near)));
        };
        if (v.kind == Kind::string)
            add(v);
        else
            for (const TomlValue& item : list(v)) add(item);
        return out;
    }

    static std::string label_of(const TomlValue& v) {
        return v.kind == Kind::string || is_number(v) ? toml_text(v)
                                                      : toml_text(std::string_view(toml_text(v)));
    }

    void axis(const TomlValue& v) {
        only(v, {"key", "keys", "values", "range", "zip", "wires", "fraction_bits", "fraction_offset",
                 "integer_bits", "integer_offset", "rounding", "overflow", "settings", "name", "cross"});
        Axis axis;
        axis.at = place(v);
        if (v.line > 0 && v.key_line == 0) axis.at = fmt::format("{}:{}:{}", sweep_.name, v.line, v.column);
        if (const auto* c = v.find("cross")) axis.cross = flag(*c);
        if (v.find("key"))
            plain(v, axis);
        else if (v.find("keys"))
            several(v, axis);
        else if (v.find("zip"))
            zip(v, axis);
        else if (v.find("settings"))
            named(v, axis);
        else if (v.find("wires"))
            of_wires(v, axis);
        else
            refuse(v, "an axis without what it varies", "key, keys, zip, settings or wires");
        if (const auto* n = v.find("name")) axis.name = text(*n);
        for (const Axis& other : sweep_.axes)
            if (other.name == axis.name)
                refuse(v, "two axes are called " + in_quotes(axis.name),
                       "axes of different names: set `name`");
        sweep_.axes.push_back(std::move(axis));
    }

    const TomlValue& needed(const TomlValue& v, const char* a, const char* b = nullptr) const {
        if (const auto* found = v.find(a)) return *found;
        if (b)
            if (const auto* found = v.find(b)) return *found;
        refuse(v, "an axis without values", b ? fmt::format("{} or {}", a, b) : std::string(a));
    }

    void plain(const TomlValue& v, Axis& axis) const {
        const TomlValue& key = *v.find("key");
        axis.name = text(key);
        if (axis.name.starts_with("precision.") && !v.find("values")) {  // the bits of one wire
            Wire wire{};
            if (!find_wire(axis.name.substr(10), wire)) known(key, axis.name);
            if (find_wire(axis.name.substr(10), wire)) return edits(v, {wire}, axis);
        }
        known(key, axis.name);
        for (const TomlValue& value : values(needed(v, "values", "range")))
            axis.choices.push_back({label_of(value), {axis.name + "=" + toml_text(value)}, {}});
    }

    // keys = [a, b], values = [[1, 2], [3, 4]]: a row is a point.
    void several(const TomlValue& v, Axis& axis) const {
        std::vector<std::string> keys;
        for (const TomlValue& key : list(*v.find("keys"))) known(key, text(key)), keys.push_back(text(key));
        for (const std::string& key : keys) axis.name += (axis.name.empty() ? "" : " + ") + key;
        for (const TomlValue& row : list(needed(v, "values"))) {
            Choice choice;
            if (row.kind != Kind::list || row.items.size() != keys.size())
                wrong(row, fmt::format("a list of {} values, one for each of keys", keys.size()));
            std::string label;
            for (std::size_t i = 0; i < keys.size(); ++i) {
                const TomlValue& item = row.items[i];
                choice.overrides.push_back(keys[i] + "=" + toml_text(item));
                label += (i ? ", " : "") + (item.kind == Kind::string ? item.text : toml_text(item));
            }
            choice.label = toml_text(std::string_view(label));
            axis.choices.push_back(std::move(choice));
        }
    }

    // zip = { a = [1, 3], b = [2, 4] }: the lists are walked in step.
    void zip(const TomlValue& v, Axis& axis) const {
        std::vector<std::pair<std::string, std::vector<TomlValue>>> columns;
        const std::function<void(const TomlValue&, const std::string&)> walk =
            [&](const TomlValue& table, const std::string& prefix) {
                for (const TomlValue& entry : table.items) {
                    const std::string key = prefix.empty() ? entry.key : prefix + "." + entry.key;
                    const bool is_range = entry.kind == Kind::table && entry.find("from");
                    if (entry.kind == Kind::table && !is_range)
                        walk(entry, key);
                    else
                        known(entry, key), columns.emplace_back(key, values(entry));
                }
            };
        const TomlValue& table = *v.find("zip");
        if (table.kind != Kind::table || table.items.empty()) wrong(table, "a table of lists");
        walk(table, "");
        const std::size_t rows = columns[0].second.size();
        for (const auto& [key, items] : columns) {
            axis.name += (axis.name.empty() ? "" : " + ") + key;
            if (items.size() != rows)
                wrong(table, fmt::format("lists of one length ({} has {} values, {} has {})",
                                         columns[0].first, rows, key, items.size()));
        }
        for (std::size_t i = 0; i < rows; ++i) {
            Choice choice;
            std::string label;
            for (const auto& [key, items] : columns) {
                choice.overrides.push_back(key + "=" + toml_text(items[i]));
                label += (label.empty() ? "" : ", ") +
                         (items[i].kind == Kind::string ? items[i].text : toml_text(items[i]));
            }
            choice.label =
                columns.size() == 1 ? label_of(columns[0].second[i]) : toml_text(std::string_view(label));
            axis.choices.push_back(std::move(choice));
        }
    }

    // settings = [{ label = "PIPS(2)", "classification.method" = "pips", ... }, ...]
    void named(const TomlValue& v, Axis& axis) const {
        axis.name = "settings";
        for (const TomlValue& item : list(*v.find("settings"))) {
            if (item.kind != Kind::table) wrong(item, "tables of settings, each with a label");
            const TomlValue* label = item.find("label");
            if (!label) wrong(item, "tables of settings, each with a label");
            Choice choice;
            choice.label = label_of(*label);
            TomlValue rest = item;
            std::erase_if(rest.items, [](const TomlValue& entry) { return entry.key == "label"; });
            settings(rest, "", choice.overrides);
            axis.choices.push_back(std::move(choice));
        }
    }

    void of_wires(const TomlValue& v, Axis& axis) const {
        const std::vector<Wire> wires = wire_list(*v.find("wires"));
        for (const Wire wire : wires)
            axis.name += (axis.name.empty() ? "" : " + ") + std::string(info(wire).name);
        edits(v, wires, axis);
    }

    void edits(const TomlValue& v, const std::vector<Wire>& wires, Axis& axis) const {
        using Part = WireEdit::Part;
        static constexpr std::pair<const char*, Part> kParts[] = {
            {"fraction_bits", Part::fraction_bits}, {"fraction_offset", Part::fraction_offset},
            {"integer_bits", Part::integer_bits},   {"integer_offset", Part::integer_offset},
            {"rounding", Part::rounding},           {"overflow", Part::overflow}};
        const TomlValue* found = nullptr;
        Part part{};
        const char* part_name = "";
        for (const auto& [name, p] : kParts)
            if (const auto* f = v.find(name)) {
                if (found) refuse(v, "two parts of a format on one axis", "one; a second axis for the other");
                found = f, part = p, part_name = name;
            }
        if (!found)
            refuse(v, "an axis of wires without values",
                   "fraction_bits, fraction_offset, integer_bits, integer_offset, rounding or overflow");
        axis.name += std::string(" ") + part_name;
        const bool words = part == Part::rounding || part == Part::overflow;
        for (const TomlValue& value : values(*found)) {
            Choice choice;
            choice.label = label_of(value);
            WireEdit edit{{}, part, words ? 0 : bits(value, part), words ? rule(value, part) : ""};
            for (const Wire wire : wires) edit.wire = wire, choice.edits.push_back(edit);
            axis.choices.push_back(std::move(choice));
        }
    }
    int bits(const TomlValue& v, WireEdit::Part part) const {
        const bool offset = part == WireEdit::Part::fraction_offset || part == WireEdit::Part::integer_offset;
        return static_cast<int>(whole(v, offset ? -kMostFractionBits : 0, kMostFractionBits));
    }
    std::string rule(const TomlValue& v, WireEdit::Part part) const {
        Rounding r{};
        Overflow o{};
        const std::string bad =
            part == WireEdit::Part::rounding ? parse_rounding(text(v), r) : parse_overflow(text(v), o);
        if (!bad.empty()) throw InputError(place(v) + ": " + bad);
        return v.text;
    }

    void wires(const TomlValue& v) {
        only(v, {"names", "fraction_bits", "fraction_offset", "integer_bits", "integer_offset", "rounding",
                 "together"});
        WireAxes& w = sweep_.wires;
        w.present = true;
        if (const auto* names = v.find("names"))
            if (names->kind != Kind::string || names->text != "used") w.wires = wire_list(*names);
        const auto numbers = [&](const char* name, WireEdit::Part part, std::vector<int>& out) {
            if (const auto* found = v.find(name))
                for (const TomlValue& item : values(*found)) out.push_back(bits(item, part));
        };
        numbers("fraction_bits", WireEdit::Part::fraction_bits, w.fraction_bits);
        numbers("fraction_offset", WireEdit::Part::fraction_offset, w.fraction_offset);
        numbers("integer_bits", WireEdit::Part::integer_bits, w.integer_bits);
        numbers("integer_offset", WireEdit::Part::integer_offset, w.integer_offset);
        if (const auto* found = v.find("rounding"))
            for (const TomlValue& item : list(*found))
                w.rounding.push_back(rule(item, WireEdit::Part::rounding));
        if (const auto* found = v.find("together")) w.together = flag(*found);
        if (w.fraction_bits.empty() && w.fraction_offset.empty() && w.integer_bits.empty() &&
            w.integer_offset.empty() && w.rounding.empty())
            refuse(v, "[wires] without values",
                   "fraction_bits, fraction_offset, integer_bits, integer_offset or rounding");
    }

    void measure(const TomlValue& v) {
        only(v, {"real", "reference", "srgb", "ssim", "mean_cost", "audit", "conservation", "repeats",
                 "threads", "exr", "picture_size"});
        Measure& m = sweep_.measure;
        const std::pair<const char*, bool*> flags[] = {
            {"real", &m.real}, {"reference", &m.reference}, {"srgb", &m.srgb},
            {"ssim", &m.ssim}, {"mean_cost", &m.mean_cost}, {"conservation", &m.conservation},
            {"exr", &m.exr}};
        for (const auto& [name, target] : flags)
            if (const auto* found = v.find(name)) *target = flag(*found);
        if (const auto* found = v.find("audit")) m.audit = flag(*found);
        if (const auto* found = v.find("repeats")) m.repeats = static_cast<int>(whole(*found, 0, 1000));
        if (const auto* found = v.find("threads")) m.threads = static_cast<int>(whole(*found, 0, 4096));
        if (const auto* found = v.find("picture_size"))
            m.picture_size = static_cast<int>(whole(*found, 0, 2048));
    }

    void baselines(const TomlValue& v) {
        if (v.kind != Kind::table) wrong(v, "a table of named settings");
        for (const TomlValue& entry : v.items) {
            if (entry.key == "real" || entry.key == "reference")
                refuse(entry, fmt::format("a baseline called {}", in_quotes(entry.key)),
                       "another name: measure.real and measure.reference ask for these");
            Baseline baseline{entry.key, {}};
            settings(entry, "", baseline.overrides);
            sweep_.baselines.push_back(std::move(baseline));
        }
    }

    void mode(const TomlValue& whole_file) {
        if (const auto* v = whole_file.find("mode")) {
            static const std::vector<std::string_view> names{"product", "one_at_a_time", "random"};
            const auto found = std::find(names.begin(), names.end(), text(*v));
            if (found == names.end()) wrong(*v, listed(names));
            sweep_.mode = static_cast<Mode>(found - names.begin());
        } else if (sweep_.wires.present) {
            sweep_.mode = Mode::one_at_a_time;
        }
        if (sweep_.wires.present && sweep_.mode != Mode::one_at_a_time)
            refuse(*whole_file.find("mode"), "[wires] in another mode", "mode = \"one_at_a_time\"");
        const auto* samples = whole_file.find("samples");
        if (samples) sweep_.samples = whole(*samples, 1, 10'000'000);
        if (const auto* v = whole_file.find("seed"))
            sweep_.seed = static_cast<std::uint64_t>(whole(*v, 0, std::numeric_limits<std::int64_t>::max()));
        if (samples && sweep_.mode != Mode::random)
            refuse(*samples, "samples in another mode", "mode = \"random\"");
        if (!samples && sweep_.mode == Mode::random)
            throw InputError(sweep_.name +
                             ": mode random without samples; allowed: samples = a whole number");
    }

    SweepFile& sweep_;
    std::vector<std::string> keys_;
    Scene settings_of_;
};

// Without a scene file, a path in an override is relative to the sweep file's folder.
void root_paths(SweepFile& sweep) {
    if (!sweep.scenes.empty() || sweep.folder.empty()) return;
    const auto root = [&](std::string& text) {
        const std::size_t equals = text.find('=');
        const std::string key = text.substr(0, equals);
        if (key != "volume.file" && key != "transfer_function.file" && key != "precision.preset") return;
        std::string value = text.substr(equals + 1);
        if (value.size() < 2 || value.front() != '"') return;
        value = value.substr(1, value.size() - 2);
        const bool built_in = key == "precision.preset" &&
                              std::find(std::begin(kPrecisionPresets), std::end(kPrecisionPresets), value) !=
                                  std::end(kPrecisionPresets);
        if (built_in || value.empty() || value[0] == '/' || value.starts_with("${")) return;
        text = key + "=\"" + sweep.folder + "/" + value + "\"";
    };
    for (std::string& text : sweep.overrides) root(text);
    for (Axis& axis : sweep.axes)
        for (Choice& choice : axis.choices)
            for (std::string& text : choice.overrides) root(text);
    for (Baseline& baseline : sweep.baselines)
        for (std::string& text : baseline.overrides) root(text);
}

}  // namespace

bool find_wire(std::string_view name, Wire& wire) {
    for (int w = 0; w < kWires; ++w)
        if (kWireInfo[static_cast<std::size_t>(w)].name == name) return wire = static_cast<Wire>(w), true;
    return false;
}

SweepFile parse_sweep(std::string_view text, const std::string& name, const std::string& folder,
                      const std::vector<std::string>& overrides) {
    SweepFile sweep;
    sweep.name = name, sweep.folder = folder, sweep.text = std::string(text);
    Reader(sweep).read(parse_toml(text, name));
    root_paths(sweep);
    sweep.overrides.insert(sweep.overrides.end(), overrides.begin(), overrides.end());
    return sweep;
}

SweepFile read_sweep(const std::string& path, const std::vector<std::string>& overrides) {
    return parse_sweep(read_toml_text(path), path, std::filesystem::path(path).parent_path().string(),
                       overrides);
}

std::string scene_path(const SweepFile& sweep, std::size_t i) {
    if (sweep.scenes.empty()) return {};
    const std::string path = expand_path(sweep.scenes[i], sweep.folder, sweep.name + ": scene");
    return path;
}

}  // namespace squint::sweep
