// Procedural volumes: exact scalar fields with exact gradients, sampled and rounded to levels.
#pragma once

#include "core/vector.h"
#include "core/volume.h"

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace squint {

/// A scalar field over the unit cube [0,1]^3.  Its values are in [0,1] of full scale.
struct ProceduralField {
    std::string name;
    std::string description;                    // one line for help
    int default_bits = 12;                      // 8 or 12
    std::int64_t default_size = 128;            // voxels a side
    std::function<double(const Vec3&)> value;   // in [0,1]
    std::function<Vec3(const Vec3&)> gradient;  // exact derivative of `value`
};

/// All fields: phantom, sphere, marschner_lobb, shells, ramp, constant, fog, polynomial, noisy_sphere.
const std::vector<ProceduralField>& procedural_fields();
const ProceduralField* find_procedural(std::string_view name);  // null if unknown

/// Samples a field at the voxel centres (x / (dims.x - 1), ...): scalars round(value * (2^bits - 1)).  Uses
/// portable arithmetic alone: the same bits on every CPU.
Volume make_procedural(const ProceduralField& field, Index3 dims, int bits, const Vec3& spacing = {1, 1, 1});

}  // namespace squint
