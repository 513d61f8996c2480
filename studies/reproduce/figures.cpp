#include "studies/reproduce/figures.h"

#include "core/error.h"
#include "scene/toml.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <string_view>

namespace squint::reproduce {
namespace {

using Kind = TomlValue::Kind;

constexpr std::string_view kKinds[] = {"render", "reference", "difference", "angles", "slab_light"};
constexpr std::string_view kMeasures[] = {"psnr",       "foreground_psnr", "rms",        "largest",
                                          "bias",       "opacity",         "slab_error", "table_size",
                                          "build_time", "frames",          "angles",     "normal_length"};
constexpr const char* kUnits[] = {"dB",   "dB",  "LSB8", "LSB8",     "LSB8", "%",
                                  "LSB8", "KiB", "ms",   "frames/s", "%",    "%"};

class Reader {
  public:
    explicit Reader(std::string file) : file_(std::move(file)) {}

    Paper paper(const TomlValue& whole) const {
        only(whole, {"title", "figure"});
        Paper paper;
        paper.name = std::filesystem::path(file_).stem().string();
        paper.title = text(needed(whole, "title"));
        for (const TomlValue& v : list(needed(whole, "figure"))) {
            paper.figures.push_back(figure(v));
            const Figure& last = paper.figures.back();
            for (std::size_t i = 0; i + 1 < paper.figures.size(); ++i)
                if (paper.figures[i].name == last.name) refuse(v, "two figures are called " + last.name);
            for (const std::string& name : last.rows_of)
                if (!paper.find(name)) refuse(v, fmt::format("rows_of: no figure {} before it", name));
        }
        return paper;
    }

  private:
    [[noreturn]] void refuse(const TomlValue& v, const std::string& what) const {
        const bool keyed = v.key_line > 0;
        throw InputError(fmt::format("{}:{}:{}: {}", file_, keyed ? v.key_line : v.line,
                                     keyed ? v.key_column : v.column, what));
    }
    void only(const TomlValue& table, const std::vector<std::string_view>& names) const {
        if (table.kind != Kind::table) refuse(table, "found " + described(table) + "; allowed: a table");
        for (const TomlValue& entry : table.items)
            if (std::find(names.begin(), names.end(), entry.key) == names.end())
                refuse(entry,
                       fmt::format("unknown setting {}; allowed: {}", in_quotes(entry.key), listed(names)));
    }
    const TomlValue& needed(const TomlValue& table, const char* key) const {
        const TomlValue* v = table.find(key);
        if (!v) refuse(table, fmt::format("{} is missing", key));
        return *v;
    }
    const std::string& text(const TomlValue& v) const {
        if (v.kind != Kind::string) refuse(v, "found " + described(v) + "; allowed: a text in quotes");
        return v.text;
    }
    double number(const TomlValue& v) const {
        if (v.kind != Kind::integer && v.kind != Kind::number)
            refuse(v, "found " + described(v) + "; allowed: a number");
        return v.number;
    }
    const std::vector<TomlValue>& list(const TomlValue& v) const {
        if (v.kind != Kind::list) refuse(v, "found " + described(v) + "; allowed: a list");
        return v.items;
    }
    std::vector<std::string> texts(const TomlValue& v) const {
        std::vector<std::string> out;
        for (const TomlValue& item : list(v)) out.push_back(text(item));
        return out;
    }
    std::size_t place(const TomlValue& v, const std::string_view* first, std::size_t count) const {
        const std::vector<std::string_view> names(first, first + count);
        const auto found = std::find(names.begin(), names.end(), text(v));
        if (found == names.end())
            refuse(v, fmt::format("found {}; allowed: {}", described(v), listed(names)));
        return static_cast<std::size_t>(found - names.begin());
    }
    // Tables, nested or with dotted keys -> key=value.  Whether a program knows a key is asked when it is set.
    void settings(const TomlValue& v, const std::string& prefix, std::vector<std::string>& out) const {
        if (v.kind != Kind::table) refuse(v, "found " + described(v) + "; allowed: a table of settings");
        for (const TomlValue& entry : v.items) {
            const std::string key = prefix.empty() ? entry.key : prefix + "." + entry.key;
            if (entry.kind == Kind::table)
                settings(entry, key, out);
            else
                out.push_back(key + "=" + toml_text(entry));
        }
    }

