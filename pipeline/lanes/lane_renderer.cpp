#include "pipeline/lanes/lane_renderer.h"

#include "pipeline/lanes/targets.h"
#include "pipeline/raycast.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <vector>

namespace squint::lanes {
namespace {

using namespace squint::HWY_NAMESPACE;

// Bits of the lanes that hold a stage; 0 where none does.
int bits_of(const WordNeeds& needs) {
    constexpr int kBitsOfDouble = 54;  // with a sign: what 32-bit lanes have for wide numbers
    if (needs.operand_bits > 32) return 0;
    if (needs.lane_bits <= 32 && needs.wide_bits <= kBitsOfDouble) return 32;
    return std::max(needs.lane_bits, needs.wide_bits) <= 64 ? 64 : 0;
}

// The most that is known of a stage's roundings, in 32-bit lanes.
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

// How far samples may leave the box that is rendered, in voxels: what rounding V adds up to.
double drift_of(const Plan& plan) {
    const Index3& n = plan.volume->dims;
    const double of_floats = plan.float32 ? static_cast<double>(std::max({n.x, n.y, n.z})) * 0x1p-20 : 0;
    return of_floats + std::ldexp(static_cast<double>(-plan.location.low[0]), -plan.location.common_fraction);
}

// A word in the buffers: an integer, or a float's bits.
Word bits_of(std::int64_t word) {
    return static_cast<Word>(word);
}
Word bits_of(Real<float> word) {
    return std::bit_cast<Word>(word.v);
}
void word_from_bits(Word bits, std::int64_t& word) {
    word = bits;
}
void word_from_bits(Word bits, Real<float>& word) {
    word.v = std::bit_cast<float>(bits);
}

// Blocks that a slab's two ends may lie apart; 0 where one sample classifies it.
int slab_reach(const Plan& plan) {
    if (!plan.needs_back) return 0;
    return static_cast<int>(std::ceil(std::min((plan.scene.sampling.step + drift_of(plan)) / kBlock, 1e6)));
}

// Blocks that samples may lie in, and as many about them as a slab reaches, and one more.
BlockBox blocks_met(const Plan& plan) {
    const Volume& volume = *plan.volume;
    const BlockBox all = all_blocks_of(volume);
    const Vec3 low = volume.voxel_from_world(plan.box_low), high = volume.voxel_from_world(plan.box_high);
    const double beyond = kBlock * (slab_reach(plan) + 1) + drift_of(plan) + 1;
    BlockBox box;
    for (int a = 0; a < 3; ++a) {
        const auto block = [&](double voxel) {
            const double inside = std::clamp(voxel, 0.0, static_cast<double>(volume.dims[a] - 1));
            return std::min(static_cast<std::int64_t>(inside) >> kBlockBits, all.blocks[a] - 1);
        };
        box.low[a] = block(low[a] - beyond);
        box.blocks[a] = std::max(block(high[a] + beyond), box.low[a]) - box.low[a] + 1;
    }
    return box;
}

// Whether rays may meet a block of cells.  Those that leave out empty space still run through what lies
// within a batch of something visible.
bool may_be_met(const BlockBox& box, const EmptySpace* empty, const Index3& cell_blocks, std::int64_t block) {
    constexpr int kBits = CellBlocks::kBits - kBlockBits;
    static_assert(kBits >= 0);
    const Index3 at(block % cell_blocks.x, block / cell_blocks.x % cell_blocks.y,
                    block / (cell_blocks.x * cell_blocks.y));
    Index3 low, end;
    for (int a = 0; a < 3; ++a) {
        low[a] = std::max(at[a] << kBits, box.low[a]);
        end[a] = std::min((at[a] + 1) << kBits, box.low[a] + box.blocks[a]);
        if (low[a] >= end[a]) return false;
    }
    if (!empty) return true;
    for (auto z = low.z; z < end.z; ++z)
        for (auto y = low.y; y < end.y; ++y)
            for (auto x = low.x; x < end.x; ++x)
                if (empty->at(x, y, z) <= kSteps >> kBlockBits) return true;
    return false;
}

// MIP: a block changes a ray where its greatest scalar or any below can be seen.  Else no sample of it is the
// ray's largest, or the largest is as transparent as whatever stands in its place.
BlockRanges from_zero(BlockRanges ranges) {
    std::fill(ranges.smallest.begin(), ranges.smallest.end(), std::uint16_t{0});
    return ranges;
}

// What the system could give: pages of mapped files make way.
std::int64_t free_memory() {
    std::ifstream file("/proc/meminfo");
    for (std::string word; file >> word;)
        if (std::int64_t kib = 0; word == "MemAvailable:" && file >> kib) return kib << 10;
    return std::int64_t{sysconf(_SC_AVPHYS_PAGES)} * sysconf(_SC_PAGESIZE);
}

bool any_active(const PixelPacket& pixels) {
    return std::any_of(std::begin(pixels.active.v), std::end(pixels.active.v), [](Word a) { return a != 0; });
}

}  // namespace

StageWays ways_of(const Plan& plan) {
    const auto bits = [&](std::size_t stage) { return bits_of(plan.stages[stage].needs); };
    StageWays ways;
    if (plan.float32) {
        for (StageWay* way : {&ways.location, &ways.interpolation, &ways.classification, &ways.compositing,
                              &ways.gradient, &ways.shading, &ways.input})
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
    ways.compositing = {bits(5), known_of(plan.compositing)};
    return ways;
}

std::optional<std::string> what_needs_the_model(const Plan& plan) {
    if (plan.real && !plan.float32) return "nothing is rounded";
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
        if (const auto obstacle = too_wide(stage.name, stage.needs);
            stage.modelled && !once_a_ray && obstacle)
            return obstacle;
    }
    if (const auto obstacle = too_wide("classification input", plan.input_needs)) return obstacle;
    if (plan.lit && plan.specs[Wire::normal].overflow == Overflow::wrap)
        return "a normal that wraps round is divided by the model";
    std::vector<Wire> stored{
        Wire::location,     Wire::direction,  Wire::weight,     Wire::length,    Wire::classification_input,
        Wire::slab_ratio,   Wire::slab_color, Wire::slab_alpha, Wire::lit_color, Wire::color,
        Wire::transparency, Wire::light};
    if (plan.lit && plan.scene.output.normals) stored.push_back(Wire::normal);
    if (plan.gradient_from_samples()) stored.push_back(Wire::sample);
    for (const Wire wire : stored) {
        const Format& f = plan.specs[wire].format;
        if (f.integer_bits + f.fraction_bits > 31)
            return fmt::format("{}: {} is wider than a lane's 31 bits and sign", info(wire).name,
                               to_string(f));
    }
    return std::nullopt;
}

LaneRenderer::LaneRenderer(const Plan& plan, const RenderOptions& options)
    : plan_(plan), target_(find_target(options.target)), ways_(ways_of(plan)) {
    room_ = options.layout_bytes >= 0 ? options.layout_bytes : free_memory() / 2;
    if (options.skip && plan.skips_empty_space) find_empty();
    choose_layout(options);
    kernels_ = kernels_for(plan, ways_, voxels_, target_);
}

void LaneRenderer::find_empty() {
    constexpr int kMostReach = 4;  // with longer slabs little is left out
    if (slab_reach(plan_) > kMostReach) return;
    const BlockBox box = blocks_met(plan_);
    if (EmptySpace::bytes_for(box) > room_) {
        no_room_to_skip_ = true;
        return;
    }
    const std::shared_ptr<const BlockRanges> ranges = block_ranges(*plan_.volume, box);
    const auto find = [&](const BlockRanges& r) {
        return find_empty_space(r, plan_.entries, slab_reach(plan_), plan_.entry_reach);
    };
    empty_ = plan_.projection_mode ? find(from_zero(*ranges)) : find(*ranges);
    room_ -= EmptySpace::bytes_for(empty_->box);
}

void LaneRenderer::choose_layout(const RenderOptions& options) {
    const Volume& volume = *plan_.volume;
    const std::int64_t all = CellBlocks::bytes_of_all(volume);
    voxels_.volume = plan_.volume.get();
    if (options.layout == LayoutRule::linear) {
        layout_ = "linear: as asked";
        return;
    }
    if (options.layout == LayoutRule::automatic) {
        // Cells pay where a block is met by many more samples than it takes voxels to build.
        const double samples = static_cast<double>(plan_.camera.width) * plan_.camera.height *
                               static_cast<double>(std::max({volume.dims.x, volume.dims.y, volume.dims.z})) /
                               plan_.scene.sampling.step;
        if (samples < 8 * static_cast<double>(volume.voxels())) {
            layout_ = "linear: too few samples for cells to pay";
            return;
        }
    }
    const std::int64_t room = std::max<std::int64_t>(room_ - CellBlocks::table_bytes_of(volume), 0);
    cells_ = cell_blocks(volume, room, options.layout_bytes >= 0);
    if (cells_->room() > 0) {
        const BlockBox box = blocks_met(plan_);
        cells_->build([&](std::int64_t block) {
            return may_be_met(box, empty_ ? &*empty_ : nullptr, cells_->blocks(), block);
        });
        voxels_.cells = cells_->data(), voxels_.blocks = cells_->blocks(), voxels_.slots = cells_->slots();
    }
    layout_ = fmt::format("cells: 2x2x2 voxels side by side, {:.1f} MiB if all were met, room for {:.1f} MiB",
                          static_cast<double>(all) / 0x1p20, static_cast<double>(cells_->room()) / 0x1p20);
}

std::string words_in_lanes(const Plan& plan) {
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

std::string LaneRenderer::why() const {
    std::string text = words_in_lanes(plan_);
    if (empty_)
        text += fmt::format("; {} of {} blocks visible", empty_->visible_blocks, empty_->distance.size());
    if (no_room_to_skip_) text += "; empty space is visited, for there is no room for its blocks";
    return text;
}

std::int64_t LaneRenderer::bytes() const {
    return (empty_ ? EmptySpace::bytes_for(empty_->box) : 0) + (cells_ ? cells_->bytes() : 0);
}

namespace {

// What depth and normals are made of: touched only where a scene asks for them.
struct Notes {
    Batch between;                     // T at the ends of a batch's slabs
    Row samples_before;                // of the batch
    Pixel<std::int64_t> pixel[kRays];  // depths, and the first visible slab's normal
    bool met[kRays];                   // something lit, and so visible
};

// One packet's buffers: about 60 KiB, most of it touched only where light falls.
struct Workspace {
    RayPacket rays;
    RayCourse course;
    PixelPacket pixels;
    ProjectionPacket projection;
    Samples samples[2];  // this batch, and the next one's locations
    LitSamples lit;
    Samples beside;  // those that a gradient is made of
    Notes notes;
};

/// Ray r's pixel, with what has been noted of it.
template <class W>
Pixel<W> finished(const PixelPacket& pixels, int r, Pixel<W> pixel = {}) {
    for (std::size_t c = 0; c < 3; ++c) word_from_bits(pixels.color[c].v[r], pixel.gathered.color[c]);
    word_from_bits(pixels.transparency.v[r], pixel.gathered.transparency);
    pixel.samples = pixels.samples.v[r];
    return pixel;
}

class PacketLoop {
  public:
    PacketLoop(const Plan& plan, const StageKernels& kernels, const VoxelSource& voxels,
               const EmptySpace* empty, Workspace& w)
        : plan_(plan),
          kernels_(kernels),
          voxels_(voxels),
          empty_(empty),
          w_(w),
          backwards_(plan.compositing.form == CompositingForm::back_to_front && !plan.projection_mode),
          notes_((plan.wants_depth || plan.scene.output.normals) && !plan.projection_mode) {}

    /// All slabs of a packet whose rays are set up.
    void run() {
        located_ = -1, visited_ = 0;
        start_pixels();
        if (notes_)
            std::fill_n(w_.notes.pixel, kRays, Pixel<std::int64_t>{}),
                std::fill_n(w_.notes.met, kRays, false);
        if (empty_) kernels_.set_course(plan_, *empty_, w_.rays, w_.course);
        if (backwards_)
            run_backwards();
        else
            run_forwards();
    }

    /// Ray r's pixel.
    Pixel<std::int64_t> pixel(int r) const {
        if (plan_.projection_mode && w_.rays.slabs.v[r] > 0)
            return project_pixel(plan_,
                                 plan_.scene.compositing.mode == CompositingMode::average
                                     ? w_.projection.sum[r]
                                     : w_.projection.extreme.v[r],
                                 w_.rays.slabs.v[r]);
        return finished<std::int64_t>(w_.pixels, r, notes_ ? w_.notes.pixel[r] : Pixel<std::int64_t>{});
    }

    /// Slabs of the packet, of all its rays, that went through the stages.
    std::int64_t visited() const { return visited_; }

  private:
    void start_pixels() {
        if (plan_.float32)
            start_pixels_from(nothing_yet<Real<float>>(plan_.compositing));
        else
            start_pixels_from(nothing_yet<std::int64_t>(plan_.compositing));
    }
    template <class W>
    void start_pixels_from(const Accumulated<W>& none) {
        for (int r = 0; r < kRays; ++r) {
            for (std::size_t c = 0; c < 3; ++c) w_.pixels.color[c].v[r] = bits_of(none.color[c]);
            w_.pixels.transparency.v[r] = bits_of(none.transparency);
            w_.pixels.active.v[r] = w_.rays.slabs.v[r] > 0;
            w_.pixels.samples.v[r] = 0;
            // Inputs are not negative.
            w_.projection.extreme.v[r] =
                plan_.scene.compositing.mode == CompositingMode::minip ? std::numeric_limits<Word>::max() : 0;
            w_.projection.sum[r] = 0;
        }
    }

    void run_forwards() {
        bool carried = false;  // the sample behind the last slab is known: the next batch's row 0
        for (int k = 0; k < w_.rays.most_slabs;) {
            if (const int skip = leave_out(k); skip > 0) {
                k += skip, carried = false;
                continue;
            }
            batch(k, std::min(kSteps, w_.rays.most_slabs - k), carried);
            carried = plan_.needs_back;
            k += kSteps;
            if (!any_active(w_.pixels)) return;
        }
    }

    void run_backwards() {
        for (int end = w_.rays.most_slabs; end > 0; end -= kSteps) {
            const int k = std::max(0, end - kSteps);
            batch(k, end - k, false);
        }
    }

    // Slabs that composite nothing; they count as composited, as in the model.
    int leave_out(int k) {
        return empty_ ? kernels_.leave_out(*empty_, w_.rays, plan_.volume->dims, k, w_.rays.most_slabs - k,
                                           w_.course, w_.pixels)
                      : 0;
    }

    Samples& here() { return w_.samples[current_]; }

    int samples_for(int k) const {
        return std::min(kSteps, w_.rays.most_slabs - k) + (plan_.needs_back ? 1 : 0);
    }

    // Slabs k to k + steps through all stages.
    void batch(int k, int steps, bool carried) {
        const int from = carried ? 1 : 0, to = steps + (plan_.needs_back ? 1 : 0);
        if (located_ == k) {
            current_ = 1 - current_;
            if (carried) carry(w_.samples[1 - current_], here());
        } else {
            if (carried) carry(here(), here());
            locate(here(), k, from, to);
        }
        Samples& s = here();
        if (!backwards_) look_ahead(k + kSteps);
        kernels_.fetch(voxels_, from, to, s);
        kernels_.interpolate(plan_, from, to, s);
        visited_ += steps * w_.rays.rays;
        if (plan_.projection_mode) {
            kernels_.project(w_.rays, steps, s, w_.projection);
            return;
        }
        kernels_.classify(plan_, steps, s);
        const int lit = plan_.lit ? light(steps) : 0;
        if (notes_) w_.notes.samples_before = w_.pixels.samples;
        kernels_.composite(plan_, w_.rays, steps, s, w_.pixels, w_.notes.between);
        if (notes_) note(lit);
    }

    void locate(Samples& s, int k, int from, int to) {
        s.first = k;
        kernels_.locate(plan_, w_.rays, from, to, s);
        kernels_.prefetch(voxels_, from, to, s);
    }

    // Locations of the batch at k, and its voxels on their way from memory while this batch computes.
    void look_ahead(int k) {
        located_ = -1;
        if (k >= w_.rays.most_slabs) return;
        locate(w_.samples[1 - current_], k, plan_.needs_back ? 1 : 0, samples_for(k));
        located_ = k;
    }

    // One batch's last row becomes the next one's first.
    void carry(const Samples& from, Samples& to) const {
        const auto move = [](const Batch& a, Batch& b) {
            std::memmove(b.v, a.v + kSteps * kRays, sizeof(Word) * kRays);
        };
        move(from.input, to.input), move(from.length, to.length);
        for (int a = 0; a < 3; ++a) move(from.cell[a], to.cell[a]), move(from.weight[a], to.weight[a]);
        for (int a = 0; plan_.gradient_from_samples() && a < 3; ++a) move(from.location[a], to.location[a]);
    }

    // Gathers what is visible and not yet hidden, lights it, and puts it back.  Gives its number.
    int light(int steps) {
        Samples& s = here();
        LitSamples& lit = w_.lit;
        const int count = kernels_.gather_lit(plan_, w_.rays, w_.pixels, steps, s, lit);
        if (count == 0) return 0;
        if (plan_.gradient_from_samples())
            sample_beside(count);
        else
            kernels_.fetch_lit(plan_, count, lit);
        kernels_.shade(plan_, count, lit);
        for (int i = 0; i < count; ++i)
            for (int c = 0; c < 3; ++c) s.color[c].v[lit.from.v[i]] = lit.color[c].v[i];
        return count;
    }

    // The six samples about each of the first `count` gathered ones, or about either of its ends.
    void sample_beside(int count) {
        const int rows = (count + kRays - 1) / kRays;
        for (int end = 0; end < (plan_.needs_back ? 2 : 1); ++end)
            for (int axis = 0; axis < 3; ++axis)
                for (const bool ahead : {false, true}) {
                    kernels_.step_aside(plan_, w_.lit, end, axis, ahead, rows, w_.beside);
                    kernels_.prefetch(voxels_, 0, rows, w_.beside);
                    kernels_.fetch(voxels_, 0, rows, w_.beside);
                    kernels_.interpolate_scalars(plan_, 0, rows, w_.beside);
                    std::copy_n(w_.beside.input.v, rows * kRays, w_.lit.beside[end][axis][ahead].v);
                }
    }

    // Depths and first normals of the batch that has just been composited, `lit` samples of it lit.  A ray
    // took its first slabs, so many as it has more `samples` than before.
    void note(int lit) {
        int taken[kRays];
        for (int r = 0; r < kRays; ++r) taken[r] = w_.pixels.samples.v[r] - w_.notes.samples_before.v[r];
        for (int r = 0; plan_.wants_depth && r < kRays; ++r) note_depths(r, taken[r]);
        for (int i = 0; plan_.scene.output.normals && i < lit; ++i) {
            const int place = backwards_ ? lit - 1 - i : i;  // as the ray meets them
            const int at = w_.lit.from.v[place], r = at % kRays;
            if (at / kRays >= taken[r] || (w_.notes.met[r] && !backwards_)) continue;
            for (std::size_t a = 0; a < 3; ++a) w_.notes.pixel[r].first_normal[a] = w_.lit.normal[a].v[place];
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
            note_depth(plan_, w_.rays.entry_distance[r], here().first + row, backwards_ ? back : front,
                       backwards_ ? front : back, backwards_, w_.notes.pixel[r]);
        }
    }

    const Plan& plan_;
    const StageKernels& kernels_;
    const VoxelSource& voxels_;
    const EmptySpace* empty_;
    Workspace& w_;
    bool backwards_;
    bool notes_;  // depth or normals are asked for
    int current_ = 0;
    int located_ = -1;  // first slab of the batch whose locations stand in the other buffer
    std::int64_t visited_ = 0;
};

}  // namespace

void LaneRenderer::render_tile(int left, int top, int right, int bottom, Image& image,
                               TileStatistics& statistics) const {
    const auto workspace = std::make_unique<Workspace>();
    Workspace& w = *workspace;
    PacketLoop loop(plan_, kernels_, voxels_, empty_ ? &*empty_ : nullptr, w);
    for (int y = top; y < bottom; y += kSide)
        for (int x = left; x < right; x += kSide) {
            const PacketPlace place{x, y, right, bottom};
            kernels_.set_up(plan_, place, w.rays);
            loop.run();
            for (int r = 0; r < kRays; ++r) {
                if (!place.inside(r)) continue;
                const auto store = [&](const auto& pixel) {
                    store_pixel(plan_, pixel, place.column(r), place.row(r), image);
                    statistics.samples += pixel.samples;
                };
                plan_.float32 ? store(finished<Real<float>>(w.pixels, r)) : store(loop.pixel(r));
            }
            statistics.rays += w.rays.rays, statistics.visited += loop.visited();
        }
}

}  // namespace squint::lanes
