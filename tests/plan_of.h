// The volume and the plan of a scene, as the program makes them.
#pragma once

#include "core/volume_source.h"
#include "pipeline/plan/plan.h"
#include "scene/scene.h"

#include <memory>

namespace squint::test {

inline std::shared_ptr<const Volume> volume_of(const Scene& scene) {
    return std::make_shared<const Volume>(load_volume(volume_source(scene)));
}
inline Plan plan_of(const Scene& scene) {
    return make_plan(scene, volume_of(scene));
}

}  // namespace squint::test
