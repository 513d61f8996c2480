#include "pipeline/machines/scene_bound/cost_blocks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace squint {
namespace {

constexpr std::int64_t kMostBlocks = 3 << 20;  // of 36 bytes
constexpr std::int64_t kBlocksABox = 64;       // that stand for a box

}  // namespace

CostBlocks::CostBlocks(const Plan& plan, const SampleErrors& errors, const SlabCosts& costs)
    : volume_(*plan.volume) {
    const Vec3 low = volume_.voxel_from_grid(plan.box_low), high = volume_.voxel_from_grid(plan.box_high);
    std::array<std::int64_t, 3> size{};
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const std::int64_t most = std::max<std::int64_t>(volume_.dims[axis] - 2, 0);
        const double off = errors.displacement + 0x1p-20;
        const auto cell = [&](double place) {
            return std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(place)), 0, most);
        };
        cells_.first[a] = cell(low[axis] - off), cells_.last[a] = cell(high[axis] + off);
        size[a] = cells_.last[a] - cells_.first[a] + 1;
        // A ray leaves by any face of a clip box with axes of its own.
        const double step = plan.clip ? 1e30 : plan.step_world / volume_.spacing[axis] + off;
        inside_[a] = {low[axis] + step, high[axis] - step};
        if (pips_of(plan))
            within_a_step_[a] =
                static_cast<std::int64_t>(std::ceil(plan.step_world / volume_.spacing[axis] + 2 * off));
    }
    const auto blocks = [&](int bits) {
        std::int64_t n = 1;
        for (const std::int64_t s : size) n *= ((s - 1) >> bits) + 1;
        return n;
    };
    while (blocks(lowest_bits_) > kMostBlocks) ++lowest_bits_;
    levels_.emplace_back();
    for (std::size_t a = 0; a < 3; ++a) levels_[0].blocks[a] = ((size[a] - 1) >> lowest_bits_) + 1;
    levels_[0].block.resize(static_cast<std::size_t>(blocks(lowest_bits_)));
    build_lowest(costs);
    while (levels_.back().block.size() > 1) build_above();
}

CellValues CostBlocks::of_cell(const Place& at) const {
    const Index3& d = volume_.dims;
    const auto [x, y, z] = at;
    const std::array<std::int64_t, 2> xs{x, std::min(x + 1, d.x - 1)}, ys{y, std::min(y + 1, d.y - 1)},
        zs{z, std::min(z + 1, d.z - 1)};
    std::array<std::int64_t, 8> v{};
    for (std::size_t i = 0; i < 8; ++i) v[i] = volume_.at(xs[i & 1], ys[i >> 1 & 1], zs[i >> 2]);
    const auto [low, high] = std::minmax_element(v.begin(), v.end());
    CellValues cell{static_cast<double>(*low), static_cast<double>(*high), 0};
    if (*low == *high) return cell;
    for (const std::size_t axis : {std::size_t{1}, std::size_t{2}, std::size_t{4}}) {
        std::int64_t steepest = 0;
        for (std::size_t i = 0; i < 8; ++i)
            if (!(i & axis)) steepest = std::max(steepest, std::abs(v[i | axis] - v[i]));
        cell.edges += static_cast<double>(steepest);
    }
    return cell;
}

CellValues CostBlocks::values(std::int64_t x, std::int64_t y, std::int64_t z) const {
    const Place at{x, y, z};
    CellValues all = of_cell(at);
    if (within_a_step_ == Place{}) return all;
    Place low{}, high{};
    for (std::size_t a = 0; a < 3; ++a) {
        low[a] = std::max<std::int64_t>(at[a] - within_a_step_[a], 0);
        high[a] = std::min(at[a] + within_a_step_[a],
                           std::max<std::int64_t>(volume_.dims[static_cast<int>(a)] - 2, 0));
    }
    for (std::int64_t k = low[2]; k <= high[2]; ++k)
        for (std::int64_t j = low[1]; j <= high[1]; ++j)
            for (std::int64_t i = low[0]; i <= high[0]; ++i) all.take(of_cell({i, j, k}));
    return all;
}

/// values() of all cells that are rendered with this z, x fastest: axis by axis.
std::vector<CellValues> CostBlocks::plane(std::int64_t z) const {
    Place first{}, last{};
    for (std::size_t a = 0; a < 3; ++a) {
        const std::int64_t most = std::max<std::int64_t>(volume_.dims[static_cast<int>(a)] - 2, 0);
        first[a] = std::max<std::int64_t>((a < 2 ? cells_.first[a] : z) - within_a_step_[a], 0);
        last[a] = std::min((a < 2 ? cells_.last[a] : z) + within_a_step_[a], most);
    }
    const std::int64_t wide = last[0] - first[0] + 1, deep = last[1] - first[1] + 1;
    std::vector<CellValues> along_z;
    along_z.reserve(static_cast<std::size_t>(wide * deep));
    for (std::int64_t y = first[1]; y <= last[1]; ++y)
        for (std::int64_t x = first[0]; x <= last[0]; ++x) {
            CellValues all = of_cell({x, y, first[2]});
            for (std::int64_t k = first[2] + 1; k <= last[2]; ++k) all.take(of_cell({x, y, k}));
            along_z.push_back(all);
        }
    // Each rendered place of a line that begins at `begin`, with its neighbours.
    const auto dilate = [&](std::size_t axis, const auto& line, std::int64_t begin, std::int64_t length,
                            std::vector<CellValues>& to) {
        for (std::int64_t at = cells_.first[axis]; at <= cells_.last[axis]; ++at) {
            const std::int64_t low = std::max<std::int64_t>(at - within_a_step_[axis] - begin, 0),
                               high = std::min(at + within_a_step_[axis] - begin, length - 1);
            CellValues all = line(low);
            for (std::int64_t i = low + 1; i <= high; ++i) all.take(line(i));
            to.push_back(all);
        }
    };
    std::vector<CellValues> along_x, all;
    for (std::int64_t y = 0; y < deep; ++y)
        dilate(
            0, [&](std::int64_t i) { return along_z[static_cast<std::size_t>(y * wide + i)]; }, first[0],
            wide, along_x);
    const std::int64_t row = cells_.last[0] - cells_.first[0] + 1;
    std::vector<CellValues> columns;
    for (std::int64_t x = 0; x < row; ++x)
        dilate(
            1, [&](std::int64_t i) { return along_x[static_cast<std::size_t>(i * row + x)]; }, first[1], deep,
            columns);
    const std::int64_t column = cells_.last[1] - cells_.first[1] + 1;
    for (std::int64_t y = 0; y < column; ++y)
        for (std::int64_t x = 0; x < row; ++x)
            all.push_back(columns[static_cast<std::size_t>(x * column + y)]);
    return all;
}

