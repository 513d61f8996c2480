// NRRD: the header is read with teem, raw data are mapped, gzip data are inflated into exactly the room they
// need.
#include "core/nrrd.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <teem/nrrd.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <string_view>

namespace squint {
namespace {

constexpr std::size_t kLongestHeader = std::size_t{1} << 20;
/// Deflate makes at most 1032 bytes of one (two bits for a match of 258 bytes).
constexpr std::size_t kMostBytesPerDeflatedByte = 1032;
constexpr std::size_t kLongestSkip = std::size_t{1} << 30;
/// Off-axis part of a direction that counts as rounding: under a tenth of a voxel at 8,192 voxels.
constexpr double kObliqueTolerance = 1e-5;

constexpr const char* kScaleKey = "squint value scale";
constexpr const char* kOffsetKey = "squint value offset";
constexpr const char* kBitsKey = "squint scalar bits";

// --- The header's text
// -----------------------------------------------------------------------------------------------------

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

/// The data file beside the header.  A header from elsewhere must not make us read any file it likes.
std::string data_path(const std::string& path, const std::string& name) {
    const std::filesystem::path data(name);
    if (name == "LIST" || name.starts_with("LIST ") || name.find('%') != std::string::npos)
        throw InputError(fmt::format(
            "{}: data file is \"{}\", but data in several files are not supported: one name is allowed", path,
            excerpt(name)));
    if (data.is_absolute() || std::find(data.begin(), data.end(), "..") != data.end())
        throw InputError(fmt::format(
            "{}: data file is \"{}\", but only files in the header's own folder or below are allowed", path,
            excerpt(name)));
    const std::filesystem::path folder = std::filesystem::path(path).parent_path(), file = folder / data;
    std::error_code error;
    const auto really = [&](const std::filesystem::path& p) { return std::filesystem::canonical(p, error); };
    const std::filesystem::path home = really(folder.empty() ? "." : folder), there = really(file);
    if (!error && std::mismatch(home.begin(), home.end(), there.begin(), there.end()).first != home.end())
        throw InputError(fmt::format(
            "{}: data file is \"{}\", a link to elsewhere, but only files in the header's own folder "
            "or below are allowed: put the header beside the file that the link leads to",
            path, excerpt(name)));
    return file.string();  // where there is none, opening it says so
}

// --- teem
// ------------------------------------------------------------------------------------------------------------------

/// teem keeps its errors in one place for all threads.
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

/// biff's message has a line for every caller, the deepest and most telling last: that one, and what was
/// being parsed.
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

// --- What the header says
// --------------------------------------------------------------------------------------------------

void take_type(StoredVolume& stored, const Parsed& parsed) {
    switch (parsed.nrrd->type) {
        case nrrdTypeUChar:
            stored.type = StoredType::u8;
            break;
        case nrrdTypeShort:
            stored.type = StoredType::i16;
            break;
        case nrrdTypeUShort:
            stored.type = StoredType::u16;
            break;
        case nrrdTypeFloat:
            stored.type = StoredType::f32;
            break;
        default:
            throw InputError(fmt::format("{}: type is {}, but uchar, short, ushort and float are allowed",
                                         stored.where, airEnumStr(nrrdType, parsed.nrrd->type)));
    }
    if (stored.type != StoredType::u8 && parsed.io->endian == airEndianUnknown)
        throw InputError(fmt::format("{}: endian is missing, but little or big is needed for {} bits",
                                     stored.where, bytes_of(stored.type) * 8));
    stored.big_endian = parsed.io->endian == airEndianBig;
}

void take_dims(StoredVolume& stored, const Parsed& parsed) {
    if (parsed.nrrd->dim != 3)
        throw InputError(
            fmt::format("{}: dimension is {}, but 3 is allowed", stored.where, parsed.nrrd->dim));
    for (int axis = 0; axis < 3; ++axis) {
        const std::size_t size = parsed.nrrd->axis[axis].size;
        if (size > static_cast<std::size_t>(std::numeric_limits<std::int64_t>::max()))
            throw InputError(
                fmt::format("{}: axis {} has {} voxels, which is too many", stored.where, axis, size));
        stored.dims[axis] = static_cast<std::int64_t>(size);
    }
    checked_bytes(stored.dims, bytes_of(stored.type), stored.where);
}

/// Axes from `space directions`: each along a world axis, in any order and either sense.
void take_directions(StoredVolume& stored, const Nrrd& nrrd) {
    if (nrrd.spaceDim != 3)
        throw InputError(
            fmt::format("{}: space dimension is {}, but 3 is allowed", stored.where, nrrd.spaceDim));
    std::array<bool, 3> taken{};
    for (int axis = 0; axis < 3; ++axis) {
        const double* direction = nrrd.axis[axis].spaceDirection;
        const Vec3 v(direction[0], direction[1], direction[2]);
        const std::string text = fmt::format("({},{},{})", v.x, v.y, v.z);
        if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z) || v == Vec3(0))
            throw InputError(
                fmt::format("{}: space direction of axis {} is {}, but must be finite and not zero",
                            stored.where, axis, text));
        int world = 0;
        for (int i = 1; i < 3; ++i)
            if (std::abs(v[i]) > std::abs(v[world])) world = i;
        for (int i = 0; i < 3; ++i)
            if (i != world && std::abs(v[i]) > kObliqueTolerance * std::abs(v[world]))
                throw InputError(
                    fmt::format("{}: axis {} is oblique, its space direction is {}, but only axes along x, y "
                                "or z are allowed",
                                stored.where, axis, text));
        if (taken[world])
            throw InputError(fmt::format("{}: axis {} with space direction {} lies along an earlier axis",
                                         stored.where, axis, text));
        taken[world] = true;
        stored.axis[world] = axis;
        stored.flipped[world] = v[world] < 0;
        stored.spacing[world] = std::abs(v[world]);
    }
    for (int world = 0; world < 3; ++world) {
        const double origin = nrrd.spaceOrigin[world];
        stored.origin[world] = AIR_EXISTS(origin) ? origin : 0;
        if (stored.flipped[world])
            stored.origin[world] -=
                stored.spacing[world] * static_cast<double>(stored.dims[stored.axis[world]] - 1);
    }
}

