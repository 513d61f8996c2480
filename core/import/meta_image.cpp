#include "core/import/meta_image.h"

#include "core/error.h"
#include "core/import/axes.h"
#include "core/import/stored_bytes.h"
#include "core/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>

namespace squint {
namespace {

constexpr std::size_t kLongestHeader = std::size_t{1} << 16;
constexpr std::string_view kBlanks = " \t\r";

std::string_view trimmed(std::string_view text) {
    const std::size_t first = text.find_first_not_of(kBlanks);
    return first == std::string_view::npos ? ""
                                           : text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// The keys of the header.  Comments that may name a patient are never looked at.
class Header {
  public:
    std::string path;
    std::size_t end = 0;  // offset of the first byte after the header

    Header(std::string file_path, const MappedFile& file) : path(std::move(file_path)) {
        const std::string_view bytes(reinterpret_cast<const char*>(file.bytes.get()),
                                     std::min(file.size, kLongestHeader));
        while (end < bytes.size() && !keys_.contains("ElementDataFile")) {
            const std::size_t newline = bytes.find('\n', end);
            const std::string_view line = bytes.substr(end, newline - end);
            end = newline == std::string_view::npos ? bytes.size() : newline + 1;
            if (trimmed(line).empty()) continue;
            const std::size_t equals = line.find('=');
            if (equals == std::string_view::npos)
                throw InputError(
                    fmt::format("{}: MetaImage header: no \"Key = Value\" in a line, and no "
                                "ElementDataFile, which ends it, before",
                                path));
            keys_.emplace(trimmed(line.substr(0, equals)), trimmed(line.substr(equals + 1)));
        }
        if (!keys_.contains("ElementDataFile"))
            throw InputError(fmt::format(
                "{}: MetaImage header without ElementDataFile, which ends it (in the first {} bytes)", path,
                end));
    }

    /// The first of several names of a key that is present.
    std::optional<std::string> text(std::initializer_list<const char*> names) const {
        for (const char* name : names)
            if (const auto found = keys_.find(name); found != keys_.end()) return found->second;
        return {};
    }
    bool flag(std::initializer_list<const char*> names, bool otherwise) const {
        const auto given = text(names);
        if (!given) return otherwise;
        if (given->empty() || std::string_view("TtYy1FfNn0").find((*given)[0]) == std::string_view::npos)
            refuse(*names.begin(), *given, "True or False");
        return std::string_view("TtYy1").find((*given)[0]) != std::string_view::npos;
    }
    /// Exactly `count` numbers; empty where the key is absent.
    template <class Number>
    std::vector<Number> numbers(std::initializer_list<const char*> names, std::size_t count) const {
        const auto given = text(names);
        std::vector<Number> list;
        if (!given) return list;
        const char *at = given->data(), *end_of = at + given->size();
        while (at < end_of) {
            while (at < end_of && kBlanks.find(*at) != std::string_view::npos) ++at;
            Number number{};
            const auto [next, error] = std::from_chars(at, end_of, number);
            if (error != std::errc{}) break;
            list.push_back(number), at = next;
        }
        if (at != end_of || list.size() != count)
            refuse(*names.begin(), *given, fmt::format("{} number{}", count, count == 1 ? "" : "s"));
        return list;
    }
    [[noreturn]] void refuse(const char* key, const std::string& found, const std::string& allowed) const {
        throw InputError(fmt::format("{}: MetaImage header: {} is \"{}\"; allowed: {}", path, key,
                                     excerpt(found), allowed));
    }

  private:
    std::map<std::string, std::string, std::less<>> keys_;
};

void take_type(StoredVolume& stored, const Header& header) {
    constexpr std::pair<std::string_view, StoredType> kTypes[] = {
        {"MET_UCHAR", StoredType::u8},       {"MET_CHAR", StoredType::i8},
        {"MET_USHORT", StoredType::u16},     {"MET_SHORT", StoredType::i16},
        {"MET_UINT", StoredType::u32},       {"MET_INT", StoredType::i32},
        {"MET_ULONG_LONG", StoredType::u64}, {"MET_LONG_LONG", StoredType::i64},
        {"MET_FLOAT", StoredType::f32},      {"MET_DOUBLE", StoredType::f64},
    };
    const std::string type = header.text({"ElementType"}).value_or("");
    const auto* known = std::find_if(std::begin(kTypes), std::end(kTypes),
                                     [&](const auto& candidate) { return candidate.first == type; });
    if (known == std::end(kTypes))
        header.refuse(
            "ElementType", type,
            "MET_ with UCHAR, CHAR, USHORT, SHORT, UINT, INT, ULONG_LONG, LONG_LONG, FLOAT or DOUBLE");
    stored.type = known->second;
    stored.big_endian = header.flag({"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}, false);
}

void take_dims(StoredVolume& stored, const Header& header) {
    const auto dimensions = header.numbers<std::int64_t>({"NDims"}, 1);
    if (dimensions.empty() || dimensions[0] < 3 || dimensions[0] > 4)
        header.refuse("NDims", header.text({"NDims"}).value_or(""), "3, and 4 with volume.component");
    const auto n = static_cast<std::size_t>(dimensions[0]);
    const auto size = header.numbers<std::int64_t>({"DimSize"}, n);
    if (size.empty()) header.refuse("DimSize", "", fmt::format("{} numbers", n));
    stored.dims = {size[0], size[1], size[2]};
    checked_bytes(stored.dims, bytes_of(stored.type), stored.where);
    const auto channels = header.numbers<std::int64_t>({"ElementNumberOfChannels"}, 1);
    if (!channels.empty() && channels[0] != 1) {
        if (n == 4)
            header.refuse("ElementNumberOfChannels", *header.text({"ElementNumberOfChannels"}),
                          "1 of NDims 4");
        take_components(stored, channels[0], 1);
    } else if (n == 4) {
        take_components(stored, size[3], static_cast<std::int64_t>(stored.voxels()));
    }
}

void take_geometry(StoredVolume& stored, const Header& header) {
    const auto dims = static_cast<std::size_t>(header.numbers<std::int64_t>({"NDims"}, 1)[0]);
    const auto spacing = header.numbers<double>({"ElementSpacing", "ElementSize"}, dims);
    const auto offset = header.numbers<double>({"Offset", "Position", "Origin"}, dims);
    const auto turn = header.numbers<double>({"TransformMatrix", "Rotation", "Orientation"}, dims * dims);
    std::array<Vec3, 3>& steps = stored.steps;
    Vec3& first = stored.first_voxel;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t world = 0; world < 3; ++world)
            steps[axis][static_cast<int>(world)] = turn.empty() ? axis == world : turn[axis * dims + world];
        steps[axis] *= spacing.empty() ? 1 : spacing[axis];
        if (!offset.empty()) first[static_cast<int>(axis)] = offset[axis];
    }
    if (!spacing.empty()) check_spacing({spacing[0], spacing[1], spacing[2]}, stored.where);
    if (!std::isfinite(first.x + first.y + first.z))
        header.refuse("Offset", *header.text({"Offset", "Position", "Origin"}), "finite numbers");
    stored.space = kLps;
    take_axes(stored);
}

void take_data(StoredVolume& stored, const Header& header, const MappedFile& file, std::size_t start,
               const LoadLimits& limits, const std::string& where) {
    std::size_t offset = start;
    const auto skip = header.numbers<std::int64_t>({"HeaderSize"}, 1);
    const bool packed = header.flag({"CompressedData"}, false);
    if (!skip.empty() && skip[0] != 0) {
        const bool at_end = skip[0] == -1 && !packed && file.size >= stored.size() + start;
        if (!at_end && (skip[0] < 0 || static_cast<std::size_t>(skip[0]) > file.size))
            header.refuse("HeaderSize", std::to_string(skip[0]),
                          "the bytes before the voxels, or -1 for raw voxels at the end");
        offset = at_end ? file.size - stored.size() : std::max(start, static_cast<std::size_t>(skip[0]));
    }
    if (!header.flag({"BinaryData"}, true)) return take_ascii(stored, file, offset, limits, where);
    if (!packed) return take_mapped(stored, file, offset, where);
    const auto size = header.numbers<std::int64_t>({"CompressedDataSize"}, 1);
    std::size_t bytes = file.size - offset;
    if (!size.empty() && size[0] > 0) bytes = std::min(bytes, static_cast<std::size_t>(size[0]));
    take_inflated(stored, file, offset, bytes, 0, limits, where);
}

}  // namespace

StoredVolume read_meta_image(const std::string& path, const MappedFile& file, const LoadLimits& limits,
                             std::vector<std::string>&) {
    const Header header(path, file);
    StoredVolume stored;
    stored.where = path;
    take_type(stored, header);
    take_dims(stored, header);
    take_geometry(stored, header);
    const std::string data = *header.text({"ElementDataFile"});
    if (data == "LOCAL" || data == "Local" || data == "local") {
        take_data(stored, header, file, header.end, limits, path);
    } else {
        if (data.starts_with("LIST") || data.find('%') != std::string::npos)
            header.refuse("ElementDataFile", data, "LOCAL or one file's name");
        const std::string beside = data_path(path, data);
        take_data(stored, header, map_file(beside), 0, limits, beside);
    }
    return stored;
}

}  // namespace squint
