#include "pipeline/machines/model.h"

#include "pipeline/machines/lanes/blocks_met.h"
#include "pipeline/machines/model/rays.h"
#include "pipeline/machines/model/store.h"
#include "pipeline/slab-inl.h"

namespace squint {

using namespace HWY_NAMESPACE;

void store_pixel(const Plan& plan, const Pixel<std::int64_t>& pixel, int column, int row, Image& image) {
    model::store(plan, pixel, column, row, image);
}
void store_pixel(const Plan& plan, const Pixel<Real<float>>& pixel, int column, int row, Image& image) {
    model::store(plan, pixel, column, row, image);
}

Pixel<std::int64_t> project_pixel(const Plan& plan, const ProjectedRay<std::int64_t>& ray) {
    return std::visit(
        [&](const auto& method) {
            const auto in_words = [&]<class W>(WordTag<W>) {
                const Silent silent;
                return projected(
                    plan, method,
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
        },
        plan.method);
}

void ModelRenderer::skip_empty_space(std::int64_t room) {
    const CompositingStage& s = plan_.compositing;
    const bool divides = s.form == CompositingForm::straight || s.is_unit255();
    if (plan_.real && !plan_.float32 && !plan_.projection_mode && !divides)
        empty_ = lanes::empty_space_of(plan_, room);
}

void ModelRenderer::render_tile(int left, int top, int right, int bottom, Image& image,
                                TileStatistics& statistics) const {
    if (audit_ && !plan_.real) {
        Plan audited = plan_;  // with its own counters: no thread waits for another
        statistics.wires = std::make_unique<std::array<WireStatistics, kWires>>();
        attach_statistics(audited, *statistics.wires);
        model::cast_tile<Audited>(audited, empty_.get(), left, top, right, bottom, image, statistics);
    } else if (plan_.float32) {
        model::cast_tile<Real<float>>(plan_, empty_.get(), left, top, right, bottom, image, statistics);
    } else if (plan_.real) {
        model::cast_tile<Real<double>>(plan_, empty_.get(), left, top, right, bottom, image, statistics);
    } else if (plan_.word_bits == 64) {
        model::cast_tile<std::int64_t>(plan_, empty_.get(), left, top, right, bottom, image, statistics);
    } else {
        model::cast_tile<Int128>(plan_, empty_.get(), left, top, right, bottom, image, statistics);
    }
}

std::string ModelRenderer::why() const {
    if (audit_ && !plan_.real) return "audited integers";
    if (plan_.real) return plan_.float32 ? "float32" : "double";
    return plan_.word_bits == 64 ? "64-bit integers" : "128-bit integers";
}

RayTrace trace_ray(const Plan& plan, int column, int row) {
    RayTrace trace;
    trace.setup = plan.set_up(column, row);
    Plan traced = plan;
    std::array<WireStatistics, kWires> statistics;
    std::vector<TraceEvent> fresh;
    for (WireStatistics& s : statistics) s.trace = &fresh;
    attach_statistics(traced, statistics);
    // The words that render() takes, so that pixel and picture agree.
    if (plan.float32)
        model::cast_traced<Real<float>>(traced, fresh, trace);
    else if (plan.real)
        model::cast_traced<Real<double>>(traced, fresh, trace);
    else
        model::cast_traced<Audited>(traced, fresh, trace);
    return trace;
}

}  // namespace squint
