#include "pipeline/lanes/lane_renderer.h"

#include "pipeline/lanes/targets.h"
#include "pipeline/raycast.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace squint::lanes {
namespace {

using namespace squint::HWY_NAMESPACE;

constexpr int kSide = 4;  // a packet is 4x4 pixels

// Bits of the lanes that hold a stage; 0 where none does.
int bits_of(const WordNeeds& needs) {
    if (needs.operand_bits > 32) return 0;
    return needs.lane_bits <= 32 ? 32 : needs.lane_bits <= 64 ? 64 : 0;
}

StageWidths widths_of(const Plan& plan) {
    const auto bits = [&](std::size_t stage) { return bits_of(plan.stages[stage].needs); };
    return {bits(0), bits(1), bits_of(plan.input_needs), bits(3), 64, bits(5)};
}

// ------------------------------------------------------------------------------------------------ rays

struct PixelPlace {
    int column, row;
    bool inside;
};

struct PacketSetup {
    PixelPlace place[kRays];
    RaySetup ray[kRays];
    int most_slabs = 0, rays = 0;
    double fastest[3] = {0, 0, 0};  // most voxels a step moves, per axis
};

void set_up_packet(const Plan& plan, int left, int top, int right, int bottom, PacketSetup& setup,
                   RayPacket& packet) {
    for (int r = 0; r < kRays; ++r) {
        PixelPlace& place = setup.place[r];
        place = {left + r % kSide, top + r / kSide, false};
        place.inside = place.column < right && place.row < bottom;
        setup.ray[r] = place.inside ? plan.set_up(place.column, place.row) : RaySetup{};
        const RaySetup& ray = setup.ray[r];
        setup.most_slabs = std::max(setup.most_slabs, ray.slabs);
        setup.rays += ray.slabs > 0;
        for (int a = 0; a < 3; ++a) setup.fastest[a] = std::max(setup.fastest[a], std::abs(ray.step[a]));
        const RayWords<std::int64_t> words = ray_words<std::int64_t>(plan, ray);
        for (std::size_t a = 0; a < 3; ++a) {
            packet.first[a].v[r] = static_cast<Word>(words.first[a]);
            packet.last[a].v[r] = static_cast<Word>(words.last[a]);
            packet.step[a].v[r] = static_cast<Word>(words.step[a]);
            packet.view[a].v[r] = static_cast<Word>(words.view[a]);
            for (std::size_t l = 0; l < kMostHalves; ++l)
                packet.half[l][a].v[r] = static_cast<Word>(words.half[l][a]);
        }
        packet.last_index.v[r] = static_cast<Word>(words.last_index);
        packet.last_length.v[r] = static_cast<Word>(words.last_length);
        packet.slabs.v[r] = ray.slabs;
    }
}

// ------------------------------------------------------------------------------------------------ voxels

// Where voxels lie: offsets from a cell's lower corner to its four pairs along x.
struct PairOffsets {
    std::int64_t pair[4];
    bool wide;  // indices need 64 bits
    explicit PairOffsets(const Volume& volume) : wide(volume.voxels() > std::numeric_limits<Word>::max()) {
        const std::int64_t y = volume.dims.y > 1 ? volume.dims.x : 0,
                           z = volume.dims.z > 1 ? volume.dims.x * volume.dims.y : 0;
        pair[0] = 0, pair[1] = y, pair[2] = z, pair[3] = y + z;
    }
};

std::int64_t corner_index(const Volume& volume, const PairOffsets& offsets, const Samples& s, int i) {
    if (!offsets.wide) return s.index.v[i];
    return s.cell[0].v[i] + (s.cell[1].v[i] + s.cell[2].v[i] * volume.dims.y) * volume.dims.x;
}

// Corners of each sample's cell as four pairs along x.
template <class T>
void fetch_pairs(const Volume& volume, const PairOffsets& offsets, int from, int to, Samples& samples) {
    const T* data = static_cast<const T*>(volume.data.get());
    const T* base[4] = {data, data + offsets.pair[1], data + offsets.pair[2], data + offsets.pair[3]};
    for (int i = from * kRays; i < to * kRays; ++i) {
        const std::int64_t at = corner_index(volume, offsets, samples, i);
        for (int p = 0; p < 4; ++p) {
            if constexpr (sizeof(T) == 2) {
                std::memcpy(&samples.pair[p].v[i], base[p] + at, 4);
            } else {
                std::uint16_t both;
                std::memcpy(&both, base[p] + at, 2);
                samples.pair[p].v[i] = (both & 0xff) | (both >> 8) << 16;
            }
        }
    }
}

// Asks for the voxels of a batch to come: every second step will do, for neighbours share cache lines.
template <class T>
void prefetch_pairs(const Volume& volume, const PairOffsets& offsets, int from, int to,
                    const Samples& samples) {
    const T* data = static_cast<const T*>(volume.data.get());
    for (int row = from; row < to; row += 2)
        for (int i = row * kRays; i < (row + 1) * kRays; ++i) {
            const T* corner = data + corner_index(volume, offsets, samples, i);
            for (const std::int64_t offset : offsets.pair) __builtin_prefetch(corner + offset);
        }
}

template <class T>
void fetch_neighbourhood_at(const Volume& volume, const Index3& cell, bool corners_only, int at,
                            Batch* voxel) {
    const T* data = static_cast<const T*>(volume.data.get());
    const auto clamped = [](std::int64_t i, std::int64_t n) { return std::clamp<std::int64_t>(i, 0, n - 1); };
    std::int64_t x[4], y[4], z[4];
    for (int i = 0; i < 4; ++i) {
        x[i] = clamped(cell.x + i - 1, volume.dims.x);
        y[i] = clamped(cell.y + i - 1, volume.dims.y) * volume.dims.x;
        z[i] = clamped(cell.z + i - 1, volume.dims.z) * volume.dims.x * volume.dims.y;
    }
    const int low = corners_only ? 1 : 0, high = corners_only ? 3 : 4;
    for (int k = low; k < high; ++k)
        for (int j = low; j < high; ++j)
            for (int i = low; i < high; ++i) voxel[(k * 4 + j) * 4 + i].v[at] = data[x[i] + y[j] + z[k]];
}

// ------------------------------------------------------------------------------------------------ empty
// space

// Steps from sample k that every ray of the packet can leave out: all of them stay in blocks where nothing is
// to be seen.
int empty_steps(const Plan& plan, const EmptySpace& empty, const PacketSetup& setup, const RayPacket& packet,
                const PixelPacket& pixels, int k) {
    const double cell_unit = std::ldexp(1.0, plan.location.location_fraction);
    const double direction_unit = std::ldexp(1.0, plan.location.direction_fraction);
    const auto block_of = [&](double p, int a) {
        return std::min(static_cast<std::int64_t>(p) >> kBlockBits, empty.blocks[a] - 1);
    };
    int least = setup.most_slabs - k;
    for (int r = 0; r < kRays && least > 0; ++r) {
        if (!pixels.active.v[r] || k >= packet.slabs.v[r]) continue;
        double p[3];
        Index3 block;
        for (int a = 0; a < 3; ++a) {
            const double limit = static_cast<double>(plan.volume->dims[a] - 1);
            p[a] = std::clamp(packet.first[a].v[r] / cell_unit + k * (packet.step[a].v[r] / direction_unit),
                              0.0, limit);
            block[a] = block_of(p[a], a);
        }
        const int distance = empty.at(block.x, block.y, block.z);
        if (distance == 0) return 0;
        double steps = setup.most_slabs;
        for (int a = 0; a < 3; ++a) {
            const double v = packet.step[a].v[r] / direction_unit;
            if (v == 0) continue;
            // To the far side of the empty blocks ahead, less what rounding can move a sample.
            const double side = v > 0 ? static_cast<double>((block[a] + distance) << kBlockBits) - p[a]
                                      : p[a] - static_cast<double>((block[a] - distance + 1) << kBlockBits);
            steps = std::min(steps, (side - 1e-3) / std::abs(v));
        }
        // Sample k + m is the last one inside: m + 1 slabs may go (the next sample is looked at anew).
        least = std::min(least, steps < 0 ? 0 : static_cast<int>(steps) + 1);
        // The ray's last sample stands at its exit, off P0 + kV by what rounding V adds up to.
        const int last = packet.last_index.v[r] - (plan.needs_back ? 1 : 0);
        if (k + least <= last) continue;
        Index3 exit;
        for (int a = 0; a < 3; ++a) exit[a] = block_of(packet.last[a].v[r] / cell_unit, a);
        if (empty.at(exit.x, exit.y, exit.z) == 0) least = std::min(least, std::max(last - k, 0));
    }
    return least;
}

bool any_active(const PixelPacket& pixels) {
    return std::any_of(std::begin(pixels.active.v), std::end(pixels.active.v), [](Word a) { return a != 0; });
}

}  // namespace

