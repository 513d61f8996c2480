// One point of a sweep: settings -> scene, name and figures.  Volumes, base scenes and the pictures that
// points are compared with are made once and shared by all threads.
#pragma once

#include "core/image.h"
#include "core/volume.h"
#include "pipeline/plan/plan.h"
#include "studies/sweep/points.h"

#include <nlohmann/json.hpp>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace squint::sweep {

using Json = nlohmann::ordered_json;

/// A point prepared for rendering, or the reason why it cannot be.
struct Prepared {
    Scene scene;
    std::shared_ptr<const Volume> volume;
    std::string scene_file;             // empty: the built-in scene
    std::vector<std::string> settings;  // key=value, as for `squint render SCENE --set ...`
    std::string hash;                   // of the resolved configuration and the data: the point's name
    std::string failure;
};

class Evaluator {
  public:
    /// `folder` keeps baselines and pictures; empty: nothing goes to disk.
    Evaluator(const SweepFile& sweep, std::string folder, const std::atomic<bool>* cancelled = nullptr);

    /// The wires that the sweep's scenes use at their base points; for expand().
    std::vector<Wire> wires_in_use();

    /// Never throws for a fault of the point: see Prepared::failure.  Safe from many threads.
    Prepared prepare(const Point& point);

    /// Makes the pictures that a point is compared with, unless memory or disk has them.
    void make_baselines(const Prepared& point, int threads);

    /// The names of those pictures: hashes of all that they depend on.
    std::vector<std::string> baseline_keys(const Prepared& point);

    /// Renders, compares and counts; returns the record of a point (docs/sweeps.md, "The record of a point").
    /// `timed`: alone on the machine, with the sweep's repeats.  `base`: audited unless the sweep says otherwise.
    /// Throws InputError and Cancelled.
    Json measure(const Prepared& point, int threads, bool timed, bool base = false);

    /// The names of all that a record of this sweep, or of a base point, holds; a record that holds more serves as
    /// well.
    std::vector<std::string> wanted(bool base = false) const;

  private:
    struct BaselineScene {
        std::string name, key;
        Scene scene;
    };
    std::shared_ptr<const Volume> volume_of(const Scene& scene);
    WireSpecs preset_specs_of(const Scene& scene, const std::shared_ptr<const Volume>& volume);
    WireSpecs specs_of(const Scene& scene, const std::shared_ptr<const Volume>& volume);
    std::string identity(const Scene& scene, const std::shared_ptr<const Volume>& volume,
                         const WireSpecs& specs);
    std::vector<BaselineScene> baselines_of(const Prepared& point);
    std::shared_ptr<const Image> baseline(const BaselineScene& of, int threads);
    std::shared_ptr<const Image> remembered(const std::string& key);
    void remember(const std::string& key, std::shared_ptr<const Image> image);
    std::string path(const char* room, const std::string& name) const {
        return folder_ + "/" + room + "/" + name;
    }

    struct Loaded {
        std::shared_ptr<const Volume> volume;
        std::string failure;
    };
    const SweepFile& sweep_;
    std::string folder_;
    const std::atomic<bool>* cancelled_;
    std::vector<Scene> bases_;
    std::mutex volumes_mutex_, specs_mutex_, images_mutex_;
    std::map<std::string, Loaded> volumes_;
    std::map<std::string, WireSpecs> specs_;
    std::map<std::string, std::shared_ptr<const Image>> images_;
    std::vector<std::string> images_by_age_;
};

/// "u1.12 rnd_conv sat" with one part changed.  Throws InputError for more bits than a format can have.
Spec edited(Spec spec, const WireEdit& edit);

/// What made a record: the version, and a hash of the running program.
Json program_record();
/// CPU, processors, SIMD target.
Json machine_record();

/// Every n-th pixel, so that no side is longer than `most`, as 16-bit linear words, for reports: one line
/// "squint.values/1 WIDTH HEIGHT STRIDE", then the deflated planes R G B A, low bytes before high bytes,
/// each row as differences from the left neighbour.  `level`: 1 compresses quickly, 9 to the smallest
/// size.
std::string values_file(const Image& image, int most, int level = 1);
Image read_values(const std::string& bytes);  // R G B A

}  // namespace squint::sweep
