// The cells of a volume that a point may lie in, for all that its location may be.
#pragma once

#include "core/volume.h"
#include "pipeline/machines/certificate/payers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace squint {

struct ReachedCells {
    std::array<std::int64_t, 3> low{}, high{};
    bool far = false;  // too many: any cell

    bool is_one() const { return !far && low == high; }
    /// Calls f with every corner of them.
    template <class F>
    void corners(F&& f) const {
        for (std::int64_t z = low[2]; z <= high[2] + 1; ++z)
            for (std::int64_t y = low[1]; y <= high[1] + 1; ++y)
                for (std::int64_t x = low[0]; x <= high[0] + 1; ++x) f(std::array<std::int64_t, 3>{x, y, z});
    }
};
/// Around a point at `weight` in `cell`.
inline ReachedCells reached_cells(const Volume& volume, const std::array<std::int64_t, 3>& cell,
                                  const std::array<Bounded, 3>& weight, int weight_bits) {
    const double whole = std::ldexp(1.0, weight_bits);
    ReachedCells cells;
    for (std::size_t a = 0; a < 3; ++a) {
        const double place = in_double(weight[a].v) / whole, off = weight[a].most() / whole * (1 + 1e-9);
        cells.far = cells.far || !(off < 4);
        if (cells.far) return cells;
        const std::int64_t last = std::max<std::int64_t>(volume.dims[static_cast<int>(a)] - 2, 0);
        const auto reached = [&](double p) {
            return std::clamp<std::int64_t>(cell[a] + static_cast<std::int64_t>(std::floor(p)), 0, last);
        };
        cells.low[a] = reached(place - off);
        cells.high[a] = std::max(cells.low[a], reached(std::ceil(place + off) - 1));
    }
    return cells;
}

}  // namespace squint