std::optional<std::string> what_needs_the_model(const Plan& plan) {
    if (plan.real) return "nothing is rounded";
    if (plan.projection_mode) return "mip, minip and average run in the model";
    if (plan.scene.output.depth || plan.scene.output.normals)
        return "depth and normals are written by the model";
    if (plan.lit && plan.scene.shading.gradient == GradientRule::central_samples)
        return "gradients from samples run in the model";
    if (plan.volume->dims.x < 2) return "the volume is one voxel thick along x";
    const auto too_wide = [](std::string_view name, const WordNeeds& needs) -> std::optional<std::string> {
        if (bits_of(needs) != 0) return std::nullopt;
        return fmt::format("{}: factors of {} bits and results of {} fit no lane (32 and 64)", name,
                           needs.operand_bits, needs.lane_bits);
    };
    for (const StageReport& stage : plan.stages)
        if (const auto obstacle = too_wide(stage.name, stage.needs); stage.modelled && obstacle)
            return obstacle;
    if (const auto obstacle = too_wide("classification input", plan.input_needs)) return obstacle;
    if (plan.lit && plan.specs[Wire::normal].overflow == Overflow::wrap)
        return "a normal that wraps round is divided by the model";
    for (const Wire wire : {Wire::location, Wire::direction, Wire::weight, Wire::length,
                            Wire::classification_input, Wire::slab_ratio, Wire::slab_color, Wire::slab_alpha,
                            Wire::lit_color, Wire::color, Wire::transparency, Wire::light}) {
        const Format& f = plan.specs[wire].format;
        if (f.integer_bits + f.fraction_bits > 31)
            return fmt::format("{}: {} is wider than a lane's 31 bits and sign", info(wire).name,
                               to_string(f));
    }
    return std::nullopt;
}

