// Light inside a slab: where its gradients are taken (shading.inside), and how a slab in which the surface
// turns is lit in pieces.  docs/conventions.md#light; docs/papers/guetat.md.
//
//     mean       the mean of the raw gradients at both ends
//     front      the gradient at the front end
//     middle     one gradient, sampled at the slab's middle
//     linear     fades from the front end's to the back end's (Lum et al. 2004): pi2d's tables say how
//     nlpi       the same, the normal between them kept at length one by a quadratic (Guetat et al. 2010)
//     adaptive   up to an angle between the ends' gradients as mean; beyond it 2 or 4 pieces, each a slab of
//                the method's own tables with a gradient sampled at its middle
#pragma once

#include "fixedpoint/words.h"
#include "scene/scene.h"
#include "scene/wires.h"

#include <array>
#include <cstdint>

namespace squint {

/// A slab is cut into at most 2^kMostCuts pieces.
inline constexpr int kMostCuts = 2;

/// Whether a rule wants tables of where light lies in a slab.
constexpr bool lights_fade(InsideRule rule) {
    return rule == InsideRule::linear || rule == InsideRule::nlpi;
}
/// Whether a rule lights by the sum of the gradients at a slab's ends.
constexpr bool lights_by_ends(InsideRule rule) {
    return rule == InsideRule::mean || rule == InsideRule::adaptive;
}

struct InsideStage {
    InsideRule rule = InsideRule::mean;
    // For places k 2^-b along a slab, by b: a piece's middle needs one bit more than its ends.
    std::array<Rescale, kMostCuts + 2> to_location;
    std::array<Rescale, kMostCuts + 1> to_input, to_length;
    std::array<std::int64_t, 3> most_apart{};  // of the two ends of a slab, as locations
    std::array<std::int64_t, 3> limit{};       // the last voxel centre
    std::int64_t highest_input = 0;
    std::int64_t least_cut = 0;  // slabs of less opacity are not cut: 2^-10, or 32 last bits
    std::int64_t one_alpha = 0;
    // Joining pieces: colours come in this wire's format, straight or premultiplied.
    Wire color_wire = Wire::lit_color;
    bool lit = false, premultiplied = false;
    int finer = 0;  // fraction bits of a colour above an opacity's
    std::int64_t largest_color = 0, most_light = 0;
    Rescale to_end;    // a gradient on the way to the back
    Rescale to_part;   // light behind earlier pieces
    Rescale to_whole;  // light of all pieces; straight: over their opacity

    bool needs_back() const { return rule != InsideRule::front; }
    /// Whether gradients are sampled between a slab's ends.
    bool samples_between() const { return rule == InsideRule::middle || rule == InsideRule::adaptive; }

    template <class V>
    void visit(V&& v) {
        for (Rescale& r : to_location) v(r);
        for (Rescale& r : to_input) v(r);
        for (Rescale& r : to_length) v(r);
        v(to_end), v(to_part), v(to_whole);
    }
};

/// Whether the gradients of pieces count twice: where light fades in by the sums of gradients at slabs' ends.
struct GradientStage;
bool doubles_pieces(const InsideStage& inside, const GradientStage& gradient);

struct LocationStage;
struct StageInputs;
InsideStage build_inside(const StageInputs& in, const LocationStage& location);

}  // namespace squint
