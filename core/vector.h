// Vectors of doubles: Imath's types under our names.
#pragma once

#include <Imath/ImathVec.h>

#include <cstdint>

namespace squint {

using Vec3 = Imath::V3d;
using Index3 = Imath::Vec3<std::int64_t>;

}  // namespace squint
