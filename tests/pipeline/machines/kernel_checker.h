// Every kernel of the fast path alone, on random inputs, beside the model's own lines: the stage's functions over
// 64-bit integers.  In the manner of FFmpeg's checkasm: the same inputs are checked by a test and timed by
// bench_kernels.
#pragma once

#include "pipeline/slab-inl.h"
#include "pipeline/stages/ray_setup-inl.h"
#include "tests/pipeline/machines/kernel_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <tuple>
#include <variant>
#include <vector>

namespace squint::lanes {

/// One kernel of one case: draw() new inputs, run() it on them, and find where it differs from the model.
struct KernelCheck {
    std::string kernel;
    std::function<void()> draw, run;
    std::function<std::string()> difference;  // empty where there is none
    std::function<int()> samples;             // that one run() works on
};

/// All kernels of a case on one SIMD target.
class KernelChecker : KernelInputs {
  public:
    KernelChecker(const KernelCase& c, std::int64_t target, unsigned seed) : KernelInputs(c, target, seed) {}

    std::vector<KernelCheck> checks() {
        using namespace squint::HWY_NAMESPACE;
        std::vector<KernelCheck> all;
        const int back = plan_.needs_back ? 1 : 0, rows = kSteps + back;
        const auto add = [&](const char* kernel, auto draw, auto run, auto difference) {
            all.push_back({kernel, draw, run, difference, [] { return kSteps * kRays; }});
        };
        const auto add_lit = [&](const char* kernel, auto draw, auto run, auto difference) {
            all.push_back({kernel, draw, run, difference, [this] { return count_; }});
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
            add_lit(
                "add_ends", [this] { draw_ends(); },
                [this] { kernels_.add_ends(plan_, count_, ends_, *lit_); },
                [this] { return sum_difference(); });
        }
        if (looks_into_slabs(plan_.inside.rule) && plan_.inside.rule != InsideRule::adaptive) {
            add_lit(
                "find_light", [this] { draw_whole_slabs(); },
                [this] { kernels_.find_light(plan_, count_, *lit_, *light_); },
                [this] { return light_difference(); });
            add_lit(
                "lerp_ends", [this] { draw_ends(), draw_ways(); },
                [this] { kernels_.lerp_ends(plan_, count_, ends_, lit_->from, *light_, *lit_, &*far_); },
                [this] { return lerp_difference(); });
            if (lights_fade(plan_.inside.rule))
                add_lit(
                    "shade_fading", [this] { draw_lit(), draw_two_normals(), draw_parts(); },
                    [this] { kernels_.shade_fading(plan_, count_, *light_, *far_, *lit_); },
                    [this] { return fading_difference(); });
            else
                add_lit(
                    "join_places", [this] { draw_lit(), draw_two_normals(), draw_ways(); },
                    [this] { kernels_.join_places(plan_, count_, *light_, *far_, *lit_); },
                    [this] { return join_difference(); });
        }
        add_lit(
            "fetch_lit, find_gradients and find_normals", [this] { draw_lit(); },
            [this] {
                kernels_.fetch_lit(plan_, c_.source, count_, *lit_);
                kernels_.find_gradients(plan_, count_, *lit_);
                kernels_.find_normals(plan_, count_, *lit_);
            },
            [this] { return normal_difference(); });
        add_lit(
            "shade", [this] { draw_lit(), draw_lit_slabs(); },
            [this] { kernels_.shade(plan_, count_, *lit_); }, [this] { return shade_difference(); });
        return all;
    }

  private:
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
};

}  // namespace squint::lanes
