// Every kernel of the fast path alone, on random inputs, beside the model's own lines: the stage's functions over
// 64-bit integers.  In the manner of FFmpeg's checkasm: the same inputs are checked by a test and timed by
// bench_kernels.
#pragma once

#include "core/error.h"
#include "core/volume_source.h"
#include "pipeline/machines/lanes/cell_blocks.h"
#include "pipeline/machines/lanes/kernels.h"
#include "pipeline/slab-inl.h"
#include "pipeline/stages/ray_setup-inl.h"
#include "scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <tuple>
#include <variant>
#include <vector>

namespace squint::lanes {

/// A plan, its words, and where its voxels are fetched from.
struct KernelCase {
    std::string name;
    Plan plan;
    StageWays ways;
    std::shared_ptr<CellBlocks> cells;  // none: the volume as it lies
    VoxelSource source;
    std::shared_ptr<LitCells> lit = nullptr;
};

/// One kernel of one case: draw() new inputs, run() it on them, and find where it differs from the model.
struct KernelCheck {
    std::string kernel;
    std::function<void()> draw, run;
    std::function<std::string()> difference;  // empty where there is none
    std::function<int()> samples;             // that one run() works on
};

inline KernelCase kernel_case(const std::string& name, std::vector<std::string> settings, bool in_cells) {
    for (const char* common :
         {"classification.method=pc", "volume.dims=[26, 23, 21]", "image.width=24", "image.height=24"})
        settings.insert(settings.begin(), common);
    const Scene scene = scene_with(built_in_scene(), settings);
    const auto volume = std::make_shared<const Volume>(load_volume(volume_source(scene)));
    KernelCase c{name + (in_cells ? ", cells" : ", linear"), make_plan(scene, volume), {}, nullptr, {}};
    c.ways = ways_of(c.plan);
    c.source.volume = c.plan.volume.get();
    if (in_cells) {
        c.cells = cell_blocks(*volume, CellBlocks::bytes_of_all(*volume), true);
        c.cells->build([](std::int64_t block) { return block % 3 != 0; });  // some cells are put together
        c.source.cells = c.cells->data(), c.source.blocks = c.cells->blocks();
        c.source.slots = c.cells->slots();
        c.source.near = c.cells->near();
    }
    return c;
}

/// The same with lit cells in half of the volume.
inline KernelCase with_lit_cells(KernelCase c) {
    c.name += " and lit cells";
    const Volume& volume = *c.plan.volume;
    constexpr auto kContent = CellContent::differences;
    BlockBox half = all_blocks_of(volume);
    half.blocks.z = (half.blocks.z + 1) / 2;
    c.lit = std::make_shared<LitCells>(
        half, nullptr,
        std::make_shared<CellBlocks>(volume, CellBlocks::bytes_of_all(volume, kContent), kContent));
    c.lit->build();
    c.source.lit = c.lit.get();
    return c;
}

inline std::vector<KernelCase> kernel_cases() {
    const std::string lit = "shading.model=blinn_phong", unlit = "shading.model=none";
    const auto method = [](const char* name) { return std::string("classification.method=") + name; };
    std::vector<KernelCase> cases;
    for (const bool in_cells : {true, false}) {
        const auto add = [&](const std::string& name, std::vector<std::string> settings) {
            cases.push_back(kernel_case(name, std::move(settings), in_cells));
        };
        add("default", {unlit});
        add("default, from 0 to 1 at once",
            {unlit,
             "transfer_function.points=[[0, 0, 0, 1, 0.1], [900, 0, 0, 1, 0.1], [901, 1, 0, 0, 0.1]]"});
        for (const auto& [name, more] :
             {std::pair{"default, lit", std::vector<std::string>{}},
              {"default, lit, 8 bits, uneven voxels", {"volume.bits=8", "volume.spacing=[1, 0.7, 1.6]"}}}) {
            std::vector<std::string> settings{lit};
            settings.insert(settings.end(), more.begin(), more.end());
            add(name, settings);
            cases.push_back(with_lit_cells(kernel_case(name, settings, in_cells)));
        }
        add("16 bits, sobel, perspective",
            {lit, "volume.bits=16", "shading.gradient=sobel", "camera.projection=perspective"});
        add("pips, analytic, phong, two-sided", {lit, method("pips"), "shading.gradient=analytic",
                                                 "shading.model=phong", "shading.two_sided=true"});
        for (const char* rule : {"linear", "nlpi", "centroid", "two_point"})
            for (const char* name : {"pi2d", "pips", "leg"})
                add(fmt::format("{}, {}", name, rule),
                    {lit, method(name), "classification.table_size=64", std::string("shading.inside=") + rule,
                     "classification.order=" + std::string(name == std::string_view("leg") ? "3" : "1")});
        add("pi2d, back to front",
            {unlit, method("pi2d"), "classification.table_size=64", "compositing.form=back_to_front"});
        for (const char* name : {"pc", "pips", "pi2d", "pi1d"}) {
            add(std::string(name) + ", unlit", {unlit, method(name), "classification.table_size=64"});
            add(std::string(name) + ", fine steps",
                {unlit, method(name), "classification.table_size=64", "sampling.step=0.2"});
        }
        add("pi1d, opacities", {lit, method("pi1d"), "compositing.form=alpha", "sampling.step=0.6"});
        add("squeeze", {unlit, method("pc_mid"), "precision.preset=squeeze"});
        add("eight bits", {lit, "precision.preset=eight_bit"});
        add("wide", {lit, "precision.preset=wide"});
    }
    return cases;
}

/// All kernels of a case on one SIMD target.
class KernelChecker {
  public:
    using Integer = std::int64_t;

