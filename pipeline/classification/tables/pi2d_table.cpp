#include "pipeline/classification/tables/pi2d_table.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/parallel.h"
#include "core/portable_math.h"
#include "pipeline/classification/tables/exact_slab.h"
#include "pipeline/classification/tables/pi1d_table.h"
#include "pipeline/classification/tables/pi2d_kernel.h"
#include "pipeline/classification/tables/power_series.h"

namespace squint::preintegration {
namespace {

/// The function cut at the table's nodes and at the entries: everything is linear between two neighbouring
/// points.
struct Grid {
    int size = 0;               // nodes
    double spacing = 0;         // entries from node to node
    double length = 0;          // world units
    int stretches = 0;          // one less than points
    std::vector<double> width;  // of the stretch after each point, in entries
    std::vector<double> extinction;
    Channels color;
    std::vector<char> wall;         // the point is opaque
    std::vector<int> node;          // node[j]: its point
    std::vector<double> depth;      // T at the nodes
    std::vector<int> walls_to;      // opaque points up to and with node j
    std::vector<int> walls_before;  // opaque points before node j
    double deepest = 0;             // largest extinction * width of a stretch
    bool any_wall = false;

    bool one_stretch_per_node() const { return stretches == size - 1; }
};

/// Exact on entries, so that a node on an entry meets the wall of that entry.
double node_coordinate(int node, int size, int entries) {
    return static_cast<double>(static_cast<std::int64_t>(node) * (entries - 1)) / (size - 1);
}

std::vector<double> cut_points(const Entries& entries, int size, std::vector<int>& node) {
    std::vector<double> points;
    int entry = 0;
    for (int j = 0; j < size; ++j) {
        const double s = node_coordinate(j, size, entries.size());
        for (; entry < s; ++entry) points.push_back(entry);
        if (entry == s) ++entry;
        node.push_back(static_cast<int>(points.size()));
        points.push_back(s);
    }
    return points;
}

Grid make_grid(const Entries& entries, int size, double length) {
    Grid grid;
    grid.size = size;
    grid.spacing = static_cast<double>(entries.size() - 1) / (size - 1);
    grid.length = length;
    const std::vector<double> points = cut_points(entries, size, grid.node);
    double depth = 0;
    int walls = 0;
    std::size_t next_node = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        grid.extinction.push_back(extinction_at(entries, points[i]));
        const Vec3 color = color_at(entries, points[i]);
        for (int k = 0; k < 3; ++k) grid.color[k].push_back(color[k]);
        grid.wall.push_back(opaque_at(entries, points[i]));
        if (i > 0) {
            const double width = points[i] - points[i - 1];
            grid.width.push_back(width);
            depth += width * (grid.extinction[i - 1] + grid.extinction[i]) / 2;
            grid.deepest =
                std::max(grid.deepest, width * std::max(grid.extinction[i - 1], grid.extinction[i]));
        }
        const bool is_node = next_node < grid.node.size() && grid.node[next_node] == static_cast<int>(i);
        if (is_node) grid.walls_before.push_back(walls);
        walls += grid.wall[i];
        if (is_node) {
            grid.walls_to.push_back(walls);
            grid.depth.push_back(depth);
            ++next_node;
        }
    }
    grid.any_wall = walls > 0;
    grid.stretches = static_cast<int>(points.size()) - 1;
    for (auto* array :
         {&grid.width, &grid.extinction, &grid.color[0], &grid.color[1], &grid.color[2], &grid.depth})
        array->resize(array->size() + kPadding);
    return grid;
}

/// K and E of the stretches, or of stretches joined from node to node.
struct Terms {
    std::vector<double> up_transparency, down_transparency;
    Channels up, down;

    explicit Terms(std::size_t count = 0)
        : up_transparency(count + kPadding), down_transparency(count + kPadding) {
        for (int k = 0; k < 3; ++k) up[k].resize(count + kPadding), down[k].resize(count + kPadding);
    }
};

class DiagonalSolver final : public Pi2dDiagonal {
  public:
    explicit DiagonalSolver(const Grid& grid)
        : grid_(grid),
          fine_(grid.stretches),
          joined_(grid.one_stretch_per_node() ? 0 : grid.size - 1),
          transparency_(grid.size + kPadding) {
        for (auto* side : {&up_, &down_})
            for (auto& plane : *side) plane.resize(grid.size + kPadding);
        if (grid.any_wall) down_transparency_.resize(grid.size + kPadding);
    }

