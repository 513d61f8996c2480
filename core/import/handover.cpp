#include "core/import/handover.h"

#include "core/error.h"
#include "core/import/axes.h"
#include "core/import/stored_bytes.h"
#include "core/text.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace squint {
namespace {

constexpr std::size_t kLongestNote = 400;

[[noreturn]] void refuse(const std::string& where) {
    throw InputError(fmt::format("{}: its reader handed back no header of this version's", where));
}

/// The words of a line, taken one after the other.
class Words {
  public:
    Words(std::string_view line, const std::string& where) : rest_(line), where_(where) {}
    std::string_view word() {
        const std::size_t end = rest_.find(' ');
        const std::string_view word = rest_.substr(0, end);
        rest_ = end == std::string_view::npos ? "" : rest_.substr(end + 1);
        return word;
    }
    std::string_view rest() const { return rest_; }
    template <class Number>
    Number number() {
        const std::string_view text = word();
        Number value{};
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error != std::errc{} || end != text.data() + text.size()) refuse(where_);
        return value;
    }
    double finite() {
        const auto value = number<double>();
        if (!std::isfinite(value)) refuse(where_);
        return value;
    }
    Vec3 vector() {
        Vec3 v;
        for (int i = 0; i < 3; ++i) v[i] = finite();
        return v;
    }

  private:
    std::string_view rest_;
    const std::string& where_;
};

}  // namespace

std::string text_of(const Handover& h) {
    const StoredVolume& s = h.stored;
    std::string text = fmt::format("{}\ntype {}\ndims {} {} {}\ncomponents {} {}\n", kHandoverHead,
                                   kStoredTypes[static_cast<std::size_t>(s.type)], s.dims.x, s.dims.y,
                                   s.dims.z, s.components, s.component_run);
    for (const Vec3& step : h.stored.steps) text += fmt::format("step {} {} {}\n", step.x, step.y, step.z);
    text += fmt::format("first {} {} {}\n", h.stored.first_voxel.x, h.stored.first_voxel.y,
                        h.stored.first_voxel.z);
    if (s.big_endian) text += "big\n";
    if (s.component_chosen) text += "chosen\n";
    if (s.value_scale) text += fmt::format("values {} {}\n", *s.value_scale, s.value_offset.value_or(0));
    if (!s.space.empty()) text += fmt::format("space {}\n", s.space);
    if (!s.modality.empty()) text += fmt::format("modality {}\n", s.modality);
    for (const std::string& note : h.notes) text += fmt::format("note {}\n", printable(note));
    return text + "end\n";
}

Handover handover_from(std::string_view text, const std::string& where) {
    Handover h;
    h.stored.where = where;
    if (!text.starts_with(kHandoverHead) || !text.ends_with("\nend\n")) refuse(where);
    std::size_t steps = 0;
    std::int64_t components = 1, run = 1;
    for (std::size_t at = text.find('\n') + 1; at < text.size();) {
        const std::size_t end = text.find('\n', at);
        Words words(text.substr(at, end - at), where);
        at = end + 1;
        const std::string_view key = words.word();
        if (key == "type") {
            const std::string_view name = words.word();
            const auto* known = std::find(std::begin(kStoredTypes), std::end(kStoredTypes), name);
            if (known == std::end(kStoredTypes)) refuse(where);
            h.stored.type = static_cast<StoredType>(known - std::begin(kStoredTypes));
        } else if (key == "dims") {
            for (int i = 0; i < 3; ++i) h.stored.dims[i] = words.number<std::int64_t>();
        } else if (key == "components") {
            components = words.number<std::int64_t>(), run = words.number<std::int64_t>();
        } else if (key == "step" && steps < 3) {
            h.stored.steps[steps++] = words.vector();
        } else if (key == "first") {
            h.stored.first_voxel = words.vector();
        } else if (key == "big") {
            h.stored.big_endian = true;
        } else if (key == "chosen") {
            h.stored.component_chosen = true;
        } else if (key == "values") {
            h.stored.value_scale = words.finite(), h.stored.value_offset = words.finite();
        } else if (key == "space") {
            h.stored.space = printable(std::string(words.rest().substr(0, kLongestNote)));
        } else if (key == "modality") {
            h.stored.modality = printable(std::string(words.word().substr(0, 16)));
        } else if (key == "note") {
            h.notes.push_back(printable(std::string(words.rest().substr(0, kLongestNote))));
        } else if (key != "end") {
            refuse(where);
        }
    }
    checked_bytes(h.stored.dims, bytes_of(h.stored.type), where);
    if (run < 1) refuse(where);
    take_components(h.stored, components, run);
    return h;
}

}  // namespace squint
