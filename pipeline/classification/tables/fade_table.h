// How a slab's light lies along it, over both ends: Bernstein moments of the slab integral, for shading.inside
// linear (Lum et al. 2004) and nlpi (Guetat et al. 2010).
//
//     B_k = C(3, k) int_0^1 c(u) m(u) (1 - u)^(3 - k) u^k du,    m(u) = tau(u) exp(-int_0^u tau)
//
// for the three colours and for white; u is 0 at the front.  None is negative, and their sum over k is the slab
// itself.
#pragma once

#include "pipeline/classification/tables/linear_entries.h"

#include <array>
#include <vector>

namespace squint::preintegration {

inline constexpr int kFades = 4;  // Bernstein polynomials of degree 3

/// B_k of red, green, blue and white: [k][channel].
using FadeMoments = std::array<std::array<double, 4>, kFades>;

/// int u c m du, which Lum et al. call I_1: B_1 / 3 + 2 B_2 / 3 + B_3.
std::array<double, 4> first_moment(const FadeMoments& moments);

/// Of one slab of `length` between two entry coordinates, the entries linear between them and none opaque: by
/// quadrature, to 1e-12.
FadeMoments fade_moments(const Entries& entries, double front, double back, double length);

/// Tables of size x size cells, the cell of front f and back b at (f * size + b) * 4; node j stands at coordinate
/// j (entries - 1) / (size - 1).  What a cell holds of its moments: `linear`, one table of first moments;
/// else three, of B_1, B_2 and B_3.
///
/// All slabs |b - f| = m share one rate, so that a diagonal is one problem, as for PI2D (pi2d_table.h): in units
/// of nodes from the front, J_k = int c m w^k dw,
///   J_k(f) = h_k(f) + E_f sum_j C(k, j) (J_j(f + 1) - P(f + 1) sum_i C(j, i) (m - 1)^(j - i) h_i(f + m)),
/// with h the moments of the stretch from a node to the next, E its transparency and P that of what lies in front.
/// Moving the origin m times multiplies a rounding by (size / m)^3: slabs of few nodes are put together afresh.
std::vector<std::vector<double>> build_fades(const Entries& entries, int size, double length, bool linear);

}  // namespace squint::preintegration
