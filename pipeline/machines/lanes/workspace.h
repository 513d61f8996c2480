// The memory of one packet of 16 rays on its way through the kernels, and what its words stand for.
#pragma once

#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/packet.h"
#include "pipeline/machines/model.h"

#include <bit>

namespace squint::lanes {

// A word in the buffers: an integer, or the bits of a float.
inline Word bits_of(std::int64_t word) {
    return static_cast<Word>(word);
}
inline Word bits_of(Real<float> word) {
    return std::bit_cast<Word>(word.v);
}
inline void word_from_bits(Word bits, std::int64_t& word) {
    word = bits;
}
inline void word_from_bits(Word bits, Real<float>& word) {
    word.v = std::bit_cast<float>(bits);
}

// What depth and normals need: touched only where a scene asks for them.
struct Notes {
    Batch between;                     // T at the ends of a batch's slabs
    Row samples_before;                // of the batch
    Batch in_pieces, normal[3];        // which slabs were lit in pieces; normal of the first visible piece
    Pixel<std::int64_t> pixel[kRays];  // depths, and the first visible slab's normal
    bool met[kRays];                   // something lit, and so visible
};

// Pieces of packed slabs, as they are classified.
struct alignas(64) PieceColors {
    Batch color[3], alpha;
};

// The buffers of one packet: about 60 KiB, most of them touched only where light falls.
struct Workspace {
    RayPacket rays;
    RayCourse course;
    PixelPacket pixels;
    ProjectionPacket projection;
    Samples samples[2];  // this batch's, and the next one's locations
    LitSamples lit;
    LitSamples ends;  // ends of slabs that are lit by the gradients there
    EndGradients end_gradients;
    LitSamples picked, pieces;                 // slabs lit in one number of pieces, and these pieces
    LitSamples twice;                          // slabs looked at twice
    PieceColors looked[1 << kSecondLookBits];  // and the pieces of each
    SlabLight slab_light;
    Samples cut;
    Samples beside;  // neighbours that a gradient is computed from
    Notes notes;
};

}  // namespace squint::lanes
