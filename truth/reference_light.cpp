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
    : parabola_(settings.power == PowerRule::parabola), exponent_(settings.exponent) {
    for (; !parabola_ && exponent_ > 1 && std::fmod(exponent_, 2) == 0; exponent_ /= 2) ++squarings_;
}

RayLight::RayLight(const Scene& scene, const Camera& camera, const Vec3& ray_direction)
    : settings_(&scene.shading), power_(scene.shading), eye_(-ray_direction) {
    for (const Light& light : scene.lights) {
        const Vec3 towards = light.headlight ? -camera.view : light.direction.normalized();
        white_ = white_ && light.color == Vec3(1);
        lamp_[lamps_++] = {towards, (towards + eye_).normalized(), light.color};
    }
}

Reflection RayLight::operator()(const Vec3& gradient) const {
    const ShadingSettings& s = *settings_;
    Vec3 diffuse{0, 0, 0}, specular{0, 0, 0};
    const double length = std::sqrt(gradient.dot(gradient));
    if (length > 0) {
        const Vec3 normal = gradient * (-1 / length);
        for (std::size_t l = 0; l < lamps_; ++l) {
            const Lamp& lamp = lamp_[l];
            double facing = normal.dot(lamp.towards);
            double highlight = normal.dot(lamp.half);
            if (s.model == ShadingModel::phong) {  // R.V, R the light mirrored about N; N or -N is the same
                highlight = 2 * facing * normal.dot(eye_) - lamp.towards.dot(eye_);
                if (facing < 0 && !s.two_sided) highlight = 0;
            } else if (s.two_sided) {
                highlight = std::abs(highlight);
            }
            if (s.two_sided) facing = std::abs(facing);
            diffuse += lamp.color * unit_clamped(facing);
            specular += lamp.color * power_(unit_clamped(highlight));
        }
    }
    const auto lit = [&](double sum) { return unit_clamped(s.ka + s.kd * unit_clamped(sum)); };
    const auto shine = [&](double sum) { return s.ks * unit_clamped(sum); };
    if (white_) return {Vec3(lit(diffuse.x)), Vec3(shine(specular.x))};
    return {Vec3(lit(diffuse.x), lit(diffuse.y), lit(diffuse.z)),
            Vec3(shine(specular.x), shine(specular.y), shine(specular.z))};
}

}  // namespace squint::reference
