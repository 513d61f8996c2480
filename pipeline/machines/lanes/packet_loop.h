// Takes one packet of 16 rays, batch after batch, through the stages' kernels.  Only for lane_renderer.cpp.
#pragma once

#include "pipeline/machines/aovs.h"
#include "pipeline/machines/lanes/exaggerated.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/packet.h"
#include "pipeline/machines/model.h"
#include "pipeline/stages/compositing-inl.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <iterator>
#include <limits>
#include <numeric>
#include <vector>

namespace squint::lanes {

using namespace squint::HWY_NAMESPACE;

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

inline bool any_active(const PixelPacket& pixels) {
    return std::any_of(std::begin(pixels.active.v), std::end(pixels.active.v), [](Word a) { return a != 0; });
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

/// The pixel of ray r, with its depths and normal.
template <class W>
Pixel<W> finished(const PixelPacket& pixels, int r, Pixel<W> pixel = {}) {
    for (std::size_t c = 0; c < 3; ++c) word_from_bits(pixels.color[c].v[r], pixel.gathered.color[c]);
    word_from_bits(pixels.transparency.v[r], pixel.gathered.transparency);
    pixel.samples = pixels.samples.v[r];
    return pixel;
}

class PacketLoop {
  public:
    PacketLoop(const Plan& plan, const StageKernels& kernels, const Schedule& schedule,
               const VoxelSource& voxels, const EmptySpace* empty, const NearWalls* walls, BoxSums* box_sums,
               Workspace& w)
        : plan_(plan),
          kernels_(kernels),
          schedule_(schedule),
          voxels_(voxels),
          empty_(empty),
          walls_(walls),
          box_sums_(box_sums),
          w_(w),
          backwards_(plan.compositing.form == CompositingForm::back_to_front && !plan.projection_mode),
          notes_((plan.wants_depth || plan.scene.output.normals) && !plan.projection_mode) {}

    /// Casts all slabs of a packet whose rays are set up.
    void run() {
        located_ = -1, visited_ = gradients_ = 0, refined_ = {};
        start_pixels();
        if (notes_)
            std::fill_n(w_.notes.pixel, kRays, Pixel<std::int64_t>{}),
                std::fill_n(w_.notes.met, kRays, false);
        if (w_.rays.most_slabs == 0) return;
        if (empty_) kernels_.set_course(plan_, *empty_, w_.rays, w_.course);
        if (backwards_)
            run_backwards();
        else
            run_forwards();
    }

    /// The pixel of ray r.
    Pixel<std::int64_t> pixel(int r) const {
        if (plan_.projection_mode && w_.rays.slabs.v[r] > 0)
            return project_pixel(
                plan_, {plan_.scene.compositing.mode == CompositingMode::average ? w_.projection.sum[r]
                                                                                 : w_.projection.extreme.v[r],
                        w_.projection.last_ends[r], w_.rays.slabs.v[r], w_.rays.last_length.v[r]});
        return finished<std::int64_t>(w_.pixels, r, notes_ ? w_.notes.pixel[r] : Pixel<std::int64_t>{});
    }

    /// Slabs composited or projected; a ray outside the tile has none.
    std::int64_t samples() const {
        const Row& counted = plan_.projection_mode ? w_.rays.slabs : w_.pixels.samples;
        return std::accumulate(std::begin(counted.v), std::end(counted.v), std::int64_t{0});
    }
    /// Slabs of all rays of the packet that went through the stages.
    std::int64_t visited() const { return visited_; }
    /// Gradients taken from voxels.
    std::int64_t gradients() const { return gradients_; }
    /// Of the slabs visited, those that were refined.
    const RefinedSlabs& refined() const { return refined_; }

  private:
    void start_pixels() {
        if (plan_.float32)
            start_pixels_from(nothing_yet<Real<float>>(plan_.compositing));
        else
            start_pixels_from(nothing_yet<std::int64_t>(plan_.compositing));
        for (int r = 0; plan_.projection_mode && r < kRays; ++r) {
            // Inputs are not negative.
            w_.projection.extreme.v[r] =
                plan_.scene.compositing.mode == CompositingMode::minip ? std::numeric_limits<Word>::max() : 0;
            w_.projection.sum[r] = w_.projection.last_ends[r] = 0;
        }
    }
    template <class W>
    void start_pixels_from(const Accumulated<W>& none) {
        for (int r = 0; r < kRays; ++r) {
            for (std::size_t c = 0; c < 3; ++c) w_.pixels.color[c].v[r] = bits_of(none.color[c]);
            w_.pixels.transparency.v[r] = bits_of(none.transparency);
            w_.pixels.remainder.v[r] = bits_of(none.remainder);
            w_.pixels.active.v[r] = w_.rays.slabs.v[r] > 0;
            w_.pixels.samples.v[r] = 0;
        }
    }

    void run_forwards() {
        Rows rows = next_rows(0);
        kernels_.pass_over(w_.rays, 0, rows.first, w_.pixels);
        bool carried = false;  // the sample behind the last slab is known and becomes row 0 of the next batch
        while (rows.count > 0) {
            const Rows next = next_rows(rows.end());
            batch(rows, next, carried);
            if (!any_active(w_.pixels)) return;
            kernels_.pass_over(w_.rays, rows.end(), next.first, w_.pixels);
            carried = plan_.samples_both_ends() && next.first == rows.end();
            rows = next;
        }
    }

    void run_backwards() {
        batches_.clear();
        for (Rows rows = next_rows(0); rows.count > 0; rows = next_rows(rows.end())) batches_.push_back(rows);
        int end = w_.rays.most_slabs;  // of the slabs still to come
        for (std::size_t i = batches_.size(); i-- > 0;) {
            const Rows rows = batches_[i];
            kernels_.pass_over(w_.rays, rows.end(), end, w_.pixels);
            batch(rows, i > 0 ? batches_[i - 1] : Rows{0, 0}, false);
            end = rows.first;
        }
        kernels_.pass_over(w_.rays, 0, end, w_.pixels);
    }

    // Slabs between two batches composite nothing, but count as composited, as in the model.
    Rows next_rows(int k) {
        if (empty_) return kernels_.visible_rows(*empty_, w_.rays, k, w_.course);
        return {k, std::min(kSteps, w_.rays.most_slabs - k)};
    }

    Samples& here() { return w_.samples[current_]; }

    // Rows of a batch's samples.
    struct RowsOf {
        Samples& samples;
        int from, to;
    };

    // A batch's slabs through the segments of the schedule.  `next`: the batch behind it, no rows where that
    // is not known.
    void batch(const Rows& rows, const Rows& next, bool carried) {
        const int back = plan_.samples_both_ends() ? 1 : 0;
        const int from = carried ? 1 : 0, to = rows.count + back;
        if (located_ == rows.first) {
            current_ = 1 - current_;
            if (carried) carry(w_.samples[1 - current_], here());
        } else {
            if (carried) carry(here(), here());
            run_ahead({here(), from, to}, rows.first);
            // Else its voxels were asked for by the batch before.
            if (schedule_.asks_ahead) kernels_.request(voxels_, from, to, here());
        }
        // Locations of the batch to come, and its voxels on their way from memory while this batch computes.
        const RowsOf behind{w_.samples[1 - current_], next.first == rows.end() ? back : 0,
                            next.count == 0 ? 0 : next.count + back};
        located_ = next.count == 0 ? -1 : next.first;
        if (next.count > 0) run_ahead(behind, next.first);
        last_count_ = rows.count;
        visited_ += rows.count * w_.rays.rays;
        if (!carried) w_.end_gradients.known = {};
        if (notes_) w_.notes.in_pieces = {};
        for (const Segment segment : schedule_.now)
            run_segment(segment, {here(), from, to}, behind, rows.count);
    }

    // The segments that a batch is ahead by, from slab k on.
    void run_ahead(const RowsOf& rows, int k) {
        rows.samples.first = k;
        for (const Segment segment : schedule_.ahead) run_segment(segment, rows, rows, 0);
    }

    // `rows` of samples, and the first `slabs` slabs between them; `next`: rows that may be asked for
    // meanwhile.
    void run_segment(Segment segment, const RowsOf& rows, const RowsOf& next, int slabs) {
        Samples& s = rows.samples;
        switch (segment) {
            case Segment::locate:
                return kernels_.locate(plan_, w_.rays, rows.from, rows.to, s);
            case Segment::address:
                return kernels_.prefetch(voxels_, rows.from, rows.to, s);
            case Segment::locate_address:
                return kernels_.locate_address(plan_, voxels_, w_.rays, rows.from, rows.to, s);
            case Segment::fetch:
                return kernels_.fetch(voxels_, rows.from, rows.to, s);
            case Segment::interpolate:
                return kernels_.interpolate(plan_, rows.from, rows.to, s);
            case Segment::fetch_interpolate:
                return kernels_.fetch_interpolate(plan_, voxels_, rows.from, rows.to, s, next.from, next.to,
                                                  next.samples);
            case Segment::classify:
                return kernels_.classify(plan_, slabs, s);
            case Segment::look_twice:
                return look_twice(slabs);
            case Segment::light:
                lit_ = light(slabs);
                return;
            case Segment::composite:
                return composite(slabs);
            case Segment::classify_composite:
                return kernels_.classify_composite(plan_, kernels_.unit_rows.data(), w_.rays, slabs, s,
                                                   w_.pixels);
            case Segment::project:
                return kernels_.project(w_.rays, slabs, s, w_.projection);
        }
    }

    void composite(int slabs) {
        if (notes_) w_.notes.samples_before = w_.pixels.samples;
        kernels_.composite(plan_, w_.rays, slabs, here(), w_.pixels, w_.notes.between);
        if (notes_) note(lit_);
    }

    // The last row of one batch becomes the first of the next.
    void carry(const Samples& from, Samples& to) const {
        const auto move = [this](const Batch& a, Batch& b) {
            std::memmove(b.v, a.v + last_count_ * kRays, sizeof(Word) * kRays);
        };
        move(from.input, to.input), move(from.length, to.length);
        to.all_full = to.all_full && from.all_full;
        for (int a = 0; a < 3; ++a) move(from.cell[a], to.cell[a]), move(from.weight[a], to.weight[a]);
        for (int a = 0; plan_.keeps_locations() && a < 3; ++a) move(from.location[a], to.location[a]);
        for (Batch& end : w_.end_gradients.component)
            if (plan_.shares_ends()) move(end, end);
    }

    // Packs what is visible and not hidden, lights it, and puts it back.  Returns its number, without slabs that are
    // looked at twice where nobody asks for normals.
    int light(int steps) {
        Samples& s = here();
        LitSamples& lit = w_.lit;
        if (!backwards_) kernels_.hide(plan_, w_.rays, w_.pixels, steps, s);
        for (int i = 0; i < looked_; ++i) {
            Word& alpha = s.alpha.v[w_.twice.from.v[i]];
            w_.twice.alpha.v[i] = alpha;
            if (!notes_) alpha = 0;
        }
        const int count = kernels_.gather_lit(plan_, w_.rays, steps, s, lit);
        if (plan_.shares_ends()) find_end_gradients(steps);
        for (int i = 0; i < looked_; ++i) s.alpha.v[w_.twice.from.v[i]] = w_.twice.alpha.v[i];
        if (count > 0) light_as_wholes(count);
        if (looked_ > 0) light_second_looks();
        return count;
    }
    // Packed slabs, by shading.inside.
    void light_as_wholes(int count) {
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
        put_back(count, lit);
        if (plan_.inside.rule == InsideRule::adaptive) light_as_it_turns(count);
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
    void find_end_gradients(int steps) {
        const int ends = kernels_.gather_ends(plan_, w_.rays, steps, here(), w_.end_gradients.known, w_.ends);
        if (ends == 0) return;
        find_gradients(ends, w_.ends);
        for (int i = 0; i < ends; ++i)
            for (int a = 0; a < 3; ++a)
                w_.end_gradients.component[a].v[w_.ends.from.v[i]] = w_.ends.gradient[a].v[i];
    }
    void put_back(int count, const LitSamples& lit) {
        Samples& s = here();
        for (int i = 0; i < count; ++i)
            for (int c = 0; c < 3; ++c) s.color[c].v[lit.from.v[i]] = lit.color[c].v[i];
    }

    // Slabs that turn are lit again, in 2 or 4 pieces.
    void light_as_it_turns(int count) {
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
            put_back(many, w_.picked);
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

    // Slabs with a wall in a cell on their way, and none found, are made of pieces between samples inside them.
    void look_twice(int steps) {
        LitSamples& slabs = w_.twice;
        looked_ = kernels_.gather_second_looks(plan_, *walls_, w_.rays, w_.pixels, steps, here(), slabs);
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
        Samples& s = here();
        for (int i = 0; i < looked_; ++i) s.alpha.v[slabs.from.v[i]] = slabs.alpha.v[i];
        put_back(looked_, slabs);
    }
    // Light of those that are seen, by gradients of their pieces' own.
    void light_second_looks() {
        const LitSamples& all = w_.twice;
        LitSamples& slabs = w_.picked;
        for (int i = 0, count = 0; i < looked_; ++i) {
            if (all.alpha.v[i] > 0) pick_second_look(i, count++);
            if (count == 0 || (count < kRays && i + 1 < looked_)) continue;
            light_sixteen(slabs, 0, count, kSecondLookBits);
            put_back(count, slabs);
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

    // for_pieces of gathered gradients.
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

    // Fetches what the gradients of the first `count` packed places need: voxels, or the six samples around
    // each place.
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

    // Adds the depths and first normals of a batch just composited, of which `lit` samples were lit.  A ray
    // composited as many slabs of this batch as its `samples` count grew.
    void note(int lit) {
        int taken[kRays];
        for (int r = 0; r < kRays; ++r) taken[r] = w_.pixels.samples.v[r] - w_.notes.samples_before.v[r];
        for (int r = 0; plan_.wants_depth && r < kRays; ++r) note_depths(r, taken[r]);
        for (int i = 0; plan_.scene.output.normals && i < lit; ++i) {
            const int place = backwards_ ? lit - 1 - i : i;  // in the order in which the ray meets them
            const int at = w_.lit.from.v[place], r = at % kRays;
            if (at / kRays >= taken[r] || (w_.notes.met[r] && !backwards_)) continue;
            const bool in_pieces = w_.notes.in_pieces.v[at] != 0;
            for (std::size_t a = 0; a < 3; ++a)
                w_.notes.pixel[r].first_normal[a] =
                    in_pieces ? w_.notes.normal[a].v[at] : w_.lit.normal[a].v[place];
            w_.notes.met[r] = true;
        }
    }

    void note_depths(int r, int taken) {
        const auto transparency_at = [&](int row) {
            Accumulated<std::int64_t> there{};
            there.transparency = w_.notes.between.v[row * kRays + r];
            return transparency(plan_.compositing, there);
        };
        for (int i = 0; i < taken; ++i) {
            const int row = backwards_ ? taken - 1 - i : i;
            if (here().alpha.v[row * kRays + r] <= 0) continue;
            const std::int64_t front = transparency_at(row), back = transparency_at(row + 1);
            note_depth(w_.rays.entry_distance[r] + (here().first + row) * plan_.step_world,
                       to_double(backwards_ ? back : front), to_double(backwards_ ? front : back), backwards_,
                       w_.notes.pixel[r]);
        }
    }

    const Plan& plan_;
    const StageKernels& kernels_;
    const Schedule& schedule_;
    const VoxelSource& voxels_;
    const EmptySpace* empty_;
    const NearWalls* walls_;
    BoxSums* box_sums_;  // where normals are exaggerated
    Workspace& w_;
    bool backwards_;
    bool notes_;                 // depth or normals are asked for
    int lit_ = 0, looked_ = 0;   // slabs of the batch at hand: those lit, those looked at twice
    std::vector<Rows> batches_;  // of a packet, where the last is the first
    int current_ = 0;
    int located_ = -1;    // first slab of the batch whose locations are in the other buffer
    int last_count_ = 0;  // slabs of the last batch
    std::int64_t visited_ = 0, gradients_ = 0;
    RefinedSlabs refined_;
};

}  // namespace squint::lanes
