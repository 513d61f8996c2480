// Stages 3 and 5 of a packet's batch, and slabs that are made of pieces: those that turn, and those looked at twice.
// Only for packet_loop.h.
#pragma once

#include "pipeline/machines/lanes/exaggerated.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/workspace.h"
#include "pipeline/machines/model.h"

#include <algorithm>
#include <cstdint>

namespace squint::lanes {

class PacketLight {
  public:
    PacketLight(const Plan& plan, const StageKernels& kernels, const VoxelSource& voxels,
                const NearWalls* walls, BoxSums* box_sums, bool backwards, bool notes, Workspace& w)
        : plan_(plan),
          kernels_(kernels),
          voxels_(voxels),
          walls_(walls),
          box_sums_(box_sums),
          w_(w),
          backwards_(backwards),
          notes_(notes) {}

    void begin() { gradients_ = 0, refined_ = {}; }

    /// Slabs with a wall in a cell on their way, and none found, are made of pieces between samples inside them.
    void look_twice(int steps, Samples& s) {
        LitSamples& slabs = w_.twice;
        looked_ = kernels_.gather_second_looks(plan_, *walls_, w_.rays, w_.pixels, steps, s, slabs);
        refined_.looked_twice += looked_;
        constexpr int kBits = kSecondLookBits, kPieces = 1 << kBits;
        Samples& cut = w_.cut;
        for (int at = 0; at < looked_; at += kRays) {
            kernels_.cut(plan_, slabs, at, kBits, cut);
            kernels_.place_samples_between(plan_, slabs, at, kBits, cut);
            kernels_.prefetch(voxels_, 1, kPieces, cut);
            kernels_.fetch(voxels_, 1, kPieces, cut);
            kernels_.interpolate(plan_, 1, kPieces, cut);
            kernels_.classify(plan_, kPieces, cut);
            kernels_.join(plan_, cut.color, cut.alpha, kBits, slabs, at);
            for (int piece = 0; plan_.lit && piece < kPieces; ++piece)
                copy_pieces(cut, piece * kRays, kRays, w_.looked[piece], at);
        }
        for (int i = 0; i < looked_; ++i) s.alpha.v[slabs.from.v[i]] = slabs.alpha.v[i];
        put_back(looked_, slabs, s);
    }
    /// Packs what is visible and not hidden, lights it, and puts it back.  Returns its number, without slabs that are
    /// looked at twice where nobody asks for normals.
    int light(int steps, Samples& s) {
        LitSamples& lit = w_.lit;
        if (!backwards_) kernels_.hide(plan_, w_.rays, w_.pixels, steps, s);
        for (int i = 0; i < looked_; ++i) {
            Word& alpha = s.alpha.v[w_.twice.from.v[i]];
            w_.twice.alpha.v[i] = alpha;
            if (!notes_) alpha = 0;
        }
        const int count = kernels_.gather_lit(plan_, w_.rays, steps, s, lit);
        if (plan_.shares_ends()) find_end_gradients(steps, s);
        for (int i = 0; i < looked_; ++i) s.alpha.v[w_.twice.from.v[i]] = w_.twice.alpha.v[i];
        if (count > 0) light_as_wholes(count, s);
        if (looked_ > 0) light_second_looks(s);
        return count;
    }
    /// Gradients taken from voxels.
    std::int64_t gradients() const { return gradients_; }
    /// Slabs that were refined.
    const RefinedSlabs& refined() const { return refined_; }

  private:
    // Packed slabs, by shading.inside.
    void light_as_wholes(int count, Samples& s) {
        LitSamples& lit = w_.lit;
        if (plan_.inside.rule == InsideRule::middle)
            kernels_.place_between(plan_, lit, 0, count, 1, 1, lit, 0);
        if (lights_between_ends(plan_.inside.rule)) {
            light_between_ends(count, lit);
        } else {
            if (plan_.shares_ends())
                kernels_.add_ends(plan_, count, w_.end_gradients, lit);
            else
                find_gradients(count, lit);
            shade(count, lit);
        }
        put_back(count, lit, s);
        if (plan_.inside.rule == InsideRule::adaptive) light_as_it_turns(count, s);
    }

    // By gradients between the ends', at one place or two, or by light that fades.
    void light_between_ends(int count, LitSamples& lit) {
        SlabLight& light = w_.slab_light;
        LitSamples& far = w_.picked;
        const bool one_place = plan_.inside.rule == InsideRule::centroid;
        kernels_.find_light(plan_, count, lit, light);
        kernels_.lerp_ends(plan_, count, w_.end_gradients, lit.from, light, lit, one_place ? nullptr : &far);
        if (one_place) return shade(count, lit);
        kernels_.find_normals(plan_, count, lit);
        kernels_.find_normals(plan_, count, far);
        if (lights_fade(plan_.inside.rule)) return kernels_.shade_fading(plan_, count, light, far, lit);
        far.alpha = lit.alpha;
        std::copy_n(lit.color, 3, far.color);
        if (plan_.shading.needs_ray()) {
            std::copy_n(lit.view, 3, far.view);
            for (int l = 0; l < plan_.shading.lights; ++l) std::copy_n(lit.half[l], 3, far.half[l]);
        }
        kernels_.shade(plan_, count, lit);
        kernels_.shade(plan_, count, far);
        kernels_.join_places(plan_, count, light, far, lit);
    }

