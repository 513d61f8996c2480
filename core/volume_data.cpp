// Memory of voxels: allocates or maps it, measures and names it.
#include "core/volume_data.h"

#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <new>
#include <vector>

namespace squint {
namespace {

constexpr std::size_t kHugePage = std::size_t{1} << 21;

[[noreturn]] void refuse(const std::string& where, int error) {
    throw InputError(fmt::format("{}: cannot read: {}", where, std::strerror(error)));
}

/// Scalars are measured and hashed in pieces of this size, side by side; the pieces' hashes are then hashed
/// in order.
constexpr std::size_t kPieceBytes = std::size_t{1} << 22;

struct Piece {
    std::uint32_t smallest = 0, largest = 0;
    std::string hash;
};

/// 64 running minima and maxima side by side: compilers turn this shape into vector code.
template <class Scalar>
Piece measure_piece(const Scalar* scalars, std::size_t count) {
    constexpr std::size_t kLanes = 64;
    Scalar least[kLanes], greatest[kLanes];
    std::fill_n(least, kLanes, scalars[0]);
    std::fill_n(greatest, kLanes, scalars[0]);
    std::size_t i = 0;
    for (; i + kLanes <= count; i += kLanes)
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const Scalar scalar = scalars[i + lane];
            least[lane] = scalar < least[lane] ? scalar : least[lane];
            greatest[lane] = scalar > greatest[lane] ? scalar : greatest[lane];
        }
    for (; i < count; ++i) {
        least[0] = std::min(least[0], scalars[i]);
        greatest[0] = std::max(greatest[0], scalars[i]);
    }
    Hasher hasher;
    hasher.bytes(scalars, count * sizeof(Scalar));
    return {*std::min_element(least, least + kLanes), *std::max_element(greatest, greatest + kLanes),
            hasher.hex()};
}

/// The holes of a file: none where it is not sparse or its system cannot tell.
std::vector<ByteRun> holes_of(int file, const struct stat& status) {
    constexpr std::int64_t kSector = 512;        // the unit of st_blocks
    constexpr std::size_t kMostHoles = 1 << 16;  // a file with more is read in full from there on
    std::vector<ByteRun> holes;
    if (status.st_blocks * kSector >= status.st_size) return holes;
    for (off_t at = 0; at < status.st_size && holes.size() < kMostHoles;) {
        const off_t hole = lseek(file, at, SEEK_HOLE);
        if (hole < 0 || hole >= status.st_size) break;
        const off_t data = lseek(file, hole, SEEK_DATA);
        if (data < 0 && errno != ENXIO) break;  // ENXIO: no data after it
        at = data < 0 ? status.st_size : data;
        holes.push_back({static_cast<std::size_t>(hole), static_cast<std::size_t>(at)});
    }
    return holes;
}

}  // namespace

std::shared_ptr<void> allocate_voxels(std::size_t bytes, const std::string& where) {
    const std::align_val_t alignment{bytes >= kHugePage ? kHugePage : std::size_t{64}};
    void* memory = ::operator new(bytes + kPaddingBytes, alignment, std::nothrow);
    if (!memory)
        throw InputError(fmt::format(
            "{}: {} bytes of voxels are needed, but the system has no such memory left", where, bytes));
    if (bytes >= kHugePage)
        madvise(memory, bytes, MADV_HUGEPAGE);  // rays touch many pages; failure costs only time
    std::memset(static_cast<char*>(memory) + bytes, 0, kPaddingBytes);
    return {memory, [alignment](void* p) { ::operator delete(p, alignment); }};
}

