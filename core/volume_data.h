// Memory of voxels: allocates or maps it, measures and names it.  Only for loaders of volumes.
#pragma once

#include "core/volume.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace squint {

/// Bytes that can be read after the last voxel, in allocated and in mapped memory: a wide load of the last
/// voxel stays within bounds.
inline constexpr std::size_t kPaddingBytes = 64;

/// Allocates `bytes`, not initialised, and kPaddingBytes of zeros after them.  Throws InputError naming
/// `where` if there is no memory.
std::shared_ptr<void> allocate_voxels(std::size_t bytes, const std::string& where);

/// Bytes [first, end) of a file.
struct ByteRun {
    std::size_t first = 0, end = 0;
};

/// A whole file, mapped read-only, with kPaddingBytes readable after it.
struct MappedFile {
    std::shared_ptr<const unsigned char> bytes;
    std::size_t size = 0;
    std::vector<ByteRun> holes;  // of a sparse file: zeros without disk blocks; ascending
};
/// Maps a file.  Throws InputError if there is none or it is not regular.  A file that shrinks while it is
/// mapped ends the process (SIGBUS).
MappedFile map_file(const std::string& path);

/// The bytes of x y z voxels, in wide arithmetic.  Throws InputError when a dimension is below 1 or the
/// product reaches 2^62.
std::size_t checked_bytes(const Index3& dims, std::size_t scalar_bytes, const std::string& where);

/// Throws InputError when a spacing is not finite or not positive.
void check_spacing(const Vec3& spacing, const std::string& where);

/// "256x256x128".
std::string text_of(const Index3& dims);

/// The number of bits that hold `largest`, at least 1.
int bits_for(std::uint64_t largest);

/// Sets smallest, largest and content_hash from dims, type and data.  Does not read what is known to be zero.
void measure(Volume& volume);

}  // namespace squint
