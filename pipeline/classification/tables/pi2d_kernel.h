// Vector loops of PI2D's exact O(n^2) build.  Double arithmetic without contraction, compiled once per SIMD
// target: every target gives the same bits.
#pragma once

#include <array>
#include <cstddef>

// Loops run over whole vectors: after its last value every array of doubles, except that of encode_u16, has
// kPadding values that can be read and written.

namespace squint::preintegration {

inline constexpr int kPadding = 16;

/// `count` stretches between count + 1 nodes, at one rate.  The caller owns all arrays.
struct Stretches {
    int count = 0;
    const double* width = nullptr;         // in entries
    const double* extinction = nullptr;    // at the nodes
    std::array<const double*, 3> color{};  // at the nodes
    double* transparency = nullptr;        // E_i, out
    std::array<double*, 3> up{}, down{};   // out: K_i entered from the lower node, from the higher
};

/// E_i = e^-x and K_i, exact to 1e-9 for any depth.  `deepest` is the largest extinction times width of a
/// stretch.
void solve_stretches(const Stretches& stretches, double rate, double deepest);

/// transparency[f] = exp(-rate (depth[f + m] - depth[f])), opacity[f] = 1 - transparency[f], f < count.
void slab_opacities(const double* depth, int m, int count, double rate, double* transparency,
                    double* opacity);

/// out[f] = add[f] - transparency[f] * drop[f], f < count.
void subtract_dropped(const double* add, const double* transparency, const double* drop, int count,
                      double* out);

/// words[i] = values[i] 2^fraction_bits to the nearest, ties to even, in [0, 65535].
void encode_u16(const double* values, int count, int fraction_bits, unsigned short* words);

/// cells[4 i + k] = planes[k plane + i], i < count.
void interleave_4(const unsigned short* planes, std::size_t plane, std::size_t count, unsigned short* cells);

}  // namespace squint::preintegration
