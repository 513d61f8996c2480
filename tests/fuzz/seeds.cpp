// Writes the first inputs of every fuzz target, all made here or taken from configs/:  fuzz_seeds FOLDER
#include "core/atomic_file.h"
#include "core/image.h"
#include "core/procedural.h"
#include "core/volume_source.h"
#include "scene/scene.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace squint {
namespace {

namespace fs = std::filesystem;

class Seeds {
  public:
    explicit Seeds(fs::path folder) : folder_(std::move(folder)) {}
    void add(const std::string& target, const std::string& bytes) {
        fs::create_directories(folder_ / target);
        write_text_whole((folder_ / target / fmt::format("{:04}", count_++)).string(), bytes);
    }

  private:
    fs::path folder_;
    int count_ = 0;
};

std::string bytes_of(const fs::path& path) {
    std::ostringstream bytes;
    bytes << std::ifstream(path, std::ios::binary).rdbuf();
    return bytes.str();
}

void add_scenes(Seeds& seeds) {
    for (const fs::directory_entry& file : fs::recursive_directory_iterator(SQUINT_SOURCE_DIR "/configs"))
        if (file.path().extension() == ".toml")
            seeds.add(file.path().string().find("/sweeps/") != std::string::npos ? "sweep" : "scene",
                      bytes_of(file.path()));
    Scene scene = built_in_scene();
    seeds.add("scene", to_toml(scene));
    for (const auto& [key, value] : resolved(scene)) seeds.add("override", key + '=' + value);
    std::string preset = "[precision]\npreset = 'wide'\n";
    for (const WireInfo& wire : kWireInfo) preset += std::string(wire.name) + " = 'u1.15 trn sat'\n";
    seeds.add("preset", preset);
    seeds.add("preset", "[precision]\npreset = 'default'\nsample = 's12.8 rnd wrap'\n");
    for (int i = 0; i < 16; ++i) {  // drawn from: any bytes will do
        std::string bytes;
        for (int k = 0; k < 400; ++k)
            bytes += static_cast<char>((i * 7919 + k * (31 + i)) * 2654435761u >> 13);
        seeds.add("scenes", bytes);
    }
}

void add_volumes(Seeds& seeds, const fs::path& folder) {
    for (const int bits : {8, 12}) {
        const std::string path = (folder / "seed.nrrd").string();
        save_nrrd(make_procedural(*find_procedural("sphere"), {4, 3, 2}, bits, {1, 0.5, 2}), path);
        seeds.add("volume", bytes_of(path));
        fs::remove(path);
    }
    const std::string voxels(24, '\7');
    for (const char* more : {"spacings: 1 2 3\n", "axis mins: 0 0 0\naxis maxs: 4 3 2\n",
                             "space: left-posterior-superior\nspace directions: (0,1,0) (-1,0,0) (0,0,2)\n",
                             "line skip: 0\nbyte skip: -1\nkey:=value\n"})
        seeds.add("volume", "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 3 2\nencoding: raw\n" +
                                std::string(more) + "\n" + voxels);
}

void add_functions(Seeds& seeds) {
    for (const char* space : {"RGB", "HSV", "Lab", "Diverging", "Step"})
        seeds.add("function", std::string(1, '\0') + R"([{"ColorSpace": ")" + space +
                                  R"(", "Name": "b", "RGBPoints": [0, 1, 0, 0, 1, 0, 0.5, 1],)"
                                  R"("Points": [0, 0, 0.5, 0, 1, 1, 0.5, 0],}] // one)");
    seeds.add("function",
              "\1"
              "1\n1\n0.9\n0.1\n0.2\n10\n4 -10 0 90 0.5\n4 0 1 255 1\n8 -10 0 0 0 90 1 1 1\n");
    seeds.add("function",
              "\2"
              R"({"volumeProperties": [{"components": [{"scalarOpacityUnitDistance": 0.5,
        "rgbTransferFunction": {"points": [{"x": 0, "color": [0, 0.25, 1]}, {"x": 9, "color": [1, 1, 1]}]},
        "scalarOpacity": {"points": [{"x": 0, "y": 0}, {"x": 9, "y": 0.75}]}}]}]})");
    seeds.add("function",
              "\3"
              "3\n0 0 0 0\n0.5 0.25 1 0.125\n1 1 1 1\n");
}

void add_pictures(Seeds& seeds, const fs::path& folder) {
    Image image{5, 4, {}};
    for (const char* name : {"R", "G", "B", "A"})
        for (float& value : image.add_float(name).values) value = 0.25F;
    for (const bool words : {false, true}) {
        const std::string path = (folder / "seed.exr").string();
        if (words) image.add_words("fixed.R");
        write_exr(image, path, {{"squint.scene", "x"}});
        seeds.add("picture", bytes_of(path));
        fs::remove(path);
    }
}

void add_numbers(Seeds& seeds) {
    for (const char* line :
         {"u1.15 0.7", "u1.15 trn mul u1.15 0.7 0.7", "s4.4 rnd wrap add u4.4 15.5 u1.8 0.75",
          "u12.4 lerp u12.0 100 200 u1.12 0.25", "u1.8 madd #128 0xff #1", "s3.0 sub -1e-3 +2"})
        seeds.add("number", line);
}

}  // namespace
}  // namespace squint

int main(int argc, char** argv) {
    using namespace squint;
    if (argc != 2) return 2;
    const fs::path folder = argv[1];
    fs::remove_all(folder);
    fs::create_directories(folder);
    Seeds seeds(folder);
    add_scenes(seeds), add_volumes(seeds, folder), add_functions(seeds), add_pictures(seeds, folder),
        add_numbers(seeds);
    return 0;
}
