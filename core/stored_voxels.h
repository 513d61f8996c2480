// Reads the voxels of a file in the order of x, y, z, whatever their type, byte order and order of axes.
// Only volume_stored.cpp includes it.
#pragma once

#include "core/parallel.h"
#include "core/volume_stored.h"

#include <bit>
#include <cstring>
#include <type_traits>

namespace squint {

/// Calls visit(T{}) with the type of a stored voxel.
template <class Visit>
auto with_type(StoredType type, const Visit& visit) {
    switch (type) {
        case StoredType::u8:
            return visit(std::uint8_t{});
        case StoredType::i8:
            return visit(std::int8_t{});
        case StoredType::u16:
            return visit(std::uint16_t{});
        case StoredType::i16:
            return visit(std::int16_t{});
        case StoredType::u32:
            return visit(std::uint32_t{});
        case StoredType::i32:
            return visit(std::int32_t{});
        case StoredType::u64:
            return visit(std::uint64_t{});
        case StoredType::i64:
            return visit(std::int64_t{});
        case StoredType::f32:
            return visit(float{});
        default:
            return visit(double{});
    }
}

inline bool is_float(StoredType type) {
    return type == StoredType::f32 || type == StoredType::f64;
}
inline bool is_signed(StoredType type) {
    return with_type(type, [](auto voxel) { return std::is_signed_v<decltype(voxel)>; });
}

template <class T>
struct VoxelReader {
    const unsigned char* bytes;
    bool swapped;

    T operator()(std::int64_t index) const {
        if constexpr (sizeof(T) == 1) {
            return static_cast<T>(bytes[index]);
        } else {
            using Word = std::conditional_t<sizeof(T) == 2, std::uint16_t,
                                            std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>;
            Word word;
            std::memcpy(&word, bytes + index * static_cast<std::int64_t>(sizeof(T)), sizeof(T));
            if (swapped) {
                if constexpr (sizeof(T) == 2) word = __builtin_bswap16(word);
                if constexpr (sizeof(T) == 4) word = __builtin_bswap32(word);
                if constexpr (sizeof(T) == 8) word = __builtin_bswap64(word);
            }
            return std::bit_cast<T>(word);
        }
    }
};

template <class T>
VoxelReader<T> voxels_of(const StoredVolume& stored) {
    return {stored.inflated ? stored.inflated.get() : stored.bytes.get(), stored.big_endian};
}

/// Where voxel (x, y, z) of world order lies in the file: first + x * step.x + y * step.y + z * step.z.
struct FileOrder {
    Index3 dims, step;
    std::int64_t first;

    explicit FileOrder(const StoredVolume& stored) : first(stored.component * stored.component_run) {
        Index3 stride{1, stored.dims.x, stored.dims.x * stored.dims.y};
        for (int axis = 0; axis < 3; ++axis)
            if (stride[axis] >= stored.component_run) stride[axis] *= stored.components;
        for (int world = 0; world < 3; ++world) {
            const int axis = stored.axis[world];
            dims[world] = stored.dims[axis];
            step[world] = stored.flipped[world] ? -stride[axis] : stride[axis];
            if (stored.flipped[world]) first += stride[axis] * (dims[world] - 1);
        }
    }
};

inline constexpr std::int64_t kRowsPerPiece = 64;

/// Folds the numbers of the chosen component, in parallel: fold(so far, number) over all, then join(a, b).
template <class T, class Part, class Fold, class Join>
Part reduce_voxels(const StoredVolume& stored, const Part& none, const Fold& fold, const Join& join) {
    const VoxelReader<T> read = voxels_of<T>(stored);
    const FileOrder file(stored);
    const auto fold_row = [&](Part& part, std::int64_t row) {
        const std::int64_t y = row % file.dims.y, z = row / file.dims.y;
        std::int64_t index = file.first + y * file.step.y + z * file.step.z;
        for (std::int64_t x = 0; x < file.dims.x; ++x, index += file.step.x) fold(part, read(index));
    };
    return reduce_in_parallel(file.dims.y * file.dims.z, kRowsPerPiece, none, fold_row, join);
}

/// Sets levels[world order] = convert(voxel, its index in the file), rows in parallel.
template <class T, class Scalar, class Convert>
void convert_voxels(const StoredVolume& stored, void* levels, const Convert& convert) {
    const VoxelReader<T> read = voxels_of<T>(stored);
    const FileOrder file(stored);
    in_parallel_pieces(file.dims.y * file.dims.z, kRowsPerPiece, [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t row = begin; row < end; ++row) {
            const std::int64_t y = row % file.dims.y, z = row / file.dims.y;
            const std::int64_t start = file.first + y * file.step.y + z * file.step.z;
            Scalar* out = static_cast<Scalar*>(levels) + row * file.dims.x;
            std::int64_t clamped = 0;
            for (std::int64_t x = 0; x < file.dims.x; ++x) {
                const std::int64_t index = start + x * file.step.x;
                out[x] = static_cast<Scalar>(convert(read(index), index, clamped));
            }
            convert.count(clamped);
        }
    });
}

/// Memory for the levels: the file's own where a level fits the place of its voxel, otherwise new.
inline std::shared_ptr<void> room_for_levels(const StoredVolume& stored, const Volume& volume,
                                             const LoadLimits& limits) {
    const std::size_t bytes = stored.voxels() * volume.scalar_bytes();
    if (stored.inflated && !stored.reordered() && stored.components == 1 &&
        bytes_of(stored.type) == volume.scalar_bytes())
        return stored.inflated;
    check_memory(bytes + (stored.inflated ? stored.size() : 0), stored, limits);
    return allocate_voxels(bytes, stored.where);
}

template <class Convert>
void convert_all(Volume& volume, const StoredVolume& stored, const LoadLimits& limits,
                 const Convert& convert) {
    const std::shared_ptr<void> levels = room_for_levels(stored, volume, limits);
    with_type(stored.type, [&](auto voxel) {
        using T = decltype(voxel);
        if (volume.type == ScalarType::u8) convert_voxels<T, std::uint8_t>(stored, levels.get(), convert);
        if (volume.type == ScalarType::u16) convert_voxels<T, std::uint16_t>(stored, levels.get(), convert);
    });
    volume.data = levels;
}

}  // namespace squint