    const double* up(int k) const override { return up_[k].data(); }
    const double* down(int k) const override {
        return k == 3 && !grid_.any_wall ? up_[3].data() : down_[k].data();
    }

    void solve(int m) override {
        if (m == 0) return solve_points();
        const double rate = grid_.length / (m * grid_.spacing);
        solve_terms(rate);
        const int count = grid_.size - m;
        slab_opacities(grid_.depth.data(), m, count, rate, transparency_.data(), up_[3].data());
        if (grid_.any_wall) hide_behind_walls(m, count);
        start_lights(m, count);
        add_lights(m, count);
        if (grid_.any_wall) overwrite_walls(m, count);
    }

  private:
    const Terms& terms() const { return grid_.one_stretch_per_node() ? fine_ : joined_; }

    /// The diagonal (f, f): the point itself over the slab's length.
    void solve_points() {
        for (int j = 0; j < grid_.size; ++j) {
            const int point = grid_.node[j];
            const double alpha =
                grid_.wall[point] ? 1 : -portable::expm1(-grid_.extinction[point] * grid_.length);
            for (int k = 0; k < 4; ++k)
                up_[k][j] = down_[k][j] = k == 3 ? alpha : grid_.color[k][point] * alpha;
        }
    }

    void solve_terms(double rate) {
        Stretches s;
        s.count = grid_.stretches;
        s.width = grid_.width.data();
        s.extinction = grid_.extinction.data();
        s.transparency = fine_.up_transparency.data();
        for (int k = 0; k < 3; ++k) {
            s.color[k] = grid_.color[k].data();
            s.up[k] = fine_.up[k].data();
            s.down[k] = fine_.down[k].data();
        }
        solve_stretches(s, rate, grid_.deepest);
        if (grid_.any_wall || !grid_.one_stretch_per_node()) fine_.down_transparency = fine_.up_transparency;
        if (grid_.any_wall) close_stretches_at_walls();
        if (!grid_.one_stretch_per_node()) join_stretches();
    }

    /// A stretch that arrives at a wall ends in the wall's colour and lets nothing through.
    void close_stretches_at_walls() {
        for (int i = 0; i < grid_.stretches; ++i) {
            if (grid_.wall[i + 1]) {
                for (int k = 0; k < 3; ++k)
                    fine_.up[k][i] += fine_.up_transparency[i] * grid_.color[k][i + 1];
                fine_.up_transparency[i] = 0;
            }
            if (grid_.wall[i]) {
                for (int k = 0; k < 3; ++k)
                    fine_.down[k][i] += fine_.down_transparency[i] * grid_.color[k][i];
                fine_.down_transparency[i] = 0;
            }
        }
    }

    void join_stretches() {
        for (int j = 0; j + 1 < grid_.size; ++j) {
            const int first = grid_.node[j], end = grid_.node[j + 1];
            double up_transparency = 1, down_transparency = 1;
            Vec3 up{0, 0, 0}, down{0, 0, 0};
            for (int i = first; i < end; ++i) {
                for (int k = 0; k < 3; ++k) {
                    up[k] += up_transparency * fine_.up[k][i];
                    down[k] = fine_.down[k][i] + fine_.down_transparency[i] * down[k];
                }
                up_transparency *= fine_.up_transparency[i];
                down_transparency *= fine_.down_transparency[i];
            }
            joined_.up_transparency[j] = up_transparency;
            joined_.down_transparency[j] = down_transparency;
            for (int k = 0; k < 3; ++k) joined_.up[k][j] = up[k], joined_.down[k][j] = down[k];
        }
    }

