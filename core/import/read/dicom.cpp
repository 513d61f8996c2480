// Reads a DICOM series with DCMTK: slices sorted by position, one rescale for all.  Looks only at the
// attributes that say how voxels lie and what they mean: no name of a person and no date leaves this process.
#include "core/error.h"
#include "core/import/axes.h"
#include "core/import/read/readers.h"

#include <dcmtk/config/osconfig.h>

#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

namespace squint::read {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostFiles = 20000;
constexpr int kDeepest = 4;  // folders in folders
/// Positions and directions have some six digits: gaps of a twentieth of a slice are rounding.
constexpr double kSameDirection = 1e-4, kSamePlace = 1e-3, kGap = 0.05;

struct Slice {
    std::string path;
    long series_number = 0, instance = 0;
    std::string series, modality, syntax;
    int columns = 0, rows = 0, frames = 1, samples = 1;
    int allocated = 16, stored = 16, high = 15;
    bool is_signed = false, has_position = false, has_spacing = false;
    double slope = 1, intercept = 0, thickness = 0;
    Vec3 position{0, 0, 0}, row{1, 0, 0}, column{0, 1, 0};
    double column_step = 1, row_step = 1;

    Vec3 normal() const { return row.cross(column); }
    double place() const { return position.dot(normal()); }
};

bool begins_like_dicom(const fs::path& path) {
    char head[132] = {};
    std::ifstream file(path, std::ios::binary);
    file.read(head, sizeof head);
    return file.gcount() == sizeof head && std::memcmp(head + 128, "DICM", 4) == 0;
}

std::vector<std::string> dicom_files(const std::string& path) {
    std::error_code error;
    std::vector<std::string> files;
    if (!fs::is_directory(path, error)) return {path};
    using Walk = fs::recursive_directory_iterator;
    for (Walk at(path, error); !error && at != Walk(); at.increment(error)) {
        if (at.depth() >= kDeepest) at.disable_recursion_pending();
        std::error_code ignored;
        if (!at->is_regular_file(ignored) || at->path().filename() == "DICOMDIR" ||
            !begins_like_dicom(at->path()))
            continue;
        files.push_back(at->path().string());
        if (files.size() > kMostFiles)
            throw InputError(
                fmt::format("{}: more than {} DICOM files, which is too many", path, kMostFiles));
    }
    if (files.empty())
        throw InputError(fmt::format(
            "{}: a folder without DICOM, TIFF or PNG slices; allowed: one of their series", path));
    std::sort(files.begin(), files.end());
    return files;
}

// --- Attributes ---------------------------------------------------------------------------------------------------

std::string text(DcmItem& data, const DcmTagKey& tag) {
    OFString value;
    return data.findAndGetOFString(tag, value).good() ? std::string(value.c_str()) : std::string();
}
long whole(DcmItem& data, const DcmTagKey& tag, long otherwise) {
    Sint32 number = 0;
    if (data.findAndGetSint32(tag, number).good()) return number;
    Uint16 small = 0;
    return data.findAndGetUint16(tag, small).good() ? small : otherwise;
}
/// `count` finite decimal numbers; empty where they are absent.
std::vector<double> numbers(DcmItem& data, const DcmTagKey& tag, unsigned long count) {
    std::vector<double> list;
    for (unsigned long i = 0; i < count; ++i) {
        Float64 value = 0;
        if (data.findAndGetFloat64(tag, value, i).bad() || !std::isfinite(value)) return {};
        list.push_back(value);
    }
    return list;
}

Slice slice_of(const std::string& path, const std::string& where) {
    DcmFileFormat file;
    const OFCondition loaded = file.loadFileUntilTag(path.c_str(), EXS_Unknown, EGL_noChange,
                                                     DCM_MaxReadLength, ERM_autoDetect, DCM_PixelData);
    if (loaded.bad()) throw InputError(fmt::format("{}: a damaged DICOM file: {}", where, loaded.text()));
    DcmDataset& data = *file.getDataset();
    Slice s;
    s.path = path;
    s.syntax = DcmXfer(data.getOriginalXfer()).getXferName();
    s.series = text(data, DCM_SeriesInstanceUID);
    s.series_number = whole(data, DCM_SeriesNumber, 0);
    s.instance = whole(data, DCM_InstanceNumber, 0);
    const std::string modality = text(data, DCM_Modality);
    const bool code =
        modality.size() <= 16 && std::all_of(modality.begin(), modality.end(), [](unsigned char c) {
            return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
        });
    s.modality = code ? modality : "";
    s.columns = static_cast<int>(whole(data, DCM_Columns, 0));
    s.rows = static_cast<int>(whole(data, DCM_Rows, 0));
    s.frames = static_cast<int>(whole(data, DCM_NumberOfFrames, 1));
    s.samples = static_cast<int>(whole(data, DCM_SamplesPerPixel, 1));
    s.allocated = static_cast<int>(whole(data, DCM_BitsAllocated, 16));
    s.stored = static_cast<int>(whole(data, DCM_BitsStored, s.allocated));
    s.high = static_cast<int>(whole(data, DCM_HighBit, s.stored - 1));
    s.is_signed = whole(data, DCM_PixelRepresentation, 0) == 1;
    if (const auto slope = numbers(data, DCM_RescaleSlope, 1); !slope.empty() && slope[0] != 0)
        s.slope = slope[0];
    if (const auto intercept = numbers(data, DCM_RescaleIntercept, 1); !intercept.empty())
        s.intercept = intercept[0];
    if (const auto thickness = numbers(data, DCM_SpacingBetweenSlices, 1); !thickness.empty())
        s.thickness = thickness[0];
    else if (const auto slab = numbers(data, DCM_SliceThickness, 1); !slab.empty())
        s.thickness = slab[0];
    if (const auto p = numbers(data, DCM_ImagePositionPatient, 3); !p.empty())
        s.position = Vec3(p[0], p[1], p[2]), s.has_position = true;
    if (const auto o = numbers(data, DCM_ImageOrientationPatient, 6); !o.empty()) {
        s.row = Vec3(o[0], o[1], o[2]), s.column = Vec3(o[3], o[4], o[5]);
        if (std::abs(s.row.length() - 1) > kSameDirection || std::abs(s.column.length() - 1) > kSameDirection)
            throw InputError(fmt::format("{}: ImageOrientationPatient holds no two unit vectors", where));
    }
    auto spacing = numbers(data, DCM_PixelSpacing, 2);
    if (spacing.empty()) spacing = numbers(data, DCM_ImagerPixelSpacing, 2);
    if (!spacing.empty()) s.row_step = spacing[0], s.column_step = spacing[1], s.has_spacing = true;
    return s;
}

// --- The series ---------------------------------------------------------------------------------------------------

std::string text_of(const Slice& s, std::size_t slices) {
    return fmt::format("{}{}x{}, {} slice{}", s.modality.empty() ? "" : s.modality + ", ", s.columns, s.rows,
                       slices, slices == 1 ? "" : "s");
}

std::vector<Slice> series_of(const Request& request) {
    std::map<std::pair<long, std::string>, std::vector<Slice>> all;
    for (const std::string& path : dicom_files(request.path)) {
        Slice slice = slice_of(path, request.path);
        if (slice.columns == 0 && slice.rows == 0) continue;  // a report, a presentation state: no picture
        all[{slice.series_number, slice.series}].push_back(std::move(slice));
    }
    if (all.empty()) throw InputError(fmt::format("{}: DICOM without pictures", request.path));
    if (request.series > 0 && static_cast<std::size_t>(request.series) <= all.size())
        return std::next(all.begin(), request.series - 1)->second;
    if (request.series == 0 && all.size() == 1) return all.begin()->second;
    std::string list;
    std::size_t number = 0;
    for (const auto& [key, slices] : all)
        list +=
            fmt::format("{}{} ({})", ++number == 1 ? "" : "; ", number, text_of(slices[0], slices.size()));
    throw InputError(fmt::format(
        "{}: {}{} series: {}; --series N or volume.series = N chooses one", request.path,
        request.series > 0 ? fmt::format("no series {}: ", request.series) : "", all.size(), list));
}

/// Refuses slices of which no volume can be made: all must be alike.
void check_alike(const std::vector<Slice>& slices, const std::string& where) {
    const Slice& a = slices[0];
    if (a.samples != 1)
        throw InputError(
            fmt::format("{}: {} samples a pixel (colour), but DICOM of one is allowed", where, a.samples));
    if (a.frames != 1)
        throw InputError(fmt::format("{}: {} frames in one file, but DICOM of one slice a file is allowed",
                                     where, a.frames));
    if ((a.allocated != 8 && a.allocated != 16 && a.allocated != 32) || a.stored < 1 ||
        a.stored > a.allocated || a.high != a.stored - 1)
        throw InputError(
            fmt::format("{}: {} bits allocated, {} stored, high bit {}, but 8, 16 or 32 bits with the "
                        "stored ones lowest are allowed",
                        where, a.allocated, a.stored, a.high));
    if (!(a.row_step > 0) || !(a.column_step > 0))
        throw InputError(fmt::format("{}: PixelSpacing is {} and {}, but must be above 0", where, a.row_step,
                                     a.column_step));
    for (const Slice& b : slices) {
        if (b.columns != a.columns || b.rows != a.rows)
            throw InputError(fmt::format("{}: slices of {}x{} and of {}x{} pixels in one series", where,
                                         a.columns, a.rows, b.columns, b.rows));
        if (b.allocated != a.allocated || b.stored != a.stored || b.high != a.high ||
            b.is_signed != a.is_signed || b.samples != a.samples || b.frames != a.frames)
            throw InputError(fmt::format("{}: slices of different types in one series", where));
        if ((b.row - a.row).length() > kSameDirection || (b.column - a.column).length() > kSameDirection)
            throw InputError(fmt::format("{}: slices of different orientations in one series", where));
        if (std::abs(b.row_step - a.row_step) > kSameDirection * a.row_step ||
            std::abs(b.column_step - a.column_step) > kSameDirection * a.column_step)
            throw InputError(fmt::format("{}: slices of different pixel spacings in one series", where));
    }
}

/// Several slices at each place, as of times or echoes: takes the one asked for, by instance number.
std::vector<Slice> one_a_place(std::vector<Slice> slices, const Request& request, bool& of_several) {
    std::vector<std::vector<Slice>> places;
    for (Slice& slice : slices) {
        if (places.empty() || slice.place() - places.back()[0].place() > kSamePlace) places.emplace_back();
        places.back().push_back(std::move(slice));
    }
    const std::size_t times = places[0].size();
    for (const auto& place : places)
        if (place.size() != times)
            throw InputError(fmt::format("{}: {} slices at {} mm and {} at {} mm along their normal",
                                         request.path, times, places[0][0].place(), place.size(),
                                         place[0].place()));
    if (times > 1 && (request.component < 0 || static_cast<std::size_t>(request.component) >= times))
        throw InputError(
            fmt::format("{}: {} slices at each place (times or echoes), but one is allowed: "
                        "volume.component = 0 to {} chooses it",
                        request.path, times, times - 1));
    of_several = times > 1;
    std::vector<Slice> chosen;
    for (const auto& place : places)
        chosen.push_back(place[times > 1 ? static_cast<std::size_t>(request.component) : 0]);
    return chosen;
}

/// The step from slice to slice; refuses uneven ones and says where the gap is.
Vec3 slice_step(const std::vector<Slice>& slices, Handover& h) {
    const Slice& a = slices[0];
    const std::string& where = h.stored.where;
    if (slices.size() == 1) return a.normal() * (a.thickness > 0 ? a.thickness : 1);
    std::vector<double> steps;
    for (std::size_t i = 1; i < slices.size(); ++i)
        steps.push_back(slices[i].place() - slices[i - 1].place());
    std::vector<double> sorted = steps;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                     sorted.end());
    const double usual = sorted[sorted.size() / 2];
    for (std::size_t i = 0; i < steps.size(); ++i)
        if (std::abs(steps[i] - usual) > kGap * usual)
            throw InputError(
                fmt::format("{}: a gap between the slices at {:.6g} and {:.6g} mm: {:.6g} mm, but {:.6g} "
                            "between the others; allowed: even steps",
                            where, slices[i].place(), slices[i + 1].place(), steps[i], usual));
    return (slices.back().position - a.position) / static_cast<double>(slices.size() - 1);
}

