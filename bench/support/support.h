// Shared by benchmarks: scenes, errors on a lattice of pixels, times, and the machine.
#pragma once

#include "core/image.h"
#include "pipeline/plan/plan.h"
#include "pipeline/render.h"

#include <nlohmann/json.hpp>

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace squint::bench {

using Json = nlohmann::ordered_json;

/// The names in configs/bench: "cthead_opaque", ...
std::vector<std::string> data_scene_names();
/// Whether SQUINT_DATA names a folder.
bool has_data();
/// A scene of configs/bench with `key=value` overrides; lit as written, or without lights.
Scene data_scene(const std::string& name, bool lit, const std::vector<std::string>& overrides = {});
/// A procedural phantom of size^3 with its own transfer function, 800x800, filling the picture; equally dense
/// at every size.
Scene phantom_scene(std::int64_t size, bool lit, const std::vector<std::string>& overrides = {});

/// The scene's volume; kept until another one is asked for.
std::shared_ptr<const Volume> volume_of(const Scene& scene);
/// The same voxels in other memory: nothing cached for the volume applies to the copy.
std::shared_ptr<const Volume> fresh_copy(const Volume& volume);

using squint::thinned;
/// What thinned() leaves of the picture without rounding (preset `real`), and of the reference.  The reference is
/// kept on disk, in SQUINT_BENCH_CACHE or the temporary folder, by all that decides it.
Image thinned_real(const Plan& plan, int frame, int every);
Image thinned_reference(const Plan& plan, int frame, int every);

/// Foreground PSNR of R, G and B together, in dB; 200 for identical pictures.
double psnr(const Image& picture, const Image& other);

/// `key=value` words of a command line, over defaults; each value is a list separated by commas.
class Settings {
  public:
    using Defaults = std::vector<std::pair<std::string, std::string>>;
    /// Throws InputError for a key without a default.
    Settings(int argc, char** argv, Defaults defaults);
    std::vector<std::string> list(const std::string& key) const;
    std::vector<double> numbers(const std::string& key) const;
    double number(const std::string& key) const { return numbers(key).at(0); }

  private:
    Defaults values_;
};

/// Measures wall time.
class Stopwatch {
  public:
    double ms() const {
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
    }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Processor time of this program in milliseconds, all threads together: a busy machine does not stretch
/// it.
double processor_ms();

double median(std::vector<double> values);

/// The highest resident memory since the last reset, in bytes; 0 where the system does not tell.
void reset_peak_memory();
std::int64_t peak_memory();

/// Runnable processes over the last minute, and the machine: printed beside every figure.
double load();
Json machine();

/// Prints one line at once: a long run that is cut short keeps what it measured.
void print_line(const Json& json);

}  // namespace squint::bench
