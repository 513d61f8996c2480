// What passes between the stages of the fast path: 16 rays side by side, a few steps deep, in buffers that
// stay in the first-level cache.  A wire is an array of 32-bit words: row after row, one step a row, 16 rays
// each.
#pragma once

#include "pipeline/stages/location.h"

#include <array>
#include <cstdint>

namespace squint::lanes {

inline constexpr int kSide = 4;  // pixels along a packet's side
inline constexpr int kRays = kSide * kSide;
inline constexpr int kSteps = 8;          // slabs of each ray in a batch
inline constexpr int kRows = kSteps + 1;  // samples: a slab may want the one behind it
inline constexpr int kBatch = kRays * kRows;

using Word = std::int32_t;
struct alignas(64) Batch {
    Word v[kBatch];
};
struct alignas(64) Row {
    Word v[kRays];
};
struct alignas(64) RealRow {
    float v[kRays];
};

/// Sixteen pixels of a tile: pixel r is (left + r % 4, top + r / 4).  Those from `right` or `bottom` on are
/// outside it.
struct PacketPlace {
    int left, top, right, bottom;
    int column(int r) const { return left + r % kSide; }
    int row(int r) const { return top + r / kSide; }
    bool inside(int r) const { return column(r) < right && row(r) < bottom; }
};

/// Sixteen rays, set up; those that miss, or lie outside the tile, have no slabs.
struct alignas(64) RayPacket {
    Row first[3], last[3], step[3], last_index, slabs, last_length;
    Row half[kMostHalves][3], view[3];
    alignas(64) double entry_distance[kRays];  // world, as RaySetup's
    int most_slabs, rays;                      // of any ray; rays that have slabs
};

/// About where a packet's rays run together, for leaving out empty space: never used to take a sample.  All
/// of them, or four groups of 2x2, keep close to a course in their midst.
struct RayCourse {
    static constexpr int kMostBeams = 4;
    static constexpr int kWindow = 16;  // rows looked at together
    int beams;
    float first[kMostBeams][3], step[kMostBeams][3];  // blocks, from the lowest corner of the empty space
    int enough;                    // empty blocks about the corner nearest to a course, for its whole beam
    int stride, enough_of_stride;  // steps; the same for so many at once
    int window;                    // row r of those looked at last is window + r:
    std::uint32_t may_be_seen;     // bit r, where something may be seen
};

/// Rows one after the other, at most kSteps.
struct Rows {
    int first, count;
    int end() const { return first + count; }
};

/// One batch: row s of ray r at s * kRays + r.  Row 0 is sample `first`.
struct alignas(64) Samples {
    Word first = 0;
    Batch cell[3], weight[3];
    Batch location[3];  // where gradients are made of samples, or lie between them
    Batch place;  // of the cell in memory (VoxelSource): among the cells, or below 0; or of its lowest voxel
    Batch pair[4];          // corners by pairs along x: the lower in the low half; y fastest
    Batch input;            // classification input
    Batch length;           // of the slab, in steps
    Batch color[3], alpha;  // of the slab
};

/// Samples to be lit, gathered from a batch: dense, so that transparent ones cost nothing.
struct alignas(64) LitSamples {
    Batch from;                // place in the batch
    Batch cell[3], weight[3];  // where a gradient is taken
    // The 4x4x4 voxels about its cell, by pairs along x; for central differences alone, of outer rows the
    // inner pair, in place of the first.
    Batch pair[32];
    Batch location[2][3];  // of the front and the back: where gradients are made of samples, or between ends
    Batch beside[3][2];    // scalars one voxel off along each axis: behind, ahead
    Batch half[kMostHalves][3], view[3];
    Batch gradient[3];  // raw; the sum of those at a slab's two ends
    Batch normal[3];
    Batch confidence;  // where light fades in
    Batch color[3], alpha;
    // Where slabs may be cut: inputs at both ends, length, and log2 of the pieces.
    Batch input[2], length, cuts;
};

/// Raw gradients at slabs' ends, by place in the batch.
struct alignas(64) EndGradients {
    Batch component[3];
    Row known;  // 1 where row 0 has one, from the batch in front
};

/// Whether a row of four voxels, of the 4x4 about a cell, holds none of the cell's corners.
constexpr bool is_outer_row(int y, int z) {
    return y % 3 == 0 || z % 3 == 0;
}

/// Sixteen pixels on their way.
struct alignas(64) PixelPacket {
    Row color[3], transparency;
    Row remainder;  // w_carry
    Row active;     // 1 while a ray goes on
    Row samples;    // slabs composited
};

/// What stands for sixteen rays in MIP, MinIP and average, so far.
struct alignas(64) ProjectionPacket {
    Row extreme;                    // the largest or smallest input
    std::int64_t sum[kRays];        // of both ends' inputs of every full slab
    std::int64_t last_ends[kRays];  // of the last slab's
};

}  // namespace squint::lanes
