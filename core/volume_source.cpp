// Loads the volume of a [volume] table: a file or folder of any kind that is read, or a procedural field.
#include "core/volume_source.h"

#include "core/error.h"
#include "core/import/axes.h"
#include "core/import/child.h"
#include "core/import/kind.h"
#include "core/import/meta_image.h"
#include "core/import/stored_bytes.h"
#include "core/nrrd.h"
#include "core/procedural.h"
#include "core/volume_stored.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>

namespace squint {
namespace {

Vec3 spacing_of(const VolumeSource& source, const std::string& where, const Vec3& otherwise) {
    if (source.spacing.empty()) return otherwise;
    if (source.spacing.size() != 3)
        throw InputError(
            fmt::format("{}: spacing has {} numbers, but needs three", where, source.spacing.size()));
    const Vec3 spacing(source.spacing[0], source.spacing[1], source.spacing[2]);
    check_spacing(spacing, where);
    return spacing;
}

StoredVolume read_raw(const VolumeSource& source, const MappedFile& file) {
    StoredVolume stored;
    stored.where = source.file;
    if (source.dims.size() != 3)
        throw InputError(fmt::format("{}: dims has {} numbers, but a raw file needs three", stored.where,
                                     source.dims.size()));
    stored.dims = {source.dims[0], source.dims[1], source.dims[2]};
    const auto* type = std::find(std::begin(kStoredTypes), std::end(kStoredTypes), source.type);
    if (type == std::end(kStoredTypes))
        throw InputError(fmt::format("{}: type is \"{}\", but a raw file needs one of {}", stored.where,
                                     source.type, fmt::join(kStoredTypes, ", ")));
    stored.type = static_cast<StoredType>(type - std::begin(kStoredTypes));
    if (source.endian != "little" && source.endian != "big")
        throw InputError(
            fmt::format("{}: endian is \"{}\", but little and big are allowed", stored.where, source.endian));
    stored.big_endian = source.endian == "big";
    if (source.offset < 0 || static_cast<std::size_t>(source.offset) > file.size)
        throw InputError(fmt::format("{}: offset is {}, but 0 to the file's size of {} is allowed",
                                     stored.where, source.offset, file.size));
    checked_bytes(stored.dims, bytes_of(stored.type), stored.where);
    take_mapped(stored, file, static_cast<std::size_t>(source.offset), stored.where);
    return stored;
}

/// The kind of a file or folder, by its name and its first bytes.
enum class Kind { raw, nrrd, meta_image, nifti, dicom, vti, pictures };

std::string extension_of(const std::string& path) {
    std::string name = std::filesystem::path(path).filename().string();
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
    if (name.ends_with(".nii.gz")) return ".nii.gz";
    return std::filesystem::path(name).extension().string();
}

bool is_picture(const std::string& extension) {
    return extension == ".tif" || extension == ".tiff" || extension == ".png";
}

/// Loads a folder of slices: of pictures where it holds one, otherwise of DICOM.
Kind kind_of_folder(const std::string& path) {
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(path, error))
        if (is_picture(extension_of(entry.path().string()))) return Kind::pictures;
    return Kind::dicom;
}

Kind kind_of_file(const std::string& path, const MappedFile& file, bool described) {
    const std::string extension = extension_of(path);
    const auto begins = [&](std::size_t at, std::string_view with) {
        return file.size >= at + with.size() &&
               std::memcmp(file.bytes.get() + at, with.data(), with.size()) == 0;
    };
    if (extension == ".nrrd" || extension == ".nhdr") return Kind::nrrd;
    if (extension == ".mha" || extension == ".mhd") return Kind::meta_image;
    if (extension == ".nii" || extension == ".nii.gz") return Kind::nifti;
    if (!described && (extension == ".hdr" || extension == ".img")) return Kind::nifti;
    if (extension == ".vti") return Kind::vti;
    if (extension == ".dcm") return Kind::dicom;
    if (is_picture(extension)) return Kind::pictures;
    if (described) return Kind::raw;
    if (is_nrrd(file)) return Kind::nrrd;
    if (begins(128, "DICM")) return Kind::dicom;
    if (begins(344, std::string_view("n+1\0", 4)) || begins(344, std::string_view("ni1\0", 4)))
        return Kind::nifti;
    return Kind::raw;
}

StoredVolume read_stored(const VolumeSource& source, const LoadLimits& limits,
                         std::vector<std::string>& notes) {
    constexpr std::string_view kNames[] = {"raw file", "NRRD", "MetaImage", "NIfTI",
                                           "DICOM",    "VTI",  "picture"};
    constexpr std::string_view kReaders[] = {"", "", "", "nifti", "dicom", "vti", "pictures"};
    std::error_code error;
    const bool described = !source.dims.empty() || !source.type.empty();
    const bool folder = std::filesystem::is_directory(source.file, error);
    const MappedFile file = folder ? MappedFile{} : map_file(source.file);
    const Kind kind = folder ? kind_of_folder(source.file) : kind_of_file(source.file, file, described);
    const auto index = static_cast<std::size_t>(kind);
    if (kind != Kind::raw && described)
        throw InputError(fmt::format("{}: dims and type are for raw files, but this is a {} and says its own",
                                     source.file, kNames[index]));
    if (kind == Kind::raw) return read_raw(source, file);
    if (kind == Kind::nrrd) return read_nrrd(source.file, file, limits, notes);
    if (kind == Kind::meta_image) return read_meta_image(source.file, file, limits, notes);
    if (kind == Kind::pictures && source.spacing.empty())
        notes.push_back(fmt::format(
            "{}: pictures state no spacing: 1 is taken along each axis; volume.spacing = [x, y, z] "
            "gives it",
            source.file));
    return read_in_child(kReaders[index], source, limits, notes);
}

Volume load_file(const VolumeSource& source, const LoadLimits& limits, std::vector<std::string>& notes) {
    StoredVolume stored = read_stored(source, limits, notes);
    choose_component(stored, source);
    if (source.space == "lps")
        turn_to_lps(stored);
    else if (stored.space.starts_with("right-anterior-superior"))
        notes.push_back(fmt::format(
            "{}: its space is right-anterior-superior and its axes are kept; those of DICOM, which "
            "are left-posterior-superior, show it turned by half a turn about z: volume.space = "
            "\"lps\" turns it",
            source.file));
    stored.spacing = spacing_of(source, source.file, stored.spacing);
    return levels_from_stored(stored, source, limits, notes);
}

Volume load_procedural(const VolumeSource& source, const LoadLimits& limits) {
    const std::string& name = source.procedural;
    const ProceduralField* field = find_procedural(name);
    if (!field) {
        std::vector<std::string> names;
        for (const ProceduralField& known : procedural_fields()) names.push_back(known.name);
        throw InputError(
            fmt::format("procedural: no field \"{}\", but {} are known", name, fmt::join(names, ", ")));
    }
    const std::size_t given = source.dims.size();
    if (given != 0 && given != 1 && given != 3)
        throw InputError(fmt::format("{}: dims has {} numbers, but one or three are allowed", name, given));
    Index3 dims(given == 0 ? field->default_size : source.dims[0]);
    if (given == 3) dims = {source.dims[0], source.dims[1], source.dims[2]};
    const int bits = source.bits != 0 ? source.bits : field->default_bits;
    const double scale = source.value_scale.value_or(1), offset = source.value_offset.value_or(0);
    if (!std::isfinite(scale) || scale == 0 || !std::isfinite(offset))
        throw InputError(
            fmt::format("{}: value scale is {} and offset {}, but both must be finite and the scale not 0",
                        name, scale, offset));
    StoredVolume size;
    size.where = name, size.dims = dims;
    check_memory(checked_bytes(dims, bits <= 8 ? 1 : 2, name), size, limits);
    Volume volume = make_procedural(*field, dims, bits, spacing_of(source, name, {1, 1, 1}));
    volume.value_scale = scale, volume.value_offset = offset;
    return volume;
}

}  // namespace

Volume load_volume(const VolumeSource& source, const LoadLimits& limits, std::vector<std::string>* notes) {
    std::vector<std::string> unread;
    if (source.file.empty()) return load_procedural(source, limits);
    return load_file(source, limits, notes ? *notes : unread);
}

bool looks_like_volume(const std::string& path) {
    std::error_code error;
    if (std::filesystem::is_directory(path, error)) return true;
    const std::string extension = extension_of(path);
    if (extension == ".toml") return false;
    if (extension == ".raw") return true;
    const MappedFile nothing;
    if (kind_of_file(path, nothing, false) != Kind::raw) return true;
    return std::filesystem::is_regular_file(path, error) &&
           kind_of_file(path, map_file(path), false) != Kind::raw;
}

}  // namespace squint
