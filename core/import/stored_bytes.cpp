// Voxels out of a file: mapped where they lie raw, otherwise inflated or parsed into memory of our own.
#include "core/import/stored_bytes.h"

#include "core/error.h"
#include "core/text.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <new>
#include <vector>

namespace squint {
namespace {

/// Deflate makes at most 1032 bytes of one (two bits for a match of 258 bytes).
constexpr std::size_t kMostBytesPerDeflatedByte = 1032;
constexpr std::size_t kLongestSkip = std::size_t{1} << 30;
constexpr std::int64_t kMostComponents = 1 << 16;

/// A gzip or zlib stream (or several of gzip in a row) read into room that is given: what does not fit stays in the stream.
class Inflater {
  public:
    Inflater(const unsigned char* data, std::size_t size, std::string where)
        : next_(data), left_(size), where_(std::move(where)) {
        if (inflateInit2(&stream_, 15 + 32) != Z_OK)
            throw std::bad_alloc();  // 15: any window; + 32: gzip or zlib, as the data begin
    }
    ~Inflater() { inflateEnd(&stream_); }
    Inflater(const Inflater&) = delete;
    Inflater& operator=(const Inflater&) = delete;

    /// Whether the last member ended with the right checksum and length.
    bool whole() const { return whole_; }

    /// Reads up to `room` bytes and returns how many: fewer only where the data end.
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
                throw InputError(fmt::format("{}: compressed data are damaged: {}", where_,
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

/// Allocates room for all numbers of `stored`.
unsigned char* room_of(StoredVolume& stored, const std::string& where) {
    const std::shared_ptr<void> memory = allocate_voxels(stored.size(), where);
    stored.inflated = std::shared_ptr<unsigned char>(memory, static_cast<unsigned char*>(memory.get()));
    return stored.inflated.get();
}

/// Parses numbers separated by blanks or commas as T into `out`; returns what was wrong, or nothing.
template <class T>
std::string parse_numbers(const char* at, const char* end, std::size_t count, unsigned char* out) {
    const auto separates = [](char c) { return c == ' ' || c == ',' || (c >= '\t' && c <= '\r'); };
    for (std::size_t i = 0; i < count; ++i) {
        while (at < end && separates(*at)) ++at;
        if (at == end) return fmt::format("{} numbers", i);
        if (*at == '+') ++at;
        T number{};
        const auto [next, error] = std::from_chars(at, end, number);
        if (error != std::errc{} || (next < end && !separates(*next)))
            return fmt::format(
                "number {} is \"{}\", which its type does not hold", i,
                excerpt(std::string_view(at, static_cast<std::size_t>(std::find_if(at, end, separates) - at)),
                        20));
        std::memcpy(out + i * sizeof number, &number, sizeof number);
        at = next;
    }
    while (at < end && separates(*at)) ++at;
    return at == end ? "" : fmt::format("more than {} numbers", count);
}

/// How many inflated bytes come before the last `size`; counts no further than a skip may go.
std::size_t bytes_before_the_last(std::size_t size, const unsigned char* packed, std::size_t packed_size,
                                  const std::string& where) {
    Inflater inflater(packed, packed_size, where);
    std::vector<unsigned char> scratch(1 << 16);
    std::size_t all = 0;
    while (all <= size + kLongestSkip) {
        const std::size_t got = inflater.read(scratch.data(), scratch.size());
        if (got == 0) break;
        all += got;
    }
    return all - std::min(all, size);
}

}  // namespace

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
    return file.string();  // if it does not exist, opening it says so
}

void take_mapped(StoredVolume& stored, const MappedFile& file, std::size_t offset, const std::string& where) {
    const std::size_t there = file.size - offset;
    if (there != stored.size())
        throw InputError(fmt::format("{}: {} bytes of voxels{}, but {}{}", where, there,
                                     offset ? fmt::format(" after the first {}", offset) : "", needs(stored),
                                     there > stored.size() ? ": oversized" : ""));
    stored.bytes = std::shared_ptr<const unsigned char>(file.bytes, file.bytes.get() + offset);
    // Only the whole voxels of each hole.
    const std::size_t width = bytes_of(stored.type);
    for (const ByteRun& hole : file.holes) {
        const std::size_t first = (std::max(hole.first, offset) - offset + width - 1) / width,
                          end = (std::max(hole.end, offset) - offset) / width;
        if (first < end)
            stored.zeros.push_back({static_cast<std::int64_t>(first), static_cast<std::int64_t>(end)});
    }
}

void take_inflated(StoredVolume& stored, const MappedFile& file, std::size_t offset, std::size_t packed,
                   std::optional<std::size_t> given_skip, const LoadLimits& limits,
                   const std::string& where) {
    const std::size_t size = stored.size();
    if (size / kMostBytesPerDeflatedByte > packed)
        throw InputError(
            fmt::format("{}: {} bytes of compressed data hold at most {} bytes of voxels, but {}", where,
                        packed, packed * kMostBytesPerDeflatedByte, needs(stored)));
    check_memory(size, stored, limits);
    const std::size_t skip =
        given_skip ? *given_skip : bytes_before_the_last(size, file.bytes.get() + offset, packed, where);
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
    const std::size_t got = inflater.read(room_of(stored, where), size);
    if (got < size)
        throw InputError(fmt::format("{}: {} bytes of voxels, but {}", where, got, needs(stored)));
    if (inflater.read(scratch, 1) != 0)
        throw InputError(fmt::format("{}: more than {} bytes of voxels, but {}", where, size, needs(stored)));
    if (!inflater.whole())
        throw InputError(fmt::format(
            "{}: compressed data end before their checksum: the file is cut short, compress or copy it anew",
            where));
}

void take_ascii(StoredVolume& stored, const MappedFile& file, std::size_t offset, const LoadLimits& limits,
                const std::string& where) {
    const std::size_t count = stored.size() / bytes_of(stored.type);
    if (count > (file.size - offset + 1) / 2)  // each number has a digit and a blank at least
        throw InputError(fmt::format("{}: {} bytes of text hold at most {} numbers, but {}", where,
                                     file.size - offset, (file.size - offset + 1) / 2, needs(stored)));
    check_memory(stored.size(), stored, limits);
    stored.big_endian = false;
    unsigned char* out = room_of(stored, where);
    const auto* text = reinterpret_cast<const char*>(file.bytes.get());
    const char *at = text + offset, *end = text + file.size;
    std::string wrong;
    switch (stored.type) {
        case StoredType::u8:
            wrong = parse_numbers<std::uint8_t>(at, end, count, out);
            break;
        case StoredType::i8:
            wrong = parse_numbers<std::int8_t>(at, end, count, out);
            break;
        case StoredType::u16:
            wrong = parse_numbers<std::uint16_t>(at, end, count, out);
            break;
        case StoredType::i16:
            wrong = parse_numbers<std::int16_t>(at, end, count, out);
            break;
        case StoredType::u32:
            wrong = parse_numbers<std::uint32_t>(at, end, count, out);
            break;
        case StoredType::i32:
            wrong = parse_numbers<std::int32_t>(at, end, count, out);
            break;
        case StoredType::u64:
            wrong = parse_numbers<std::uint64_t>(at, end, count, out);
            break;
        case StoredType::i64:
            wrong = parse_numbers<std::int64_t>(at, end, count, out);
            break;
        case StoredType::f32:
            wrong = parse_numbers<float>(at, end, count, out);
            break;
        case StoredType::f64:
            wrong = parse_numbers<double>(at, end, count, out);
            break;
    }
    if (!wrong.empty())
        throw InputError(fmt::format("{}: text of voxels: {}; {} numbers are needed", where, wrong, count));
}

void take_components(StoredVolume& stored, std::int64_t count, std::int64_t run) {
    if (count < 1 || count > kMostComponents)
        throw InputError(
            fmt::format("{}: {} components, but 1 to {} are allowed", stored.where, count, kMostComponents));
    stored.components = count, stored.component_run = run;
    Index3 all = stored.dims;
    all.z *= count;
    if (stored.dims.z > (std::int64_t{1} << 40)) all.z = 0;
    checked_bytes(all, bytes_of(stored.type), stored.where);
}

void choose_component(StoredVolume& stored, const VolumeSource& source) {
    if (stored.component_chosen || (stored.components == 1 && source.component.value_or(0) == 0)) return;
    if (!source.component)
        throw InputError(
            fmt::format("{}: {} numbers a voxel (colours, a vector or times), but one is allowed: "
                        "volume.component = 0 to {} chooses it",
                        stored.where, stored.components, stored.components - 1));
    if (*source.component < 0 || *source.component >= stored.components)
        throw InputError(fmt::format("{}: volume.component is {}, but 0 to {} are allowed", stored.where,
                                     *source.component, stored.components - 1));
    stored.component = *source.component;
}

}  // namespace squint
