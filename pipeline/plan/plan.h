// The plan: decides before the first ray what a scene exercises.  Formats become shifts and limits, the
// transfer function becomes tables, names become types, and each stage gets the narrowest word that holds its
// exact results.
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
#include "pipeline/stages/walls.h"
#include "scene/scene.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace squint {

/// Names of the six stages, in order; a wire's WireInfo::stage is one of them.
inline constexpr std::array<std::string_view, 6> kStages{"sample location", "interpolation", "gradient",
                                                         "classification",  "shading",       "compositing"};

/// What the plan decided about a stage.
struct StageReport {
    std::string name;
    bool modelled = true;
    std::string why;  // why it is left out, or how it runs
    WordNeeds needs;  // in bits, sign included
};

struct Plan {
    Scene scene;
    std::shared_ptr<const Volume> volume;
    Camera camera;  // in the volume's grid space, as all else here
    Entries entries;
    WireSpecs specs;
    bool real = false;      // presets `real` and `float32`: nothing is quantised, words are doubles
    bool float32 = false;   // or floats
    double step_world = 1;  // world units of a full slab
    Vec3 box_low{0, 0, 0}, box_high{0, 0, 0};  // the rendered part of the volume, in grid space
    std::optional<TurnedBox> clip;  // of a turned volume: the scene's clip box, which cuts that part

    LocationStage location;
    InterpolationStage interpolation;
    GradientStage gradient;
    GradientStage box_gradient;  // of sums of 5^3 voxels, where normals are exaggerated
    InputStage input;
    ClassificationMethod method;
    ShadingStage shading;
    InsideStage inside;
    WallStage walls;
    CompositingStage compositing;
    bool lit = false;
    bool projection_mode = false;  // mip, minip, average
    bool needs_back = false;       // slab methods need the samples at both ends
    int entry_reach = 0;           // how many entries beside a slab's own may colour it
    // Inputs up to the first and from the second on belong to entries where they and their neighbours show
    // nothing: a slab with both ends there is transparent.
    std::int64_t unseen_to = -1, unseen_from = std::numeric_limits<std::int32_t>::max();
    bool wants_depth = false;
    Rescale to_average;             // average mode: sum of inputs over twice their length
    bool skips_empty_space = true;  // a transparent sample is the identity

    WordNeeds gradient_needs,
        normal_needs;       // of both halves of stage 3: the raw gradient, and its normalisation
    WordNeeds input_needs;  // of a sample on its way to table entries, between stages 2 and 4
    int word_bits = 64;     // of the golden model: 64 or 128
    std::vector<Wire>
        used_wires;  // those that carry anything, in order: found by running the stages over intervals
    std::vector<StageReport> stages;
    std::vector<TableReport> tables;
    std::vector<Approximation> approximations;  // errors of tables
    std::vector<std::string> notes;             // what a user should know
    std::vector<std::string> warnings;          // what a user should change

    RaySetup set_up(int column, int row) const;
    /// The preset of these words, where none is quantised.
    std::string real_name() const { return float32 ? "float32" : "real"; }
    /// Slab methods and projections look at both ends of each slab, and so at the ray's exit.
    bool samples_both_ends() const { return needs_back || projection_mode; }
    /// Whether light comes by the gradients at slabs' ends, which neighbours share.
    bool shares_ends() const { return lit && lights_by_ends(inside.rule); }
    /// Whether places between samples, or one voxel beside them, are computed: from locations, not only cells.
    bool keeps_locations() const { return walls.looks_twice || lights_by_locations(); }
    bool lights_by_locations() const { return gradient_from_samples() || (lit && inside.samples_between()); }
    bool gradient_from_samples() const { return lit && gradient.rule == GradientRule::central_samples; }
    Spec spec(Wire wire) const { return specs[wire]; }
};

/// Resolves a scene against its volume.  Throws InputError naming the wire and the bits it needs, where no
/// word holds them.
Plan make_plan(const Scene& scene, std::shared_ptr<const Volume> volume, int frame = 0);

/// The same plan with only these wires rounded and the rest in double, to attribute errors to stages; `real`
/// rounds none.
void set_active(Plan& plan, const std::array<bool, kWires>& rounded);

/// For audits: every Rescale of wire w counts into statistics[w].
void attach_statistics(Plan& plan, std::array<WireStatistics, kWires>& statistics);

/// Calls v(Rescale&) for every Rescale of a plan, and v(Table&) or v(CellTable&) for every table.
template <class V>
void visit_stages(Plan& plan, V&& v) {
    plan.location.visit(v), plan.interpolation.visit(v), plan.gradient.visit(v), plan.input.visit(v);
    if (plan.gradient.exaggerated.wanted) plan.box_gradient.visit(v);
    std::visit([&](auto& method) { method.visit(v); }, plan.method);
    plan.inside.visit(v), plan.shading.visit(v), plan.compositing.visit(v);
}

}  // namespace squint