LaneRenderer::LaneRenderer(const Plan& plan, const RenderOptions& options)
    : plan_(plan),
      target_(find_target(options.target)),
      widths_(widths_of(plan)),
      kernels_(kernels_for(plan, widths_, target_)) {
    // A slab's two ends must lie in neighbouring blocks; its far one may be off by what V's rounding adds up
    // to.
    const double drift =
        std::ldexp(static_cast<double>(-plan.location.low[0]), -plan.location.common_fraction);
    const bool reachable = !plan.needs_back || plan.scene.sampling.step + drift <= kBlock;
    if (options.skip && plan.skips_empty_space && reachable)
        empty_ =
            find_empty_space(*block_ranges(*plan.volume), plan.entries, plan.needs_back, plan.entry_reach);
}

std::string LaneRenderer::why() const {
    const auto name = [](int bits) { return std::to_string(bits); };
    return fmt::format("lanes of {}/{}/{}/{} bits (location, interpolation, classification, compositing)",
                       name(widths_.location), name(widths_.interpolation), name(widths_.classification),
                       name(widths_.compositing)) +
           (plan_.lit ? ", shading 64" : "") +
           (empty_ ? fmt::format("; {} of {} blocks visible", empty_->visible_blocks, empty_->distance.size())
                   : "");
}

std::int64_t LaneRenderer::bytes() const {
    return empty_ ? static_cast<std::int64_t>(5 * empty_->distance.size()) : 0;
}

namespace {

// One packet's buffers: about 60 KiB, most of it touched only where light falls.
struct Workspace {
    PacketSetup setup;
    RayPacket rays;
    PixelPacket pixels;
    Samples samples[2];  // this batch, and the next one's locations
    LitSamples lit;
};

class PacketLoop {
  public:
    PacketLoop(const Plan& plan, const StageKernels& kernels, const EmptySpace* empty, Workspace& w)
        : plan_(plan),
          kernels_(kernels),
          empty_(empty),
          offsets_(*plan.volume),
          w_(w),
          backwards_(plan.compositing.form == CompositingForm::back_to_front) {}

