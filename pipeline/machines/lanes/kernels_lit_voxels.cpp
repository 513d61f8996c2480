// Before stage 3: packs the samples to be lit, and loads the voxels around them or their central differences.
#include "pipeline/machines/lanes/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/machines/lanes/kernels_lit_voxels.cpp"
#include <hwy/foreach_target.h>

#include "fixedpoint/words/lane_tables-inl.h"
#include "pipeline/machines/lanes/fetch-inl.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/packing-inl.h"
#include "pipeline/stages/faces.h"

#include <algorithm>
#include <array>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {
namespace {

using lanes::kRays;
using lanes::Samples;
using lanes::VoxelSource;
using lanes::Word;
constexpr int kLanes = static_cast<int>(HWY_LANES(Word));

int gather_lit_samples(const Plan& plan, const lanes::RayPacket& rays, int steps, const Samples& s,
                       lanes::LitSamples& lit) {
    const hn::ScalableTag<Word> d;
    const auto zero = hn::Zero(d);
    const bool per_ray = plan.shading.needs_ray(), locations = plan.lights_by_locations();
    const bool within_slabs = looks_into_slabs(plan.inside.rule), between = plan.inside.samples_between();
    const bool places = between || !plan.shares_ends();
    int count = 0;
    for (int at = 0; at < steps * kRays; at += kLanes) {
        const int r = at % kRays;
        const auto within = hn::Gt(hn::Load(d, rays.slabs.v + r), hn::Set(d, s.first + at / kRays));
        const auto wanted = hn::And(hn::Gt(hn::Load(d, s.alpha.v + at), zero), within);
        if (hn::AllFalse(d, wanted)) continue;
        const Packing packing(wanted);
        // Stores whole vectors; the next store overwrites what follows the last sample.
        const auto pack = [&](const Word* from, lanes::Batch& to) {
            packing(hn::Load(d, from), to.v + count);
        };
        packing(hn::Iota(d, at), lit.from.v + count);
        for (int a = 0; places && a < 3; ++a) {
            if (!locations) {
                pack(s.cell[a].v + at, lit.cell[a]), pack(s.weight[a].v + at, lit.weight[a]);
                continue;
            }
            pack(s.location[a].v + at, lit.location[0][a]);
            if (between) pack(s.location[a].v + at + kRays, lit.location[1][a]);
        }
        for (int c = 0; c < 3; ++c) pack(s.color[c].v + at, lit.color[c]);
        pack(s.alpha.v + at, lit.alpha);
        if (within_slabs) {
            for (int end = 0; end < 2; ++end) pack(s.input.v + at + end * kRays, lit.input[end]);
            pack(s.length.v + at, lit.length);
        }
        for (int a = 0; per_ray && a < 3; ++a) {
            pack(rays.view[a].v + r, lit.view[a]);
            for (int l = 0; l < plan.shading.lights; ++l) pack(rays.half[l][a].v + r, lit.half[l][a]);
        }
        count += packing.count();
    }
    return count;
}

// The rows of four voxels that a gradient needs, of the 4x4 around a cell: bit z * 4 + y.
constexpr unsigned rows_of(GradientRule rule) {
    return rule == GradientRule::analytic ? 0x0660U : rule == GradientRule::central ? 0x6ff6U : 0xffffU;
}

using Words = hn::Vec<hn::ScalableTag<Word>>;

/// Gathers four voxels along x at each lane's element of a row: as two words of pairs, or the middle pair alone.
#if HWY_TARGET != HWY_SCALAR
constexpr bool kGathersRows = true;
HWY_INLINE Words spread_bytes(Words two) {
    const hn::ScalableTag<Word> d;
    return hn::And(hn::Or(two, hn::ShiftLeft<8>(two)), hn::Set(d, 0x00ff00ff));
}
HWY_INLINE std::array<Words, 2> gathered_row(const std::uint8_t* row, Words first) {
    const hn::ScalableTag<Word> d;
    const hn::RebindToUnsigned<decltype(d)> du;
    const auto four = hn::GatherOffset(d, reinterpret_cast<const Word*>(row), first);
    const auto upper = hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(du, four)));
    return {spread_bytes(hn::And(four, hn::Set(d, 0xffff))), spread_bytes(upper)};
}
HWY_INLINE Words gathered_inner_pair(const std::uint8_t* row, Words first) {
    const hn::ScalableTag<Word> d;
    const auto four = hn::GatherOffset(d, reinterpret_cast<const Word*>(row), first);
    return hn::Or(hn::And(hn::ShiftRight<8>(four), hn::Set(d, 0xff)), hn::And(four, hn::Set(d, 0xff0000)));
}
HWY_INLINE std::array<Words, 2> gathered_row(const std::uint16_t* row, Words first) {
    alignas(64) Word at[kLanes];
    hn::Store(first, hn::ScalableTag<Word>(), at);
    return load_pairs([&](int lane) { return reinterpret_cast<const Word*>(row + at[lane]); });
}
HWY_INLINE Words gathered_inner_pair(const std::uint16_t* row, Words first) {
    return hn::GatherOffset(hn::ScalableTag<Word>(), reinterpret_cast<const Word*>(row + 1),
                            hn::ShiftLeft<1>(first));
}
#else
constexpr bool kGathersRows = false;
template <class T>
std::array<Words, 2> gathered_row(const T*, Words) {
    return {};
}
template <class T>
Words gathered_inner_pair(const T*, Words) {
    return {};
}
#endif