    // The first half of stage 3, at packed places.
    void find_gradients(int count, LitSamples& lit) {
        look_around(count, lit);
        kernels_.find_gradients(plan_, count, lit);
        if (plan_.gradient.exaggerated.wanted) exaggerate(plan_, count, *box_sums_, lit);
    }
    // Its second half, and stage 5.
    void shade(int count, LitSamples& lit) {
        kernels_.find_normals(plan_, count, lit);
        kernels_.shade(plan_, count, lit);
    }
    // The gradients at the ends of slabs to be lit; two neighbouring slabs share one.
    void find_end_gradients(int steps, const Samples& s) {
        const int ends = kernels_.gather_ends(plan_, w_.rays, steps, s, w_.end_gradients.known, w_.ends);
        if (ends == 0) return;
        find_gradients(ends, w_.ends);
        for (int i = 0; i < ends; ++i)
            for (int a = 0; a < 3; ++a)
                w_.end_gradients.component[a].v[w_.ends.from.v[i]] = w_.ends.gradient[a].v[i];
    }
    static void put_back(int count, const LitSamples& lit, Samples& s) {
        for (int i = 0; i < count; ++i)
            for (int c = 0; c < 3; ++c) s.color[c].v[lit.from.v[i]] = lit.color[c].v[i];
    }

    // Slabs that turn are lit again, in 2 or 4 pieces.
    void light_as_it_turns(int count, Samples& s) {
        kernels_.find_cuts(plan_, count, w_.end_gradients, w_.lit);
        for (int bits = 1; bits <= kMostCuts; ++bits) {
            const int many = kernels_.pick_by_cuts(plan_, count, bits, w_.lit, w_.picked);
            if (many == 0) continue;
            refined_.cut(bits, many);
            for (int at = 0; at < many; at += kRays) {
                kernels_.cut(plan_, w_.picked, at, bits, w_.cut);
                kernels_.classify(plan_, 1 << bits, w_.cut);
                light_sixteen(w_.picked, at, std::min(kRays, many - at), bits);
            }
            if (notes_) note_pieces(many, w_.picked);
            put_back(many, w_.picked, s);
        }
    }
    // Lights what is visible of the pieces of sixteen slabs that were cut and classified, and joins them.  Slabs from
    // `many` on repeat others.
    void light_sixteen(LitSamples& slabs, int at, int many, int bits) {
        Samples& cut = w_.cut;
        LitSamples& pieces = w_.pieces;
        copy_pieces(cut, 0, kRays << bits, pieces, 0);
        for (int row = 0; row < 1 << bits; ++row) {
            const int to = row * kRays;
            kernels_.place_between(plan_, slabs, at, kRays, 2 * row + 1, bits + 1, pieces, to);
            for (int a = 0; plan_.shading.needs_ray() && a < 3; ++a) {
                std::copy_n(slabs.view[a].v + at, kRays, pieces.view[a].v + to);
                for (int l = 0; l < plan_.shading.lights; ++l)
                    std::copy_n(slabs.half[l][a].v + at, kRays, pieces.half[l][a].v + to);
            }
        }
        int from[kRays << kMostCuts], count = 0;  // where those that are lit lay
        for (int i = 0; i < kRays << bits; ++i) {
            if (i % kRays >= many) continue;
            if (pieces.alpha.v[i] > 0)
                copy_piece(i, count), from[count++] = i;
            else
                for (Batch& color : cut.color) color.v[i] = 0;
        }
        if (count > 0) light_pieces(count);
        for (int i = count; i-- > 0;) {  // the normal of a slab is that of its first visible piece
            for (int c = 0; c < 3; ++c) cut.color[c].v[from[i]] = pieces.color[c].v[i];
            for (int a = 0; notes_ && a < 3; ++a)
                slabs.normal[a].v[at + from[i] % kRays] = pieces.normal[a].v[i];
        }
        kernels_.join(plan_, cut.color, cut.alpha, bits, slabs, at);
    }
    void light_pieces(int count) {
        for (int i = count; i % kRays != 0; ++i) copy_piece(count - 1, i);
        find_gradients(count, w_.pieces);
        if (const int as_sums = bits_of_pieces(plan_.inside, plan_.gradient))
            lengthen_gradients(count, as_sums, w_.pieces);
        shade(count, w_.pieces);
    }
    // What is known of a piece before it is lit.
    void copy_piece(int from, int to) {
        if (from == to) return;
        LitSamples& pieces = w_.pieces;
        const auto copy = [&](Batch& wire) { wire.v[to] = wire.v[from]; };
        copy(pieces.alpha);
        for (int a = 0; a < 3; ++a) {
            copy(pieces.color[a]);
            if (plan_.gradient_from_samples())
                copy(pieces.location[0][a]);
            else
                copy(pieces.cell[a]), copy(pieces.weight[a]);
            if (!plan_.shading.needs_ray()) continue;
            copy(pieces.view[a]);
            for (int l = 0; l < plan_.shading.lights; ++l) copy(pieces.half[l][a]);
        }
    }
    void note_pieces(int count, const LitSamples& slabs) {
        for (int i = 0; i < count; ++i) {
            const int place = slabs.from.v[i];
            w_.notes.in_pieces.v[place] = 1;
            for (int a = 0; a < 3; ++a) w_.notes.normal[a].v[place] = slabs.normal[a].v[i];
        }
    }

