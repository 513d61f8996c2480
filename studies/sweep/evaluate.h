// One point of a sweep: its settings -> its scene, its name, its figures.  Volumes, base scenes and the
// pictures that points are compared with are made once and shared by all threads.
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

/// A point ready to be rendered, or why it cannot be.
struct Prepared {
    Scene scene;
    std::shared_ptr<const Volume> volume;
    std::string scene_file;             // empty: the built-in scene
    std::vector<std::string> settings;  // key=value: what `squint render SCENE --set ...` needs
    std::string hash;                   // of the resolved configuration and the data: names the point
    std::string failure;
};

class Evaluator {
  public:
    /// `folder` keeps baselines and pictures; empty: nothing is kept on disk.
    Evaluator(const SweepFile& sweep, std::string folder, const std::atomic<bool>* cancelled = nullptr);

    /// The wires that the sweep's scenes use at their base points, for expand().
    std::vector<Wire> wires_in_use();

    /// Never throws for what is wrong with the point: see Prepared::failure.  Safe from many threads.
    Prepared prepare(const Point& point);

    /// Makes the pictures that a point is compared with, where neither memory nor disk has them.
    void make_baselines(const Prepared& point, int threads);

    /// Names of those pictures: what they depend on, hashed.
    std::vector<std::string> baseline_keys(const Prepared& point);

    /// Renders, compares and counts: the record of a point (docs/sweeps.md, "The record of a point").
    /// `timed`: alone on the machine, with the sweep's repeats.  Throws InputError and Cancelled.
    Json measure(const Prepared& point, int threads, bool timed);

    /// Names of everything that a record of this sweep holds; a record with more is as good.
    std::vector<std::string> wanted() const;

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

/// "u1.12 rnd_conv sat" with one part changed.  Throws InputError where the bits are more than a format has.
Spec edited(Spec spec, const WireEdit& edit);

/// Version, and a hash of the running program: what a record was made by.
Json program_record();
/// CPU, processors, SIMD target.
Json machine_record();

/// Every n-th pixel, so that no side is longer than `most`, as 16-bit linear words: what reports show.  One
/// line "squint.values/1 WIDTH HEIGHT STRIDE", then deflated planes R G B A, low bytes before high bytes,
/// each row as differences from its left neighbour.
/// `level`: 1 is quick, 9 small.
std::string values_file(const Image& image, int most, int level = 1);
Image read_values(const std::string& bytes);  // R G B A

}  // namespace squint::sweep