/// What `axis mins` and `axis maxs` say of an axis: a voxel is between two cell faces, or on two nodes; cells
/// where the file does not say, as teem has it.
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

/// Axes from `spacings`, `axis mins` and `axis maxs`, in the file's order.
void take_spacings(StoredVolume& stored, const Parsed& parsed) {
    const bool given = parsed.seen(nrrdField_spacings);
    for (int axis = 0; axis < 3; ++axis) {
        const NrrdAxisInfo& info = parsed.nrrd->axis[axis];
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
    if (parsed.seen(nrrdField_space_directions))
        take_directions(stored, *parsed.nrrd);
    else
        take_spacings(stored, parsed);
    check_spacing(stored.spacing, stored.where);
    const Vec3& o = stored.origin;
    const bool origin_given = parsed.seen(nrrdField_space_origin);
    const double* given = parsed.nrrd->spaceOrigin;
    if (!std::isfinite(o.x + o.y + o.z) || (origin_given && !std::isfinite(given[0] + given[1] + given[2])))
        throw InputError(fmt::format("{}: origin is ({},{},{}), but must be finite", stored.where, given[0],
                                     given[1], given[2]));
    const int space = parsed.nrrd->space;
    if (space == nrrdSpaceLeftAnteriorSuperior || space == nrrdSpace3DLeftHanded)
        notes.push_back(
            fmt::format("{}: its space is left-handed; pictures show its mirror image", stored.where));
    if (space == nrrdSpaceRightAnteriorSuperior || space == nrrdSpaceRightAnteriorSuperiorTime)
        notes.push_back(fmt::format(
            "{}: its space is right-anterior-superior and its axes are kept; those of DICOM, which are "
            "left-posterior-superior, show it turned by half a turn about z",
            stored.where));
}

/// Units and bits that save_nrrd kept.
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

// --- Data
// ------------------------------------------------------------------------------------------------------------------

std::size_t skip_lines(const MappedFile& file, std::size_t offset, unsigned lines, const std::string& where) {
    for (; lines > 0; --lines) {
        const void* newline =
            offset < file.size ? std::memchr(file.bytes.get() + offset, '\n', file.size - offset) : nullptr;
        if (!newline) throw InputError(fmt::format("{}: line skip reaches past the end of the data", where));
        offset = static_cast<std::size_t>(static_cast<const unsigned char*>(newline) - file.bytes.get()) + 1;
    }
    return offset;
}

/// A gzip stream (or several in a row) read into room that is given: what does not fit stays in the stream.
class Inflater {
  public:
    Inflater(const unsigned char* data, std::size_t size, std::string where)
        : next_(data), left_(size), where_(std::move(where)) {
        if (inflateInit2(&stream_, 15 + 16) != Z_OK)
            throw std::bad_alloc();  // 15: any window; + 16: gzip only
    }
    ~Inflater() { inflateEnd(&stream_); }
    Inflater(const Inflater&) = delete;
    Inflater& operator=(const Inflater&) = delete;

    /// Whether the last member came to its end, its checksum and length right.
    bool whole() const { return whole_; }

    /// Bytes written: fewer than `room` only where the data end.
    std::size_t read(unsigned char* out, std::size_t room) {
        std::size_t done = 0;
        while (done < room && !ended_) {
            feed(out + done, room - done);
            const std::size_t before = stream_.avail_out;
            const int status = inflate(&stream_, Z_NO_FLUSH);
            done += before - stream_.avail_out;
            left_ -= static_cast<std::size_t>(stream_.next_in - next_);
            next_ = stream_.next_in;
            if (status == Z_STREAM_END)
                end_of_member();
            else if (status == Z_BUF_ERROR && left_ == 0)
                ended_ = true;  // cut short: the caller counts
            else if (status != Z_OK && status != Z_BUF_ERROR)
                throw InputError(fmt::format("{}: gzip data are damaged: {}", where_,
                                             stream_.msg ? stream_.msg : "unknown reason"));
        }
        return done;
    }

  private:
    void feed(unsigned char* out, std::size_t room) {
        constexpr std::size_t kMost = std::size_t{1} << 30;  // zlib counts in 32 bits
        stream_.next_in = const_cast<unsigned char*>(next_);
        stream_.avail_in = static_cast<unsigned>(std::min(left_, kMost));
        stream_.next_out = out;
        stream_.avail_out = static_cast<unsigned>(std::min(room, kMost));
    }
    void end_of_member() {
        const bool another = left_ >= 2 && next_[0] == 0x1f && next_[1] == 0x8b;
        ended_ = whole_ = !another;
        if (another) inflateReset(&stream_);
    }

    z_stream stream_{};
    const unsigned char* next_;
    std::size_t left_;
    std::string where_;
    bool ended_ = false, whole_ = false;
};

void take_inflated(StoredVolume& stored, const MappedFile& file, std::size_t offset, std::size_t skip,
                   const LoadLimits& limits, const std::string& where) {
    const std::size_t packed = file.size - offset, size = stored.size();
    if (size / kMostBytesPerDeflatedByte > packed)
        throw InputError(fmt::format("{}: {} bytes of gzip data hold at most {} bytes of voxels, but {}",
                                     where, packed, packed * kMostBytesPerDeflatedByte, needs(stored)));
    check_memory(size, stored, limits);
    if (skip > kLongestSkip)
        throw InputError(
            fmt::format("{}: byte skip is {}, but at most {} is allowed", where, skip, kLongestSkip));

    Inflater inflater(file.bytes.get() + offset, packed, where);
    unsigned char scratch[4096];
    for (std::size_t left = skip; left > 0;) {
        const std::size_t got = inflater.read(scratch, std::min(left, sizeof scratch));
        if (got == 0)
            throw InputError(fmt::format("{}: byte skip is {}, but the data end before", where, skip));
        left -= got;
    }
    const std::shared_ptr<void> memory = allocate_voxels(size, where);
    stored.inflated = std::shared_ptr<unsigned char>(memory, static_cast<unsigned char*>(memory.get()));
    const std::size_t got = inflater.read(stored.inflated.get(), size);
    if (got < size)
        throw InputError(fmt::format("{}: {} bytes of voxels, but {}", where, got, needs(stored)));
    if (inflater.read(scratch, 1) != 0)
        throw InputError(fmt::format("{}: more than {} bytes of voxels, but {}", where, size, needs(stored)));
    if (!inflater.whole())
        throw InputError(fmt::format(
            "{}: gzip data end before their checksum: the file is cut short, compress or copy it anew",
            where));
}

void take_data(StoredVolume& stored, const Parsed& parsed, const MappedFile& file, std::size_t start,
               const LoadLimits& limits, const std::string& where) {
    const std::size_t offset = skip_lines(file, start, parsed.io->lineSkip, where);
    const long skip = parsed.io->byteSkip;
    if (parsed.io->encoding == nrrdEncodingGzip) {
        if (skip < 0)
            throw InputError(
                fmt::format("{}: byte skip is {}, but must not be negative for gzip data", where, skip));
        return take_inflated(stored, file, offset, static_cast<std::size_t>(skip), limits, where);
    }
    if (parsed.io->encoding != nrrdEncodingRaw)
        throw InputError(fmt::format("{}: encoding is {}, but raw and gzip are allowed", stored.where,
                                     parsed.io->encoding->name));
    if (skip < -1) throw InputError(fmt::format("{}: byte skip is {}, but must be -1 or more", where, skip));
    if (skip == -1 && file.size >= stored.size())
        return take_mapped(stored, file, file.size - stored.size(), where);  // at the end
    const std::size_t bytes = skip > 0 ? static_cast<std::size_t>(skip) : 0;
    take_mapped(stored, file, bytes < file.size - offset ? offset + bytes : file.size, where);
}

}  // namespace

