// What the command line asked for: one plain structure for each verb.
#pragma once

#include "pipeline/render.h"
#include "studies/search/search.h"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace squint::cli {

/// A scene, from a file or built in, and its settings in the order given.
struct SceneArguments {
    std::string file;
    std::vector<std::string> overrides;
};

struct RenderArguments {
    SceneArguments scene;
    std::string output, preview, json;  // json: a file, or - for standard output
    std::string reference_output;       // the reference picture, as EXR
    RenderOptions options;
    std::int64_t max_memory = 0;  // bytes; 0: no limit
    bool reference = false, error = false, bound = false, quiet = false, scene_reference = false,
         print_scene = false;
};
struct PlanArguments {
    SceneArguments scene;
    bool json = false, brief = false;
};
struct PixelArguments {
    std::vector<std::string> words;  // [SCENE.toml] X Y as given; split below
    SceneArguments scene;
    int column = 0, row = 0;
    std::pair<int, int> samples{0, -1};  // first and last; last -1: all samples
    bool json = false;
};
struct NumberArguments {
    std::vector<std::string> words;  // empty: read operations from standard input
    bool json = false;
};
struct CompareArguments {
    std::string a, b, diff, json;  // json: a file, or - for standard output
    double gain = 1;
    bool srgb = false;
    std::optional<double> fail_above;  // LSB8
    std::optional<double> min_psnr;    // dB
};
struct InfoArguments {
    std::string volume;  // the name of a procedural volume, or a file
    std::vector<std::string> overrides;
    bool json = false;
};
struct VolumeArguments {
    std::string volume, output;
    std::vector<std::string> overrides;
};
struct DoctorArguments {
    bool json = false;
};
struct HardArguments {
    std::vector<std::string> scenes;  // files and folders
    std::vector<std::string> overrides;
    int views = 0;  // 0: slabs alone, no pictures
    std::vector<int> sizes{16, 24};
    bool json = false;
};
struct TableArguments {
    SceneArguments scene;
    std::string output;
};
struct SweepArguments {
    std::vector<std::string> files;  // the sweep, or the folders to join (collect)
    std::vector<std::string> overrides;
    std::string output = "run";
    std::string command;  // as typed, for records
    int shard = 1, shards = 1, threads = 0;
    bool collect = false, dry_run = false, redo = false, json_lines = false, quiet = false;
};
struct ReportArguments {
    std::string run, output, format = "html";
    double max_error = 0.5;  // LSB8
    std::int64_t most_picture_bytes = 24 << 20;
};
struct SearchArguments {
    search::Settings settings;
    std::string guarantee = "views";
    bool json = false, quiet = false;
};
struct ReproduceArguments {
    std::string paper, figure;  // empty: all of them; both empty: what there is is listed
    std::string output = "reproduced", data;
    std::vector<std::string> overrides;
    int threads = 0;
    bool timed = false, json = false, quiet = false;
};
struct Text {  // help or version: printed, and done
    std::string text;
};

using Arguments =
    std::variant<RenderArguments, PlanArguments, PixelArguments, NumberArguments, CompareArguments,
                 InfoArguments, VolumeArguments, DoctorArguments, HardArguments, TableArguments,
                 SweepArguments, ReportArguments, SearchArguments, ReproduceArguments, Text>;

/// Parses the command line.  Throws InputError: what was found, and where help is.
Arguments parse(int argc, char** argv);

// One function for each verb.  Each returns an exit code and throws InputError.
int run(const RenderArguments& arguments);
int run(const PlanArguments& arguments);
int run(const PixelArguments& arguments);
int run(const NumberArguments& arguments);
int run(const CompareArguments& arguments);
int run(const InfoArguments& arguments);
int run(const VolumeArguments& arguments);
int run(const DoctorArguments& arguments);
int run(const HardArguments& arguments);
int run(const TableArguments& arguments);
int run(const SweepArguments& arguments);
int run(const ReportArguments& arguments);
int run(const SearchArguments& arguments);
int run(const ReproduceArguments& arguments);
int run(const Text& text);

}  // namespace squint::cli
