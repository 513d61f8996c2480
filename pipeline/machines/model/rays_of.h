// Defines what rays.h declares; included once a word, to be instantiated.
#pragma once

#include "pipeline/machines/aovs.h"
#include "pipeline/machines/model/rays.h"
#include "pipeline/machines/model/store.h"
#include "pipeline/slab-inl.h"
#include "pipeline/stages/ray_setup-inl.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace squint::model {

// Notes depths and the first normal of a ray where a picture asks for them, and counts slabs that are refined.
template <class W>
class Aovs : public Silent {
  public:
    Aovs(const Plan& plan, double entry_distance, Pixel<W>& pixel)
        : plan_(plan),
          entry_distance_(entry_distance),
          pixel_(pixel),
          backwards_(plan.compositing.form == CompositingForm::back_to_front) {}

    void slab(W k) { k_ = k; }
    void looked_twice() { ++pixel_.refined.looked_twice; }
    void cut(int bits) { pixel_.refined.cut(bits); }
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

// How many slabs of a ray of doubles are transparent, by the blocks where they begin.
class ClearSlabs {
  public:
    ClearSlabs(const Plan& plan, const lanes::EmptySpace* empty, const RayWords<Real<double>>& ray)
        : plan_(plan), empty_(empty), ray_(ray) {
        double fastest = 0;  // voxels a slab, along any axis
        for (const Real<double> v : ray.step) fastest = std::max(fastest, std::abs(v.v));
        slabs_per_voxel_ = power_of_two<double>(plan.location.direction_fraction) / fastest;
        voxels_per_unit_ = power_of_two<double>(-plan.location.location_fraction);
    }
    std::int64_t operator()(std::int64_t k) const {
        if (!empty_) return 0;
        Index3 block, corner;  // the corner nearest to the place
        double way = 0;        // to it, in voxels along any axis
        for (int a = 0; a < 3; ++a) {
            const auto axis = static_cast<std::size_t>(a);
            const Real<double> place = locate(plan_.location, ray_, constant<Real<double>>(k), a);
            const std::int64_t cell = to_index(floor_shift(place, plan_.location.location_fraction));
            const std::int64_t inside = std::min(cell, plan_.location.last_cell[axis]);
            block[a] = inside >> lanes::kBlockBits;
            corner[a] = (inside + lanes::kBlock / 2) >> lanes::kBlockBits;
            way = std::max(
                way, std::abs(place.v * voxels_per_unit_ - static_cast<double>(corner[a] * lanes::kBlock)));
        }
        if (!empty_->box.holds({block, Index3(1)}) || empty_->visible(block.x, block.y, block.z)) return 0;
        // As far as the empty blocks about the corner go, less the way to it and a voxel for roundings.
        constexpr double kMost = 0x1p30;
        const int clear = empty_->clear_at(corner.x, corner.y, corner.z);
        const double voxels = std::max(lanes::kBlock * clear - way - 1, 0.0);
        return 1 + static_cast<std::int64_t>(std::min(voxels * slabs_per_voxel_, kMost));
    }

  private:
    const Plan& plan_;
    const lanes::EmptySpace* empty_;
    const RayWords<Real<double>>& ray_;
    double slabs_per_voxel_, voxels_per_unit_;
};

template <class W>
void cast_tile(const Plan& plan, [[maybe_unused]] const lanes::EmptySpace* empty, int left, int top,
               int right, int bottom, Image& image, TileStatistics& statistics) {
    // A method's name becomes a type once, outside the loops.
    std::visit(
        [&](const auto& method) {
            for (int row = top; row < bottom; ++row)
                for (int column = left; column < right; ++column) {
                    const RaySetup ray = plan.set_up(column, row);
                    Pixel<W> pixel;
                    Aovs<W> aovs(plan, ray.entry_distance, pixel);
                    const RayWords<W> words = ray_words<W>(plan, ray);
                    const auto clear = [&] {
                        if constexpr (std::is_same_v<W, Real<double>>)
                            return ClearSlabs(plan, empty, words);
                        else
                            return NothingClear{};
                    }();
                    statistics.visited += cast_ray(plan, method, FromVolume{*plan.volume}, words, ray.slabs,
                                                   aovs, pixel, clear);
                    store(plan, pixel, column, row, image);
                    statistics.rays += ray.slabs > 0, statistics.samples += pixel.samples;
                    statistics.refined.add(pixel.refined);
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
