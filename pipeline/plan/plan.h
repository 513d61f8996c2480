// The plan: what a scene exercises, decided before the first ray.  Formats become shifts and limits, the
// transfer function becomes tables, names become types, and each stage gets the narrowest word its exact
// results fit.
#pragma once

#include "core/camera.h"
#include "core/transfer_function.h"
#include "core/volume.h"
#include "pipeline/classification/methods.h"
#include "pipeline/stages/compositing.h"
#include "pipeline/stages/gradient.h"
#include "pipeline/stages/inside.h"
#include "pipeline/stages/interpolation.h"
#include "pipeline/stages/location.h"
#include "pipeline/stages/shading.h"
#include "scene/scene.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace squint {

/// Names of the six stages, in order; a wire's WireInfo::stage is one of them.
inline constexpr std::array<std::string_view, 6> kStages{"sample location", "interpolation", "gradient",
                                                         "classification",  "shading",       "compositing"};

/// What became of a stage.
struct StageReport {
    std::string name;
    bool modelled = true;
    std::string why;  // left out, and why; or how it runs
    WordNeeds needs;  // sign included
};

struct Plan {
    Scene scene;
    std::shared_ptr<const Volume> volume;
    Camera camera;
    Entries entries;
    WireSpecs specs;
    bool real = false;      // presets `real` and `float32`: nothing quantised, words are doubles
    bool float32 = false;   // or floats
    double step_world = 1;  // length of a full slab
    Vec3 box_low{0, 0, 0}, box_high{0, 0, 0};  // what of the volume is rendered, world

    LocationStage location;
    InterpolationStage interpolation;
    GradientStage gradient;
    InputStage input;
    ClassificationMethod method;
    ShadingStage shading;
    InsideStage inside;
    CompositingStage compositing;
    bool lit = false;
    bool projection_mode = false;  // mip, minip, average
    bool needs_back = false;       // slab methods classify by the samples at both ends
    int entry_reach = 0;           // entries beside a slab's own that its colour may come from
    // Inputs up to the one and from the other on are those of entries in which nothing is to be seen, nor in
    // any beside them: a slab with both its ends there is transparent.
    std::int64_t unseen_to = -1, unseen_from = std::numeric_limits<std::int32_t>::max();
    bool wants_depth = false;
    Rescale to_average;             // average mode: sum of inputs over twice their length
    bool skips_empty_space = true;  // a transparent sample is the identity

    WordNeeds gradient_needs,
        normal_needs;       // of stage 3's two halves: up to the raw gradient, and normalising it
    WordNeeds input_needs;  // of a sample on its way to table entries, between stages 2 and 4
    int word_bits = 64;     // of the golden model: 64 or 128
    std::vector<Wire>
        used_wires;  // that carry anything, in order: found by running the stages over intervals
    std::vector<StageReport> stages;
    std::vector<TableReport> tables;
    std::vector<Approximation> approximations;  // what tables leave out
    std::vector<std::string> notes;             // what a user should know
    std::vector<std::string> warnings;          // what a user should mend

    RaySetup set_up(int column, int row) const;
    /// The preset whose words these are, where none is quantised.
    std::string real_name() const { return float32 ? "float32" : "real"; }
    /// Slab methods and projections look at both ends of every slab, a ray's exit among them.
    bool samples_both_ends() const { return needs_back || projection_mode; }
    /// Gradients that light a slab, side by side.
    int gradients_a_slab() const { return inside.rule == InsideRule::mean ? 2 : 1; }
    /// Whether stage 3 wants samples' locations, not their cells alone.
    bool keeps_locations() const { return gradient_from_samples() || (lit && inside.samples_between()); }
    bool gradient_from_samples() const { return lit && gradient.rule == GradientRule::central_samples; }
    Spec spec(Wire wire) const { return specs[wire]; }
};

/// Resolves a scene against its volume.  Throws InputError, naming the wire and the bits it needs, for what
/// no word holds.
Plan make_plan(const Scene& scene, std::shared_ptr<const Volume> volume, int frame = 0);

/// The same plan with only these wires rounded, the rest in double (attribution of errors to stages); `real`
/// rounds none.
void set_active(Plan& plan, const std::array<bool, kWires>& rounded);

/// For audits: every Rescale of wire w counts into statistics[w].
void attach_statistics(Plan& plan, std::array<WireStatistics, kWires>& statistics);

/// Calls v(Rescale&) for every Rescale and v(Table&) or v(CellTable&) for every table of a plan.
template <class V>
void visit_stages(Plan& plan, V&& v) {
    plan.location.visit(v), plan.interpolation.visit(v), plan.gradient.visit(v), plan.input.visit(v);
    std::visit([&](auto& method) { method.visit(v); }, plan.method);
    plan.inside.visit(v), plan.shading.visit(v), plan.compositing.visit(v);
}

}  // namespace squint
