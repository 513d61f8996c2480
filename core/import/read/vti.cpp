// Reads VTK's ImageData (.vti) with pugixml: text, base64 or appended raw data, plain or zlib in blocks.
#include "core/error.h"
#include "core/import/read/readers.h"

#include <fmt/format.h>
#include <zlib.h>
#include <pugixml.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>
#include <vector>

namespace squint::read {
namespace {

constexpr std::size_t kMostText = std::size_t{1} << 31;

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
    throw InputError(fmt::format("{}: {}", where, what));
}

/// As many numbers as the array holds.
template <class Number, std::size_t n>
std::array<Number, n> numbers(const char* text, const char* key, const std::string& where) {
    std::array<Number, n> list{};
    const char *at = text, *end = text + std::strlen(text);
    for (Number& number : list) {
        while (at < end && std::isspace(static_cast<unsigned char>(*at))) ++at;
        const auto [next, error] = std::from_chars(at, end, number);
        if (error != std::errc{}) refuse(where, fmt::format("{} needs {} numbers", key, n));
        at = next;
    }
    return list;
}

std::string from_base64(std::string_view text, std::size_t most, const std::string& where) {
    std::string bytes;
    std::uint32_t word = 0;
    int digits = 0;
    for (const char c : text) {
        if (c == '=' || bytes.size() >= most) break;
        const char* alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        const char* digit = c == '\0' ? nullptr : std::strchr(alphabet, c);
        if (std::isspace(static_cast<unsigned char>(c))) continue;
        if (digit == nullptr) refuse(where, "base64 data hold a byte that is no digit of theirs");
        word = word << 6 | static_cast<std::uint32_t>(digit - alphabet);
        if (++digits % 4 == 0)
            for (const int shift : {16, 8, 0}) bytes.push_back(static_cast<char>(word >> shift & 0xff));
    }
    if (digits % 4 == 2) bytes.push_back(static_cast<char>(word >> 4 & 0xff));
    if (digits % 4 == 3)
        for (const int shift : {10, 2}) bytes.push_back(static_cast<char>(word >> shift & 0xff));
    return bytes;
}
/// The digits of base64 that hold `bytes`.
std::size_t base64_length(std::size_t bytes) {
    return (bytes + 2) / 3 * 4;
}

/// An encoded array: a count or a table of blocks, then the data.
struct Encoded {
    std::string_view text;
    bool base64 = false, packed = false, wide = false, big = false;  // wide: counts of 64 bits

    std::uint64_t count_at(std::string_view bytes, std::size_t index, const std::string& where) const {
        const std::size_t width = wide ? 8 : 4;
        if (bytes.size() < (index + 1) * width) refuse(where, "data end within their own header");
        std::uint64_t count = 0;
        for (std::size_t i = 0; i < width; ++i) {
            const std::size_t from = big ? width - 1 - i : i;
            count |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes[index * width + from]))
                     << (8 * i);
        }
        return count;
    }
    std::string decoded(std::string_view part, std::size_t most, const std::string& where) const {
        return base64 ? from_base64(part, most, where) : std::string(part.substr(0, most));
    }

    void into(unsigned char* out, std::size_t size, const std::string& where) const {
        const std::size_t width = wide ? 8 : 4;
        if (!packed) {
            const std::string head = decoded(text, width, where);
            const std::uint64_t bytes = count_at(head, 0, where);
            if (bytes != size)
                refuse(where, fmt::format("{} bytes of voxels, but {} are needed", bytes, size));
            const std::string all = decoded(text, width + size, where);
            if (all.size() < width + size)
                refuse(where, fmt::format("data end before {} bytes of voxels", size));
            std::memcpy(out, all.data() + width, size);
            return;
        }
        // The number of blocks, a block's bytes, the last one's (0: whole), then each one's packed bytes.
        const std::string first = decoded(text, 3 * width, where);
        const std::uint64_t blocks = count_at(first, 0, where), whole = count_at(first, 1, where);
        if (blocks > text.size() || whole > size + (std::uint64_t{1} << 30))
            refuse(where, fmt::format("{} blocks of {} bytes cannot be", blocks, whole));
        const std::size_t head_bytes = (3 + static_cast<std::size_t>(blocks)) * width;
        const std::string head = decoded(text, head_bytes, where);
        std::uint64_t packed_bytes = 0;
        for (std::size_t b = 0; b < blocks; ++b) packed_bytes += count_at(head, 3 + b, where) & 0xffffffffffu;
        const std::size_t start = base64 ? base64_length(head_bytes) : head_bytes;
        if (start > text.size() || packed_bytes > text.size()) refuse(where, "data end before their blocks");
        const std::string data = decoded(text.substr(start), static_cast<std::size_t>(packed_bytes), where);
        std::size_t from = 0, to = 0;
        for (std::size_t b = 0; b < blocks; ++b) {
            const std::size_t bytes = static_cast<std::size_t>(count_at(head, 3 + b, where));
            if (bytes > data.size() - from) refuse(where, "data end before their blocks");
            uLongf got =
                static_cast<uLongf>(std::min<std::size_t>(size - to, static_cast<std::size_t>(whole)));
            if (uncompress(out + to, &got, reinterpret_cast<const Bytef*>(data.data() + from), bytes) != Z_OK)
                refuse(where, fmt::format("compressed data are damaged in block {}", b));
            from += bytes, to += got;
        }
        if (to != size) refuse(where, fmt::format("{} bytes of voxels, but {} are needed", to, size));
    }
};

