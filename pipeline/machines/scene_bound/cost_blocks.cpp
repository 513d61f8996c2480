#include "pipeline/machines/scene_bound/cost_blocks.h"

#include "core/parallel.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace squint {
namespace {

constexpr std::int64_t kMostBlocks = 3 << 20;  // of 36 bytes
constexpr std::int64_t kBlocksABox = 64;       // that stand for a box

}  // namespace

CostBlocks::CostBlocks(const Plan& plan, const SampleErrors& errors, const LightErrors& light,
                       const SlabCosts& costs)
    : volume_(*plan.volume), costs_(costs), whole_{1.0 * volume_.smallest, 1.0 * volume_.largest} {
    if (light.lit) lights_.emplace(plan, light);
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
    if (lights_ && !has_one_cell()) mark_lit();
    build_lowest();
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

CostBlocks::Span CostBlocks::met(std::size_t axis) const {
    const std::int64_t most = std::max<std::int64_t>(volume_.dims[static_cast<int>(axis)] - 2, 0);
    return {std::max<std::int64_t>(cells_.first[axis] - within_a_step_[axis], 0),
            std::min(cells_.last[axis] + within_a_step_[axis], most)};
}

CellValues CostBlocks::lit_cell(const Place& at) const {
    CellValues cell = of_cell(at);
    if (!lights_) return cell;
    bool may_count = true;
    if (has_one_cell()) {
        may_count = costs_.may_cost(cell);
    } else if (marks_) {
        Place block{};
        for (std::size_t a = 0; a < 3; ++a) block[a] = (at[a] - met(a).first) >> kMarkBits;
        may_count = marks_->at(block[0], block[1], block[2]) != 0;
    }
    if (may_count) lights_->add_to(cell, at);
    return cell;
}

std::vector<CellValues> CostBlocks::values(const CellBox& box) const {
    std::array<Span, 3> from;
    for (std::size_t a = 0; a < 3; ++a)
        from[a] = {std::max(box.first[a] - within_a_step_[a], met(a).first),
                   std::min(box.last[a] + within_a_step_[a], met(a).last)};
    std::vector<CellValues> values;
    values.reserve(static_cast<std::size_t>(from[0].size() * from[1].size() * from[2].size()));
    for (std::int64_t z = from[2].first; z <= from[2].last; ++z)
        for (std::int64_t y = from[1].first; y <= from[1].last; ++y)
            for (std::int64_t x = from[0].first; x <= from[0].last; ++x)
                values.push_back(lit_cell({x, y, z}));
    if (has_one_cell()) return values;
    // Each with its neighbours, axis by axis; the axis becomes the slowest, so all three are in order in the end.
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::int64_t length = from[axis].size();
        const auto lines = static_cast<std::int64_t>(values.size()) / length;
        std::vector<CellValues> dilated;
        dilated.reserve(static_cast<std::size_t>(lines * (box.last[axis] - box.first[axis] + 1)));
        for (std::int64_t at = box.first[axis]; at <= box.last[axis]; ++at) {
            const std::int64_t low = std::max(at - within_a_step_[axis] - from[axis].first, std::int64_t{0}),
                               high = std::min(at + within_a_step_[axis] - from[axis].first, length - 1);
            for (std::int64_t line = 0; line < lines; ++line) {
                CellValues all = values[static_cast<std::size_t>(line * length + low)];
                for (std::int64_t i = low + 1; i <= high; ++i)
                    all.take(values[static_cast<std::size_t>(line * length + i)]);
                dilated.push_back(all);
            }
        }
        values = std::move(dilated);
    }
    return values;
}

bool CostBlocks::at_a_face(std::int64_t x, std::int64_t y, std::int64_t z) const {
    const std::array<std::int64_t, 3> cell{x, y, z};
    for (std::size_t a = 0; a < 3; ++a)
        if (static_cast<double>(cell[a]) <= inside_[a][0] ||
            static_cast<double>(cell[a] + 1) >= inside_[a][1])
            return true;
    return false;
}