/// What central differences need around a vector of cells, from the cells beside each: of those, an interpolated
/// sample's neighbours have lately been read, and a row of the volume itself may be far.
template <class T>
class CellsBeside {
    using D = hn::ScalableTag<Word>;
    static constexpr int kBits = lanes::CellBlocks::kBits;

  public:
    explicit CellsBeside(const VoxelSource& source) : cells_(source.cells), places_(source), near_(source) {}

    /// Takes cells `at` and on; lanes from `here` on repeat the first.  All lie at least one voxel from a face.
    /// Returns whether it could: else some cell beside is not built.
    HWY_INLINE bool take(const lanes::Batch (&cell)[3], int at, int here) {
        const D d;
        const auto wanted = hn::FirstN(d, static_cast<std::size_t>(here));
        Words place[3];
        for (int a = 0; a < 3; ++a)
            place[a] = hn::IfThenElse(wanted, hn::Load(d, cell[a].v + at), hn::Set(d, cell[a].v[at]));
        std::array<Words, 3> low, high;
        for_three([&](std::size_t a) SQUINT_WRITTEN_OUT {
            low[a] = hn::Sub(place[a], hn::Set(d, 1)), high[a] = hn::Add(place[a], hn::Set(d, 1));
        });
        auto missing = hn::Lt(place[0], hn::Zero(d));
        const auto keep = [&](int axis, int ahead, Words there) SQUINT_WRITTEN_OUT {
            missing = hn::Or(missing, hn::Lt(there, hn::Zero(d)));
            hn::Store(there, d, beside_[axis][ahead]);
        };
        if (near_.take(low, high)) {
            keep(0, 0, near_(low[0], place[1], place[2])), keep(0, 1, near_(high[0], place[1], place[2]));
            keep(1, 0, near_(place[0], low[1], place[2])), keep(1, 1, near_(place[0], high[1], place[2]));
            keep(2, 0, near_(place[0], place[1], low[2])), keep(2, 1, near_(place[0], place[1], high[2]));
        } else {
            const Words middle = places_(place[0], place[1], place[2]);
            missing = hn::Lt(middle, hn::Zero(d));
            for (int a = 0; a < 3; ++a)
                for (const int ahead : {0, 1}) keep(a, ahead, next_to(place, middle, a, ahead != 0));
        }
        return hn::AllFalse(d, missing);
    }

    /// Stores the rows around the cells taken, as LitSamples::pair has them.
    HWY_INLINE void store_rows(int at, lanes::Batch (&pair)[32]) const {
        const D d;
        const auto store_row = [&](Words words, int y, int z, int half) {
            hn::Store(words, d, pair[(z * 4 + y) * 2 + half].v + at);
        };
        for (const int ahead : {0, 1}) {
            const auto x = corners(beside_[0][ahead]);
            for (int row = 0; row < 4; ++row)
                store_row(x[static_cast<std::size_t>(row)], 1 + row % 2, 1 + row / 2, ahead);
            const auto y = corners(beside_[1][ahead]);
            store_row(ahead ? y[1] : y[0], 3 * ahead, 1, 0), store_row(ahead ? y[3] : y[2], 3 * ahead, 2, 0);
            const auto z = corners(beside_[2][ahead]);
            store_row(ahead ? z[2] : z[0], 1, 3 * ahead, 0), store_row(ahead ? z[3] : z[1], 2, 3 * ahead, 0);
        }
    }

#if HWY_TARGET != HWY_SCALAR
    /// Stores their differences, as LitSamples::difference has them: along each axis the corners of the cell ahead less
    /// those of the cell behind.
    HWY_INLINE void store_differences(int at, lanes::Batch (&difference)[3][4]) const {
        const D d;
        for (int a = 0; a < 3; ++a) {
            const auto words = corner_differences(beside_[a][0], beside_[a][1]);
            for (std::size_t row = 0; row < 4; ++row) hn::Store(words[row], d, difference[a][row].v + at);
        }
    }
#endif

