// Takes one packet of 16 rays, batch after batch, through the stages' kernels.  Only for lane_renderer.cpp.
#pragma once

#include "pipeline/machines/aovs.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/machines/lanes/packet_light.h"
#include "pipeline/machines/lanes/workspace.h"
#include "pipeline/machines/model.h"
#include "pipeline/stages/compositing-inl.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <limits>
#include <numeric>
#include <vector>

namespace squint::lanes {

using namespace squint::HWY_NAMESPACE;

inline bool any_active(const PixelPacket& pixels) {
    return std::any_of(std::begin(pixels.active.v), std::end(pixels.active.v), [](Word a) { return a != 0; });
}

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
          w_(w),
          backwards_(plan.compositing.form == CompositingForm::back_to_front && !plan.projection_mode),
          notes_((plan.wants_depth || plan.scene.output.normals) && !plan.projection_mode),
          light_(plan, kernels, voxels, walls, box_sums, backwards_, notes_, w) {}

    /// Casts all slabs of a packet whose rays are set up.
    void run() {
        located_ = -1, visited_ = 0;
        light_.begin();
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
    std::int64_t gradients() const { return light_.gradients(); }
    /// Of the slabs visited, those that were refined.
    const RefinedSlabs& refined() const { return light_.refined(); }

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
                return light_.look_twice(slabs, s);
            case Segment::light:
                lit_ = light_.light(slabs, s);
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
    Workspace& w_;
    bool backwards_;
    bool notes_;  // depth or normals are asked for
    PacketLight light_;
    int lit_ = 0;                // slabs of the batch at hand that were lit
    std::vector<Rows> batches_;  // of a packet, where the last is the first
    int current_ = 0;
    int located_ = -1;    // first slab of the batch whose locations are in the other buffer
    int last_count_ = 0;  // slabs of the last batch
    std::int64_t visited_ = 0;
};

}  // namespace squint::lanes
