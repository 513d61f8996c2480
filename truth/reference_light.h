// The light of docs/conventions.md in doubles, for the reference: its equations, written directly.
#pragma once

#include "core/camera.h"
#include "core/portable_math.h"
#include "core/volume.h"
#include "scene/scene.h"

#include <algorithm>
#include <array>
#include <vector>

namespace squint::reference {

/// What light does at a gradient: matter of colour c shines with c * diffuse + specular.
struct Reflection {
    Vec3 diffuse{1, 1, 1}, specular{0, 0, 0};
    bool held_to_one = false;  // each channel is clamped to one

    Vec3 of(const Vec3& color) const {
        Vec3 light = color * diffuse + specular;
        for (int c = 0; held_to_one && c < 3; ++c) light[c] = std::min(light[c], 1.0);
        return light;
    }
};

/// x^p, or the cone that replaces it (a parabola in the angle), for x in [0, 1].
class Power {
  public:
    explicit Power(const ShadingSettings& settings);
    double operator()(double x) const {
        if (cone_) return std::max(0.0, 1 - slope_ * (1 - x));
        for (int i = 0; i < squarings_; ++i) x *= x;
        return exponent_ == 1 ? x : portable::pow(x, exponent_);
    }

  private:
    bool cone_;
    double slope_;
    int squarings_ = 0;  // x^p = (x^(2^squarings))^exponent
    double exponent_;
};

/// The lights as one ray meets them.
class RayLight {
  public:
    /// Camera and ray in grid space.
    RayLight(const Scene& scene, const Volume& volume, const Camera& camera, const Vec3& ray_direction);
    /// `gradient` is in grid space, in levels per smallest voxel spacing.  A zero gradient gets only ambient
    /// light, and one below 2^-40 of the data's range counts as zero: a rounding error has a direction, too.
    /// `mean`: of the gradients about it, from which the normal is turned away where normals are exaggerated.
    Reflection operator()(const Vec3& gradient, const Vec3& mean = Vec3(0)) const;
    /// Directions at a right angle to which a normal is at the limit of a lamp's light, or of its highlight.
    const std::vector<Vec3>& limits() const { return limits_; }
    /// Whether the light's value has corners there and nowhere else: one white lamp, no limit of a sum.
    bool has_corners_at_its_limits() const { return has_corners_at_its_limits_; }

  private:
    struct Lamp {
        Vec3 towards, half, color;
    };
    /// For shading.model gooch: the tone between the warm and the cool side.
    Reflection tone(double facing) const;

    const ShadingSettings* settings_;
    Power power_;
    double shortest_;  // of a gradient
    Vec3 eye_;         // towards it
    std::array<Lamp, kMostLights> lamp_;
    std::size_t lamps_ = 0;
    bool white_ = true;  // whether every lamp is
    std::vector<Vec3> limits_;
    bool has_corners_at_its_limits_ = false;
};

}  // namespace squint::reference
