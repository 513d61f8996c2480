// Turns voxels as a file stores them into a volume of levels.  Only for loaders of volumes.
#pragma once

#include "core/volume_data.h"
#include "core/volume_source.h"

#include <array>
#include <optional>
#include <string_view>

namespace squint {

enum class StoredType { u8, i8, u16, i16, u32, i32, u64, i64, f32, f64 };
inline constexpr std::string_view kStoredTypes[] = {"u8",  "i8",  "u16", "i16", "u32",
                                                    "i32", "u64", "i64", "f32", "f64"};
std::size_t bytes_of(StoredType type);

/// What a header says, and the bytes of the voxels.
struct StoredVolume {
    std::string where;  // the file, for messages
    StoredType type = StoredType::u8;
    bool big_endian = false;
    Index3 dims{0, 0, 0};                // along the file's axes, the fastest first
    std::array<int, 3> axis{0, 1, 2};    // the file's axis along world x, y, z
    std::array<bool, 3> flipped{};       // whether that axis runs against its world axis
    Vec3 spacing{1, 1, 1};               // along world x, y, z
    Vec3 origin{0, 0, 0};                // position of the voxel with the least x, y, z
    std::array<Vec3, 3> turn = kNoTurn;  // see Volume
    // Where the file states them: each axis's step and the first voxel's place, in world space.  take_axes
    // derives the five fields above from them.
    std::array<Vec3, 3> steps = kNoTurn;
    Vec3 first_voxel{0, 0, 0};
    std::optional<double> value_scale, value_offset;  // declared in the file; a scene's override them
    int scalar_bits = 0;                              // declared in the file, or 0
    std::string space;     // the world axes' names where the file states them: "left-posterior-superior"
    std::string modality;  // of DICOM: "CT", "MR"; otherwise empty

    // A fourth axis, of components or of times.  Two neighbours on it are `component_run` numbers apart (1
    // where a voxel's components lie side by side); `component` is the one to take.
    std::int64_t components = 1, component_run = 1, component = 0;
    bool component_chosen = false;  // the reader has chosen, and read only that one

    std::shared_ptr<const unsigned char> bytes;  // mapped from the file, or
    std::vector<VoxelRun> zeros;                 // of `bytes`: voxels that are zeros without disk blocks
    std::shared_ptr<unsigned char> inflated;     // or in memory of our own, which may be changed in place

    std::size_t voxels() const { return static_cast<std::size_t>(dims.x * dims.y * dims.z); }
    std::size_t size() const { return voxels() * static_cast<std::size_t>(components) * bytes_of(type); }
    bool reordered() const { return axis != std::array{0, 1, 2} || flipped != std::array<bool, 3>{}; }
};

/// "256x256x128 of 16 bits needs 16777216".
std::string needs(const StoredVolume& stored);

/// Throws InputError when `bytes` of memory exceed the limit.
void check_memory(std::size_t bytes, const StoredVolume& stored, const LoadLimits& limits);

/// Converts stored voxels to levels, or takes their bytes where they are levels already; measures the volume.
Volume levels_from_stored(const StoredVolume& stored, const VolumeSource& source, const LoadLimits& limits,
                          std::vector<std::string>& notes);

}  // namespace squint