    KernelChecker(const KernelCase& c, std::int64_t target, unsigned seed)
        : c_(c), plan_(c.plan), random_(seed), kernels_(kernels_for(c.plan, c.ways, c.source, target)) {
        *lit_ = {}, *far_ = {}, *light_ = {}, *samples_ = {};
    }

    std::vector<KernelCheck> checks() {
        using namespace squint::HWY_NAMESPACE;
        std::vector<KernelCheck> all;
        const int back = plan_.needs_back ? 1 : 0, rows = kSteps + back;
        const auto add = [&](const char* kernel, auto draw, auto run, auto difference) {
            const bool lit = std::string_view(kernel) == "shade" ||
                             std::string_view(kernel) == "fetch_lit, find_gradients and find_normals";
            all.push_back(
                {kernel, draw, run, difference, [this, lit] { return lit ? count_ : kSteps * kRays; }});
        };
        add(
            "set_up", [this] { draw_place(); }, [this] { kernels_.set_up(plan_, place_, rays_); },
            [this] { return set_up_difference(); });
        add(
            "locate", [this] { draw_inputs(), draw_rays(); },
            [this, rows] { kernels_.locate(plan_, rays_, 0, rows, *samples_); },
            [this, rows] { return locate_difference(rows); });
        add(
            "prefetch and fetch", [this] { draw_cells(); },
            [this, rows] {
                kernels_.prefetch(c_.source, 0, rows, *samples_);
                kernels_.fetch(c_.source, 0, rows, *samples_);
            },
            [this, rows] { return fetch_difference(rows); });
        add(
            "interpolate", [this] { draw_corners(), draw_weights(samples_->weight, kBatch); },
            [this, rows] { kernels_.interpolate(plan_, 0, rows, *samples_); },
            [this, rows] { return interpolate_difference(rows, true); });
        add(
            "interpolate_scalars", [this] { draw_corners(), draw_weights(samples_->weight, kBatch); },
            [this, rows] { kernels_.interpolate_scalars(plan_, 0, rows, *samples_); },
            [this, rows] { return interpolate_difference(rows, false); });
        if (kernels_.locate_address)
            add(
                "locate+address", [this] { draw_inputs(), draw_cells(), draw_rays(); },
                [this, rows] { kernels_.locate_address(plan_, c_.source, rays_, 0, rows, *samples_); },
                [this, rows] { return locate_address_difference(rows); });
        if (kernels_.fetch_interpolate)
            add(
                "fetch+interpolate",
                [this, rows] { draw_cells(), kernels_.prefetch(c_.source, 0, rows, *samples_); },
                [this, rows] {
                    kernels_.fetch_interpolate(plan_, c_.source, 0, rows, *samples_, 0, rows, *samples_);
                },
                [this, rows] { return sample_difference(rows); });
        add(
            "classify", [this] { draw_inputs(); }, [this] { kernels_.classify(plan_, kSteps, *samples_); },
            [this] { return classify_difference(); });
        add(
            "composite", [this] { draw_rays(), draw_slabs(), draw_pixels(); },
            [this] { kernels_.composite(plan_, rays_, kSteps, *samples_, pixels_, between_); },
            [this] { return composite_difference(); });
        if (kernels_.classify_composite)
            add(
                "classify+composite", [this] { draw_rays(), draw_inputs(), draw_pixels(); },
                [this] {
                    kernels_.classify_composite(plan_, kernels_.unit_rows.data(), rays_, kSteps, *samples_,
                                                pixels_);
                },
                [this] {
                    classify_as_the_model();
                    return composite_difference();
                });
        if (plan_.compositing.form != CompositingForm::back_to_front)
            add(
                "hide", [this] { draw_rays(), draw_slabs(), draw_pixels(), before_ = *samples_; },
                [this] { kernels_.hide(plan_, rays_, pixels_, kSteps, *samples_); },
                [this] { return hide_difference(); });
        if (!plan_.lit) return all;
        add(
            "gather_lit", [this] { draw_rays(), draw_slabs(), draw_cells(); },
            [this] { count_ = kernels_.gather_lit(plan_, rays_, kSteps, *samples_, *lit_); },
            [this] { return gather_difference(); });
        if (plan_.shares_ends()) {
            add(
                "gather_ends", [this] { draw_rays(), draw_slabs(), draw_cells(), draw_known(); },
                [this] {
                    ends_.known = known_before_;
                    count_ = kernels_.gather_ends(plan_, rays_, kSteps, *samples_, ends_.known, *lit_);
                },
                [this] { return ends_difference(); });
            add(
                "add_ends", [this] { draw_ends(); },
                [this] { kernels_.add_ends(plan_, count_, ends_, *lit_); },
                [this] { return sum_difference(); });
        }
        if (looks_into_slabs(plan_.inside.rule) && plan_.inside.rule != InsideRule::adaptive) {
            add(
                "find_light", [this] { draw_whole_slabs(); },
                [this] { kernels_.find_light(plan_, count_, *lit_, *light_); },
                [this] { return light_difference(); });
            add(
                "lerp_ends", [this] { draw_ends(), draw_ways(); },
                [this] { kernels_.lerp_ends(plan_, count_, ends_, lit_->from, *light_, *lit_, &*far_); },
                [this] { return lerp_difference(); });
            if (lights_fade(plan_.inside.rule))
                add(
                    "shade_fading", [this] { draw_lit(), draw_two_normals(), draw_parts(); },
                    [this] { kernels_.shade_fading(plan_, count_, *light_, *far_, *lit_); },
                    [this] { return fading_difference(); });
            else
                add(
                    "join_places", [this] { draw_lit(), draw_two_normals(), draw_ways(); },
                    [this] { kernels_.join_places(plan_, count_, *light_, *far_, *lit_); },
                    [this] { return join_difference(); });
        }
        add(
            "fetch_lit, find_gradients and find_normals", [this] { draw_lit(); },
            [this] {
                kernels_.fetch_lit(plan_, c_.source, count_, *lit_);
                kernels_.find_gradients(plan_, count_, *lit_);
                kernels_.find_normals(plan_, count_, *lit_);
            },
            [this] { return normal_difference(); });
        add(
            "shade", [this] { draw_lit(), draw_lit_slabs(); },
            [this] { kernels_.shade(plan_, count_, *lit_); }, [this] { return shade_difference(); });
        return all;
    }

