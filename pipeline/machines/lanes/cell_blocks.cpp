#include "pipeline/machines/lanes/cell_blocks.h"

#include "core/parallel.h"
#include "pipeline/kept.h"
#include "pipeline/stages/faces.h"
#include "pipeline/stages/gradient-inl.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstring>

namespace squint::lanes {
namespace {

constexpr std::int32_t kNotBuilt = -1;

std::int64_t blocks_along(std::int64_t voxels) {
    return (std::max<std::int64_t>(voxels - 1, 1) + (1 << CellBlocks::kBits) - 1) >> CellBlocks::kBits;
}
Index3 blocks_of(const Volume& volume) {
    return Index3(blocks_along(volume.dims.x), blocks_along(volume.dims.y), blocks_along(volume.dims.z));
}
std::int64_t cell_bytes_of(const Volume& volume, CellContent content) {
    if (content == CellContent::differences) return CellBlocks::kDifferenceBytes;
    return volume.type == ScalarType::u8 ? 8 : 16;
}
/// Whether near blocks have a table, which takes eight times the room of their slots.
bool has_near(const Index3& blocks, CellContent content) {
    constexpr std::int64_t kMostBlocks = 1 << 20;
    // So that CellBlocks::kNotThere and all starts fit.
    const bool are_few = blocks.x + (blocks.y << CellBlocks::kBits) + (blocks.z << 2 * CellBlocks::kBits) <
                         1 << (29 - CellBlocks::kBits);
    return content == CellContent::corners && are_few && blocks.x * blocks.y * blocks.z <= kMostBlocks;
}
/// The volume without ownership of its voxels: what is cached for them must not keep them alive.
Volume borrowed(const Volume& volume) {
    Volume view = volume;
    view.data = std::shared_ptr<const void>(std::shared_ptr<const void>(), volume.data.get());
    return view;
}

}  // namespace

std::int64_t CellBlocks::bytes_of_all(const Volume& volume, CellContent content) {
    const Index3 n = blocks_of(volume);
    return n.x * n.y * n.z * kCells * cell_bytes_of(volume, content);
}

std::int64_t CellBlocks::table_bytes_of(const Volume& volume, CellContent content) {
    const Index3 n = blocks_of(volume);
    return n.x * n.y * n.z *
           static_cast<std::int64_t>(sizeof(std::int32_t) + (has_near(n, content) ? sizeof(Near) : 0));
}

CellBlocks::CellBlocks(const Volume& volume, std::int64_t most_bytes, CellContent content)
    : volume_(borrowed(volume)), content_(content), blocks_(blocks_of(volume)) {
    block_bytes_ = kCells * cell_bytes_of(volume, content);
    const std::int64_t all = blocks_.x * blocks_.y * blocks_.z;
    // Cells are counted in 32 bits.
    room_ = std::min({all, most_bytes / block_bytes_, std::int64_t{0x7fffffff} / kCells});
    if (room_ <= 0) return;
    slots_.assign(static_cast<std::size_t>(all), kNotBuilt);
    const auto bytes = static_cast<std::size_t>(room_ * block_bytes_);
    void* place =
        mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (place == MAP_FAILED) {
        room_ = 0, slots_.clear();
        return;
    }
    madvise(place, bytes, MADV_HUGEPAGE);
    data_ = static_cast<std::uint8_t*>(place);
}

CellBlocks::~CellBlocks() {
    if (data_) munmap(data_, static_cast<std::size_t>(room_ * block_bytes_));
}

std::int64_t CellBlocks::bytes() const {
    const std::lock_guard lock(mutex_);
    return taken_ * block_bytes_ + static_cast<std::int64_t>(slots_.size() * sizeof(slots_[0]) +
                                                             (near_ ? near_->size() * sizeof(Near) : 0));
}

std::vector<std::int32_t> CellBlocks::slots() const {
    const std::lock_guard lock(mutex_);
    return slots_;
}

std::shared_ptr<const std::vector<CellBlocks::Near>> CellBlocks::near() const {
    const std::lock_guard lock(mutex_);
    return near_;
}

void CellBlocks::find_near() {
    if (!has_near(blocks_, content_)) return;
    auto near = std::make_shared<std::vector<Near>>(slots_.size());
    std::size_t at = 0;
    for (std::int64_t z = 0; z < blocks_.z; ++z)
        for (std::int64_t y = 0; y < blocks_.y; ++y)
            for (std::int64_t x = 0; x < blocks_.x; ++x, ++at)
                for (std::int64_t i = 0; i < 8; ++i) {
                    const auto along = [&](int a, std::int64_t first) {
                        return std::min(first + ((first ^ (i >> a)) & 1), blocks_[a] - 1);
                    };
                    const Index3 block(along(0, x), along(1, y), along(2, z));
                    const std::int32_t slot = slots_[static_cast<std::size_t>(
                        (block.z * blocks_.y + block.y) * blocks_.x + block.x)];
                    const std::int64_t corner = (block.x + (block.y << kBits) + (block.z << 2 * kBits))
                                                << kBits;
                    (*near)[at].start[i] =
                        slot == kNotBuilt ? kNotThere : static_cast<std::int32_t>(slot - corner);
                }
    near_ = std::move(near);
}

void CellBlocks::build(const std::function<bool(std::int64_t)>& wanted) {
    const std::lock_guard lock(mutex_);
    std::vector<std::int64_t> fresh;
    for (std::size_t i = 0; i < slots_.size() && taken_ + static_cast<std::int64_t>(fresh.size()) < room_;
         ++i)
        if (slots_[i] == kNotBuilt && wanted(static_cast<std::int64_t>(i)))
            fresh.push_back(static_cast<std::int64_t>(i));
    const auto fill_block = [&](std::size_t i) {
        const std::int64_t place = taken_ + static_cast<std::int64_t>(i);
        std::uint8_t* cells = data_ + place * block_bytes_;
        if (volume_.type == ScalarType::u8)
            fill<std::uint8_t>(fresh[i], cells);
        else
            fill<std::uint16_t>(fresh[i], cells);
        slots_[static_cast<std::size_t>(fresh[i])] = static_cast<std::int32_t>(place * kCells);
    };
    isolated([&] { in_parallel(fresh.size(), fill_block); });
    taken_ += static_cast<std::int64_t>(fresh.size());
    if (!near_ || !fresh.empty()) find_near();
}

template <class T>
void CellBlocks::fill(std::int64_t index, std::uint8_t* cells) const {
    const Index3 block(index % blocks_.x, index / blocks_.x % blocks_.y, index / (blocks_.x * blocks_.y));
    const Index3 low(block.x << kBits, block.y << kBits, block.z << kBits);
    if (content_ == CellContent::corners)
        fill_corners(low, reinterpret_cast<T*>(cells));
    else
        fill_differences<T>(low, cells);
}

template <class T>
void CellBlocks::fill_corners(const Index3& low, T* cells) const {
    constexpr std::int64_t kSide = 1 << kBits;
    const Index3 n = volume_.dims;
    const T* voxels = static_cast<const T*>(volume_.data.get());
    // No sample has a cell beyond the volume.
    std::int64_t x[kSide + 1];
    for (std::int64_t i = 0; i <= kSide; ++i) x[i] = voxel_at(low.x + i, n.x);
    for (std::int64_t k = 0; k < kSide; ++k)
        for (std::int64_t j = 0; j < kSide; ++j) {
            const T* row[4];  // y fastest
            for (std::int64_t r = 0; r < 4; ++r)
                row[r] = voxels +
                         (voxel_at(low.z + k + r / 2, n.z) * n.y + voxel_at(low.y + j + r % 2, n.y)) * n.x;
            for (std::int64_t i = 0; i < kSide; ++i)
                for (const T* line : row) *cells++ = line[x[i]], *cells++ = line[x[i + 1]];
        }
}

template <class T>
void CellBlocks::fill_differences(const Index3& low, std::uint8_t* cells) const {
    constexpr int kSide = 1 << kBits, kCorners = kSide + 1, kAround = kCorners + 2;
    const Index3 n = volume_.dims;
    const T* voxels = static_cast<const T*>(volume_.data.get());
    struct {
        std::int16_t voxel[kAround][kAround][kAround];  // the first one is beside the block
        int at(int x, int y, int z) const { return voxel[z][y][x]; }
    } around;
    for (int z = 0; z < kAround; ++z)
        for (int y = 0; y < kAround; ++y) {
            const T* row = voxels + (voxel_at(low.z + z - 1, n.z) * n.y + voxel_at(low.y + y - 1, n.y)) * n.x;
            for (int x = 0; x < kAround; ++x)
                around.voxel[z][y][x] = static_cast<std::int16_t>(row[voxel_at(low.x + x - 1, n.x)]);
        }
    std::int16_t difference[3][kCorners][kCorners][kCorners];
    for (int axis = 0; axis < 3; ++axis)
        for (int z = 0; z < kCorners; ++z)
            for (int y = 0; y < kCorners; ++y)
                for (int x = 0; x < kCorners; ++x)
                    difference[axis][z][y][x] = static_cast<std::int16_t>(
                        HWY_NAMESPACE::central_difference(around, x + 1, y + 1, z + 1, axis));
    constexpr std::size_t kPair = 2 * sizeof(std::int16_t);
    for (int z = 0; z < kSide; ++z)
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x < kSide; ++x)
                for (const auto& along : difference)
                    for (int row = 0; row < 4; ++row, cells += kPair)
                        std::memcpy(cells, &along[z + row / 2][y + row % 2][x], kPair);
}

std::shared_ptr<CellBlocks> cell_blocks(const Volume& volume, std::int64_t most_bytes, bool strictly,
                                        CellContent content) {
    static KeptPerVolume<CellBlocks> corners, differences;
    const std::int64_t block = CellBlocks::kCells * cell_bytes_of(volume, content);
    const std::int64_t wanted =
        std::min(most_bytes, CellBlocks::bytes_of_all(volume, content)) / block * block;
    return (content == CellContent::corners ? corners : differences)
        .find(
            volume, [&] { return std::make_shared<CellBlocks>(volume, wanted, content); },
            [&](const CellBlocks& cells) {
                return cells.room() == wanted || (!strictly && cells.room() >= wanted / 2);
            });
}

}  // namespace squint::lanes
