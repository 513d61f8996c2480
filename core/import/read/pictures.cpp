// Reads a stack of pictures: a folder of TIFF or PNG in the order of their numbers, or a TIFF of many pages.
#include "core/pictures/pictures.h"
#include "core/error.h"
#include "core/import/read/readers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>

namespace squint::read {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostFiles = 65536;

/// Compares names so that "slice9" comes before "slice10": runs of digits count as numbers.
bool before(const std::string& a, const std::string& b) {
    const auto digit = [](char c) { return c >= '0' && c <= '9'; };
    std::size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        if (!digit(a[i]) || !digit(b[j])) {
            if (a[i] != b[j]) return a[i] < b[j];
            ++i, ++j;
            continue;
        }
        while (i < a.size() && a[i] == '0') ++i;
        while (j < b.size() && b[j] == '0') ++j;
        std::size_t m = i, n = j;
        while (m < a.size() && digit(a[m])) ++m;
        while (n < b.size() && digit(b[n])) ++n;
        if (m - i != n - j) return m - i < n - j;
        if (const int order = a.compare(i, m - i, b, j, n - j); order != 0) return order < 0;
        i = m, j = n;
    }
    return a.size() - i < b.size() - j || (a.size() - i == b.size() - j && a < b);
}

struct Source {
    std::string path;
    int page = 0;
};

std::vector<Source> sources_of(const std::string& path) {
    std::error_code error;
    std::vector<Source> sources;
    if (!fs::is_directory(path, error)) {
        const int pages = pictures::codec().count_pages(path);
        for (int page = 0; page < pages; ++page) sources.push_back({path, page});
        return sources;
    }
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(path, error)) {
        std::string extension = entry.path().extension().string();
        std::transform(extension.begin(), extension.end(), extension.begin(),
                       [](unsigned char c) { return std::tolower(c); });
        if (extension == ".tif" || extension == ".tiff" || extension == ".png")
            names.push_back(entry.path().filename().string());
        if (names.size() > kMostFiles)
            throw InputError(fmt::format("{}: more than {} pictures, which is too many", path, kMostFiles));
    }
    std::sort(names.begin(), names.end(), before);
    for (const std::string& name : names) sources.push_back({(fs::path(path) / name).string(), 0});
    return sources;
}

StoredType type_of(pictures::Page::Type type) {
    using Type = pictures::Page::Type;
    switch (type) {
        case Type::u8:
            return StoredType::u8;
        case Type::i8:
            return StoredType::i8;
        case Type::u16:
            return StoredType::u16;
        case Type::i16:
            return StoredType::i16;
        case Type::u32:
            return StoredType::u32;
        case Type::i32:
            return StoredType::i32;
        case Type::f32:
            return StoredType::f32;
        case Type::f64:
            break;
    }
    return StoredType::f64;
}

}  // namespace

Handover read_pictures(const Request& request) {
    const std::vector<Source> sources = sources_of(request.path);
    Handover h;
    StoredVolume& stored = h.stored;
    stored.where = request.path;
    unsigned char* out = nullptr;
    for (std::size_t z = 0; z < sources.size(); ++z) {
        const pictures::Page page = pictures::codec().read_page(sources[z].path, sources[z].page);
        if (z == 0) {
            stored.type = type_of(page.type);
            stored.dims = {page.width, page.height, static_cast<std::int64_t>(sources.size())};
            stored.components = page.channels;
            checked_bytes(stored.dims, bytes_of(stored.type), request.path);
            out = room_for(stored, request.limits);
        }
        if (page.width != stored.dims.x || page.height != stored.dims.y ||
            page.channels != stored.components || type_of(page.type) != stored.type)
            throw InputError(fmt::format(
                "{}: slice {} has {}x{} pixels of {} channel{} ({}), but slice 0 {}x{} of {} "
                "({}); allowed: slices alike",
                request.path, z, page.width, page.height, page.channels, page.channels == 1 ? "" : "s",
                kStoredTypes[static_cast<std::size_t>(type_of(page.type))], stored.dims.x, stored.dims.y,
                stored.components, kStoredTypes[static_cast<std::size_t>(stored.type)]));
        std::memcpy(out + z * page.bytes.size(), page.bytes.data(), page.bytes.size());
    }
    return h;
}

}  // namespace squint::read