  private:
    using L3 = std::array<Integer, 3>;

    Integer below(Integer end) {
        return static_cast<Integer>(random_() % static_cast<std::uint64_t>(std::max<Integer>(end, 1)));
    }
    /// Within [0, most], often at an end.
    Integer up_to(Integer most) {
        const Integer kind = below(8);
        return kind == 0 ? 0 : kind == 1 ? most : below(most + 1);
    }
    static Integer one(int fraction) { return Integer{1} << fraction; }
    Integer full_length() const { return one(plan_.location.length_fraction); }
    static std::string differs(const char* what, int i, Integer expected, Integer found) {
        return expected == found
                   ? std::string()
                   : fmt::format("{} at {}: the model has {}, found {}", what, i, expected, found);
    }
    template <class F>
    static std::string first_of(int count, F&& at) {
        for (int i = 0; i < count; ++i)
            if (std::string text = at(i); !text.empty()) return text;
        return {};
    }

    // ------------------------------------------------------------------------------------ inputs

    void draw_place() {
        const int left = static_cast<int>(below(24)), top = static_cast<int>(below(24));
        place_ = {left, top, 24, 24};
    }
    void draw_rays() {
        do {
            draw_place();
            kernels_.set_up(plan_, place_, rays_);
        } while (rays_.most_slabs == 0);
        samples_->first = static_cast<Word>(below(rays_.most_slabs));
    }
    void draw_cells() {
        for (int i = 0; i < kBatch; ++i)
            for (std::size_t a = 0; a < 3; ++a)
                samples_->cell[a].v[i] = static_cast<Word>(up_to(plan_.location.last_cell[a]));
        draw_weights(samples_->weight, kBatch);
    }
    void draw_weights(Batch (&weight)[3], int count) {
        for (Batch& w : weight)
            for (int i = 0; i < count; ++i)
                w.v[i] = static_cast<Word>(up_to(one(plan_.interpolation.weight_bits)));
    }
    void draw_corners() {
        const Integer largest = plan_.volume->largest;
        for (Batch& pair : samples_->pair)
            for (Word& v : pair.v) v = static_cast<Word>(up_to(largest) | up_to(largest) << 16);
    }
    void draw_inputs() {
        for (int i = 0; i < kBatch; ++i) {
            samples_->input.v[i] = static_cast<Word>(up_to(plan_.input.highest));
            samples_->length.v[i] = static_cast<Word>(below(3) == 0 ? up_to(full_length()) : full_length());
        }
        samples_->all_full = false;
    }
    // Colours and opacities of slabs as classification leaves them: within 0 to 1, premultiplied ones no greater
    // than their opacity.
    void draw_slab(Word& alpha, Word* color0, Word* color1, Word* color2) {
        const CompositingStage& s = plan_.compositing;
        const Integer a = below(4) == 0 ? 0 : up_to(one(s.alpha_fraction));
        alpha = static_cast<Word>(a);
        const int finer = s.color_fraction - s.alpha_fraction;
        const Integer most = !s.premultiplied ? one(s.color_fraction) : finer >= 0 ? a << finer : a >> -finer;
        for (Word* color : {color0, color1, color2}) *color = static_cast<Word>(up_to(most));
    }
    void draw_slabs() {
        for (int i = 0; i < kBatch; ++i)
            draw_slab(samples_->alpha.v[i], &samples_->color[0].v[i], &samples_->color[1].v[i],
                      &samples_->color[2].v[i]);
    }
    void draw_pixels() {
        const CompositingStage& s = plan_.compositing;
        for (int r = 0; r < kRays; ++r) {
            const Integer t = up_to(s.unit());
            pixels_.transparency.v[r] = static_cast<Word>(t);
            const Integer gathered = s.form == CompositingForm::alpha ? t : s.unit() - t;
            for (Row& color : pixels_.color)
                color.v[r] = static_cast<Word>(std::ldexp(static_cast<double>(up_to(gathered)),
                                                          s.sum_fraction - s.transparency_fraction));
            // A ray that goes on has not met its end yet.
            const bool goes_on = s.form == CompositingForm::back_to_front ||
                                 HWY_NAMESPACE::goes_on(s, Accumulated<Integer>{{0, 0, 0}, t});
            pixels_.active.v[r] = goes_on && rays_.slabs.v[r] > samples_->first && below(4) > 0;
            pixels_.samples.v[r] = static_cast<Word>(below(1000));
        }
        pixels_before_ = pixels_;
    }
    void draw_lit() {
        draw_rays();
        count_ = 1 + static_cast<int>(below(kSteps * kRays));
        for (int i = 0; i < kBatch; ++i)
            for (std::size_t a = 0; a < 3; ++a)
                lit_->cell[a].v[i] = static_cast<Word>(up_to(plan_.location.last_cell[a]));
        draw_weights(lit_->weight, kBatch);
    }
    void draw_known() {
        for (Word& known : known_before_.v) known = static_cast<Word>(below(2));
    }
    void draw_ends() {
        count_ = 1 + static_cast<int>(below(kSteps * kRays));
        const Integer largest = std::min<Integer>(plan_.specs[Wire::gradient].format.largest(), 1 << 29);
        for (int i = 0; i < kBatch; ++i) {
            lit_->from.v[i] = static_cast<Word>(below(kSteps * kRays));
            for (Batch& component : ends_.component)
                component.v[i] = static_cast<Word>(up_to(2 * largest) - largest);
        }
    }
    void draw_lit_slabs() {
        const double length = std::ldexp(1.0, plan_.shading.normal_fraction);
        const auto unit_vector = [&](Batch(&to)[3], int i, double size) {
            Vec3 v(std::normal_distribution<>()(random_), std::normal_distribution<>()(random_),
                   std::normal_distribution<>()(random_));
            v *= size / std::max(v.length(), 1e-9);
            for (int a = 0; a < 3; ++a) to[a].v[i] = static_cast<Word>(std::floor(v[a] + 0.5));
        };
        const double light = std::ldexp(1.0, plan_.shading.light_fraction);
        for (int i = 0; i < kBatch; ++i) {
            unit_vector(lit_->normal, i, below(8) == 0 ? 0 : length);
            unit_vector(lit_->view, i, light);
            for (auto& half : lit_->half) unit_vector(half, i, light);
            draw_slab(lit_->alpha.v[i], &lit_->color[0].v[i], &lit_->color[1].v[i], &lit_->color[2].v[i]);
        }
        *lit_before_ = *lit_;
    }

