// The buffers between the stages of the fast path, which stay in the first-level cache: 16 rays side by
// side, a few steps deep.  A wire is an array of 32-bit words, row after row; a row is one step of all 16
// rays.
#pragma once

#include "pipeline/stages/location.h"

#include <array>
#include <cstdint>

namespace squint::lanes {

inline constexpr int kSide = 4;  // pixels along a packet's side
inline constexpr int kRays = kSide * kSide;
inline constexpr int kSteps = 8;          // slabs of each ray in a batch
inline constexpr int kRows = kSteps + 1;  // samples: a slab may need the one behind it
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

/// Sixteen rays, set up; rays that miss the volume or lie outside the tile have no slabs.
struct alignas(64) RayPacket {
    Row first[3], last[3], step[3], last_index, slabs, last_length;
    Row half[kMostHalves][3], view[3];
    alignas(64) double entry_distance[kRays];  // in world units, as in RaySetup
    int most_slabs, rays;                      // of any ray; the number of rays with slabs
};

/// About where a packet's rays run, for skipping empty space only.  All of them, or each of four groups of
/// 2x2, stay close to a course in their middle.
struct RayCourse {
    static constexpr int kMostBeams = 4;
    static constexpr int kWindow = 16;  // rows examined together
    int beams;
    float first[kMostBeams][3], step[kMostBeams][3];  // in blocks, from the lowest corner of empty space
    // How far samples may lie from their beam's course along any axis, in blocks, where they meet two blocks along
    // it at most; else below zero.
    float apart;
    int enough;                    // empty blocks that a beam needs around the corner nearest to its course
    int stride, enough_of_stride;  // in steps; the same for so many steps at once
    int window;                    // row r of those examined last is window + r:
    std::uint32_t may_be_seen;     // bit r is set where something may be visible
};

/// Consecutive rows, at most kSteps.
struct Rows {
    int first, count;
    int end() const { return first + count; }
};

/// One batch: row s of ray r is at s * kRays + r.  Row 0 is sample `first`.
struct alignas(64) Samples {
    Word first = 0;
    bool all_full = false;  // every length is known to be of a full step, in all rows
    Batch cell[3], weight[3];
    Batch location[3];  // where gradients need locations
    Batch place;        // where the cell lies (VoxelSource): among the cells, or below 0; or its lowest voxel
    Batch pair[4];      // pairs of corners along x: the lower one in the low half; y fastest
    Batch input;        // classification input
    Batch length;       // of the slab, in steps
    Batch color[3], alpha;  // of the slab
};

/// Samples to be lit, packed from a batch, so that transparent ones cost nothing.
struct alignas(64) LitSamples {
    Batch from;                // its place in the batch
    Batch cell[3], weight[3];  // where a gradient is taken
    // The 4x4x4 voxels around its cell, in pairs along x.  Central differences need only the inner pair of an
    // outer row: it is stored in place of the first.
    Batch pair[32];
    // In place of them, of voxels below 2^15: central differences at the cell's corners, by axis, in pairs along
    // x, y fastest.
    Batch difference[3][4];
    Batch location[2][3];  // of front and back, for gradients from samples or between ends
    Batch beside[3][2];    // scalars one voxel off along each axis: behind, ahead
    Batch half[kMostHalves][3], view[3];
    Batch gradient[3];  // raw; the sum over a slab's two ends
    Batch normal[3];
    Batch confidence;  // where light fades in
    Batch color[3], alpha;
    // Where light looks into slabs: inputs at both ends, length, and log2 of the number of pieces.
    Batch input[2], length, cuts;
};

/// Where light lies in packed slabs: LightPlaces, or FadingLight between the slab's front and its `way[1]`.
struct alignas(64) SlabLight {
    Batch way[2], share;
    Batch part[4][4];
};

/// Raw gradients at the ends of slabs, by place in the batch.
struct alignas(64) EndGradients {
    Batch component[3];
    Row known;  // 1 where row 0 has one, from the batch before
};

/// Whether a row of four voxels, of the 4x4 around a cell, holds none of the cell's corners.
constexpr bool is_outer_row(int y, int z) {
    return y % 3 == 0 || z % 3 == 0;
}

/// Sixteen pixels that are being composited.
struct alignas(64) PixelPacket {
    Row color[3], transparency;
    Row remainder;  // w_carry
    Row active;     // 1 while a ray continues
    Row samples;    // slabs composited
};

/// The projection of sixteen rays so far, for MIP, MinIP and average.
struct alignas(64) ProjectionPacket {
    Row extreme;                    // the largest or smallest input
    std::int64_t sum[kRays];        // of the inputs at both ends of every full slab
    std::int64_t last_ends[kRays];  // of the last slab
};

}  // namespace squint::lanes