    /// Slabs that meet a wall are opaque and lose nothing at their back.
    void hide_behind_walls(int m, int count) {
        for (int f = 0; f < count; ++f) {
            const bool up_wall = grid_.walls_to[f + m] > grid_.walls_to[f];
            const bool down_wall = grid_.walls_before[f + m] > grid_.walls_before[f];
            down_transparency_[f] = down_wall ? 0 : transparency_[f];
            down_[3][f] = down_wall ? 1 : up_[3][f];
            if (up_wall) transparency_[f] = 0, up_[3][f] = 1;
        }
    }

    void overwrite_walls(int m, int count) {
        for (int f = 0; f < count; ++f) {
            const int low = grid_.node[f], high = grid_.node[f + m];
            for (int k = 0; k < 4; ++k) {
                if (grid_.wall[low]) up_[k][f] = k == 3 ? 1 : grid_.color[k][low];
                if (grid_.wall[high]) down_[k][f] = k == 3 ? 1 : grid_.color[k][high];
            }
        }
    }

    const double* through_down() const {
        const bool same = !grid_.any_wall && grid_.one_stretch_per_node();
        return same ? terms().up_transparency.data() : terms().down_transparency.data();
    }

    /// K_f - P_f K_(f + m) upwards, and the same from the other side; at the first slab of full length there
    /// is nothing to subtract.
    void start_lights(int m, int count) {
        const double* const slab_down = grid_.any_wall ? down_transparency_.data() : transparency_.data();
        for (int k = 0; k < 3; ++k) {
            const double *const light_up = terms().up[k].data(), *const light_down = terms().down[k].data();
            subtract_dropped(light_up, transparency_.data(), light_up + m, count - 1, up_[k].data());
            up_[k][count - 1] = light_up[count - 1];
            subtract_dropped(light_down + m, slab_down + 1, light_down, count - 1, down_[k].data() + 1);
            down_[k][0] = light_down[m - 1];
        }
    }

    /// C(f) = E_f C(f + 1) + ... from the last node down, and from the first node up: six chains hide each
    /// other's latency.
    void add_lights(int m, int count) {
        const double *const e_up = terms().up_transparency.data(), *const e_down = through_down();
        double up[3] = {0, 0, 0}, down[3] = {0, 0, 0};
        for (int i = 0; i < m - 1; ++i) {
            const int f = grid_.size - 2 - i;
            for (int k = 0; k < 3; ++k) {
                up[k] = terms().up[k][f] + e_up[f] * up[k];
                down[k] = terms().down[k][i] + e_down[i] * down[k];
            }
        }
        double* const out_up[3] = {up_[0].data(), up_[1].data(), up_[2].data()};
        double* const out_down[3] = {down_[0].data(), down_[1].data(), down_[2].data()};
        const double *const alpha_up = this->up(3), *const alpha_down = this->down(3);
        for (int i = 0; i < count; ++i) {
            const int f = count - 1 - i;
            for (int k = 0; k < 3; ++k) {
                up[k] = out_up[k][f] + e_up[f] * up[k];
                down[k] = out_down[k][i] + e_down[i + m - 1] * down[k];
                out_up[k][f] = within(up[k], alpha_up[f]);
                out_down[k][i] = within(down[k], alpha_down[i]);
            }
        }
    }

    /// Rounding can put a colour 1e-12 outside.
    static double within(double color, double alpha) { return std::min(std::max(color, 0.0), alpha); }

    const Grid& grid_;
    Terms fine_, joined_;
    std::vector<double> transparency_, down_transparency_;
    std::array<std::vector<double>, 4> up_, down_;
};

struct Worker {
    std::unique_ptr<DiagonalSolver> solver;
    std::vector<std::byte> scratch;
};

RealPreIntegrated2D empty_table(const Entries& entries, int size, double length) {
    assert(size >= 2 && entries.size() >= 2);
    RealPreIntegrated2D table{.size = size, .entries = entries.size(), .length = length};
    table.cell.resize(static_cast<std::size_t>(size) * size * 4);
    return table;
}

/// Fills every node with `slab(front, back)`.
template <class SlabOf>
void fill(RealPreIntegrated2D& table, const SlabOf& slab) {
    in_parallel(table.size, [&](int f) {
        for (int b = 0; b < table.size; ++b) {
            const SlabValue value = slab(node_coordinate(f, table.size, table.entries),
                                         node_coordinate(b, table.size, table.entries));
            double* const cell = &table.cell[(static_cast<std::size_t>(f) * table.size + b) * 4];
            for (int k = 0; k < 3; ++k) cell[k] = value.color[k];
            cell[3] = value.alpha;
        }
    });
}

}  // namespace