    // Visible slabs as they were classified.
    void draw_whole_slabs() {
        draw_inputs();
        kernels_.classify(plan_, kSteps, *samples_);
        count_ = 0;
        for (int i = 0; i < kSteps * kRays; ++i) {
            if (samples_->alpha.v[i] == 0) continue;
            for (int end = 0; end < 2; ++end) lit_->input[end].v[count_] = samples_->input.v[i + end * kRays];
            lit_->length.v[count_] = samples_->length.v[i], lit_->alpha.v[count_] = samples_->alpha.v[i];
            for (int c = 0; c < 3; ++c) lit_->color[c].v[count_] = samples_->color[c].v[i];
            ++count_;
        }
    }
    void draw_ways() {
        for (int i = 0; i < kBatch; ++i) {
            for (lanes::Batch& way : light_->way) way.v[i] = static_cast<Word>(up_to(one(kWayBits)));
            light_->share.v[i] = static_cast<Word>(up_to(one(kShareBits)));
        }
    }
    void draw_two_normals() {
        draw_lit_slabs();
        *far_ = *lit_;
        draw_lit_slabs();
    }
    // Parts that sum to a slab at most.
    void draw_parts() {
        const Integer most = one(plan_.shading.color_fraction);
        for (int i = 0; i < kBatch; ++i)
            for (int c = 0; c < 4; ++c) {
                Integer left = up_to(most);
                for (auto& part : light_->part) {
                    const Integer here = up_to(left);
                    part[c].v[i] = static_cast<Word>(here), left -= here;
                }
            }
    }