    /// All slabs of a packet whose rays are set up.
    void run() {
        located_ = -1;
        start_pixels();
        if (backwards_)
            run_backwards();
        else
            run_forwards();
    }

  private:
    void start_pixels() {
        const Accumulated<std::int64_t> none = nothing_yet<std::int64_t>(plan_.compositing);
        for (int r = 0; r < kRays; ++r) {
            for (std::size_t c = 0; c < 3; ++c) w_.pixels.color[c].v[r] = static_cast<Word>(none.color[c]);
            w_.pixels.transparency.v[r] = static_cast<Word>(none.transparency);
            w_.pixels.active.v[r] = w_.rays.slabs.v[r] > 0;
            w_.pixels.samples.v[r] = 0;
        }
    }

    void run_forwards() {
        bool carried = false;  // the sample behind the last slab is known: the next batch's row 0
        for (int k = 0; k < w_.setup.most_slabs;) {
            if (const int skip = leave_out(k); skip > 0) {
                k += skip, carried = false;
                continue;
            }
            batch(k, std::min(kSteps, w_.setup.most_slabs - k), carried);
            carried = plan_.needs_back;
            k += kSteps;
            if (!any_active(w_.pixels)) return;
        }
    }

    void run_backwards() {
        for (int end = w_.setup.most_slabs; end > 0; end -= kSteps) {
            const int k = std::max(0, end - kSteps);
            batch(k, end - k, false);
        }
    }

    // Slabs that composite nothing; they count as composited, as in the model.
    int leave_out(int k) {
        if (!empty_) return 0;
        const int steps = empty_steps(plan_, *empty_, w_.setup, w_.rays, w_.pixels, k);
        for (int r = 0; r < kRays && steps > 0; ++r)
            if (w_.pixels.active.v[r]) w_.pixels.samples.v[r] += std::clamp(w_.rays.slabs.v[r] - k, 0, steps);
        return steps;
    }

    Samples& here() { return w_.samples[current_]; }

    int samples_for(int k) const {
        return std::min(kSteps, w_.setup.most_slabs - k) + (plan_.needs_back ? 1 : 0);
    }

    // Slabs k to k + steps through all stages.
    void batch(int k, int steps, bool carried) {
        if (located_ == k) {
            current_ = 1 - current_;
            if (carried) carry(w_.samples[1 - current_], here());
        } else {
            if (carried) carry(here(), here());
            here().first = k;
            kernels_.locate(plan_, w_.rays, carried ? 1 : 0, steps + (plan_.needs_back ? 1 : 0), here());
        }
        Samples& s = here();
        const int from = carried ? 1 : 0, to = steps + (plan_.needs_back ? 1 : 0);
        if (!backwards_) look_ahead(k + kSteps);
        if (plan_.volume->type == ScalarType::u8)
            fetch_pairs<std::uint8_t>(*plan_.volume, offsets_, from, to, s);
        else
            fetch_pairs<std::uint16_t>(*plan_.volume, offsets_, from, to, s);
        kernels_.interpolate(plan_, from, to, s);
        kernels_.classify(plan_, steps, s);
        if (plan_.lit) light(steps);
        kernels_.composite(plan_, w_.rays, steps, s, w_.pixels);
    }

    // Locations of the batch at k, and its voxels on their way from memory while this batch computes.
    void look_ahead(int k) {
        located_ = -1;
        if (k >= w_.setup.most_slabs) return;
        Samples& next = w_.samples[1 - current_];
        next.first = k;
        kernels_.locate(plan_, w_.rays, plan_.needs_back ? 1 : 0, samples_for(k), next);
        if (plan_.volume->type == ScalarType::u8)
            prefetch_pairs<std::uint8_t>(*plan_.volume, offsets_, plan_.needs_back ? 1 : 0, samples_for(k),
                                         next);
        else
            prefetch_pairs<std::uint16_t>(*plan_.volume, offsets_, plan_.needs_back ? 1 : 0, samples_for(k),
                                          next);
        located_ = k;
    }