// --- Pixels -------------------------------------------------------------------------------------------------------

/// The pixels of a slice as stored numbers of `bytes` each, sign-extended from the bits stored.
void read_pixels(const Slice& s, unsigned char* out, std::size_t bytes, const std::string& where) {
    DcmFileFormat file;
    OFCondition done = file.loadFile(s.path.c_str());
    DcmDataset& data = *file.getDataset();
    if (done.good()) done = data.chooseRepresentation(EXS_LittleEndianExplicit, nullptr);
    if (done.bad() || !data.canWriteXfer(EXS_LittleEndianExplicit))
        throw InputError(
            fmt::format("{}: pixels in the transfer syntax \"{}\" cannot be read ({}); allowed: "
                        "uncompressed, RLE, JPEG and JPEG-LS",
                        where, s.syntax, done.bad() ? done.text() : "no decoder"));
    const std::size_t count = static_cast<std::size_t>(s.columns) * static_cast<std::size_t>(s.rows);
    DcmElement* element = nullptr;
    if (data.findAndGetElement(DCM_PixelData, element).bad() || element == nullptr)
        throw InputError(fmt::format("{}: a slice without pixels", where));
    Uint8* eight = nullptr;
    Uint16* sixteen = nullptr;
    const std::size_t there = element->getLength();
    const bool read = element->ident() == EVR_OB || element->ident() == EVR_UN
                          ? element->getUint8Array(eight).good()
                          : element->getUint16Array(sixteen).good();
    const void* pixels = eight != nullptr ? static_cast<const void*>(eight) : sixteen;
    if (!read || pixels == nullptr || there < count * bytes)
        throw InputError(fmt::format("{}: a slice of {} bytes of pixels, but {}x{} of {} bits needs {}",
                                     where, there, s.columns, s.rows, 8 * bytes, count * bytes));
    std::memcpy(out, pixels, count * bytes);
    const int unused = static_cast<int>(8 * bytes) - s.stored;
    if (unused == 0) return;
    const auto keep = [&](auto unsigned_number, auto signed_number) {
        using U = decltype(unsigned_number);
        using I = decltype(signed_number);
        for (std::size_t i = 0; i < count; ++i) {
            U word;
            std::memcpy(&word, out + i * bytes, bytes);
            word = static_cast<U>(word << unused);
            word =
                s.is_signed ? static_cast<U>(static_cast<I>(word) >> unused) : static_cast<U>(word >> unused);
            std::memcpy(out + i * bytes, &word, bytes);
        }
    };
    if (bytes == 1) keep(std::uint8_t{}, std::int8_t{});
    if (bytes == 2) keep(std::uint16_t{}, std::int16_t{});
    if (bytes == 4) keep(std::uint32_t{}, std::int32_t{});
}