template <class T>
void parse_text(const char* at, const char* end, std::size_t count, unsigned char* out,
                const std::string& where) {
    for (std::size_t i = 0; i < count; ++i) {
        while (at < end && std::isspace(static_cast<unsigned char>(*at))) ++at;
        T number{};
        const auto [next, error] = std::from_chars(at, end, number);
        if (error != std::errc{})
            refuse(where, fmt::format("number {} of {} is none of its type's", i, count));
        std::memcpy(out + i * sizeof number, &number, sizeof number);
        at = next;
    }
}

constexpr std::pair<std::string_view, StoredType> kTypes[] = {
    {"UInt8", StoredType::u8},    {"Int8", StoredType::i8},    {"UInt16", StoredType::u16},
    {"Int16", StoredType::i16},   {"UInt32", StoredType::u32}, {"Int32", StoredType::i32},
    {"UInt64", StoredType::u64},  {"Int64", StoredType::i64},  {"Float32", StoredType::f32},
    {"Float64", StoredType::f64},
};

/// The array that Scalars names, or else the first.
pugi::xml_node array_of(const pugi::xml_node& piece, bool& of_cells, Handover& h) {
    for (const char* kind : {"PointData", "CellData"}) {
        const pugi::xml_node data = piece.child(kind);
        if (!data.child("DataArray")) continue;
        of_cells = std::string_view(kind) == "CellData";
        const std::string scalars = data.attribute("Scalars").value();
        for (const pugi::xml_node& array : data.children("DataArray"))
            if (scalars == array.attribute("Name").value()) return array;
        std::size_t arrays = 0;
        for ([[maybe_unused]] const pugi::xml_node& array : data.children("DataArray")) ++arrays;
        if (arrays > 1)
            h.notes.push_back(fmt::format("{}: {} arrays and none is its scalars: the first is taken",
                                          h.stored.where, arrays));
        return data.child("DataArray");
    }
    refuse(h.stored.where, "no DataArray in PointData or CellData");
}

/// The voxels are points, or cells: these lie half a step inwards, one fewer along each axis.
void take_geometry(Handover& h, const pugi::xml_node& image, const pugi::xml_node& piece, bool of_cells) {
    const std::string& where = h.stored.where;
    const auto extent = numbers<std::int64_t, 6>(
        piece.attribute("Extent").as_string(image.attribute("WholeExtent").value()), "Extent", where);
    const auto origin = numbers<double, 3>(image.attribute("Origin").as_string("0 0 0"), "Origin", where);
    const auto spacing = numbers<double, 3>(image.attribute("Spacing").as_string("1 1 1"), "Spacing", where);
    const auto turn =
        numbers<double, 9>(image.attribute("Direction").as_string("1 0 0 0 1 0 0 0 1"), "Direction", where);
    h.stored.first_voxel = Vec3(origin[0], origin[1], origin[2]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        constexpr std::int64_t kFar = std::int64_t{1} << 40;
        const std::int64_t low = extent[2 * axis], high = extent[2 * axis + 1];
        if (low < -kFar || high > kFar || high < low) refuse(where, "Extent holds a range that cannot be");
        h.stored.dims[static_cast<int>(axis)] =
            of_cells ? std::max<std::int64_t>(high - low, 1) : high - low + 1;
        for (std::size_t world = 0; world < 3; ++world)
            h.stored.steps[axis][static_cast<int>(world)] = turn[3 * world + axis] * spacing[axis];
        h.stored.first_voxel +=
            h.stored.steps[axis] * (static_cast<double>(low) + (of_cells && high > low ? 0.5 : 0));
    }
    checked_bytes(h.stored.dims, 8, where);
}

}  // namespace