    // One batch's last row becomes the next one's first.
    static void carry(const Samples& from, Samples& to) {
        const auto move = [](const Batch& a, Batch& b) {
            std::memmove(b.v, a.v + kSteps * kRays, sizeof(Word) * kRays);
        };
        move(from.input, to.input), move(from.length, to.length);
        for (int a = 0; a < 3; ++a) move(from.cell[a], to.cell[a]), move(from.weight[a], to.weight[a]);
    }

    // Gathers what is visible and not yet hidden, lights it, and puts it back.
    void light(int steps) {
        Samples& s = here();
        LitSamples& lit = w_.lit;
        int count = 0;
        for (int at = 0; at < steps * kRays; ++at) {
            const int r = at % kRays;
            if (s.alpha.v[at] <= 0 || !w_.pixels.active.v[r] || s.first + at / kRays >= w_.rays.slabs.v[r])
                continue;
            gather_lit(at, r, count);
            lit.from[static_cast<std::size_t>(count++)] = static_cast<std::int16_t>(at);
        }
        if (count == 0) return;
        kernels_.shade(plan_, count, lit);
        for (int i = 0; i < count; ++i)
            for (int c = 0; c < 3; ++c)
                s.color[c].v[lit.from[static_cast<std::size_t>(i)]] = lit.color[c].v[i];
    }

    void gather_lit(int at, int ray, int i) {
        const Samples& s = here();
        LitSamples& lit = w_.lit;
        const bool corners_only = plan_.gradient.rule == GradientRule::analytic;
        for (int end = 0; end < (plan_.needs_back ? 2 : 1); ++end) {
            const int here = at + end * kRays;
            const Index3 cell(s.cell[0].v[here], s.cell[1].v[here], s.cell[2].v[here]);
            for (int a = 0; a < 3; ++a) lit.weight[end][a].v[i] = s.weight[a].v[here];
            if (plan_.volume->type == ScalarType::u8)
                fetch_neighbourhood_at<std::uint8_t>(*plan_.volume, cell, corners_only, i, lit.voxel[end]);
            else
                fetch_neighbourhood_at<std::uint16_t>(*plan_.volume, cell, corners_only, i, lit.voxel[end]);
        }
        for (int c = 0; c < 3; ++c) lit.color[c].v[i] = s.color[c].v[at];
        lit.alpha.v[i] = s.alpha.v[at];
        if (plan_.shading.half_per_ray || plan_.shading.model == ShadingModel::phong)
            for (int a = 0; a < 3; ++a) {
                lit.view[a].v[i] = w_.rays.view[a].v[ray];
                for (int l = 0; l < plan_.shading.lights; ++l)
                    lit.half[l][a].v[i] = w_.rays.half[l][a].v[ray];
            }
    }

    const Plan& plan_;
    const StageKernels& kernels_;
    const EmptySpace* empty_;
    PairOffsets offsets_;
    Workspace& w_;
    bool backwards_;
    int current_ = 0;
    int located_ = -1;  // first slab of the batch whose locations stand in the other buffer
};

}  // namespace

void LaneRenderer::render_tile(int left, int top, int right, int bottom, Image& image,
                               TileStatistics& statistics) const {
    const auto workspace = std::make_unique<Workspace>();
    Workspace& w = *workspace;
    PacketLoop loop(plan_, kernels_, empty_ ? &*empty_ : nullptr, w);
    for (int y = top; y < bottom; y += kSide)
        for (int x = left; x < right; x += kSide) {
            w.setup = {};
            set_up_packet(plan_, x, y, right, bottom, w.setup, w.rays);
            loop.run();
            for (int r = 0; r < kRays; ++r) {
                const PixelPlace& place = w.setup.place[r];
                if (!place.inside) continue;
                Pixel<std::int64_t> pixel;
                for (std::size_t c = 0; c < 3; ++c) pixel.gathered.color[c] = w.pixels.color[c].v[r];
                pixel.gathered.transparency = w.pixels.transparency.v[r];
                pixel.samples = w.pixels.samples.v[r];
                store_pixel(plan_, pixel, place.column, place.row, image);
                statistics.samples += pixel.samples;
            }
            statistics.rays += w.setup.rays;
        }
}

}  // namespace squint::lanes
