// The [volume] part of a scene -> a volume: a NRRD, a raw file or a procedural field.
#include "core/volume_source.h"

#include "core/error.h"
#include "core/nrrd.h"
#include "core/procedural.h"
#include "core/volume_stored.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
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
    if (source.type == "u8")
        stored.type = StoredType::u8;
    else if (source.type == "i16")
        stored.type = StoredType::i16;
    else if (source.type == "u16")
        stored.type = StoredType::u16;
    else if (source.type == "f32")
        stored.type = StoredType::f32;
    else
        throw InputError(fmt::format("{}: type is \"{}\", but a raw file needs u8, i16, u16 or f32",
                                     stored.where, source.type));
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

Volume load_file(const VolumeSource& source, const LoadLimits& limits, std::vector<std::string>& notes) {
    const MappedFile file = map_file(source.file);
    const std::string extension = std::filesystem::path(source.file).extension().string();
    const bool nrrd = extension == ".nrrd" || extension == ".nhdr" || (is_nrrd(file) && source.dims.empty());
    if (nrrd && (!source.dims.empty() || !source.type.empty()))
        throw InputError(fmt::format(
            "{}: dims and type are for raw files, but this is a NRRD and says its own", source.file));
    StoredVolume stored = nrrd ? read_nrrd(source.file, file, limits, notes) : read_raw(source, file);
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

}  // namespace squint
