// PI2D: the slab integral tabulated over (front, back) for slabs of one length (Engel et al. 2001), size x
// size nodes of (red, green, blue, alpha), premultiplied.  Node (f, b) is stored at ((f * size) + b) * 4;
// node j lies at coordinate j (entries - 1) / (size - 1).
//
// The exact table in O(size^2).  All slabs |b - f| = m share one rate r = length / |b - f|, so a diagonal is
// one problem.  Let K_i and E_i be the light and the transparency of the stretch from node i to i + 1 at that
// rate, and P the slab's transparency; then
//   C(f, f + m) = E_f C(f + 1, f + 1 + m) + K_f - P(f, f + m) K_(f + m).
// There is no division and E <= 1, so rounding never grows: the table is within 1e-9 of the exact integral.
// K needs only the mean transparency M of a stretch: integrating by parts, C = c_0 (1 - M) + c_1 (M - E) for
// linear c and tau, and M is a short polynomial.
#pragma once

#include "pipeline/classification/tables/linear_entries.h"
#include "pipeline/classification/tables/pi2d_kernel.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

namespace squint::preintegration {

enum class Lookup { nearest, bilinear };

struct RealPreIntegrated2D {
    int size = 0;
    int entries = 0;
    double length = 1;           // world units: the table is for slabs of this length
    std::vector<double> cell{};  // size * size * 4
    Lookup lookup = Lookup::bilinear;

    /// A slab of another length keeps its colour and takes alpha' = 1 - (1 - alpha)^(slab_length / length):
    /// exact in alpha, but with the self-attenuation of `length`.
    SlabValue slab(double front, double back, double slab_length) const;
};

/// From the definition, one exact_slab for each node, O(size^2 entries): the oracle.
RealPreIntegrated2D build_pi2d_direct(const Entries& entries, int size, double length);

/// Alpha exact, colour without self-attenuation: C = r (X_1(b) - X_1(f)) (Engel 2001; Lee & Shin, equation
/// 10), never above alpha.
RealPreIntegrated2D build_pi2d_without_self_attenuation(const Entries& entries, int size, double length);

/// The exact table in O(size^2), in double.
RealPreIntegrated2D build_pi2d(const Entries& entries, int size, double length);

/// Computes diagonals.  Each thread has one.
class Pi2dDiagonal {
  public:
    /// After solve(m), for f in [0, size - m), up(k)[f] is node (f, f + m) and down(k)[f] is node (f + m, f);
    /// k = 0, 1, 2 are colours, 3 is alpha.
    virtual void solve(int m) = 0;
    virtual const double* up(int k) const = 0;
    virtual const double* down(int k) const = 0;
    virtual ~Pi2dDiagonal() = default;
};

inline constexpr int kDiagonalsPerGroup = 16;

/// Calls `group(first, count, diagonal, scratch)` for groups of neighbouring diagonals, 0 <= m < size, in
/// parallel on TBB's threads.  `scratch` belongs to the thread and keeps its size between calls.
using DiagonalGroup =
    std::function<void(int first, int count, Pi2dDiagonal& diagonal, std::vector<std::byte>& scratch)>;
void for_each_diagonal_group(const Entries& entries, int size, double length, const DiagonalGroup& group);

/// The exact table in O(size^2), written as words of any type into `cells` (size * size * 4 words).
/// `encode(channel, values, words)` turns a span of doubles in [0, 1] into as many words; channel 3 is alpha.
template <class Word, class Encode>
void build_pi2d_words(const Entries& entries, int size, double length, std::span<Word> cells,
                      const Encode& encode);

/// Rounds to the nearest (ties to even) multiple of 2^-fraction_bits, at most 65535.
struct EncodeU16 {
    int fraction_bits = 15;
    void operator()(int channel, std::span<const double> values, std::span<std::uint16_t> words) const;
};

// -----------------------------------------------------------------------------------------------------------

template <class Word, class Encode>
void build_pi2d_words(const Entries& entries, int size, double length, std::span<Word> cells,
                      const Encode& encode) {
    struct Cell {
        Word word[4];
    };
    Cell* const table = reinterpret_cast<Cell*>(cells.data());
    const auto group = [&](int first, int count, Pi2dDiagonal& diagonal, std::vector<std::byte>& scratch) {
        // Encode each diagonal, then write row by row, so that the nodes of a row are written together.
        const std::size_t plane = size;
        scratch.resize(plane * (4 * sizeof(Word) + 2 * kDiagonalsPerGroup * sizeof(Cell)));
        Cell* const lanes = reinterpret_cast<Cell*>(scratch.data());
        Word* const words = reinterpret_cast<Word*>(lanes + 2 * kDiagonalsPerGroup * plane);
        const auto pack = [&](auto&& values, std::size_t slabs, Cell* out) {
            for (int k = 0; k < 4; ++k)
                encode(k, std::span(values(k), slabs), std::span(words + k * plane, slabs));
            if constexpr (sizeof(Word) == 2)
                interleave_4(words, plane, slabs, out->word);
            else
                for (std::size_t f = 0; f < slabs; ++f)
                    out[f] = {{words[f], words[plane + f], words[2 * plane + f], words[3 * plane + f]}};
        };
        for (int lane = 0; lane < count; ++lane) {
            diagonal.solve(first + lane);
            const std::size_t here = size - first - lane;
            pack([&](int k) { return diagonal.up(k); }, here, lanes + 2 * lane * plane);
            pack([&](int k) { return diagonal.down(k); }, here, lanes + (2 * lane + 1) * plane);
        }
        for (int row = 0; row < size; ++row) {
            Cell* const cells_of_row = table + row * plane;
            const int up_end = std::min(count, size - row - first),
                      down_end = std::min(count, row - first + 1);
            for (int lane = 0; lane < up_end; ++lane)
                cells_of_row[row + first + lane] = lanes[2 * lane * plane + row];
            for (int lane = 0; lane < down_end; ++lane) {
                const int column = row - first - lane;
                cells_of_row[column] = lanes[(2 * lane + 1) * plane + column];
            }
        }
    };
    for_each_diagonal_group(entries, size, length, group);
}

}  // namespace squint::preintegration