  private:
    HWY_INLINE Words next_to(const Words (&cell)[3], Words middle, int axis, bool ahead) const {
        const D d;
        const Word inner = (1 << kBits) - 1, step = ahead ? 1 : -1;
        const auto edge = hn::Set(d, ahead ? inner : 0);
        const auto leaves = hn::Eq(hn::And(cell[axis], hn::Set(d, inner)), edge);
        const Words there = hn::Add(middle, hn::Set(d, step * (1 << kBits * axis)));
        if (hn::AllFalse(d, leaves)) return there;
        const auto along = [&](int a) { return a == axis ? hn::Add(cell[a], hn::Set(d, step)) : cell[a]; };
        return hn::IfThenElse(leaves, places_(along(0), along(1), along(2)), there);
    }
    HWY_INLINE const std::uint8_t* address(const Word* place, int lane) const {
        return cells_ + std::int64_t{place[lane]} * static_cast<std::int64_t>(8 * sizeof(T));
    }
    HWY_INLINE auto corners(const Word* place) const {
        const auto there = [&](int lane) { return address(place, lane); };
        if constexpr (sizeof(T) == 1)
            return load_widened_quads(there);
        else
            return load_quads(there);
    }
#if HWY_TARGET != HWY_SCALAR
    HWY_INLINE auto corner_differences(const Word* behind, const Word* ahead) const {
        return transposed_blocks([&](int lane) {
            const hn::Full128<std::uint16_t> d16;
            const auto eight = [&](const Word* place) {
                const std::uint8_t* from = address(place, lane);
                if constexpr (sizeof(T) == 1)
                    return hn::PromoteTo(d16, hn::LoadU(hn::Full64<std::uint8_t>(), from));
                else
                    return hn::BitCast(d16, hn::LoadU(hn::Full128<std::uint8_t>(), from));
            };
            return hn::BitCast(hn::Full128<Word>(), hn::Sub(eight(ahead), eight(behind)));
        });
    }
#endif

    const std::uint8_t* cells_;
    CellPlaces places_;
    NearPlaces near_;
    alignas(64) Word beside_[3][2][kLanes];
};

/// The rows of voxels around packed samples that a gradient needs, from the volume.
template <class T>
class RowsAround {
  public:
    RowsAround(const Plan& plan)
        : volume_(*plan.volume),
          data_(static_cast<const T*>(volume_.data.get())),
          rows_(rows_of(plan.gradient.rule)),
          cross_(plan.gradient.rule == GradientRule::central),
          offsets_fit_(volume_.voxels() <
                       std::numeric_limits<Word>::max() / static_cast<std::int64_t>(sizeof(T))) {}

    /// Whether the first `here` cells from `at` on all lie at least one voxel from a face.
    HWY_INLINE bool inside(const lanes::Batch (&cell)[3], int at, int here) const {
        const hn::ScalableTag<Word> d;
        auto outside = hn::Lt(hn::Load(d, cell[0].v + at), hn::Set(d, 1));
        for (int a = 0; a < 3; ++a) {
            const auto p = hn::Load(d, cell[a].v + at);
            outside = hn::Or(outside, hn::Or(hn::Lt(p, hn::Set(d, 1)),
                                             hn::Gt(p, hn::Set(d, static_cast<Word>(volume_.dims[a] - 3)))));
        }
        return hn::AllFalse(d, hn::And(outside, hn::FirstN(d, static_cast<std::size_t>(here))));
    }