MappedFile map_file(const std::string& path) {
    const int file =
        open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe without a writer must not block
    if (file < 0) refuse(path, errno);
    const std::shared_ptr<void> closer(nullptr, [file](void*) { close(file); });
    struct stat status {};
    if (fstat(file, &status) != 0) refuse(path, errno);
    if (!S_ISREG(status.st_mode)) throw InputError(fmt::format("{}: cannot read: not a regular file", path));

    // Map zero pages first, then the file over their beginning: at least one page of zeros stays after it.
    const std::size_t page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    const std::size_t size = static_cast<std::size_t>(status.st_size);
    const std::size_t reserved = (size / page + 2) * page;
    void* memory = mmap(nullptr, reserved, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (memory == MAP_FAILED) refuse(path, errno);
    std::shared_ptr<const unsigned char> bytes(static_cast<const unsigned char*>(memory),
                                               [memory, reserved](const void*) { munmap(memory, reserved); });
    if (size > 0 && mmap(memory, size, PROT_READ, MAP_SHARED | MAP_FIXED, file, 0) == MAP_FAILED)
        refuse(path, errno);
    return {std::move(bytes), size, holes_of(file, status)};
}

std::string text_of(const Index3& dims) {
    return fmt::format("{}x{}x{}", dims.x, dims.y, dims.z);
}

std::size_t checked_bytes(const Index3& dims, std::size_t scalar_bytes, const std::string& where) {
    unsigned __int128 product = scalar_bytes;
    for (const std::int64_t size : {dims.x, dims.y, dims.z}) {
        if (size < 1)
            throw InputError(
                fmt::format("{}: dimensions are {}, but each must be at least 1", where, text_of(dims)));
        if (product < (std::uint64_t{1} << 62)) product *= static_cast<std::uint64_t>(size);
    }
    if (product >= (std::uint64_t{1} << 62))
        throw InputError(fmt::format("{}: dimensions are {}, but less than 2^62 bytes of voxels are allowed",
                                     where, text_of(dims)));
    return static_cast<std::size_t>(product);
}

void check_spacing(const Vec3& spacing, const std::string& where) {
    for (const double s : {spacing.x, spacing.y, spacing.z})
        if (!std::isfinite(s) || s <= 0)
            throw InputError(
                fmt::format("{}: spacing is {} {} {}, but each must be finite and greater than 0", where,
                            spacing.x, spacing.y, spacing.z));
}

int bits_for(std::uint64_t largest) {
    return std::max(1, static_cast<int>(std::bit_width(largest)));
}

void measure(Volume& volume) {
    const std::size_t bytes = static_cast<std::size_t>(volume.voxels()) * volume.scalar_bytes();
    const auto* data = static_cast<const unsigned char*>(volume.data.get());
    const auto measured = [&](const unsigned char* piece, std::size_t size) {
        return volume.type == ScalarType::u8
                   ? measure_piece(reinterpret_cast<const std::uint8_t*>(piece), size)
                   : measure_piece(reinterpret_cast<const std::uint16_t*>(piece), size / 2);
    };
    Piece nothing;  // a whole piece of zeros
    if (!volume.zeros.empty()) {
        const std::vector<std::uint16_t> zeros(kPieceBytes / 2);
        nothing = measured(reinterpret_cast<const unsigned char*>(zeros.data()), kPieceBytes);
    }
    std::vector<Piece> pieces((bytes + kPieceBytes - 1) / kPieceBytes);
    in_parallel(pieces.size(), [&](std::size_t i) {
        const std::size_t from = i * kPieceBytes, size = std::min(kPieceBytes, bytes - from);
        const auto first = static_cast<std::int64_t>(from / volume.scalar_bytes()),
                   end = static_cast<std::int64_t>((from + size) / volume.scalar_bytes());
        pieces[i] =
            size == kPieceBytes && volume.known_zero(first, end) ? nothing : measured(data + from, size);
    });
    Hasher hasher;
    for (const std::int64_t size : {volume.dims.x, volume.dims.y, volume.dims.z})
        hasher.number(static_cast<std::uint64_t>(size));
    hasher.number(volume.scalar_bytes());
    volume.smallest = pieces[0].smallest, volume.largest = pieces[0].largest;
    for (const Piece& piece : pieces) {
        volume.smallest = std::min(volume.smallest, piece.smallest);
        volume.largest = std::max(volume.largest, piece.largest);
        hasher.text(piece.hash);
    }
    volume.content_hash = hasher.hex();
}

}  // namespace squint
