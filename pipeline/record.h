// What is recorded of a picture: the attributes of its EXR, its hash, its errors, and the stages that cause
// them.
#pragma once

#include "core/compare.h"
#include "core/image.h"
#include "pipeline/plan/plan.h"
#include "pipeline/render.h"

#include <nlohmann/json_fwd.hpp>

#include <optional>
#include <string>
#include <vector>

namespace squint {

/// "0.1.0".
std::string version();

/// The resolved scene, the Spec of every wire, the data's hash and the version, under names that begin
/// with `squint.`: nothing that differs between runs or machines.  An absolute path is cut to the file's
/// name.
Attributes exr_attributes(const Plan& plan, int frame = 0);

/// A hash of size, channel names and every bit of every channel.
std::string picture_hash(const Image& image);

/// Bytes held for a picture.  The voxels of a mapped file do not count: they are on disk.
struct Memory {
    std::int64_t volume = 0, mapped = 0, tables = 0, image = 0, buffers = 0;
    std::int64_t total() const { return volume + tables + image + buffers; }
};
std::int64_t image_bytes(const Scene& scene);  // of all channels that the scene asks for
std::int64_t table_bytes(const Plan& plan);
Memory memory_of(const Plan& plan, const RenderStatistics& statistics);

/// The error of one stage's rounding alone, with the rest in double.
struct StageError {
    std::string stage;
    Comparison against_real;
};
struct Errors {
    std::optional<Comparison> against_real;       // of rounding alone
    std::optional<Comparison> against_reference;  // of everything
    std::vector<StageError> stages;               // those that are modelled
    bool by_floats = false;                       // against_real: floats drew the picture without rounding
    int every = 1;                                // stages: every so many-th pixel of every so many-th row
};

/// The plan of the same scene with precision.preset = real: nothing is rounded, and no wire has its own Spec.
Plan real_plan(const Plan& plan, int frame = 0);

/// The wires of one stage; of all stages for "".
std::array<bool, kWires> wires_of(std::string_view stage);

/// Every so many-th row and column stand for a picture when its stages' errors are measured: all of a small one.
int error_lattice(const Plan& plan);

enum class ErrorRays { enough, all };

/// Renders `plan` without rounding, then with the wires of each modelled stage alone rounded, and compares R, G, B
/// and A.  `all`: every pixel in double.  `enough`: the stages on error_lattice(), and the whole picture by lanes of
/// floats where these, on the lattice, err by less than a tenth (20 dB) of what is measured.  `options` are those of
/// the picture; audit is ignored.
Errors rounding_errors(const Plan& plan, const Image& picture, const RenderOptions& options, int frame = 0,
                       ErrorRays rays = ErrorRays::enough);

/// Compares R, G, B and A of two pictures of one scene.
Comparison compare_colors(const Image& picture, const Image& other);

/// The plan's warnings, and one that the picture shows nothing, where the plan has found no reason.
std::vector<std::string> warnings_of(const Plan& plan, const Rendering& rendering);

// Parts of `--json`; docs/json.md has the schema.
nlohmann::ordered_json json_of(const Difference& difference);
nlohmann::ordered_json json_of(const Comparison& comparison);
nlohmann::ordered_json json_of(const Errors& errors);
nlohmann::ordered_json json_of(const Memory& memory);
nlohmann::ordered_json json_of(const Volume& volume);
nlohmann::ordered_json json_of_scene(const Scene& scene);
nlohmann::ordered_json json_of_wires(const Plan& plan);
nlohmann::ordered_json json_of(const RefinedSlabs& refined);
/// A picture: time, samples, rays, path, target, memory, hash and, where asked for, audit and errors.
nlohmann::ordered_json json_of(const Plan& plan, const Rendering& rendering, const Errors* errors,
                               bool audit);

}  // namespace squint