    /// Stores them of cells `at` and on, as LitSamples::pair has them; lanes from `here` on read some other row.
    HWY_INLINE void store_rows(const lanes::Batch (&cell)[3], int at, int here, bool are_inside,
                               lanes::Batch (&pair)[32]) const {
        const hn::ScalableTag<Word> d;
        const Index3 n = volume_.dims;
        if (are_inside) {
            if (kGathersRows && offsets_fit_) {
                auto first = hn::Sub(hn::Load(d, cell[2].v + at), hn::Set(d, 1));
                for (const int a : {1, 0})
                    first = hn::Add(hn::Mul(first, hn::Set(d, static_cast<Word>(n[a]))),
                                    hn::Sub(hn::Load(d, cell[a].v + at), hn::Set(d, 1)));
                // Lanes past the last sample read the first voxel.
                first = hn::IfThenElseZero(hn::FirstN(d, static_cast<std::size_t>(here)), first);
                for (int row = 0; row < 16; ++row) {
                    if (!(rows_ >> row & 1)) continue;
                    const T* line = data_ + n.x * (row % 4 + n.y * (row / 4));
                    if (wants_inner(row)) {
                        hn::Store(gathered_inner_pair(line, first), d, pair[2 * row].v + at);
                        continue;
                    }
                    const std::array<Words, 2> two = gathered_row(line, first);
                    hn::Store(two[0], d, pair[2 * row].v + at);
                    hn::Store(two[1], d, pair[2 * row + 1].v + at);
                }
                return;
            }
            const T* low[kLanes];
            for (int lane = 0; lane < kLanes; ++lane) {
                const int i = lane < here ? at + lane : at;
                low[lane] = data_ + (cell[0].v[i] - 1) +
                            n.x * ((cell[1].v[i] - 1) + n.y * std::int64_t{cell[2].v[i] - 1});
            }
            for (int row = 0; row < 16; ++row) {
                if (!(rows_ >> row & 1)) continue;
                const std::int64_t offset = n.x * (row % 4 + n.y * (row / 4));
                const auto address = [&](int lane) {
                    return reinterpret_cast<const std::uint8_t*>(low[lane] + offset);
                };
                const auto words = [&] {
                    if constexpr (sizeof(T) == 1)
                        return load_widened_quads(address);
                    else
                        return load_quads(address);
                }();
                const bool inner = wants_inner(row);
                hn::Store(inner ? inner_pair(words[0], words[1]) : words[0], d, pair[2 * row].v + at);
                hn::Store(words[1], d, pair[2 * row + 1].v + at);
            }
            return;
        }
        for (int i = at; i < at + here; ++i)
            for (int row = 0; row < 16; ++row) {
                if (!(rows_ >> row & 1)) continue;
                const T* line = data_ + n.x * (voxel_at(cell[1].v[i] + row % 4 - 1, n.y) +
                                               n.y * voxel_at(cell[2].v[i] + row / 4 - 1, n.z));
                const auto voxel = [&](int x) { return Word{line[voxel_at(cell[0].v[i] + x - 1, n.x)]}; };
                const bool inner = wants_inner(row);
                pair[2 * row].v[i] = inner ? voxel(1) | voxel(2) << 16 : voxel(0) | voxel(1) << 16;
                pair[2 * row + 1].v[i] = voxel(2) | voxel(3) << 16;
            }
    }

  private:
    bool wants_inner(int row) const { return cross_ && lanes::is_outer_row(row % 4, row / 4); }

    const Volume& volume_;
    const T* data_;
    unsigned rows_;
    bool cross_, offsets_fit_;
};

template <class T>
void fetch_lit_samples(const Plan& plan, const VoxelSource& source, int count, lanes::LitSamples& lit) {
    const bool from_cells = source.cells && plan.gradient.rule == GradientRule::central;
    const RowsAround<T> around(plan);
    CellsBeside<T> beside(source);
    for (int at = 0; at < count; at += kLanes) {
        const int here = std::min(kLanes, count - at);
        const bool inside = around.inside(lit.cell, at, here);
        if (inside && from_cells && beside.take(lit.cell, at, here))
            beside.store_rows(at, lit.pair);
        else
            around.store_rows(lit.cell, at, here, inside, lit.pair);
    }
}

#if HWY_TARGET != HWY_SCALAR
/// The same of rows, in 16 bits.
HWY_INLINE void subtract_rows(const lanes::Batch (&pair)[32], int at, lanes::Batch (&difference)[3][4]) {
    const hn::ScalableTag<Word> d;
    const hn::ScalableTag<std::int16_t> d16;
    const auto words = [&](int y, int z, int half)
                           HWY_ATTR { return hn::Load(d, pair[(z * 4 + y) * 2 + half].v + at); };
    const auto middle = [&](int y, int z) HWY_ATTR {
        return lanes::is_outer_row(y, z) ? words(y, z, 0) : inner_pair(words(y, z, 0), words(y, z, 1));
    };
    for (int row = 0; row < 4; ++row) {
        const int y = 1 + row % 2, z = 1 + row / 2;
        const auto store = [&](int axis, Words ahead, Words behind) HWY_ATTR {
            hn::Store(hn::BitCast(d, hn::Sub(hn::BitCast(d16, ahead), hn::BitCast(d16, behind))), d,
                      difference[axis][row].v + at);
        };
        store(0, words(y, z, 1), words(y, z, 0));
        store(1, middle(y + 1, z), middle(y - 1, z));
        store(2, middle(y, z + 1), middle(y, z - 1));
    }
}

