// Reads NRRD: teem parses the header, and we read the data.
#include "core/nrrd.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/import/axes.h"
#include "core/import/stored_bytes.h"
#include "core/text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <teem/nrrd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <string_view>

namespace squint {
namespace {

constexpr std::size_t kLongestHeader = std::size_t{1} << 20;

constexpr const char* kScaleKey = "squint value scale";
constexpr const char* kOffsetKey = "squint value offset";
constexpr const char* kBitsKey = "squint scalar bits";

// --- The header's text ---------------------------------------------------------------------------------

struct HeaderText {
    std::string text;       // without the line that names the data file
    std::string data_file;  // empty: attached
    std::size_t end = 0;    // offset of the first byte after the header
    bool closed = false;    // by a blank line
};

/// The name in `data file: NAME`, or null.
bool names_data_file(std::string_view line, std::string& name) {
    const std::size_t colon = line.find(": ");
    if (colon == std::string_view::npos) return false;
    std::string field(line.substr(0, colon));
    std::transform(field.begin(), field.end(), field.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    if (field != "data file" && field != "datafile") return false;
    name = line.substr(colon + 2);
    name.erase(0, name.find_first_not_of(" \t"));
    name.erase(name.find_last_not_of(" \t") + 1);
    return true;
}

HeaderText split_header(const std::string& path, const MappedFile& file) {
    const std::string_view bytes(reinterpret_cast<const char*>(file.bytes.get()),
                                 std::min(file.size, kLongestHeader));
    HeaderText header;
    while (header.end < bytes.size() && !header.closed) {
        const std::size_t newline = bytes.find('\n', header.end);
        std::string_view line = bytes.substr(header.end, newline - header.end);
        header.end = newline == std::string_view::npos ? bytes.size() : newline + 1;
        if (line.ends_with('\r')) line.remove_suffix(1);
        std::string name;
        if (line.empty()) {
            header.closed = true;
        } else if (!names_data_file(line, name)) {
            header.text.append(line).push_back('\n');
        } else if (name.empty() || !header.data_file.empty()) {
            throw InputError(fmt::format("{}: data file is named {}, but exactly one name is allowed", path,
                                         name.empty() ? "by nothing" : "twice"));
        } else {
            header.data_file = name;
        }
    }
    if (!header.closed && (header.data_file.empty() || file.size > kLongestHeader))
        throw InputError(fmt::format(
            "{}: NRRD header without the blank line that ends it (in the first {} bytes)", path, header.end));
    if (header.text.find('\0') != std::string::npos)
        throw InputError(fmt::format("{}: NRRD header holds a byte of zero, but must be text", path));
    return header;
}

void check_version(const std::string& path, const HeaderText& header) {
    const std::string version = header.text.substr(0, header.text.find('\n'));
    for (const char* known : {"NRRD00.01", "NRRD0001", "NRRD0002", "NRRD0003", "NRRD0004", "NRRD0005"})
        if (version == known) return;
    throw InputError(fmt::format("{}: NRRD header: version is \"{}\", but NRRD0001 to NRRD0005 are allowed",
                                 path, printable(version.substr(0, 16))));
}

// --- teem --------------------------------------------------------------------------------------------------

/// teem keeps its errors in one place, shared by all threads.
std::mutex& teem_lock() {
    static std::mutex lock;
    return lock;
}

struct Parsed {
    Nrrd* nrrd = nrrdNew();
    NrrdIoState* io = nrrdIoStateNew();
    Parsed() = default;
    Parsed(const Parsed&) = delete;
    Parsed& operator=(const Parsed&) = delete;
    ~Parsed() {
        nrrdNuke(nrrd);
        nrrdIoStateNix(io);
    }
    bool seen(int field) const { return io->seen[field] != 0; }
};

/// The telling part of biff's message, which has a line for every caller: the last and deepest line, and what
/// was being parsed.
std::string one_line(std::string text) {
    std::vector<std::string> lines;
    for (std::size_t start = 0; start < text.size();) {
        const std::size_t end = std::min(text.find('\n', start), text.size());
        std::string line = text.substr(start, end - start);
        if (const std::size_t colon = line.find(": "); line.starts_with('[') && colon != std::string::npos)
            line.erase(0, colon + 2);
        if (!line.empty() && line != "trouble") lines.push_back(std::move(line));
        start = end + 1;
    }
    if (lines.empty()) return "unknown reason";
    std::string message = lines.back();
    for (const std::string& line : lines)
        if (line.starts_with("trouble parsing")) message = line.substr(8) + ": " + message;
    return excerpt(message, 200);
}

void parse(const std::string& path, const HeaderText& header, Parsed& parsed) {
    nrrdStateVerboseIO = 0;
    parsed.io->skipData = AIR_TRUE;
    const std::string text = header.text + "\n";
    if (nrrdStringRead(parsed.nrrd, text.c_str(), parsed.io) == 0) return;
    char* reason = biffGetDone(NRRD);
    const std::string line = one_line(reason ? reason : "");
    free(reason);
    throw InputError(fmt::format("{}: NRRD header: {}", path, line));
}

// --- What the header says ------------------------------------------------------------------------------

void take_type(StoredVolume& stored, const Parsed& parsed) {
    constexpr std::pair<int, StoredType> kTypes[] = {
        {nrrdTypeUChar, StoredType::u8},   {nrrdTypeChar, StoredType::i8},
        {nrrdTypeUShort, StoredType::u16}, {nrrdTypeShort, StoredType::i16},
        {nrrdTypeUInt, StoredType::u32},   {nrrdTypeInt, StoredType::i32},
        {nrrdTypeULLong, StoredType::u64}, {nrrdTypeLLong, StoredType::i64},
        {nrrdTypeFloat, StoredType::f32},  {nrrdTypeDouble, StoredType::f64},
    };
    const auto* known = std::find_if(std::begin(kTypes), std::end(kTypes),
                                     [&](const auto& type) { return type.first == parsed.nrrd->type; });
    if (known == std::end(kTypes))
        throw InputError(fmt::format("{}: type is {}, but integers and floats are allowed", stored.where,
                                     airEnumStr(nrrdType, parsed.nrrd->type)));
    stored.type = known->second;
    if (parsed.io->encoding == nrrdEncodingAscii) return;
    if (bytes_of(stored.type) > 1 && parsed.io->endian == airEndianUnknown)
        throw InputError(fmt::format("{}: endian is missing, but little or big is needed for {} bits",
                                     stored.where, bytes_of(stored.type) * 8));
    stored.big_endian = parsed.io->endian == airEndianBig;
}

/// The axis that is not one of space: components of a voxel, or points in time; -1: none.
int axis_of_components(const StoredVolume& stored, const Parsed& parsed) {
    const Nrrd& nrrd = *parsed.nrrd;
    if (nrrd.dim == 3) return -1;
    if (nrrd.dim != 4)
        throw InputError(
            fmt::format("{}: dimension is {}, but 3 is allowed, and 4 with an axis of components",
                        stored.where, nrrd.dim));
    for (int axis = 0; axis < 4; ++axis) {
        const bool no_direction =
            parsed.seen(nrrdField_space_directions) && !AIR_EXISTS(nrrd.axis[axis].spaceDirection[0]);
        const int kind = nrrd.axis[axis].kind;
        if (no_direction || (kind != nrrdKindUnknown && kind != nrrdKindDomain && kind != nrrdKindSpace))
            return axis;
    }
    return nrrd.axis[0].size <= 4 ? 0 : 3;  // not stated: few numbers are components, else times
}

/// The axes of space, in the file's order.
std::array<int, 3> axes_of_space(const StoredVolume& stored, const Parsed& parsed) {
    const int without = axis_of_components(stored, parsed);
    std::array<int, 3> axes{0, 1, 2};
    for (int& axis : axes) axis += without >= 0 && axis >= without;
    return axes;
}

void take_dims(StoredVolume& stored, const Parsed& parsed) {
    const std::array<int, 3> axes = axes_of_space(stored, parsed);
    const auto size_of = [&](int axis) {
        const std::size_t size = parsed.nrrd->axis[axis].size;
        if (size > static_cast<std::size_t>(std::numeric_limits<std::int64_t>::max()))
            throw InputError(
                fmt::format("{}: axis {} has {} voxels, which is too many", stored.where, axis, size));
        return static_cast<std::int64_t>(size);
    };
    for (int axis = 0; axis < 3; ++axis) stored.dims[axis] = size_of(axes[static_cast<std::size_t>(axis)]);
    checked_bytes(stored.dims, bytes_of(stored.type), stored.where);
    const int components = axis_of_components(stored, parsed);
    if (components < 0) return;
    std::int64_t run = 1;
    for (int axis = 0; axis < components; ++axis) run *= stored.dims[axis];
    take_components(stored, size_of(components), run);
}

/// Reads axes from `space directions`: each along a world axis, in any order and either sense.
void take_directions(StoredVolume& stored, const Nrrd& nrrd, const std::array<int, 3>& axes) {
    if (nrrd.spaceDim != 3)
        throw InputError(
            fmt::format("{}: space dimension is {}, but 3 is allowed", stored.where, nrrd.spaceDim));
    for (std::size_t i = 0; i < 3; ++i) {
        const double* step = nrrd.axis[axes[i]].spaceDirection;
        stored.steps[i] = Vec3(step[0], step[1], step[2]);
        stored.first_voxel[static_cast<int>(i)] = AIR_EXISTS(nrrd.spaceOrigin[i]) ? nrrd.spaceOrigin[i] : 0;
    }
    take_axes(stored);
}

/// What `axis mins` and `axis maxs` bound: cells, whose voxels lie between two faces, or nodes, whose voxels
/// lie on both ends.  Without a statement it is cells, as in teem.
double spacing_between_ends(const std::string& where, const NrrdAxisInfo& info, int axis) {
    if (!AIR_EXISTS(info.min) || !std::isfinite(info.max - info.min) || !(info.min < info.max))
        throw InputError(
            fmt::format("{}: axis {} runs from {} to {} (axis mins, axis maxs), but needs two finite "
                        "numbers, the least first",
                        where, axis, info.min, info.max));
    const double voxels = static_cast<double>(info.size) - (info.center == nrrdCenterNode);
    if (voxels < 1)
        throw InputError(
            fmt::format("{}: axis {} has one node, but axis mins and axis maxs need two", where, axis));
    return (info.max - info.min) / voxels;
}

/// Reads axes from `spacings`, `axis mins` and `axis maxs`, in the file's order.
void take_spacings(StoredVolume& stored, const Parsed& parsed, const std::array<int, 3>& axes) {
    const bool given = parsed.seen(nrrdField_spacings);
    for (int axis = 0; axis < 3; ++axis) {
        const NrrdAxisInfo& info = parsed.nrrd->axis[axes[static_cast<std::size_t>(axis)]];
        bool cells = info.center == nrrdCenterCell;
        if (given) stored.spacing[axis] = info.spacing;
        if (AIR_EXISTS(info.max)) {
            const double between = spacing_between_ends(stored.where, info, axis);
            constexpr double kRoundingOfText = 1e-4;
            if (given && !(std::abs(between - info.spacing) <= kRoundingOfText * between))
                throw InputError(fmt::format("{}: axis {} has spacing {}, but its min and max make it {}",
                                             stored.where, axis, info.spacing, between));
            if (!given) stored.spacing[axis] = between;
            cells = info.center != nrrdCenterNode;
        }
        if (AIR_EXISTS(info.min)) stored.origin[axis] = info.min + (cells ? stored.spacing[axis] / 2 : 0);
    }
}

void take_geometry(StoredVolume& stored, const Parsed& parsed, std::vector<std::string>& notes) {
    const std::array<int, 3> axes = axes_of_space(stored, parsed);
    if (parsed.seen(nrrdField_space_directions))
        take_directions(stored, *parsed.nrrd, axes);
    else
        take_spacings(stored, parsed, axes);
    check_spacing(stored.spacing, stored.where);
    const Vec3& o = stored.origin;
    const bool origin_given = parsed.seen(nrrdField_space_origin);
    const double* given = parsed.nrrd->spaceOrigin;
    if (!std::isfinite(o.x + o.y + o.z) || (origin_given && !std::isfinite(given[0] + given[1] + given[2])))
        throw InputError(fmt::format("{}: origin is ({},{},{}), but must be finite", stored.where, given[0],
                                     given[1], given[2]));
    const int space = parsed.nrrd->space;
    if (space != nrrdSpaceUnknown) stored.space = airEnumStr(nrrdSpace, space);
    if (space == nrrdSpaceLeftAnteriorSuperior || space == nrrdSpace3DLeftHanded)
        notes.push_back(
            fmt::format("{}: its space is left-handed; pictures show its mirror image", stored.where));
}

/// Reads the units and bits that save_nrrd stored.
void take_values(StoredVolume& stored, const Parsed& parsed) {
    const auto number = [&](const char* key) -> std::optional<double> {
        char* text = nrrdKeyValueGet(parsed.nrrd, key);
        if (!text) return {};
        char* end = nullptr;
        const double value = std::strtod(text, &end);
        const bool whole = end != text && *end == 0 && std::isfinite(value);
        free(text);
        if (!whole) throw InputError(fmt::format("{}: \"{}\" must be a finite number", stored.where, key));
        return value;
    };
    stored.value_scale = number(kScaleKey);
    stored.value_offset = number(kOffsetKey);
    if (const std::optional<double> bits = number(kBitsKey)) {
        if (*bits < 1 || *bits > 16)
            throw InputError(
                fmt::format("{}: \"{}\" is {}, but 1 to 16 are allowed", stored.where, kBitsKey, *bits));
        stored.scalar_bits = static_cast<int>(*bits);
    }
}

// --- Data --------------------------------------------------------------------------------------------------

std::size_t skip_lines(const MappedFile& file, std::size_t offset, unsigned lines, const std::string& where) {
    for (; lines > 0; --lines) {
        const void* newline =
            offset < file.size ? std::memchr(file.bytes.get() + offset, '\n', file.size - offset) : nullptr;
        if (!newline) throw InputError(fmt::format("{}: line skip reaches past the end of the data", where));
        offset = static_cast<std::size_t>(static_cast<const unsigned char*>(newline) - file.bytes.get()) + 1;
    }
    return offset;
}

void take_data(StoredVolume& stored, const Parsed& parsed, const MappedFile& file, std::size_t start,
               const LoadLimits& limits, const std::string& where) {
    const std::size_t offset = skip_lines(file, start, parsed.io->lineSkip, where);
    const long skip = parsed.io->byteSkip;
    if (skip < -1) throw InputError(fmt::format("{}: byte skip is {}, but must be -1 or more", where, skip));
    const bool at_end = skip == -1;
    const std::size_t bytes = at_end ? 0 : static_cast<std::size_t>(skip);
    if (parsed.io->encoding == nrrdEncodingGzip) {
        const std::optional<std::size_t> before = at_end ? std::nullopt : std::optional(bytes);
        return take_inflated(stored, file, offset, file.size - offset, before, limits, where);
    }
    if (parsed.io->encoding == nrrdEncodingAscii) {
        return take_ascii(stored, file, offset + std::min(bytes, file.size - offset), limits, where);
    }
    if (parsed.io->encoding != nrrdEncodingRaw)
        throw InputError(fmt::format("{}: encoding is {}, but raw, gzip and ascii are allowed", stored.where,
                                     parsed.io->encoding->name));
    if (at_end && file.size - offset >= stored.size())
        return take_mapped(stored, file, file.size - stored.size(), where);
    take_mapped(stored, file, bytes < file.size - offset ? offset + bytes : file.size, where);
}

}  // namespace

bool is_nrrd(const MappedFile& file) {
    return file.size >= 4 && std::memcmp(file.bytes.get(), "NRRD", 4) == 0;
}

StoredVolume read_nrrd(const std::string& path, const MappedFile& file, const LoadLimits& limits,
                       std::vector<std::string>& notes) {
    if (!is_nrrd(file))
        throw InputError(fmt::format("{}: no NRRD: the file does not begin with \"NRRD\"", path));
    const HeaderText header = split_header(path, file);
    check_version(path, header);
    const std::string data_file =
        header.data_file.empty() ? std::string() : data_path(path, header.data_file);
    const std::lock_guard lock(teem_lock());
    Parsed parsed;
    parse(path, header, parsed);

    StoredVolume stored;
    stored.where = path;
    take_type(stored, parsed);
    take_dims(stored, parsed);
    take_geometry(stored, parsed, notes);
    take_values(stored, parsed);
    if (data_file.empty())
        take_data(stored, parsed, file, header.end, limits, path);
    else
        take_data(stored, parsed, map_file(data_file), 0, limits, data_file);
    return stored;
}

void save_nrrd(const Volume& volume, const std::string& path) {
    const Vec3 &s = volume.spacing, o = volume.world_from_voxel(Vec3(0));
    const Vec3 x = volume.turn[0] * s.x, y = volume.turn[1] * s.y, z = volume.turn[2] * s.z;
    std::string header = fmt::format(
        "NRRD0004\n# written by squint\ntype: {}\ndimension: 3\nspace dimension: 3\nsizes: {} {} {}\n"
        "space directions: ({},{},{}) ({},{},{}) ({},{},{})\nkinds: domain domain domain\nendian: "
        "little\nencoding: raw\n"
        "space origin: ({},{},{})\n{}:={}\n{}:={}\n{}:={}\n",
        volume.type == ScalarType::u8 ? "uchar" : "ushort", volume.dims.x, volume.dims.y, volume.dims.z, x.x,
        x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z, o.x, o.y, o.z, kScaleKey, volume.value_scale, kOffsetKey,
        volume.value_offset, kBitsKey, volume.scalar_bits);
    // A comment pads the header: voxels that begin at a multiple of 64 can be mapped and used in
    // place.
    const std::size_t with_comment = header.size() + 3;
    header += "#" + std::string((64 - with_comment % 64) % 64, ' ') + "\n\n";
    const std::size_t bytes = static_cast<std::size_t>(volume.voxels()) * volume.scalar_bytes();
    write_parts_whole(path, {header, {static_cast<const char*>(volume.data.get()), bytes}});
}

}  // namespace squint
