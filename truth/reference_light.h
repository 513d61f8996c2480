// The light of docs/conventions.md in doubles, for the reference: straight from its equations.
#pragma once

#include "core/camera.h"
#include "core/portable_math.h"
#include "scene/scene.h"

#include <algorithm>
#include <array>

namespace squint::reference {

/// What a gradient makes of the light: matter of colour c shines with c * diffuse + specular.
struct Reflection {
    Vec3 diffuse{1, 1, 1}, specular{0, 0, 0};
};

/// x^p, or the parabola in its place, for x in [0, 1].
class Power {
  public:
    explicit Power(const ShadingSettings& settings);
    double operator()(double x) const {
        if (parabola_) return std::max(0.0, 1 - (exponent_ + 1) / 2 * (1 - x));
        for (int i = 0; i < squarings_; ++i) x *= x;
        return exponent_ == 1 ? x : portable::pow(x, exponent_);
    }

  private:
    bool parabola_;
    int squarings_ = 0;  // x^p = (x^(2^squarings))^exponent
    double exponent_;
};

/// The lights as one ray meets them.
class RayLight {
  public:
    RayLight(const Scene& scene, const Camera& camera, const Vec3& ray_direction);
    /// `gradient` in world space, of any length.  A zero gradient gets ambient light only.
    Reflection operator()(const Vec3& gradient) const;

  private:
    struct Lamp {
        Vec3 towards, half, color;
    };
    const ShadingSettings* settings_;
    Power power_;
    Vec3 eye_;  // towards it
    std::array<Lamp, kMostLights> lamp_;
    std::size_t lamps_ = 0;
    bool white_ = true;  // every lamp is
};

}  // namespace squint::reference