    Figure figure(const TomlValue& v) const {
        only(v, {"name", "title", "look", "seconds", "timed", "scene", "stand_in", "settings", "picture",
                 "row", "rows_of"});
        Figure f;
        f.name = text(needed(v, "name")), f.title = text(needed(v, "title")),
        f.look = text(needed(v, "look"));
        f.seconds = number(needed(v, "seconds"));
        if (const auto* t = v.find("timed")) f.timed = t->flag;
        if (const auto* s = v.find("scene")) f.scene = text(*s);
        if (const auto* s = v.find("stand_in")) f.stand_in = text(*s);
        if (const auto* s = v.find("settings")) settings(*s, "", f.settings);
        if (const auto* r = v.find("rows_of")) f.rows_of = texts(*r);
        if (const auto* p = v.find("picture"))
            for (const TomlValue& item : list(*p)) f.pictures.push_back(picture(item, f));
        if (const auto* r = v.find("row"))
            for (const TomlValue& item : list(*r)) f.rows.push_back(row(item, f));
        return f;
    }
    void known(const TomlValue& v, const std::vector<std::string>& of, const Figure& f) const {
        for (const std::string& name : of)
            if (std::none_of(f.pictures.begin(), f.pictures.end(),
                             [&](const PictureOrder& p) { return p.name == name; }))
                refuse(v, fmt::format("of: no picture {} before it", in_quotes(name)));
    }
    PictureOrder picture(const TomlValue& v, const Figure& f) const {
        only(v, {"name", "title", "kind", "scene", "settings", "of", "gain", "angle", "exponent"});
        PictureOrder p;
        p.name = text(needed(v, "name"));
        if (const auto* t = v.find("title")) p.title = text(*t);
        if (const auto* k = v.find("kind"))
            p.kind = static_cast<PictureKind>(place(*k, kKinds, std::size(kKinds)));
        if (const auto* s = v.find("scene")) p.scene = text(*s);
        if (const auto* s = v.find("settings")) settings(*s, "", p.settings);
        if (const auto* o = v.find("of")) p.of = texts(*o);
        if (const auto* g = v.find("gain")) p.gain = number(*g);
        if (const auto* a = v.find("angle")) p.angle = number(*a);
        if (const auto* e = v.find("exponent")) p.exponent = number(*e);
        known(v, p.of, f);
        if (p.of.size() != (p.kind == PictureKind::difference ? 2 : 0))
            refuse(v, "of: a difference has two pictures, others none");
        return p;
    }
    RowOrder row(const TomlValue& v, const Figure& f) const {
        only(v, {"what", "measure", "of", "scene", "settings", "paper"});
        RowOrder r;
        r.what = text(needed(v, "what"));
        r.measure = static_cast<Measure>(place(needed(v, "measure"), kMeasures, std::size(kMeasures)));
        if (const auto* o = v.find("of")) r.of = texts(*o);
        if (const auto* s = v.find("scene")) r.scene = text(*s);
        if (const auto* s = v.find("settings")) settings(*s, "", r.settings);
        if (const auto* p = v.find("paper"))
            for (const TomlValue& item : list(*p)) r.paper.push_back(number(item));
        known(v, r.of, f);
        if (r.of.size() != pictures_of(r.measure))
            refuse(v, fmt::format("of: {} pictures, and {} has {}", r.of.size(),
                                  kMeasures[static_cast<std::size_t>(r.measure)], pictures_of(r.measure)));
        return r;
    }
    static std::size_t pictures_of(Measure measure) {
        switch (measure) {
            case Measure::opacity:
            case Measure::angles:
            case Measure::normal_length:
                return 1;
            case Measure::slab_error:
            case Measure::table_size:
            case Measure::build_time:
            case Measure::frames:
                return 0;
            default:
                return 2;
        }
    }

    std::string file_;
};

}  // namespace

const char* unit_of(Measure measure) {
    return kUnits[static_cast<std::size_t>(measure)];
}

const Figure* Paper::find(const std::string& figure) const {
    const auto found =
        std::find_if(figures.begin(), figures.end(), [&](const Figure& f) { return f.name == figure; });
    return found == figures.end() ? nullptr : &*found;
}

Paper read_paper(const std::string& path) {
    return Reader(path).paper(read_toml(path));
}

}  // namespace squint::reproduce
