// squint in one header, without SIMD: a scene and volume -> a plan -> a picture; differences of pictures.
//
//     find_package(squint REQUIRED)
//     target_link_libraries(mine PRIVATE squint::pipeline)
#pragma once

#include <squint/core/compare.h>
#include <squint/core/error.h>
#include <squint/core/image.h>
#include <squint/core/volume.h>
#include <squint/core/volume_source.h>
#include <squint/fixedpoint/format.h>
#include <squint/pipeline/plan/plan.h>
#include <squint/pipeline/render.h>
#include <squint/scene/scene.h>
