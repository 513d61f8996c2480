#include "pipeline/machines/model.h"

#include "pipeline/machines/aovs.h"
#include "pipeline/slab-inl.h"
#include "pipeline/stages/ray_setup-inl.h"

#include <cmath>
#include <limits>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;

// Calls f with the method as its own type: a name becomes a type once, outside the loops.
template <class F>
decltype(auto) with_method(const Plan& plan, F&& f) {
    return std::visit(std::forward<F>(f), plan.method);
}

template <class W>
Accumulated<double> in_doubles(const Accumulated<W>& pixel) {
    return {{to_double(pixel.color[0]), to_double(pixel.color[1]), to_double(pixel.color[2])},
            to_double(pixel.transparency)};
}

void put(Image& image, const char* name, std::size_t at, double value) {
    if (Channel* channel = image.find(name)) channel->values[at] = static_cast<float>(value);
}
template <class W>
void put_word(Image& image, const char* name, std::size_t at, W word) {
    if (Channel* channel = image.find(name))
        channel->words[at] =
            static_cast<std::uint32_t>(static_cast<std::int64_t>(std::floor(to_double(word) + 0.5)));
}

constexpr double kNoHit = std::numeric_limits<float>::max();  // Z where a ray meets nothing

template <class W>
void store(const Plan& plan, const Pixel<W>& pixel, int column, int row, Image& image) {
    const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                           static_cast<std::size_t>(column);
    const std::array<double, 4> color = color_of(plan.compositing, in_doubles(pixel.gathered));
    for (std::size_t c = 0; c < 4; ++c)
        image.channels[c].values[at] = static_cast<float>(color[c]);  // R G B A come first
    const OutputSettings& output = plan.scene.output;
    if (output.depth) {
        put(image, "Z", at, pixel.first_hit.value_or(kNoHit));
        put(image, "Z.mean", at, pixel.weight > 0 ? pixel.weighted_distance / pixel.weight : kNoHit);
    }
    if (output.normals) {
        const double one = std::ldexp(1.0, plan.gradient.normal_fraction);
        const auto& n = pixel.first_normal;
        const Vec3 normal = plan.volume->world_from_grid(
            Vec3(to_double(n[0]) / one, to_double(n[1]) / one, to_double(n[2]) / one));
        put(image, "N.x", at, normal.x), put(image, "N.y", at, normal.y), put(image, "N.z", at, normal.z);
    }
    if (output.samples) put(image, "samples", at, static_cast<double>(pixel.samples));
    if (output.transparency) put(image, "T", at, 1 - color[3]);
    if (output.fixed) {
        put_word(image, "fixed.R", at, pixel.gathered.color[0]),
            put_word(image, "fixed.G", at, pixel.gathered.color[1]);
        put_word(image, "fixed.B", at, pixel.gathered.color[2]),
            put_word(image, "fixed.T", at, transparency(plan.compositing, pixel.gathered));
    }
}

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

template <class W>
void cast_tile(const Plan& plan, int left, int top, int right, int bottom, Image& image,
               TileStatistics& statistics) {
    with_method(plan, [&](const auto& method) {
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
    });
}

}  // namespace

void store_pixel(const Plan& plan, const Pixel<std::int64_t>& pixel, int column, int row, Image& image) {
    store(plan, pixel, column, row, image);
}
void store_pixel(const Plan& plan, const Pixel<Real<float>>& pixel, int column, int row, Image& image) {
    store(plan, pixel, column, row, image);
}

Pixel<std::int64_t> project_pixel(const Plan& plan, const ProjectedRay<std::int64_t>& ray) {
    return with_method(plan, [&](const auto& method) {
        const auto in_words = [&]<class W>(WordTag<W>) {
            const Silent silent;
            return projected(plan, method,
                             ProjectedRay<W>{W{ray.kept}, W{ray.last_ends}, W{ray.slabs}, W{ray.last_length}},
                             nothing_yet<W>(plan.compositing), silent);
        };
        Pixel<std::int64_t> pixel;
        pixel.samples = ray.slabs;
        if (plan.word_bits == 64) {
            pixel.gathered = in_words(WordTag<std::int64_t>{});
        } else {
            const Accumulated<Int128> wide = in_words(WordTag<Int128>{});
            for (std::size_t c = 0; c < 3; ++c)
                pixel.gathered.color[c] = static_cast<std::int64_t>(wide.color[c]);
            pixel.gathered.transparency = static_cast<std::int64_t>(wide.transparency);
        }
        return pixel;
    });
}

void ModelRenderer::render_tile(int left, int top, int right, int bottom, Image& image,
                                TileStatistics& statistics) const {
    if (audit_ && !plan_.real) {
        Plan audited = plan_;  // its own counters: no thread waits for another
        statistics.wires = std::make_unique<std::array<WireStatistics, kWires>>();
        attach_statistics(audited, *statistics.wires);
        cast_tile<Audited>(audited, left, top, right, bottom, image, statistics);
    } else if (plan_.float32) {
        cast_tile<Real<float>>(plan_, left, top, right, bottom, image, statistics);
    } else if (plan_.real) {
        cast_tile<Real<double>>(plan_, left, top, right, bottom, image, statistics);
    } else if (plan_.word_bits == 64) {
        cast_tile<std::int64_t>(plan_, left, top, right, bottom, image, statistics);
    } else {
        cast_tile<Int128>(plan_, left, top, right, bottom, image, statistics);
    }
}

std::string ModelRenderer::why() const {
    if (audit_ && !plan_.real) return "audited integers";
    if (plan_.real) return plan_.float32 ? "float32" : "double";
    return plan_.word_bits == 64 ? "64-bit integers" : "128-bit integers";
}

namespace {
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
}  // namespace

RayTrace trace_ray(const Plan& plan, int column, int row) {
    RayTrace trace;
    trace.setup = plan.set_up(column, row);
    Plan traced = plan;
    std::array<WireStatistics, kWires> statistics;
    std::vector<TraceEvent> fresh;
    for (WireStatistics& s : statistics) s.trace = &fresh;
    attach_statistics(traced, statistics);
    Collector collector(fresh, trace);
    const auto cast = [&]<class W>(WordTag<W>) {
        with_method(traced, [&](const auto& method) {
            Pixel<W> pixel;
            cast_ray(traced, method, FromVolume{*traced.volume}, ray_words<W>(traced, trace.setup),
                     trace.setup.slabs, collector, pixel);
            trace.color = color_of(traced.compositing, in_doubles(pixel.gathered));
        });
    };
    // The words that render() takes: one program, one picture.
    if (plan.float32)
        cast(WordTag<Real<float>>{});
    else if (plan.real)
        cast(WordTag<Real<double>>{});
    else
        cast(WordTag<Audited>{});
    collector.flush();
    return trace;
}

}  // namespace squint