bool CostBlocks::at_a_face(std::int64_t x, std::int64_t y, std::int64_t z) const {
    const std::array<std::int64_t, 3> cell{x, y, z};
    for (std::size_t a = 0; a < 3; ++a)
        if (static_cast<double>(cell[a]) <= inside_[a][0] ||
            static_cast<double>(cell[a] + 1) >= inside_[a][1])
            return true;
    return false;
}

void CostBlocks::build_lowest(const SlabCosts& costs) {
    Level& level = levels_[0];
    std::vector<double> steepest(static_cast<std::size_t>(level.blocks[2]), 0.0);
    tbb::parallel_for(std::int64_t{0}, level.blocks[2], [&](std::int64_t bz) {
        const auto cells_of = [&](std::int64_t block, std::size_t axis) {
            const std::int64_t first = cells_.first[axis] + (block << lowest_bits_);
            return std::array{first,
                              std::min(first + (std::int64_t{1} << lowest_bits_) - 1, cells_.last[axis])};
        };
        const auto zs = cells_of(bz, 2);
        const std::int64_t z0 = zs[0], z1 = zs[1], row = cells_.last[0] - cells_.first[0] + 1;
        std::vector<std::vector<CellValues>> planes;
        for (std::int64_t z = z0; z <= z1; ++z) planes.push_back(plane(z));
        for (std::int64_t by = 0; by < level.blocks[1]; ++by)
            for (std::int64_t bx = 0; bx < level.blocks[0]; ++bx) {
                Found all;
                const auto ys = cells_of(by, 1), xs = cells_of(bx, 0);
                for (std::int64_t z = z0; z <= z1; ++z)
                    for (std::int64_t y = ys[0]; y <= ys[1]; ++y)
                        for (std::int64_t x = xs[0]; x <= xs[1]; ++x) {
                            const CellValues& cell =
                                planes[static_cast<std::size_t>(z - z0)][static_cast<std::size_t>(
                                    (y - cells_.first[1]) * row + x - cells_.first[0])];
                            double& edges = steepest[static_cast<std::size_t>(bz)];
                            edges = std::max(edges, cell.edges);
                            Found here{costs.of(cell), costs.visible(cell)};
                            if (!at_a_face(x, y, z)) here.costs.at.back() = 0;
                            const bool is_first = z == z0 && y == ys[0] && x == xs[0];
                            is_first ? void(all = here) : all.take(here);
                        }
                level.block[level.index(bx, by, bz)] = all;
            }
    });
    steepest_ = *std::max_element(steepest.begin(), steepest.end());
}

void CostBlocks::build_above() {
    const Level& below = levels_.back();
    Level level;
    for (std::size_t a = 0; a < 3; ++a) level.blocks[a] = (below.blocks[a] + 1) / 2;
    level.block.resize(static_cast<std::size_t>(level.blocks[0] * level.blocks[1] * level.blocks[2]));
    tbb::parallel_for(std::int64_t{0}, level.blocks[2], [&](std::int64_t z) {
        for (std::int64_t y = 0; y < level.blocks[1]; ++y)
            for (std::int64_t x = 0; x < level.blocks[0]; ++x) {
                Found all = below.block[below.index(2 * x, 2 * y, 2 * z)];
                for (std::int64_t i = 1; i < 8; ++i)
                    all.take(below.block[below.index(std::min(2 * x + (i & 1), below.blocks[0] - 1),
                                                     std::min(2 * y + (i >> 1 & 1), below.blocks[1] - 1),
                                                     std::min(2 * z + (i >> 2), below.blocks[2] - 1))]);
                level.block[level.index(x, y, z)] = all;
            }
    });
    levels_.push_back(std::move(level));
}

CostBlocks::Found CostBlocks::in(const CellBox& box) const {
    std::array<std::int64_t, 3> first{}, last{};
    std::size_t at = 0;
    for (;; ++at) {
        const int bits = lowest_bits_ + static_cast<int>(at);
        std::int64_t blocks = 1;
        for (std::size_t a = 0; a < 3; ++a) {
            first[a] = (box.first[a] - cells_.first[a]) >> bits,
            last[a] = (box.last[a] - cells_.first[a]) >> bits;
            blocks *= last[a] - first[a] + 1;
        }
        if (blocks <= kBlocksABox || at + 1 == levels_.size()) break;
    }
    const Level& level = levels_[at];
    Found all = level.block[level.index(first[0], first[1], first[2])];
    for (std::int64_t z = first[2]; z <= last[2]; ++z)
        for (std::int64_t y = first[1]; y <= last[1]; ++y)
            for (std::int64_t x = first[0]; x <= last[0]; ++x) all.take(level.block[level.index(x, y, z)]);
    return all;
}

}  // namespace squint