/// Marks blocks of cells about all that can cost anything: light elsewhere is not looked at.
void CostBlocks::mark_lit() {
    const std::array<Span, 3> spans{met(0), met(1), met(2)};
    Place blocks{};
    for (std::size_t a = 0; a < 3; ++a) {
        if (2 * within_a_step_[a] > std::int64_t{1} << kMarkBits) return;
        blocks[a] = ((spans[a].size() - 1) >> kMarkBits) + 1;
    }
    BlockGrid<char> marks{blocks,
                          std::vector<char>(static_cast<std::size_t>(blocks[0] * blocks[1] * blocks[2]))};
    BlockGrid<char> cost = marks;
    in_parallel(blocks[2], [&](std::int64_t bz) {
        const std::int64_t z0 = spans[2].first + (bz << kMarkBits);
        for (std::int64_t z = z0; z <= std::min(z0 + (1 << kMarkBits) - 1, spans[2].last); ++z)
            for (std::int64_t y = spans[1].first; y <= spans[1].last; ++y)
                for (std::int64_t x = spans[0].first; x <= spans[0].last; ++x)
                    if (char& mark =
                            cost.at((x - spans[0].first) >> kMarkBits, (y - spans[1].first) >> kMarkBits, bz);
                        !mark && costs_.may_cost(of_cell({x, y, z})))
                        mark = 1;
    });
    for (std::int64_t z = 0; z < blocks[2]; ++z)
        for (std::int64_t y = 0; y < blocks[1]; ++y)
            for (std::int64_t x = 0; x < blocks[0]; ++x)
                for (std::int64_t i = 0; i < 27; ++i) {
                    const std::int64_t bx = x + i % 3 - 1, by = y + i / 3 % 3 - 1, bz = z + i / 9 - 1;
                    if (0 <= bx && bx < blocks[0] && 0 <= by && by < blocks[1] && 0 <= bz && bz < blocks[2] &&
                        cost.at(bx, by, bz))
                        marks.at(x, y, z) = 1;
                }
    marks_ = std::move(marks);
}

void CostBlocks::build_lowest() {
    Level& level = levels_[0];
    std::vector<CellValues> steepest(static_cast<std::size_t>(level.blocks[2]), whole_);
    in_parallel(level.blocks[2], [&](std::int64_t bz) {
        const auto cells_of = [&](std::int64_t block, std::size_t axis) {
            const std::int64_t first = cells_.first[axis] + (block << lowest_bits_);
            return std::array{first,
                              std::min(first + (std::int64_t{1} << lowest_bits_) - 1, cells_.last[axis])};
        };
        const auto zs = cells_of(bz, 2);
        const std::int64_t z0 = zs[0], z1 = zs[1], row = cells_.last[0] - cells_.first[0] + 1,
                           plane = row * (cells_.last[1] - cells_.first[1] + 1);
        const std::vector<CellValues> cells =
            values({{cells_.first[0], cells_.first[1], z0}, {cells_.last[0], cells_.last[1], z1}});
        for (std::int64_t by = 0; by < level.blocks[1]; ++by)
            for (std::int64_t bx = 0; bx < level.blocks[0]; ++bx) {
                Found all;
                const auto ys = cells_of(by, 1), xs = cells_of(bx, 0);
                for (std::int64_t z = z0; z <= z1; ++z)
                    for (std::int64_t y = ys[0]; y <= ys[1]; ++y)
                        for (std::int64_t x = xs[0]; x <= xs[1]; ++x) {
                            const CellValues& cell = cells[static_cast<std::size_t>(
                                (z - z0) * plane + (y - cells_.first[1]) * row + x - cells_.first[0])];
                            steepest[static_cast<std::size_t>(bz)].take(cell);
                            Found here{costs_.of(cell), costs_.visible(cell)};
                            if (!at_a_face(x, y, z)) here.costs.at.back() = 0;
                            const bool is_first = z == z0 && y == ys[0] && x == xs[0];
                            is_first ? void(all = here) : all.take(here);
                        }
                level.block[level.index(bx, by, bz)] = all;
            }
    });
    for (const CellValues& of_blocks : steepest) whole_.take(of_blocks);
}

void CostBlocks::build_above() {
    const Level& below = levels_.back();
    Level level;
    for (std::size_t a = 0; a < 3; ++a) level.blocks[a] = (below.blocks[a] + 1) / 2;
    level.block.resize(static_cast<std::size_t>(level.blocks[0] * level.blocks[1] * level.blocks[2]));
    in_parallel(level.blocks[2], [&](std::int64_t z) {
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
