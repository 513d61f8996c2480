// Light along one slab, its normal turned in three ways (Guetat et al. 2010, figures 1, 2, equations 4, 5).
#pragma once

#include <array>
#include <string>
#include <vector>

namespace squint::reproduce {

/// What the three columns of a sample are: the lerp of the ends' unit normals made a unit again (the truth), the lerp
/// itself (Lum et al. 2004), and the lerp over the paper's quadratic for its length.
inline constexpr std::array<const char*, 3> kTurns{"normalised", "linear", "quadratic"};

struct SlabLightSample {
    double place;  // 0 in front, 1 at the back
    std::array<double, 3> length, diffuse, specular;
};
struct SlabLight {
    double angle, exponent;
    std::vector<SlabLightSample> samples;
    /// How much of a length of one the linear and the quadratic normal lack or exceed at most, in %.
    std::array<double, 2> length_errors() const;
};

/// Normals `angle` degrees apart, below 180, a light and a highlight 15 degrees off the middle between them.
SlabLight slab_light(double angle, double exponent);

std::string csv_of(const SlabLight& light);
/// Three panels (diffuse, specular and both) with a line for each way to turn.
std::string svg_of(const SlabLight& light);

}  // namespace squint::reproduce
