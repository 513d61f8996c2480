// What the default's formats make true of each stage: the facts that kernels of their own are compiled for.
#pragma once

#include "pipeline/stages/compositing.h"
#include "pipeline/stages/facts.h"
#include "pipeline/stages/gradient.h"
#include "pipeline/stages/shading.h"

#include <cstdint>
#include <string>

namespace squint {

/// Voxels' gradient by central differences.
using DefaultGradient =
    Facts<GradientStage, Is<&GradientStage::rule, GradientRule::central>, Is<&GradientStage::fades, false>,
          AtMost<&GradientStage::weight_bits, 14>, Rounds<&GradientStage::to_normal, Rounding::rnd_conv>,
          DropsBits<&GradientStage::to_first>, DropsBits<&GradientStage::to_second>,
          DropsBits<&GradientStage::to_gradient>,
          DropsBitsUnless<&GradientStage::to_scaled, &GradientStage::isotropic>>;

/// Why a plan's gradients are not these, of voxels whose differences fit 16 bits; empty where they are.
inline std::string narrow_gradients_missing(std::int64_t largest_voxel, const GradientStage& stage) {
    if (largest_voxel >= 1 << 15) return "voxels have 16 bits";
    return DefaultGradient::missing(stage);
}

/// A white light on one side of things, orthographic Blinn-Phong by squarings of straight colours; sums that
/// no limit meets but the clamps that follow.
using DefaultShading = Facts<ShadingStage, Is<&ShadingStage::model, ShadingModel::blinn_phong>,
                             Is<&ShadingStage::power, PowerRule::squaring>, Is<&ShadingStage::lights, 1>,
                             Is<&ShadingStage::white, true>, Is<&ShadingStage::two_sided, false>,
                             Is<&ShadingStage::fades, false>, Is<&ShadingStage::half_per_ray, false>,
                             Is<&ShadingStage::premultiplied, false>,
                             DropsBitsBeforeClamp<&ShadingStage::to_dot, &ShadingStage::dot_fraction>,
                             DoesNothing<&ShadingStage::to_power_input>, DropsBits<&ShadingStage::to_power>,
                             DropsBits<&ShadingStage::to_diffuse_sum>,
                             DropsBits<&ShadingStage::to_specular_sum>, DropsBits<&ShadingStage::to_diffuse>,
                             DropsBits<&ShadingStage::to_specular>, DropsBits<&ShadingStage::to_lit>>;

/// Form w, sums that no limit meets.  A transparent slab is the identity.
template <bool kPremultiplied>
using SumsOfW =
    Facts<CompositingStage, Is<&CompositingStage::form, CompositingForm::w>,
          Is<&CompositingStage::premultiplied, kPremultiplied>,
          Same<&CompositingStage::contribution_fraction, &CompositingStage::transparency_fraction>,
          DropsBits<&CompositingStage::to_contribution>, DropsBits<&CompositingStage::to_color>,
          DoesNothing<&CompositingStage::to_color_sum>, DoesNothing<&CompositingStage::to_transparency>>;
using DefaultCompositing = SumsOfW<false>;

/// ... and products of numbers from 0 to 1 of 15 bits, rounded halves to even.
template <bool kPremultiplied>
using UnitSums = typename SumsOfW<kPremultiplied>::template And<
    Is<&CompositingStage::of_units, true>, Is<&CompositingStage::alpha_fraction, 15>,
    Is<&CompositingStage::color_fraction, 15>, Is<&CompositingStage::transparency_fraction, 15>,
    Is<&CompositingStage::contribution_fraction,
       15>,  // a constant: Same alone leaves a shift by the difference
    DropsBits<&CompositingStage::to_contribution, 15>, DropsBits<&CompositingStage::to_color, 15>,
    Rounds<&CompositingStage::to_contribution, Rounding::rnd_conv>,
    Rounds<&CompositingStage::to_color, Rounding::rnd_conv>>;
using UnitCompositing = UnitSums<false>;
using PremultipliedUnitCompositing = UnitSums<true>;

/// ... of wider numbers from 0 to 1, whose products are exact in 53 bits.
template <bool kPremultiplied>
using WideUnitSums = typename SumsOfW<kPremultiplied>::template And<
    Is<&CompositingStage::of_units, true>, AtMost<&CompositingStage::alpha_fraction, 26>,
    AtMost<&CompositingStage::color_fraction, 26>, AtMost<&CompositingStage::transparency_fraction, 26>,
    Rounds<&CompositingStage::to_contribution, Rounding::rnd_conv>,
    Rounds<&CompositingStage::to_color, Rounding::rnd_conv>>;
using WideUnitCompositing = WideUnitSums<false>;
using PremultipliedWideUnitCompositing = WideUnitSums<true>;

}  // namespace squint
