// The squint program: one verb a file.
#include "core/error.h"
#include "pipeline/render.h"

#include <cstdio>
#include <cstring>

int main(int argc, char** argv) {
    using namespace squint;
    try {
        const std::vector<std::string> overrides(argv + std::min(argc, 3), argv + argc);
        const Scene scene = argc > 1 && std::strcmp(argv[1], "-") != 0 ? read_scene(argv[1], overrides) : scene_with(built_in_scene(), overrides);
        const auto volume = std::make_shared<const Volume>(load_volume(volume_source(scene)));
        const Plan plan = make_plan(scene, volume);
        RenderOptions options; if (std::getenv("MODEL")) options.path = Path::model; if (std::getenv("NOSKIP")) options.skip = false; if (const char* t = std::getenv("THREADS")) options.threads = atoi(t); if (const char* t = std::getenv("TARGET")) options.target = t;
        const Rendering r = render(plan, options);
        std::fprintf(stderr, "%s %.3f s, %ld samples\n", r.statistics.why.c_str(), r.statistics.seconds, long(r.statistics.samples));
        const double background[3] = {0, 0, 0};
        if (argc > 2) write_exr(r.image, argv[2], {}), write_preview_png(r.image, std::string(argv[2]) + ".png", background);
    } catch (const InputError& e) {
        std::fprintf(stderr, "squint: %s\n", e.what());
        return 2;
    }
    return 0;
}