Handover read_vti(const Request& request) {
    const std::string& where = request.path;
    const MappedFile file = map_file(where);
    if (file.size > kMostText) refuse(where, "more than 2 GiB of XML");
    const std::string_view text(reinterpret_cast<const char*>(file.bytes.get()), file.size);
    // Appended raw data are no XML: only what stands before them is parsed.
    const std::size_t appended = text.find("<AppendedData");
    std::string xml(text.substr(0, appended));
    if (appended != std::string_view::npos) xml += "</VTKFile>";
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer(xml.data(), xml.size());
    if (!parsed) refuse(where, fmt::format("XML: {} at byte {}", parsed.description(), parsed.offset));
    const pugi::xml_node root = document.child("VTKFile"), image = root.child("ImageData"),
                         piece = image.child("Piece");
    if (!piece) refuse(where, "no VTKFile with ImageData of a Piece");
    if (piece.next_sibling("Piece")) refuse(where, "ImageData in several pieces, but one is allowed");
    Handover h;
    StoredVolume& stored = h.stored;
    stored.where = where;
    bool of_cells = false;
    const pugi::xml_node array = array_of(piece, of_cells, h);
    const auto* type = std::find_if(std::begin(kTypes), std::end(kTypes), [&](const auto& t) {
        return t.first == array.attribute("type").value();
    });
    if (type == std::end(kTypes)) refuse(where, "its DataArray's type is none of integers and floats");
    stored.type = type->second;
    take_geometry(h, image, piece, of_cells);
    const std::int64_t components = array.attribute("NumberOfComponents").as_llong(1);
    if (components < 1 || components > 65536) refuse(where, "NumberOfComponents must be 1 to 65536");
    stored.components = components;
    const std::string_view format = array.attribute("format").value();
    const std::string_view compressor = root.attribute("compressor").value();
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
        refuse(where, "compressed by other than vtkZLibDataCompressor, which alone is allowed");
    if (stored.size() / 1032 > file.size)
        refuse(where, fmt::format("{} bytes, but {}", file.size, needs(stored)));
    if (format == "ascii") {
        const std::string_view body = array.child_value();
        unsigned char* out = room_for(stored, request.limits);
        const std::size_t count = stored.size() / bytes_of(stored.type);
        const auto parse = [&](auto number) {
            parse_text<decltype(number)>(body.data(), body.data() + body.size(), count, out, where);
        };
        switch (stored.type) {
            case StoredType::u8:
                parse(std::uint8_t{});
                break;
            case StoredType::i8:
                parse(std::int8_t{});
                break;
            case StoredType::u16:
                parse(std::uint16_t{});
                break;
            case StoredType::i16:
                parse(std::int16_t{});
                break;
            case StoredType::u32:
                parse(std::uint32_t{});
                break;
            case StoredType::i32:
                parse(std::int32_t{});
                break;
            case StoredType::u64:
                parse(std::uint64_t{});
                break;
            case StoredType::i64:
                parse(std::int64_t{});
                break;
            case StoredType::f32:
                parse(float{});
                break;
            case StoredType::f64:
                parse(double{});
                break;
        }
        return h;
    }
    stored.big_endian = std::string_view(root.attribute("byte_order").value()) == "BigEndian";
    Encoded data;
    data.base64 = true;
    data.packed = !compressor.empty();
    data.wide = std::string_view(root.attribute("header_type").value()) == "UInt64";
    data.big = stored.big_endian;
    if (format == "binary") {
        data.text = array.child_value();
    } else if (format == "appended" && appended != std::string_view::npos) {
        const std::size_t tag_end = text.find('>', appended), mark = text.find('_', appended);
        const std::size_t offset = array.attribute("offset").as_ullong(0);
        if (tag_end == std::string_view::npos || mark == std::string_view::npos ||
            offset > text.size() - mark - 1)
            refuse(where, "AppendedData without its voxels");
        data.base64 = text.substr(appended, tag_end - appended).find("\"raw\"") == std::string_view::npos;
        const std::size_t start = mark + 1 + offset;
        data.text = text.substr(start);
        if (data.base64) data.text = data.text.substr(0, data.text.find('<'));
    } else {
        refuse(where, "its DataArray's format is none of ascii, binary and appended");
    }
    data.into(room_for(stored, request.limits), stored.size(), where);
    return h;
}

}  // namespace squint::read