void for_each_diagonal_group(const Entries& entries, int size, double length, const DiagonalGroup& group) {
    assert(size >= 2 && entries.size() >= 2);
    const Grid grid = make_grid(entries, size, length);
    oneapi::tbb::enumerable_thread_specific<Worker> workers;
    const int groups = (size + kDiagonalsPerGroup - 1) / kDiagonalsPerGroup;
    in_parallel(groups, [&](int g) {
        Worker& worker = workers.local();
        if (!worker.solver) worker.solver = std::make_unique<DiagonalSolver>(grid);
        const int first = g * kDiagonalsPerGroup;
        group(first, std::min(kDiagonalsPerGroup, size - first), *worker.solver, worker.scratch);
    });
}

void EncodeU16::operator()(int, std::span<const double> values, std::span<std::uint16_t> words) const {
    encode_u16(values.data(), static_cast<int>(values.size()), fraction_bits, words.data());
}

RealPreIntegrated2D build_pi2d(const Entries& entries, int size, double length) {
    RealPreIntegrated2D table = empty_table(entries, size, length);
    const auto copy = [](int, std::span<const double> values, std::span<double> words) {
        std::copy(values.begin(), values.end(), words.begin());
    };
    build_pi2d_words<double>(entries, size, length, table.cell, copy);
    return table;
}

RealPreIntegrated2D build_pi2d_direct(const Entries& entries, int size, double length) {
    RealPreIntegrated2D table = empty_table(entries, size, length);
    fill(table, [&](double front, double back) { return exact_slab(entries, front, back, length); });
    return table;
}

RealPreIntegrated2D build_pi2d_without_self_attenuation(const Entries& entries, int size, double length) {
    RealPreIntegrated2D table = empty_table(entries, size, length);
    const OpaquePrediction prediction = predict_opaque(entries);
    const PrefixTables tables = build_prefix_tables(entries, 1);
    fill(table, [&](double front, double back) -> SlabValue {
        const RealCutSlab cut = cut_at_opaque(entries, prediction, front, back, length);
        if (cut.wall && cut.length == 0) return {cut.wall_color, 1};
        if (cut.front == cut.back) return point_slab(entries, cut.front, cut.length);
        const Moments moments = tables.moments(cut.front, cut.back, cut.length, 1);
        SlabValue value{moments.q[0], -portable::expm1(-moments.depth)};
        for (int k = 0; k < 3; ++k) value.color[k] = std::min(value.color[k], value.alpha);
        return cut.over_wall(value);
    });
    return table;
}

SlabValue RealPreIntegrated2D::slab(double front, double back, double slab_length) const {
    const double scale = static_cast<double>(size - 1) / (entries - 1);
    const double f = std::clamp(front * scale, 0.0, size - 1.0),
                 b = std::clamp(back * scale, 0.0, size - 1.0);
    const auto at = [&](int row, int column) {
        return &cell[(static_cast<std::size_t>(row) * size + column) * 4];
    };
    std::array<double, 4> value;
    if (lookup == Lookup::nearest) {
        std::copy_n(at(static_cast<int>(f + 0.5), static_cast<int>(b + 0.5)), 4, value.begin());
    } else {
        const int row = std::min(static_cast<int>(f), size - 2),
                  column = std::min(static_cast<int>(b), size - 2);
        const double u = f - row, v = b - column;
        for (int k = 0; k < 4; ++k)
            value[k] = (1 - u) * ((1 - v) * at(row, column)[k] + v * at(row, column + 1)[k]) +
                       u * ((1 - v) * at(row + 1, column)[k] + v * at(row + 1, column + 1)[k]);
    }
    return with_length_ratio({{value[0], value[1], value[2]}, value[3]}, slab_length / length);
}

}  // namespace squint::preintegration
