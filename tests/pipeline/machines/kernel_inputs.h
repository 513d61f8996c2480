// Random inputs that keep a kernel's promises: cells inside the volume, weights up to one, opacities and colours from 0
// to 1, rays that go on only where they have not met their end.
#pragma once

#include "pipeline/slab-inl.h"
#include "tests/pipeline/machines/kernel_cases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>

namespace squint::lanes {

/// The kernels of a case on one SIMD target, and what they read and write.
class KernelInputs {
  protected:
    using Integer = std::int64_t;
    using L3 = std::array<Integer, 3>;

    KernelInputs(const KernelCase& c, std::int64_t target, unsigned seed)
        : c_(c), plan_(c.plan), random_(seed), kernels_(kernels_for(c.plan, c.ways, c.source, target)) {
        *lit_ = {}, *far_ = {}, *light_ = {}, *samples_ = {};
    }

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
