// Defines what rays.h declares; included once a word, to be instantiated.
#pragma once

#include "pipeline/machines/aovs.h"
#include "pipeline/machines/model/rays.h"
#include "pipeline/machines/model/store.h"
#include "pipeline/slab-inl.h"
#include "pipeline/stages/ray_setup-inl.h"

namespace squint::model {

// Notes depths and the first normal of a ray where a picture asks for them.
template <class W>
class Aovs : public Silent {
  public:
    Aovs(const Plan& plan, double entry_distance, Pixel<W>& pixel)
        : plan_(plan),
          entry_distance_(entry_distance),
          pixel_(pixel),
          backwards_(plan.compositing.form == CompositingForm::back_to_front) {}

    void slab(W k) { k_ = k; }
    void lit(const std::array<W, 3>& normal) {
        if (!met_ || backwards_) pixel_.first_normal = normal;
        met_ = true;
    }
    void composited(const Slab<W>& slab, const Accumulated<W>& before, const Accumulated<W>& after) const {
        if (!plan_.wants_depth || plan_.projection_mode || !(constant<W>(0) < slab.alpha)) return;
        const auto clear = [&](const Accumulated<W>& a) {
            return to_double(transparency(plan_.compositing, a));
        };
        note_depth(entry_distance_ + to_double(k_) * plan_.step_world, clear(before), clear(after),
                   backwards_, pixel_);
    }

  private:
    const Plan& plan_;
    double entry_distance_;
    Pixel<W>& pixel_;
    bool backwards_, met_ = false;
    W k_{};
};

// Moves what the wires have collected so far to the slab it belongs to.
class Collector : public Silent {
  public:
    Collector(std::vector<TraceEvent>& fresh, RayTrace& trace) : fresh_(fresh), trace_(trace) {}
    void slab(const auto& k) { flush(), current_ = to_index(k); }
    void flush() {
        for (const TraceEvent& e : fresh_) trace_.events.push_back({current_, e});
        fresh_.clear();
    }

  private:
    std::vector<TraceEvent>& fresh_;
    RayTrace& trace_;
    std::int64_t current_ = -1;
};

template <class W>
void cast_tile(const Plan& plan, int left, int top, int right, int bottom, Image& image,
               TileStatistics& statistics) {
    // A method's name becomes a type once, outside the loops.
    std::visit(
        [&](const auto& method) {
            for (int row = top; row < bottom; ++row)
                for (int column = left; column < right; ++column) {
                    const RaySetup ray = plan.set_up(column, row);
                    Pixel<W> pixel;
                    Aovs<W> aovs(plan, ray.entry_distance, pixel);
                    cast_ray(plan, method, FromVolume{*plan.volume}, ray_words<W>(plan, ray), ray.slabs, aovs,
                             pixel);
                    store(plan, pixel, column, row, image);
                    statistics.rays += ray.slabs > 0;
                    statistics.samples += pixel.samples, statistics.visited += pixel.samples;
                }
        },
        plan.method);
}

template <class W>
void cast_traced(const Plan& plan, std::vector<TraceEvent>& fresh, RayTrace& trace) {
    Collector collector(fresh, trace);
    std::visit(
        [&](const auto& method) {
            Pixel<W> pixel;
            cast_ray(plan, method, FromVolume{*plan.volume}, ray_words<W>(plan, trace.setup),
                     trace.setup.slabs, collector, pixel);
            trace.color = color_of(plan.compositing, in_doubles(pixel.gathered));
        },
        plan.method);
    collector.flush();
}

}  // namespace squint::model