bool is_nrrd(const MappedFile& file) {
    return file.size >= 4 && std::memcmp(file.bytes.get(), "NRRD", 4) == 0;
}

void take_mapped(StoredVolume& stored, const MappedFile& file, std::size_t offset, const std::string& where) {
    const std::size_t there = file.size - offset;
    if (there != stored.size())
        throw InputError(fmt::format("{}: {} bytes of voxels{}, but {}{}", where, there,
                                     offset ? fmt::format(" after the first {}", offset) : "", needs(stored),
                                     there > stored.size() ? ": oversized" : ""));
    stored.bytes = std::shared_ptr<const unsigned char>(file.bytes, file.bytes.get() + offset);
    // Whole voxels of each hole.
    const std::size_t width = bytes_of(stored.type);
    for (const ByteRun& hole : file.holes) {
        const std::size_t first = (std::max(hole.first, offset) - offset + width - 1) / width,
                          end = (std::max(hole.end, offset) - offset) / width;
        if (first < end)
            stored.zeros.push_back({static_cast<std::int64_t>(first), static_cast<std::int64_t>(end)});
    }
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
    const Vec3 &s = volume.spacing, &o = volume.origin;
    std::string header = fmt::format(
        "NRRD0004\n# written by squint\ntype: {}\ndimension: 3\nspace dimension: 3\nsizes: {} {} {}\n"
        "space directions: ({},0,0) (0,{},0) (0,0,{})\nkinds: domain domain domain\nendian: "
        "little\nencoding: raw\n"
        "space origin: ({},{},{})\n{}:={}\n{}:={}\n{}:={}\n",
        volume.type == ScalarType::u8 ? "uchar" : "ushort", volume.dims.x, volume.dims.y, volume.dims.z, s.x,
        s.y, s.z, o.x, o.y, o.z, kScaleKey, volume.value_scale, kOffsetKey, volume.value_offset, kBitsKey,
        volume.scalar_bits);
    // A comment fills the header up: voxels that begin at a multiple of 64 can be mapped and used where they
    // lie.
    const std::size_t with_comment = header.size() + 3;
    header += "#" + std::string((64 - with_comment % 64) % 64, ' ') + "\n\n";
    const std::size_t bytes = static_cast<std::size_t>(volume.voxels()) * volume.scalar_bytes();
    write_parts_whole(path, {header, {static_cast<const char*>(volume.data.get()), bytes}});
}

}  // namespace squint