    // Light of those that are seen, by gradients of their pieces' own.
    void light_second_looks(Samples& s) {
        const LitSamples& all = w_.twice;
        LitSamples& slabs = w_.picked;
        for (int i = 0, count = 0; i < looked_; ++i) {
            if (all.alpha.v[i] > 0) pick_second_look(i, count++);
            if (count == 0 || (count < kRays && i + 1 < looked_)) continue;
            light_sixteen(slabs, 0, count, kSecondLookBits);
            put_back(count, slabs, s);
            if (notes_) note_pieces(count, slabs);
            count = 0;
        }
    }
    void pick_second_look(int i, int to) {
        const LitSamples& all = w_.twice;
        LitSamples& slabs = w_.picked;
        slabs.from.v[to] = all.from.v[i];
        for (int end = 0; end < 2; ++end)
            for (int a = 0; a < 3; ++a) slabs.location[end][a].v[to] = all.location[end][a].v[i];
        for (int a = 0; plan_.shading.needs_ray() && a < 3; ++a) {
            slabs.view[a].v[to] = all.view[a].v[i];
            for (int l = 0; l < plan_.shading.lights; ++l) slabs.half[l][a].v[to] = all.half[l][a].v[i];
        }
        for (int piece = 0; piece < 1 << kSecondLookBits; ++piece)
            copy_pieces(w_.looked[piece], i, 1, w_.cut, piece * kRays + to);
    }
    // Colours and opacities, as they are classified.
    static void copy_pieces(const auto& from, int at, int count, auto& to, int there) {
        std::copy_n(from.alpha.v + at, count, to.alpha.v + there);
        for (int c = 0; c < 3; ++c) std::copy_n(from.color[c].v + at, count, to.color[c].v + there);
    }

    // As for_pieces() does (stages/inside-inl.h), to gradients that were gathered.
    void lengthen_gradients(int count, int by, LitSamples& lit) const {
        const auto lengthen = [by](auto word, Word& bits) {
            word_from_bits(bits, word);
            bits = bits_of(shift_left(word, by));
        };
        for (int a = 0; a < 3; ++a)
            for (int i = 0; i < count; ++i)
                plan_.float32 ? lengthen(Real<float>{}, lit.gradient[a].v[i])
                              : lengthen(std::int64_t{}, lit.gradient[a].v[i]);
    }

    // Fetches what gradients of the first `count` packed places need: voxels, or six samples around each.
    void look_around(int count, LitSamples& lit) {
        if (!plan_.gradient_from_samples()) {
            gradients_ += count;
            return kernels_.fetch_lit(plan_, voxels_, count, lit);
        }
        const int rows = (count + kRays - 1) / kRays;
        for (int axis = 0; axis < 3; ++axis)
            for (const bool ahead : {false, true}) {
                kernels_.step_aside(plan_, lit, axis, ahead, rows, w_.beside);
                kernels_.prefetch(voxels_, 0, rows, w_.beside);
                kernels_.fetch(voxels_, 0, rows, w_.beside);
                kernels_.interpolate_scalars(plan_, 0, rows, w_.beside);
                std::copy_n(w_.beside.input.v, rows * kRays, lit.beside[axis][ahead].v);
            }
    }

    const Plan& plan_;
    const StageKernels& kernels_;
    const VoxelSource& voxels_;
    const NearWalls* walls_;
    BoxSums* box_sums_;  // where normals are exaggerated
    Workspace& w_;
    bool backwards_;
    bool notes_;      // depth or normals are asked for
    int looked_ = 0;  // slabs of the batch at hand that are looked at twice
    std::int64_t gradients_ = 0;
    RefinedSlabs refined_;
};

}  // namespace squint::lanes