    // ------------------------------------------------------------------------------- the model's lines

    static L3 three(const Batch (&from)[3], int i) { return {from[0].v[i], from[1].v[i], from[2].v[i]}; }

    std::string set_up_difference() {
        return first_of(kRays, [&](int r) -> std::string {
            using namespace squint::HWY_NAMESPACE;
            const RaySetup ray = plan_.set_up(place_.column(r), place_.row(r));
            const int slabs = place_.inside(r) ? ray.slabs : 0;
            if (auto text = differs("slabs", r, slabs, rays_.slabs.v[r]); !text.empty()) return text;
            if (slabs == 0) return {};
            const auto words = ray_words<Integer>(plan_, ray);
            for (std::size_t a = 0; a < 3; ++a) {
                if (auto text = differs("first", r, words.first[a], rays_.first[a].v[r]); !text.empty())
                    return text;
                if (auto text = differs("last", r, words.last[a], rays_.last[a].v[r]); !text.empty())
                    return text;
                if (auto text = differs("step", r, words.step[a], rays_.step[a].v[r]); !text.empty())
                    return text;
            }
            if (auto text = differs("last_index", r, words.last_index, rays_.last_index.v[r]); !text.empty())
                return text;
            return differs("last_length", r, words.last_length, rays_.last_length.v[r]);
        });
    }
    std::string locate_difference(int rows) {
        using namespace squint::HWY_NAMESPACE;
        return first_of(rows * kRays, [&](int i) -> std::string {
            const int r = i % kRays;
            const Integer k = samples_->first + i / kRays, slabs = rays_.slabs.v[r];
            if (k >= slabs + (plan_.needs_back ? 1 : 0)) return {};  // behind the ray's end lies anything
            const auto words = ray_words<Integer>(plan_, plan_.set_up(place_.column(r), place_.row(r)));
            L3 location;
            for (int a = 0; a < 3; ++a)
                location[static_cast<std::size_t>(a)] = HWY_NAMESPACE::locate(plan_.location, words, k, a);
            const auto position = cell_position(plan_.location, location);
            for (std::size_t a = 0; a < 3; ++a) {
                if (auto text = differs("cell", i, position.cell[a], samples_->cell[a].v[i]); !text.empty())
                    return text;
                if (auto text = differs("weight", i, position.weight[a], samples_->weight[a].v[i]);
                    !text.empty())
                    return text;
            }
            return differs("length", i, k == slabs - 1 ? words.last_length : full_length(),
                           samples_->length.v[i]);
        });
    }
    std::string fetch_difference(int rows) {
        using namespace squint::HWY_NAMESPACE;
        const FromVolume voxels{*plan_.volume};
        return first_of(rows * kRays, [&](int i) -> std::string {
            const Cell<Integer> cell = voxels.cell(three(samples_->cell, i));
            return first_of(8, [&](int corner) {
                const auto pair = static_cast<std::uint32_t>(samples_->pair[corner / 2].v[i]);
                return differs("corner", i, cell.at(corner), corner % 2 ? pair >> 16 : pair & 0xffff);
            });
        });
    }
    std::string locate_address_difference(int rows) {
        before_ = *samples_;
        if (!keeps_cells(plan_)) {
            kernels_.locate(plan_, rays_, 0, rows, *samples_);
            for (int i = 0; i < rows * kRays; ++i)
                for (std::size_t a = 0; a < 3; ++a) {
                    if (before_.place.v[i] >= 0) before_.cell[a].v[i] = samples_->cell[a].v[i];
                }
            std::swap(before_, *samples_);
        }
        if (auto text = locate_difference(rows); !text.empty()) return text;
        before_ = *samples_;
        kernels_.prefetch(c_.source, 0, rows, *samples_);
        const auto place = [](const Samples& s, int i) {
            return std::max(s.place.v[i], -1);
        };  // none is none
        return first_of(rows * kRays,
                        [&](int i) { return differs("place", i, place(*samples_, i), place(before_, i)); });
    }
    std::string sample_difference(int rows) {
        using namespace squint::HWY_NAMESPACE;
        const FromVolume voxels{*plan_.volume};
        return first_of(rows * kRays, [&](int i) {
            const Integer sample = interpolate(plan_.interpolation, voxels.cell(three(samples_->cell, i)),
                                               three(samples_->weight, i));
            return differs("input", i, classification_input(plan_.input, sample), samples_->input.v[i]);
        });
    }
    std::string interpolate_difference(int rows, bool to_input) {
        using namespace squint::HWY_NAMESPACE;
        return first_of(rows * kRays, [&](int i) {
            Cell<Integer> cell;
            for (int corner = 0; corner < 8; ++corner) {
                const auto pair = static_cast<std::uint32_t>(samples_->pair[corner / 2].v[i]);
                cell.corner[static_cast<std::size_t>(corner)] = corner % 2 ? pair >> 16 : pair & 0xffff;
            }
            const Integer sample = interpolate(plan_.interpolation, cell, three(samples_->weight, i));
            return differs("sample", i, to_input ? classification_input(plan_.input, sample) : sample,
                           samples_->input.v[i]);
        });
    }
    std::string classify_difference() {
        return std::visit(
            [&]<class M>(const M& method) {
                using namespace squint::HWY_NAMESPACE;
                return first_of(kSteps * kRays, [&](int i) -> std::string {
                    const Integer front = samples_->input.v[i],
                                  behind = plan_.needs_back ? samples_->input.v[i + kRays] : front;
                    const Slab<Integer> slab =
                        HWY_NAMESPACE::classify(method, front, behind, Integer{samples_->length.v[i]});
                    if (auto text = differs("alpha", i, slab.alpha, samples_->alpha.v[i]); !text.empty())
                        return text + fmt::format(" (inputs {} and {}, length {})", front, behind,
                                                  samples_->length.v[i]);
                    if (slab.alpha == 0) return {};  // no colour is seen
                    return first_of(3, [&](int c) {
                        return differs("color", i, slab.color[static_cast<std::size_t>(c)],
                                       samples_->color[c].v[i]);
                    });
                });
            },
            plan_.method);
    }
    void classify_as_the_model() {
        std::visit(
            [&](const auto& method) {
                using namespace squint::HWY_NAMESPACE;
                for (int i = 0; i < kSteps * kRays; ++i) {
                    const Integer input = samples_->input.v[i];
                    const Slab<Integer> slab =
                        HWY_NAMESPACE::classify(method, input, input, Integer{samples_->length.v[i]});
                    samples_->alpha.v[i] = static_cast<Word>(slab.alpha);
                    for (std::size_t c = 0; c < 3; ++c)
                        samples_->color[c].v[i] = static_cast<Word>(slab.color[c]);
                }
            },
            plan_.method);
    }
    std::string composite_difference() {
        using namespace squint::HWY_NAMESPACE;
        const CompositingStage& s = plan_.compositing;
        const bool backwards = s.form == CompositingForm::back_to_front;
        return first_of(kRays, [&](int r) -> std::string {
            const PixelPacket& from = pixels_before_;
            Accumulated<Integer> pixel{{from.color[0].v[r], from.color[1].v[r], from.color[2].v[r]},
                                       from.transparency.v[r]};
            Integer count = from.samples.v[r];
            bool active = from.active.v[r] != 0;
            for (int step = 0; step < kSteps; ++step) {
                const int at = (backwards ? kSteps - 1 - step : step) * kRays + r;
                const bool here = active && samples_->first + at / kRays < rays_.slabs.v[r];
                if (here) {
                    composite(s, pixel, three(samples_->color, at), Integer{samples_->alpha.v[at]});
                    ++count;
                }
                if (!backwards) active = here && goes_on(s, pixel);
            }
            for (std::size_t c = 0; c < 3; ++c)
                if (auto text = differs("color", r, pixel.color[c], pixels_.color[c].v[r]); !text.empty())
                    return text;
            if (auto text = differs("transparency", r, pixel.transparency, pixels_.transparency.v[r]);
                !text.empty())
                return text;
            if (auto text = differs("active", r, active, pixels_.active.v[r]); !text.empty()) return text;
            return differs("samples", r, count, pixels_.samples.v[r]);
        });
    }
    std::string hide_difference() {
        using namespace squint::HWY_NAMESPACE;
        return first_of(kRays, [&](int r) -> std::string {
            Accumulated<Integer> pixel{{0, 0, 0}, pixels_.transparency.v[r]};
            bool active = pixels_.active.v[r] != 0;
            for (int step = 0; step < kSteps; ++step) {
                const int at = step * kRays + r;
                active = active && samples_->first + step < rays_.slabs.v[r];
                const Integer alpha = active ? before_.alpha.v[at] : 0;
                if (auto text = differs("alpha", at, alpha, samples_->alpha.v[at]); !text.empty())
                    return text;
                if (!active) continue;
                composite(plan_.compositing, pixel, L3{0, 0, 0}, alpha);
                active = goes_on(plan_.compositing, pixel);
            }
            return {};
        });
    }
    std::string gather_difference() {
        int count = 0;
        for (int i = 0; i < kSteps * kRays; ++i) {
            if (samples_->alpha.v[i] <= 0 || samples_->first + i / kRays >= rays_.slabs.v[i % kRays])
                continue;
            if (count >= count_) break;
            if (auto text = differs("place", count, i, lit_->from.v[count]); !text.empty()) return text;
            if (auto text = differs("alpha", count, samples_->alpha.v[i], lit_->alpha.v[count]);
                !text.empty())
                return text;
            for (int a = 0; a < 3 && !plan_.lights_by_locations() && !plan_.shares_ends(); ++a)
                if (auto text = differs("cell", count, samples_->cell[a].v[i], lit_->cell[a].v[count]);
                    !text.empty())
                    return text;
            ++count;
        }
        return differs("count", 0, count, count_);
    }
    std::string ends_difference() {
        const auto seen = [&](int i) {
            return 0 <= i && i < kSteps * kRays && samples_->alpha.v[i] > 0 &&
                   samples_->first + i / kRays < rays_.slabs.v[i % kRays];
        };
        int count = 0;
        for (int i = 0; i < (kSteps + 1) * kRays; ++i) {
            const bool wanted = (seen(i) || seen(i - kRays)) && !(i < kRays && known_before_.v[i]);
            if (i >= kSteps * kRays)
                if (auto text = differs("known", i, wanted, ends_.known.v[i % kRays]); !text.empty())
                    return text;
            if (!wanted) continue;
            if (count >= count_) break;
            if (auto text = differs("place", count, i, lit_->from.v[count]); !text.empty()) return text;
            for (int a = 0; a < 3 && !plan_.gradient_from_samples(); ++a)
                if (auto text = differs("cell", count, samples_->cell[a].v[i], lit_->cell[a].v[count]);
                    !text.empty())
                    return text;
            ++count;
        }
        return differs("count", 0, count, count_);
    }
    std::string sum_difference() {
        return first_of(count_, [&](int i) {
            return first_of(3, [&](int a) {
                const Word* at = ends_.component[a].v + lit_->from.v[i];
                return differs("sum", i, Integer{at[0]} + at[kRays], lit_->gradient[a].v[i]);
            });
        });
    }
    std::string normal_difference() {
        using namespace squint::HWY_NAMESPACE;
        const FromVolume voxels{*plan_.volume};
        return first_of(count_, [&](int i) -> std::string {
            const auto near = voxels.neighbourhood(three(lit_->cell, i));
            const L3 weight = three(lit_->weight, i);
            L3 gradient;
            for (int a = 0; a < 3; ++a)
                gradient[static_cast<std::size_t>(a)] =
                    to_world(plan_.gradient, voxel_difference(plan_.gradient, near, weight, a), a);
            const L3 normal = normalise(plan_.gradient, gradient);
            return first_of(3, [&](int a) {
                return differs("normal", i, normal[static_cast<std::size_t>(a)], lit_->normal[a].v[i]);
            });
        });
    }
    std::string light_difference() {
        using namespace squint::HWY_NAMESPACE;
        return std::visit(
            [&]<class M>(const M& method) -> std::string {
                if constexpr (requires { method.prefix; }) {
                    return first_of(count_, [&](int i) -> std::string {
                        const Integer front = lit_->input[0].v[i], back = lit_->input[1].v[i],
                                      length = lit_->length.v[i];
                        if (lights_at_places(plan_.inside.rule)) {
                            const auto places =
                                places_of_light(plan_.inside, method.prefix, front, back, length);
                            for (const auto& [what, model, found] :
                                 {std::tuple{"near", places.near, light_->way[0].v[i]},
                                  {"far", places.far, light_->way[1].v[i]},
                                  {"share", places.share, light_->share.v[i]}})
                                if (auto text = differs(what, i, model, found); !text.empty()) return text;
                            return {};
                        }
                        const Slab<Integer> slab{three(lit_->color, i), lit_->alpha.v[i]};
                        FadingLight<Integer> fades{};
                        if constexpr (requires { method.fades; })
                            fades = fading_light(method, front, back, length, slab);
                        else if constexpr (!M::kPremultiplied)
                            fades = fading_light_of_quarters(plan_.inside, method, front, back, length, slab);
                        for (int k = 0; k < fades.count; ++k)
                            for (std::size_t c = 0; c < 4; ++c)
                                if (auto text = differs("part", i, fades.part[static_cast<std::size_t>(k)][c],
                                                        light_->part[k][c].v[i]);
                                    !text.empty())
                                    return text;
                        return differs("end", i, fades.end, light_->way[1].v[i]);
                    });
                }
                return "the method has no prefix sums";
            },
            plan_.method);
    }
    std::string lerp_difference() {
        using namespace squint::HWY_NAMESPACE;
        return first_of(count_, [&](int i) {
            L3 front, back;
            for (std::size_t a = 0; a < 3; ++a) {
                const Word* at = ends_.component[a].v + lit_->from.v[i];
                front[a] = at[0], back[a] = at[kRays];
            }
            return first_of(2, [&](int place) {
                const Word way = light_->way[static_cast<std::size_t>(place)].v[i];
                const L3 model = gradient_up_to(plan_.inside, front, back, Integer{way});
                const lanes::LitSamples& there = place == 0 ? *lit_ : *far_;
                return first_of(3, [&](int a) {
                    return differs("gradient", i, model[static_cast<std::size_t>(a)], there.gradient[a].v[i]);
                });
            });
        });
    }
    std::string fading_difference() {
        using namespace squint::HWY_NAMESPACE;
        return first_of(count_, [&](int i) {
            RayWords<Integer> ray{};
            std::array<L3, 2> normal{three(lit_before_->normal, i), three(far_->normal, i)};
            share_normal(normal[0], normal[1]);
            FadingLight<Integer> fades{plan_.inside.rule == InsideRule::linear ? 2 : 4, {}, 0};
            for (std::size_t k = 0; k < 4; ++k)
                for (std::size_t c = 0; c < 4; ++c) fades.part[k][c] = light_->part[k][c].v[i];
            L3 color;
            shade_fading(plan_.shading, ray, normal, {0, 0}, fades, color);
            return first_of(3, [&](int c) {
                return differs("color", i, color[static_cast<std::size_t>(c)], lit_->color[c].v[i]);
            });
        });
    }
    std::string join_difference() {
        using namespace squint::HWY_NAMESPACE;
        return first_of(count_, [&](int i) {
            const L3 color = light_of_places(plan_.inside, three(lit_before_->color, i),
                                             three(far_->color, i), Integer{light_->share.v[i]});
            return first_of(3, [&](int c) {
                return differs("color", i, color[static_cast<std::size_t>(c)], lit_->color[c].v[i]);
            });
        });
    }
    std::string shade_difference() {
        using namespace squint::HWY_NAMESPACE;
        return first_of(count_, [&](int i) -> std::string {
            RayWords<Integer> ray{};
            ray.view = three(lit_before_->view, i);
            for (std::size_t l = 0; l < kMostHalves; ++l) ray.half[l] = three(lit_before_->half[l], i);
            L3 color = three(lit_before_->color, i);
            HWY_NAMESPACE::shade(plan_.shading, ray, three(lit_before_->normal, i),
                                 Integer{lit_before_->alpha.v[i]}, color);
            return first_of(3, [&](int c) {
                return differs("color", i, color[static_cast<std::size_t>(c)], lit_->color[c].v[i]);
            });
        });
    }

    const KernelCase& c_;
    const Plan& plan_;
    std::mt19937_64 random_;
    StageKernels kernels_;
    PacketPlace place_{};
    RayPacket rays_{};
    PixelPacket pixels_{}, pixels_before_{};
    Batch between_{};
    std::unique_ptr<Samples> samples_ = std::make_unique<Samples>();
    Samples before_{};
    EndGradients ends_{};
    Row known_before_{};
    std::unique_ptr<LitSamples> lit_ = std::make_unique<LitSamples>(),
                                lit_before_ = std::make_unique<LitSamples>(),
                                far_ = std::make_unique<LitSamples>();
    std::unique_ptr<SlabLight> light_ = std::make_unique<SlabLight>();
    int count_ = 0;
};

}  // namespace squint::lanes
