#include "pipeline/machines/lanes/lane_renderer.h"

#include "pipeline/kept.h"
#include "pipeline/machines/lanes/blocks_met.h"
#include "pipeline/machines/lanes/packet_loop.h"
#include "pipeline/machines/lanes/targets.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

namespace squint::lanes {
namespace {

using namespace squint::HWY_NAMESPACE;

// The bits of the lanes that hold a stage; 0 if none do.
int bits_of(const WordNeeds& needs) {
    constexpr int kBitsOfDouble = 54;  // sign included: what 32-bit lanes have for wide numbers
    if (needs.operand_bits > 32) return 0;
    if (needs.lane_bits <= 32 && needs.wide_bits <= kBitsOfDouble) return 32;
    return std::max(needs.lane_bits, needs.wide_bits) <= 64 ? 64 : 0;
}

// The strongest assumption that a stage's roundings allow, in 32-bit lanes.
struct KnownOf {
    KnownRescales known = KnownRescales::halves_up;
    void operator()(const Rescale& to) {
        while (!holds(known, to, 32))
            known =
                known == KnownRescales::halves_up ? KnownRescales::halves_to_even : KnownRescales::nothing;
    }
    void operator()(const Table&) {}
    void operator()(const CellTable&) {}
};
template <class... Stage>
KnownRescales known_of(Stage... stage) {
    KnownOf all;
    const auto visit = [&](auto& r) { all(r); };
    (stage.visit(visit), ...);
    return all.known;
}

double samples_of(const Plan& plan) {
    const Index3& n = plan.volume->dims;
    return static_cast<double>(plan.camera.width) * plan.camera.height *
           static_cast<double>(std::max({n.x, n.y, n.z})) / plan.scene.sampling.step;
}

// Whether cells pay within one picture: where a block is met by many more samples than it takes voxels to build.
bool cells_pay(const Plan& plan) {
    return samples_of(plan) >= 8 * static_cast<double>(plan.volume->voxels());
}

// Or over all pictures of a volume so far, for cells last as long as its voxels: where they would have saved by
// now what they cost.  Light takes most of its time elsewhere.
bool cells_pay_by_now(const Plan& plan) {
    if (plan.lit) return false;
    static KeptPerVolume<std::atomic<double>> kept;
    const auto taken = kept.find(
        *plan.volume, [] { return std::make_shared<std::atomic<double>>(0); },
        [](const auto&) { return true; });
    return (*taken += samples_of(plan)) >= 80 * static_cast<double>(plan.volume->voxels());
}

// Whether a packet spans so many voxels that its outermost rays' cells do not stand for the others'.
bool rays_lie_apart(const Plan& plan) {
    constexpr double kVoxels = 2;
    const Camera& camera = plan.camera;
    double pitch = 2 * camera.half_height / camera.height;  // of pixels, world
    if (camera.projection == Projection::perspective) {
        const Vec3 middle = (plan.box_low + plan.box_high) * 0.5;
        pitch *= std::max((middle - camera.eye).dot(camera.view), 0.0);
    }
    return (kSide - 1) * pitch > kVoxels * plan.volume->smallest_spacing();
}

// Whether a pixel that gathered nothing is black and transparent to the last bit.
bool nothing_is_black(const Plan& plan) {
    const auto black = [&](const auto& nothing) {
        const std::array<double, 4> color = color_of(
            plan.compositing, Accumulated<double>{{to_double(nothing.color[0]), to_double(nothing.color[1]),
                                                   to_double(nothing.color[2])},
                                                  to_double(nothing.transparency)});
        return color == std::array<double, 4>{};
    };
    return plan.float32 ? black(nothing_yet<Real<float>>(plan.compositing))
                        : black(nothing_yet<std::int64_t>(plan.compositing));
}

// Builds the cells that rays may meet, unless the last call for this volume asked for the same.
void build_cells(const std::shared_ptr<CellBlocks>& cells, const Volume& volume, const BlockBox& box,
                 const std::shared_ptr<const EmptySpace>& empty) {
    struct Built {
        std::weak_ptr<CellBlocks> cells;
        BlockBox box;
        std::shared_ptr<const EmptySpace> empty;
    };
    static KeptPerVolume<Built> kept;
    kept.find_or_make(
        volume,
        [&] {
            // Rays that skip empty space still run through what lies within a batch of something visible.
            cells->build([&](std::int64_t block) {
                return may_be_met(box, empty.get(), cells->blocks(), block, kSteps >> kBlockBits);
            });
            return std::make_shared<Built>(Built{cells, box, empty});
        },
        [&](const Built& built) {
            return built.cells.lock() == cells && built.empty == empty && built.box.low == box.low &&
                   built.box.blocks == box.blocks;
        });
}

// Whether rays may meet something that cannot be seen.
bool hides_something(const EmptySpace& space) {
    const std::int64_t blocks = space.box.count();
    std::int64_t halves = 0;
    for (const std::uint32_t word : space.fine) halves += std::popcount(word);
    return space.visible_blocks < blocks || (!space.fine.empty() && halves < 8 * blocks);
}

// Found anew where the last call for this volume was about other empty space.
std::shared_ptr<const AboutEmptySpace> about(const Volume& volume,
                                             const std::shared_ptr<const EmptySpace>& empty) {
    static KeptPerVolume<const AboutEmptySpace> kept;
    return kept.find_or_make(
        volume,
        [&] {
            return std::make_shared<const AboutEmptySpace>(
                AboutEmptySpace{empty, VisibleSurface(*empty), hides_something(*empty)});
        },
        [&](const AboutEmptySpace& found) { return found.empty.lock() == empty; });
}

}  // namespace

StageWays ways_of(const Plan& plan) {
    const auto bits = [&](std::size_t stage) { return bits_of(plan.stages[stage].needs); };
    StageWays ways;
    if (plan.float32) {
        for (StageWay* way : {&ways.location, &ways.interpolation, &ways.classification, &ways.compositing,
                              &ways.gradient, &ways.shading, &ways.input, &ways.places, &ways.between})
            way->is_float = true;
        return ways;
    }
    KnownOf location;
    location(plan.location.to_location), location(plan.location.to_weight);
    ways.location = {bits(0), location.known};
    ways.input = {bits_of(plan.input_needs), known_of(plan.input)};
    ways.interpolation = {bits(1), known_of(plan.interpolation)};
    ways.classification = {bits(3), std::visit([](const auto& m) { return known_of(m); }, plan.method)};
    const KnownRescales lit = known_of(plan.gradient, plan.shading);
    ways.gradient = {bits_of(plan.gradient_needs), lit};
    ways.shading = {std::max(bits_of(plan.normal_needs), bits(4)), lit};
    const KnownRescales inside = known_of(plan.inside);
    ways.places = {ways.classification.bits, std::min(inside, ways.classification.known)};
    ways.between = {ways.gradient.bits, inside};
    ways.compositing = {bits(5), known_of(plan.compositing)};
    return ways;
}

std::optional<std::string> what_needs_the_model(const Plan& plan) {
    if (plan.real && !plan.float32) return "nothing is rounded";
    if (plan.gradient.exaggerated.wanted && (plan.float32 || plan.gradient_from_samples()))
        return fmt::format("exaggerated normals of {} are drawn by the model",
                           plan.float32 ? "floats" : "gradients from samples");
    if (plan.float32) {  // formats do not matter
        if (plan.projection_mode) return "mip, minip and average of floats run in the model";
        if (plan.scene.output.depth || plan.scene.output.normals)
            return "depth and normals of floats are written by the model";
        if (plan.gradient_from_samples()) return "gradients from samples of floats run in the model";
        if (std::holds_alternative<MomentSeries>(plan.method))
            return "moments beyond the first have no float32 lanes";
        return std::nullopt;
    }
    const auto too_wide = [](std::string_view name, const WordNeeds& needs) -> std::optional<std::string> {
        if (bits_of(needs) != 0) return std::nullopt;
        return fmt::format("{}: factors of {} bits and results of {} fit no lane (32 and 64)", name,
                           needs.operand_bits, needs.lane_bits);
    };
    for (std::size_t i = 0; i < plan.stages.size(); ++i) {
        const StageReport& stage = plan.stages[i];
        const bool once_a_ray = plan.projection_mode && i >= 2;  // in the model's words
        if (auto obstacle = too_wide(stage.name, stage.needs); stage.modelled && !once_a_ray && obstacle)
            return obstacle;
    }
    if (auto obstacle = too_wide("classification input", plan.input_needs)) return obstacle;
    if (plan.gradient.exaggerated.wanted && plan.word_bits > 64)
        return "exaggerated normals are turned in 64 bits";
    if (plan.lit && plan.specs[Wire::normal].overflow == Overflow::wrap)
        return "a normal that wraps round is divided by the model";
    if (const int carried = plan.compositing.to_contribution.shift;
        plan.compositing.form == CompositingForm::w_carry && carried > 31)
        return fmt::format("a remainder of {} bits, which w_carry carries, is wider than a lane's 31",
                           carried);
    if (plan.compositing.form == CompositingForm::straight &&
        plan.specs[Wire::color].overflow == Overflow::wrap)
        return "a straight colour that wraps round is divided by the model";
    if (plan.gradient.fades && plan.specs[Wire::confidence].overflow == Overflow::wrap)
        return "a confidence that wraps round is divided by the model";
    std::vector<Wire> stored{
        Wire::location,     Wire::direction,  Wire::weight,     Wire::length,    Wire::classification_input,
        Wire::slab_ratio,   Wire::slab_color, Wire::slab_alpha, Wire::lit_color, Wire::color,
        Wire::transparency, Wire::light};
    if (plan.lit) stored.push_back(Wire::normal);
    if (plan.gradient.fades) stored.push_back(Wire::confidence);
    if (plan.gradient_from_samples()) stored.push_back(Wire::sample);
    const auto most_bits = [&](Wire wire, int bits) -> std::optional<std::string> {
        const Format& f = plan.specs[wire].format;
        if (f.integer_bits + f.fraction_bits <= bits) return std::nullopt;
        return fmt::format("{}: {} is wider than a lane's {} bits and sign", info(wire).name, to_string(f),
                           bits);
    };
    for (const Wire wire : stored)
        if (auto obstacle = most_bits(wire, 31)) return obstacle;
    if (plan.lit)  // the sum of a slab's two ends has one more bit
        if (auto obstacle = most_bits(Wire::gradient,
                                      plan.shares_ends() && !lights_between_ends(plan.inside.rule) ? 30 : 31))
            return obstacle;
    return std::nullopt;
}

LaneRenderer::LaneRenderer(const Plan& plan, const RenderOptions& options)
    : plan_(plan),
      target_(find_target(options.target)),
      ways_(ways_of(plan)),
      count_slabs_(slab_counter(target_)) {
    room_ = room_of(options);
    if (plan.walls.looks_twice) {
        walls_ = near_walls(*plan.volume, blocks_met(plan), plan.walls);
        room_ -= NearWalls::bytes_for(walls_->box);
    }
    if (options.skip) find_empty();
    choose_layout(options);
    kernels_ = kernels_for(plan, ways_, voxels_, target_);
    if (plan.lit && !plan.projection_mode) find_lit_cells(options);
    schedule_ = schedule_of(plan, kernels_);
    if (empty_ && !plan.projection_mode && nothing_is_black(plan))
        seen_ = visible_packets(plan, about_->surface);
}

void LaneRenderer::find_empty() {
    const std::int64_t needs = EmptySpace::bytes_for(*plan_.volume, blocks_met(plan_));
    empty_ = empty_space_of(plan_, room_);
    if (empty_) {
        about_ = about(*plan_.volume, empty_);
        if (about_->hides_something) asked_ = empty_.get();
        room_ -= EmptySpace::bytes_for(*plan_.volume, empty_->box) + about_->surface.bytes();
    } else {
        no_room_to_skip_ = may_skip(plan_) && needs > room_;
    }
}

void LaneRenderer::choose_layout(const RenderOptions& options) {
    const Volume& volume = *plan_.volume;
    const std::int64_t all = CellBlocks::bytes_of_all(volume);
    voxels_.volume = plan_.volume.get();
    if (options.layout == LayoutRule::linear) {
        layout_ = "linear: as asked";
        return;
    }
    if (options.layout == LayoutRule::automatic && !cells_pay(plan_) && !cells_pay_by_now(plan_)) {
        layout_ = "linear: too few samples so far for cells to pay";
        return;
    }
    const std::int64_t room = std::max<std::int64_t>(room_ - CellBlocks::table_bytes_of(volume), 0);
    cells_ = cell_blocks(volume, room, options.layout_bytes >= 0);
    if (cells_->room() > 0) {
        build_cells(cells_, volume, blocks_met(plan_), empty_);
        voxels_.cells = cells_->data(), voxels_.blocks = cells_->blocks(), voxels_.slots = cells_->slots();
        voxels_.near = cells_->near();
        voxels_.requests_all = rays_lie_apart(plan_);
    }
    layout_ = fmt::format("cells: 2x2x2 voxels side by side, {:.1f} MiB if all were met, room for {:.1f} MiB",
                          static_cast<double>(all) / 0x1p20, static_cast<double>(cells_->room()) / 0x1p20);
}

void LaneRenderer::find_lit_cells(const RenderOptions& options) {
    no_lit_cells_ = kernels_.no_differences;
    if (no_lit_cells_.empty() && !voxels_.cells) no_lit_cells_ = "the volume lies as it is";
    if (!no_lit_cells_.empty()) return;
    const Volume& volume = *plan_.volume;
    constexpr auto kContent = CellContent::differences;
    const std::int64_t taken = cells_->room() + CellBlocks::table_bytes_of(volume);
    // Their slots lie there twice.
    const std::int64_t room = room_ - taken - 2 * CellBlocks::table_bytes_of(volume, kContent);
    const std::shared_ptr<CellBlocks> cells =
        cell_blocks(volume, std::max<std::int64_t>(room, 0), options.layout_bytes >= 0, kContent);
    if (cells->room() == 0) {
        no_lit_cells_ = "there is no room for them";
        return;
    }
    lit_cells_ = lit_cells(volume, blocks_met(plan_), empty_, cells);
    if (options.layout == LayoutRule::cells) lit_cells_->build();
    voxels_.lit = lit_cells_.get();
}

namespace {

std::string words_of(const Plan& plan) {
    if (plan.float32) return "float32 lanes";
    const StageWays ways = ways_of(plan);
    if (plan.projection_mode)
        return fmt::format("lanes of {}/{} bits (location, interpolation), one classification a ray",
                           ways.location.bits, ways.interpolation.bits);
    std::string text = fmt::format(
        "lanes of {}/{}/{}/{} bits (location, interpolation, classification, compositing)",
        ways.location.bits, ways.interpolation.bits, ways.classification.bits, ways.compositing.bits);
    if (plan.lit) text += fmt::format(", gradients {}, shading {}", ways.gradient.bits, ways.shading.bits);
    return text;
}

std::string words_and_schedule(const Plan& plan, const Schedule& schedule) {
    std::string text = fmt::format("{}; schedule {}", words_of(plan), schedule.name);
    if (!schedule.missed.empty()) text += fmt::format(" ({})", fmt::join(schedule.missed, "; "));
    return text;
}

}  // namespace

std::string words_in_lanes(const Plan& plan) {
    static constexpr std::uint8_t kSomewhere = 0;
    VoxelSource source;
    source.volume = plan.volume.get();
    source.cells = cells_pay(plan) ? &kSomewhere : nullptr;
    const StageKernels kernels = kernels_for(plan, ways_of(plan), source, find_target(""));
    std::string text = words_and_schedule(plan, schedule_of(plan, kernels));
    if (plan.lit && !plan.projection_mode)
        text += !kernels.no_differences.empty() ? "; no lit cells: " + kernels.no_differences
                : source.cells                  ? "; lit cells once they pay"
                                                : "; no lit cells: the volume lies as it is";
    return text;
}

std::string LaneRenderer::why() const {
    std::string text = words_and_schedule(plan_, schedule_);
    if (empty_) text += fmt::format("; {} of {} blocks visible", empty_->visible_blocks, empty_->box.count());
    if (!no_lit_cells_.empty()) text += fmt::format("; no lit cells: {}", no_lit_cells_);
    if (lit_cells_)
        text += lit_cells_->built()
                    ? fmt::format("; lit cells of {} blocks in {:.1f} MiB", lit_cells_->wanted(),
                                  static_cast<double>(lit_cells_->bytes()) / 0x1p20)
                    : fmt::format("; lit cells after {} more gradients", lit_cells_->to_come());
    if (no_room_to_skip_) text += "; empty space is visited, for there is no room for its blocks";
    return text;
}

std::int64_t LaneRenderer::bytes() const {
    return (empty_ ? EmptySpace::bytes_for(*plan_.volume, empty_->box) + about_->surface.bytes() : 0) +
           (walls_ ? NearWalls::bytes_for(walls_->box) : 0) + (cells_ ? cells_->bytes() : 0) +
           (lit_cells_ ? lit_cells_->bytes() : 0);
}

void LaneRenderer::render_tile(int left, int top, int right, int bottom, Image& image,
                               TileStatistics& statistics) const {
    const auto workspace = std::make_unique_for_overwrite<Workspace>();
    Workspace& w = *workspace;
    if (plan_.lit) w.lit = {};  // lanes past the last packed sample are computed, too
    if (plan_.shares_ends()) w.ends = {}, w.end_gradients = {};
    if (looks_into_slabs(plan_.inside.rule) || walls_)
        w.picked = w.pieces = {}, w.cut = {}, w.slab_light = {};
    if (walls_) w.twice = {};
    BoxSums box_sums(*plan_.volume);
    PacketLoop loop(plan_, kernels_, schedule_, voxels_, asked_, walls_.get(), &box_sums, w);
    std::int64_t gradients = 0;
    const bool colors_alone = !plan_.projection_mode && image.channels.size() == 4;
    for (int y = top; y < bottom; y += kSide)
        for (int x = left; x < right; x += kSide) {
            const PacketPlace place{x, y, right, bottom};
            if (colors_alone && !seen_.holds(x, y)) {  // the image is black where nothing is stored
                const RayCounts counts = count_slabs_(plan_, place);
                statistics.rays += counts.rays, statistics.samples += counts.slabs;
                continue;
            }
            kernels_.set_up(plan_, place, w.rays);
            loop.run();
            if (colors_alone)
                kernels_.store_colors(plan_, w.pixels, place, image);
            else
                for (int r = 0; r < kRays; ++r) {
                    if (!place.inside(r)) continue;
                    const auto store = [&](const auto& pixel) {
                        store_pixel(plan_, pixel, place.column(r), place.row(r), image);
                    };
                    plan_.float32 ? store(finished<Real<float>>(w.pixels, r)) : store(loop.pixel(r));
                }
            statistics.rays += w.rays.rays, statistics.visited += loop.visited();
            statistics.samples += loop.samples(), statistics.refined.add(loop.refined());
            gradients += loop.gradients();
        }
    if (lit_cells_) lit_cells_->add(gradients);
}

}  // namespace squint::lanes
