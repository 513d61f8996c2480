// Reads NIfTI 1 and 2 (.nii, .nii.gz, .hdr with .img): libnifti parses the header, zlib inflates the voxels.
#include "core/error.h"
#include "core/import/axes.h"
#include "core/import/read/readers.h"

#include <fmt/format.h>
#include <nifti2_io.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

namespace squint::read {
namespace {

constexpr std::size_t kMostBytesPerDeflatedByte = 1032;
constexpr int kMsbFirst = 2;  // as libnifti counts byte orders

struct Type {
    int datatype;
    StoredType type;
    std::int64_t components;
};
constexpr Type kTypes[] = {
    {DT_UINT8, StoredType::u8, 1},    {DT_INT8, StoredType::i8, 1},    {DT_UINT16, StoredType::u16, 1},
    {DT_INT16, StoredType::i16, 1},   {DT_UINT32, StoredType::u32, 1}, {DT_INT32, StoredType::i32, 1},
    {DT_UINT64, StoredType::u64, 1},  {DT_INT64, StoredType::i64, 1},  {DT_FLOAT32, StoredType::f32, 1},
    {DT_FLOAT64, StoredType::f64, 1}, {DT_RGB24, StoredType::u8, 3},   {DT_RGBA32, StoredType::u8, 4},
};

void take_type_and_dims(StoredVolume& stored, const nifti_image& image) {
    const auto* known = std::find_if(std::begin(kTypes), std::end(kTypes),
                                     [&](const Type& t) { return t.datatype == image.datatype; });
    if (known == std::end(kTypes))
        throw InputError(
            fmt::format("{}: NIfTI datatype is {} ({}), but integers, floats and RGB are allowed",
                        stored.where, image.datatype, nifti_datatype_string(image.datatype)));
    stored.type = known->type;
    stored.big_endian = image.byteorder == kMsbFirst;
    stored.dims = {image.nx, std::max<std::int64_t>(image.ny, 1), std::max<std::int64_t>(image.nz, 1)};
    checked_bytes(stored.dims, bytes_of(stored.type), stored.where);
    std::int64_t others = 1;
    for (const std::int64_t size : {image.nt, image.nu, image.nv, image.nw}) {
        if (size > 65536)
            throw InputError(fmt::format("{}: an axis of {} volumes is too long", stored.where, size));
        others = std::min<std::int64_t>(others * std::max<std::int64_t>(size, 1), 1 << 20);
    }
    if (others > 1 && known->components > 1)
        throw InputError(
            fmt::format("{}: colours at {} times, but one of the two is allowed", stored.where, others));
    stored.components = others > 1 ? others : known->components;
    stored.component_run = others > 1 ? static_cast<std::int64_t>(stored.voxels()) : 1;
}

/// World from voxel, by the s form, or the q form, or the spacing alone; turns RAS into LPS.
void take_geometry(Handover& h, const nifti_image& image) {
    const bool s_form = image.sform_code > 0, q_form = image.qform_code > 0;
    for (int axis = 0; axis < 3; ++axis)
        for (int world = 0; world < 3; ++world) {
            const double sign = world < 2 ? -1 : 1;
            const double spacing = std::array{image.dx, image.dy, image.dz}[static_cast<std::size_t>(axis)];
            const double step = s_form   ? image.sto_xyz.m[world][axis]
                                : q_form ? image.qto_xyz.m[world][axis]
                                         : (world == axis ? (spacing > 0 ? spacing : 1) : 0);
            h.stored.steps[static_cast<std::size_t>(axis)][world] = step == 0 ? 0 : sign * step;
            const double first = s_form ? image.sto_xyz.m[world][3] : q_form ? image.qto_xyz.m[world][3] : 0;
            if (axis == 0) h.stored.first_voxel[world] = first == 0 ? 0 : sign * first;
        }
    h.stored.space = kLps;
    if (!s_form && !q_form)
        h.notes.push_back(fmt::format(
            "{}: neither s form nor q form: its axes are taken to run right, front and up", h.stored.where));
}

void read_voxels(const StoredVolume& stored, const nifti_image& image, const LoadLimits& limits) {
    const std::string data = image.iname ? image.iname : stored.where;
    const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(data.c_str(), "rb"), gzclose);
    std::error_code error;
    const auto there = static_cast<std::size_t>(std::filesystem::file_size(data, error));
    if (!file || error) throw InputError(fmt::format("{}: its voxels cannot be read", stored.where));
    const bool packed = gzdirect(file.get()) == 0;
    const std::size_t most = packed ? there * kMostBytesPerDeflatedByte : there;
    if (image.iname_offset < 0 || static_cast<std::size_t>(image.iname_offset) > most ||
        stored.size() > most - static_cast<std::size_t>(image.iname_offset))
        throw InputError(fmt::format("{}: {}{} bytes, but {} after the first {}", stored.where,
                                     packed ? "at most " : "", most, needs(stored), image.iname_offset));
    if (gzseek(file.get(), static_cast<z_off_t>(image.iname_offset), SEEK_SET) < 0)
        throw InputError(fmt::format("{}: compressed data are damaged", stored.where));
    unsigned char* out = room_for(stored, limits);
    for (std::size_t done = 0; done < stored.size();) {
        const int got = gzread(file.get(), out + done,
                               static_cast<unsigned>(std::min(stored.size() - done, std::size_t{1} << 26)));
        if (got <= 0)
            throw InputError(fmt::format("{}: {} bytes of voxels{}, but {}", stored.where, done,
                                         got < 0 ? " before the compressed data are damaged" : "",
                                         needs(stored)));
        done += static_cast<std::size_t>(got);
    }
}

}  // namespace

Handover read_nifti(const Request& request) {
    Handover h;
    h.stored.where = request.path;
    nifti_set_debug_level(0);
    const std::unique_ptr<nifti_image, void (*)(nifti_image*)> image(
        nifti_image_read(request.path.c_str(), 0), nifti_image_free);
    if (!image) throw InputError(fmt::format("{}: no NIfTI header that can be read", request.path));
    take_type_and_dims(h.stored, *image);
    take_geometry(h, *image);
    if (std::isfinite(image->scl_slope) && std::isfinite(image->scl_inter) && image->scl_slope != 0)
        h.stored.value_scale = image->scl_slope, h.stored.value_offset = image->scl_inter;
    read_voxels(h.stored, *image, request.limits);
    return h;
}

}  // namespace squint::read