StoredType type_of(const Slice& s) {
    if (s.allocated == 8) return s.is_signed ? StoredType::i8 : StoredType::u8;
    if (s.allocated == 16) return s.is_signed ? StoredType::i16 : StoredType::u16;
    return s.is_signed ? StoredType::i32 : StoredType::u32;
}

double number_at(const unsigned char* bytes, StoredType type) {
    const auto as = [&](auto number) {
        std::memcpy(&number, bytes, sizeof number);
        return static_cast<double>(number);
    };
    switch (type) {
        case StoredType::u8:
            return as(std::uint8_t{});
        case StoredType::i8:
            return as(std::int8_t{});
        case StoredType::u16:
            return as(std::uint16_t{});
        case StoredType::i16:
            return as(std::int16_t{});
        case StoredType::u32:
            return as(std::uint32_t{});
        default:
            return as(std::int32_t{});
    }
}

/// All slices one after the other; as float values where each has a rescale of its own.
void read_all(const std::vector<Slice>& slices, Handover& h, const LoadLimits& limits) {
    StoredVolume& stored = h.stored;
    const Slice& a = slices[0];
    const StoredType type = type_of(a);
    const bool one_scale = std::all_of(slices.begin(), slices.end(), [&](const Slice& s) {
        return s.slope == a.slope && s.intercept == a.intercept;
    });
    // 16-bit integer values, as in CT: the rescale is applied, and the numbers are the values.
    const double least = a.is_signed ? -std::ldexp(1, a.stored - 1) : 0,
                 most = std::ldexp(1, a.is_signed ? a.stored - 1 : a.stored) - 1;
    const bool whole = one_scale && a.slope == 1 && a.intercept == std::floor(a.intercept) &&
                       a.intercept != 0 && least + a.intercept >= -32768 && most + a.intercept <= 32767;
    const bool as_stored = one_scale && !whole;
    stored.type = as_stored ? type : whole ? StoredType::i16 : StoredType::f32;
    if (as_stored && (a.slope != 1 || a.intercept != 0))
        stored.value_scale = a.slope, stored.value_offset = a.intercept;
    std::error_code error;
    std::size_t there = 0;
    for (const Slice& s : slices) there += static_cast<std::size_t>(fs::file_size(s.path, error));
    if (stored.voxels() / 1024 > there)  // its best codec packs less than that
        throw InputError(
            fmt::format("{}: {} bytes hold no {} voxels", stored.where, there, squint::text_of(stored.dims)));
    unsigned char* out = room_for(stored, limits);
    const std::size_t count = static_cast<std::size_t>(a.columns) * static_cast<std::size_t>(a.rows),
                      bytes = bytes_of(type);
    std::vector<unsigned char> slice(as_stored ? 0 : count * bytes);
    for (std::size_t z = 0; z < slices.size(); ++z) {
        const Slice& s = slices[z];
        if (as_stored) {
            read_pixels(s, out + z * count * bytes, bytes, stored.where);
            continue;
        }
        read_pixels(s, slice.data(), bytes, stored.where);
        const auto put = [&](auto number, std::size_t i) {
            number = static_cast<decltype(number)>(s.slope * number_at(slice.data() + i * bytes, type) +
                                                   s.intercept);
            std::memcpy(out + (z * count + i) * sizeof number, &number, sizeof number);
        };
        for (std::size_t i = 0; i < count; ++i) {
            if (whole)
                put(std::int16_t{}, i);
            else
                put(float{}, i);
        }
    }
    if (!one_scale)
        h.notes.push_back(fmt::format(
            "{}: every slice has a rescale of its own, so its values are taken as floats", stored.where));
}

}  // namespace

