#include "bench/support/support.h"

#include "core/compare.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/volume_source.h"
#include "pipeline/record.h"
#include "truth/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

namespace squint::bench {
namespace {

Scene with_light(Scene scene, bool lit) {
    if (!lit) scene.lights.clear();
    return scene;
}

Image empty_picture(int width, int height) {
    Image image;
    image.width = width, image.height = height;
    for (const char* name : {"R", "G", "B", "A"}) image.add_float(name);
    return image;
}

/// Calls visit(column, row) for every pixel of the lattice, on many threads.
template <class V>
void visit_lattice(int width, int height, int every, V&& visit) {
    in_parallel((height - every / 2 + every - 1) / every, [&](int i) {
        for (int column = every / 2; column < width; column += every) visit(column, i * every + every / 2);
    });
}

/// All of a scene that the reference depends on, and nothing else.
std::string reference_key(const Plan& plan, int frame, int every) {
    Hasher hasher;
    hasher.text(plan.volume->content_hash);
    for (const auto& [key, value] : resolved(plan.scene)) {
        const bool unseen = key.starts_with("sampling.") || key.starts_with("classification.") ||
                            key.starts_with("compositing.") || key.starts_with("precision.") ||
                            key.starts_with("output.") || key.starts_with("volume.file");
        if (!unseen) hasher.text(key), hasher.text(value);
    }
    hasher.number(static_cast<std::uint64_t>(frame)), hasher.number(static_cast<std::uint64_t>(every));
    return hasher.hex();
}

}  // namespace

std::vector<std::string> data_scene_names() {
    std::vector<std::string> names;
    for (const char* volume : {"cthead", "chest", "bonsai", "engine", "aneurism"})
        for (const char* kind : {"opaque", "translucent"})
            names.push_back(fmt::format("{}_{}", volume, kind));
    return names;
}

bool has_data() {
    const char* folder = std::getenv("SQUINT_DATA");
    return folder && std::filesystem::is_directory(folder);
}

Scene data_scene(const std::string& name, bool lit, const std::vector<std::string>& overrides) {
    return with_light(read_scene(fmt::format("{}/configs/bench/{}.toml", SQUINT_SOURCE_DIR, name), overrides),
                      lit);
}

Scene phantom_scene(std::int64_t size, bool lit, const std::vector<std::string>& overrides) {
    std::vector<std::string> all{
        "volume.procedural=phantom",
        "classification.method=pc",
        fmt::format("volume.dims=[{}]", size),
        "image.width=800",
        "image.height=800",
        fmt::format("camera.height={}", 1.05 * static_cast<double>(size)),
        fmt::format("transfer_function.unit_distance={}", static_cast<double>(size) / 128)};
    all.insert(all.end(), overrides.begin(), overrides.end());
    return with_light(scene_with(built_in_scene(), all), lit);
}

std::shared_ptr<const Volume> volume_of(const Scene& scene) {
    // Keep only the last one: some are large.
    static std::string loaded;
    static std::shared_ptr<const Volume> volume;
    std::string key;
    for (const auto& [name, value] : resolved(scene))
        if (name.starts_with("volume.")) key += name + "=" + value + "\n";
    if (key != loaded) {
        volume.reset();
        volume = std::make_shared<const Volume>(load_volume(volume_source(scene)));
        loaded = key;
    }
    return volume;
}

std::shared_ptr<const Volume> fresh_copy(const Volume& volume) {
    const std::size_t bytes = static_cast<std::size_t>(volume.voxels()) * volume.scalar_bytes();
    std::shared_ptr<char[]> voxels(new char[bytes + 64]());  // 64 more can be read: see Volume::data
    std::memcpy(voxels.get(), volume.data.get(), bytes);
    Volume copy = volume;
    copy.data = voxels;
    return std::make_shared<const Volume>(copy);
}

Image thinned_real(const Plan& plan, int frame, int every) {
    Plan whole = plan;
    whole.scene.output = {};
    return render_thinned(real_plan(whole, frame), {}, every);
}
Image thinned_reference(const Plan& plan, int frame, int every) {
    namespace fs = std::filesystem;
    const char* named = std::getenv("SQUINT_BENCH_CACHE");
    const fs::path folder = named ? fs::path(named) : fs::temp_directory_path() / "squint-bench";
    fs::create_directories(folder);
    const fs::path file = folder / (reference_key(plan, frame, every) + ".exr");
    if (fs::exists(file)) return read_image(file.string());

    Image image = empty_picture(plan.camera.width, plan.camera.height);
    visit_lattice(image.width, image.height, every, [&](int column, int row) {
        const std::array<double, 4> color = reference_pixel(plan, column, row);
        for (std::size_t c = 0; c < 4; ++c)
            image.channels[c].values[static_cast<std::size_t>(row * image.width + column)] =
                static_cast<float>(color[c]);
    });
    const Image part = thinned(image, every);
    write_exr(part, file.string(), {});
    return part;
}

double psnr(const Image& picture, const Image& other) {
    Image colors[2]{empty_picture(picture.width, picture.height), empty_picture(other.width, other.height)};
    for (Channel& channel : colors[0].channels) channel.values = picture.find(channel.name)->values;
    for (Channel& channel : colors[1].channels) channel.values = other.find(channel.name)->values;
    return compare(colors[0], colors[1], false, false).channel("RGB", true).psnr.value_or(200);
}

Settings::Settings(int argc, char** argv, Defaults defaults) : values_(std::move(defaults)) {
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        const std::string key = word.substr(0, word.find('='));
        const auto found =
            std::find_if(values_.begin(), values_.end(), [&](auto& v) { return v.first == key; });
        if (found == values_.end() || key.size() == word.size()) {
            std::string allowed;
            for (const auto& [name, value] : values_) allowed += fmt::format(" {}={}", name, value);
            throw InputError(fmt::format("{}: not one of{}", word, allowed));
        }
        found->second = word.substr(key.size() + 1);
    }
}

std::vector<std::string> Settings::list(const std::string& key) const {
    std::vector<std::string> words;
    for (const auto& [name, value] : values_) {
        if (name != key) continue;
        std::istringstream text(value);
        for (std::string word; std::getline(text, word, ',');) words.push_back(word);
    }
    return words;
}

std::vector<double> Settings::numbers(const std::string& key) const {
    std::vector<double> numbers;
    for (const std::string& word : list(key)) numbers.push_back(std::stod(word));
    return numbers;
}

double processor_ms() {
    return 1000.0 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

double median(std::vector<double> values) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    const std::size_t half = values.size() / 2;
    return values.size() % 2 ? values[half] : (values[half - 1] + values[half]) / 2;
}

void reset_peak_memory() {
    std::ofstream("/proc/self/clear_refs") << "5";
}

std::int64_t peak_memory() {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;)
        if (word == "VmHWM:") {
            std::int64_t kibibytes = 0;
            status >> kibibytes;
            return kibibytes * 1024;
        }
    return 0;
}

double load() {
    double average = 0;
    std::ifstream("/proc/loadavg") >> average;
    return average;
}

Json machine() {
    std::string cpu = "unknown";
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);)
        if (line.starts_with("model name")) {
            cpu = line.substr(line.find(':') + 2);
            break;
        }
    return {{"cpu", cpu},
            {"threads", std::thread::hardware_concurrency()},
            {"compiler", __VERSION__},
            {"version", version()},
            {"load", load()}};
}

void print_line(const Json& json) {
    std::fputs((json.dump() + "\n").c_str(), stdout);
    std::fflush(stdout);
}

}  // namespace squint::bench
