// The library from outside: scene -> volume -> plan -> picture, and its rounding error.
//
//     find_package(squint REQUIRED)
//     target_link_libraries(minimal PRIVATE squint::pipeline)
#include <squint/squint.h>

#include <iostream>

int main() {
    try {
        squint::Scene scene = squint::scene_with(
            squint::built_in_scene(), {"image.width=160", "image.height=120", "precision.preset=squeeze"});
        const auto volume =
            std::make_shared<const squint::Volume>(squint::load_volume(squint::volume_source(scene)));
        const squint::Plan plan = squint::make_plan(scene, volume);
        const squint::Image fixed = squint::render(plan).image;

        scene.precision.preset = "real";  // the same pipeline in double
        const squint::Image real = squint::render(squint::make_plan(scene, volume)).image;
        const squint::Difference& rgb = squint::compare(fixed, real).channel("RGB", true);

        squint::write_exr(fixed, "minimal.exr", {});
        std::cout << "minimal.exr: T is " << to_string(plan.spec(squint::Wire::transparency)) << ", "
                  << rgb.psnr.value_or(0) << " dB over " << rgb.pixels << " pixels\n";
    } catch (const squint::InputError& error) {
        std::cerr << error.what() << "\n";
        return 2;
    }
}