Handover read_dicom(const Request& request) {
    OFLog::configure(OFLogger::OFF_LOG_LEVEL);
    DcmRLEDecoderRegistration::registerCodecs();
    DJDecoderRegistration::registerCodecs();
    DJLSDecoderRegistration::registerCodecs();

    std::vector<Slice> slices = series_of(request);
    Handover h;
    StoredVolume& stored = h.stored;
    stored.where = request.path;
    check_alike(slices, request.path);
    const bool placed =
        std::all_of(slices.begin(), slices.end(), [](const Slice& s) { return s.has_position; });
    const auto before = [&](const Slice& a, const Slice& b) {
        const double p = placed ? a.place() : 0, q = placed ? b.place() : 0;
        return std::abs(p - q) > kSamePlace ? p < q : a.instance < b.instance;
    };
    std::sort(slices.begin(), slices.end(), before);
    if (placed) {
        slices = one_a_place(std::move(slices), request, stored.component_chosen);
    } else {
        const double thickness = slices[0].thickness > 0 ? slices[0].thickness : 1;
        for (std::size_t i = 0; i < slices.size(); ++i)
            slices[i].position = slices[0].normal() * (thickness * static_cast<double>(i));
        h.notes.push_back(fmt::format("{}: slices without positions: sorted by their numbers, {} mm apart",
                                      request.path, thickness));
    }
    const Slice& first = slices[0];
    stored.dims = {first.columns, first.rows, static_cast<std::int64_t>(slices.size())};
    checked_bytes(stored.dims, 4, request.path);
    stored.space = kLps;
    stored.modality = first.modality;
    if (!first.has_spacing)
        h.notes.push_back(fmt::format("{}: no pixel spacing is given: 1 mm is taken", request.path));
    h.stored.steps = {first.row * first.column_step, first.column * first.row_step, slice_step(slices, h)};
    h.stored.first_voxel = first.position;
    read_all(slices, h, request.limits);
    return h;
}

}  // namespace squint::read
