#include "truth/reference_light.h"

#include "core/portable_math.h"

#include <algorithm>
#include <cmath>

namespace squint::reference {
namespace {

double unit_clamped(double x) {
    return std::min(std::max(x, 0.0), 1.0);
}

}  // namespace

Power::Power(const ShadingSettings& settings)
    : cone_(settings.power == PowerRule::parabola || settings.model == ShadingModel::cone),
      slope_((settings.exponent + 1) / 2),
      exponent_(settings.exponent) {
    if (settings.model == ShadingModel::cone && settings.cone_slope == ConeSlope::paper)
        slope_ = settings.exponent;
    for (; !cone_ && exponent_ > 1 && std::fmod(exponent_, 2) == 0; exponent_ /= 2) ++squarings_;
}

RayLight::RayLight(const Scene& scene, const Volume& volume, const Camera& camera, const Vec3& ray_direction)
    : settings_(&scene.shading),
      power_(scene.shading),
      shortest_(0x1p-40 * static_cast<double>(volume.largest - volume.smallest)),
      eye_(-ray_direction) {
    for (const Light& light : scene.lights) {
        const Vec3 towards =
            light.headlight ? -camera.view : volume.grid_from_world(light.direction.normalized());
        white_ = white_ && light.color == Vec3(1);
        lamp_[lamps_++] = {towards, (towards + eye_).normalized(), light.color};
        limits_.push_back(towards);
        if (settings_->ks > 0) limits_.push_back(lamp_[lamps_ - 1].half);
    }
    const ShadingSettings& s = *settings_;
    has_corners_at_its_limits_ = s.model == ShadingModel::blinn_phong && s.power != PowerRule::parabola &&
                                 lamps_ == 1 && white_ && !(s.gradient_floor > 0) && s.ka + s.kd <= 1 &&
                                 !(s.exaggeration > 0) && s.gradient != GradientRule::cubic_spline;
}

// C = (a kd c + cool) (1 - N.L) / 2 + (b kd c + warm) (1 + N.L) / 2, or with the sides exchanged (Guetat et
// al. 2010, equation 11, with the part that does not depend on N.L).
Reflection RayLight::tone(double facing) const {
    const ShadingSettings& s = *settings_;
    const double side = s.cool_side == CoolSide::shadow ? facing : -facing;
    const double warm = (1 + side) / 2, cool = (1 - side) / 2;
    return {Vec3(s.kd * (s.cool_share * cool + s.warm_share * warm)), s.cool * cool + s.warm * warm, true};
}

Reflection RayLight::operator()(const Vec3& gradient, const Vec3& mean) const {
    const ShadingSettings& s = *settings_;
    Vec3 diffuse{0, 0, 0}, specular{0, 0, 0};  // of white lamps: in x alone
    const double length = std::sqrt(gradient.dot(gradient));
    const double certain = s.gradient_floor > 0 ? std::min(1.0, length / s.gradient_floor) : 1;
    double facings = 0;
    if (length > shortest_) {
        Vec3 normal = gradient * (-1 / length);
        if (s.exaggeration > 0) {
            const double of_mean = std::sqrt(mean.dot(mean));
            const Vec3 around = of_mean > shortest_ ? mean * (-1 / of_mean) : Vec3(0);
            normal = (normal + (normal - around) * s.exaggeration).normalized();
        }
        for (std::size_t l = 0; l < lamps_; ++l) {
            const Lamp& lamp = lamp_[l];
            double facing = normal.dot(lamp.towards);
            double highlight = normal.dot(lamp.half);
            if (s.model == ShadingModel::phong) {  // R.V, R the light mirrored about N; the same for -N
                highlight = 2 * facing * normal.dot(eye_) - lamp.towards.dot(eye_);
                if (facing < 0 && !s.two_sided) highlight = 0;
            } else if (s.two_sided) {
                highlight = std::abs(highlight);
            }
            if (s.two_sided) facing = std::abs(facing);
            facings += facing;
            const double shade = unit_clamped(facing), shine = power_(unit_clamped(highlight));
            if (white_)
                diffuse.x += shade, specular.x += shine;
            else
                diffuse += lamp.color * shade, specular += lamp.color * shine;
        }
    }
    if (s.model == ShadingModel::gooch) return tone(std::clamp(facings, -1.0, 1.0) * certain);
    const auto lit = [&](double sum) { return unit_clamped(s.ka + s.kd * certain * unit_clamped(sum)); };
    const auto shine = [&](double sum) { return s.ks * certain * unit_clamped(sum); };
    if (white_) return {Vec3(lit(diffuse.x)), Vec3(shine(specular.x))};
    return {Vec3(lit(diffuse.x), lit(diffuse.y), lit(diffuse.z)),
            Vec3(shine(specular.x), shine(specular.y), shine(specular.z))};
}

}  // namespace squint::reference