/// Differences out of lit cells, of which some may not be built.
class LitCellsThere {
  public:
    /// Finds the places of the first `count` packed cells, and requests them all before the first is read.
    LitCellsThere(const lanes::LitCells::Cells& cells, const lanes::Batch (&cell)[3], int count)
        : data_(cells.data) {
        const hn::ScalableTag<Word> d;
        const CellPlaces places(cells.slots.data(), cells.blocks);
        for (int at = 0; at < count; at += kLanes) {
            const auto wanted = hn::FirstN(d, static_cast<std::size_t>(count - at));
            const auto along = [&](int a) HWY_ATTR {  // lanes past the last repeat the first
                return hn::IfThenElse(wanted, hn::Load(d, cell[a].v + at), hn::Set(d, cell[a].v[at]));
            };
            hn::Store(places(along(0), along(1), along(2)), d, place_.v + at);
            for (int lane = 0; lane < kLanes; ++lane) {
                const auto first = reinterpret_cast<std::intptr_t>(data_) + offset(at + lane);
                __builtin_prefetch(reinterpret_cast<const void*>(first));
                __builtin_prefetch(
                    reinterpret_cast<const void*>(first + kBytes - 1));  // perhaps in another line
            }
        }
    }

    /// Stores those of cells `at` and on.  Returns whether all are built.
    HWY_INLINE bool store(int at, lanes::Batch (&difference)[3][4]) const {
        const hn::ScalableTag<Word> d;
        if (!hn::AllFalse(d, hn::Lt(hn::Load(d, place_.v + at), hn::Zero(d)))) return false;
        for (int a = 0; a < 3; ++a) {
            const auto words =
                load_quads([&](int lane) HWY_ATTR { return data_ + offset(at + lane) + kBytes / 3 * a; });
            for (std::size_t row = 0; row < 4; ++row) hn::Store(words[row], d, difference[a][row].v + at);
        }
        return true;
    }

  private:
    static constexpr std::intptr_t kBytes = lanes::CellBlocks::kDifferenceBytes;
    HWY_INLINE std::intptr_t offset(int i) const { return kBytes * place_.v[i]; }

    const std::uint8_t* data_;
    lanes::Batch place_;
};

template <class T>
void fetch_differences(const Plan& plan, const VoxelSource& source, int count, lanes::LitSamples& lit) {
    const RowsAround<T> around(plan);
    CellsBeside<T> beside(source);
    const auto from_voxels = [&](int at) HWY_ATTR {
        const int here = std::min(kLanes, count - at);
        const bool inside = around.inside(lit.cell, at, here);
        if (inside && source.cells && beside.take(lit.cell, at, here))
            return beside.store_differences(at, lit.difference);
        around.store_rows(lit.cell, at, here, inside, lit.pair);
        subtract_rows(lit.pair, at, lit.difference);
    };
    if (const lanes::LitCells::Cells* cells = source.lit ? source.lit->built() : nullptr) {
        const LitCellsThere there(*cells, lit.cell, count);
        for (int at = 0; at < count; at += kLanes)
            if (!there.store(at, lit.difference)) from_voxels(at);
        return;
    }
    for (int at = 0; at < count; at += kLanes) from_voxels(at);
}
#endif

template <class T>
void choose_lit_voxel_kernels(lanes::StageKernels& kernels) {
    kernels.fetch_lit = &fetch_lit_samples<T>;
#if HWY_TARGET != HWY_SCALAR
    kernels.fetch_differences = &fetch_differences<T>;
#endif
}

}  // namespace

void lit_voxel_kernels_of(const VoxelSource& source, lanes::StageKernels& kernels) {
    kernels.gather_lit = &gather_lit_samples;
    if (source.volume->type == ScalarType::u8)
        choose_lit_voxel_kernels<std::uint8_t>(kernels);
    else
        choose_lit_voxel_kernels<std::uint16_t>(kernels);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace squint::lanes {
void lit_voxel_kernels(std::int64_t target, const VoxelSource& source, StageKernels& kernels) {
    SQUINT_CALL_TARGET(target, lit_voxel_kernels_of, source, kernels)
}
}  // namespace squint::lanes
#endif
