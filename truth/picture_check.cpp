#include "truth/picture_check.h"

#include "pipeline/plan/plan.h"
#include "pipeline/render.h"

#include <cmath>

namespace squint {
namespace {

void compare(const Image& words, const Image& real, int view, PictureCheck& check) {
    for (const char* name : {"R", "G", "B", "A"}) {
        const std::vector<float>&x = words.find(name)->values, &y = real.find(name)->values;
        for (std::size_t i = 0; i < x.size(); ++i) {
            const double error = 255 * std::abs(double{x[i]} - double{y[i]});
            if (error <= check.largest) continue;
            const int at = static_cast<int>(i);
            check = {error, view, words.width, at % words.width, at / words.width};
        }
    }
}

}  // namespace

PictureCheck check_pictures(Scene scene, const std::shared_ptr<const Volume>& volume, int views,
                            const std::vector<int>& sizes) {
    PictureCheck check;
    scene.camera.turntable = views;
    for (const int size : sizes) {
        scene.image.width = scene.image.height = size;
        // Tables take longer than pictures of this size; without light only the camera differs from view to view.
        Plan words = make_plan(scene, volume), real = words;
        for (int view = 0; view < views; ++view) {
            if (words.lit && view > 0) words = make_plan(scene, volume, view), real = words;
            if (view == 0 || words.lit) set_active(real, {});
            words.camera = real.camera = make_camera(scene.camera, *volume, size, size, view);
            compare(render(words).image, render(real).image, view, check);
        }
    }
    return check;
}

}  // namespace squint
