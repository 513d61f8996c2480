// The compiled part of the Python package `squint`: arrays in, arrays and JSON out.  What a user calls is
// python/squint/__init__.py.
#include "core/error.h"
#include "core/volume_stored.h"
#include "fixedpoint/calculator.h"
#include "pipeline/machines/model.h"
#include "pipeline/plan/asked.h"
#include "pipeline/plan_record.h"
#include "pipeline/record.h"
#include "scene/from_data.h"
#include "scene/presets.h"
#include "scene/shelf.h"
#include "scene/toml.h"
#include "studies/search/auto_formats.h"
#include "studies/sweep/report.h"
#include "studies/sweep/run.h"
#include "truth/reference.h"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <future>
#include <utility>

namespace {

namespace py = pybind11;
using namespace squint;
using Json = nlohmann::ordered_json;

std::string text_of_json(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Does work on a thread of its own, the interpreter's lock free, and looks for Ctrl-C meanwhile: `cancelled`, which
/// the work watches, is then set.  Called with the lock held; gives what the work gives, or throws what it throws.
template <class Work>
auto interruptibly(std::atomic<bool>& cancelled, const Work& work) {
    std::optional<decltype(work())> result;
    std::exception_ptr failure;
    {
        const py::gil_scoped_release unlocked;
        auto running = std::async(std::launch::async, work);
        while (running.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
            const py::gil_scoped_acquire lock;
            if (!cancelled && PyErr_CheckSignals() != 0) cancelled = true;
        }
        try {
            result = running.get();
        } catch (...) {
            failure = std::current_exception();
        }
    }
    if (cancelled) throw py::error_already_set();
    if (failure) std::rethrow_exception(failure);
    return std::move(*result);
}

StoredType type_of(const py::array& array) {
    const py::dtype type = array.dtype();
    std::string name(1, type.kind());
    if (name == "i" || name == "u" || name == "f") {
        name += std::to_string(8 * type.itemsize());
        const auto* const found = std::find(std::begin(kStoredTypes), std::end(kStoredTypes), name);
        if (found != std::end(kStoredTypes)) return static_cast<StoredType>(found - kStoredTypes);
    }
    throw InputError("volume: found an array of " +
                     static_cast<std::string>(py::str(static_cast<py::handle>(type))) +
                     "; allowed: uint8 to uint64, int8 to int64, float32 and float64");
}

/// Whether kPaddingBytes can be read behind the last voxel for certain: they lie on its page.
bool is_padded(const unsigned char* data, std::size_t size) {
    const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
    const auto last = reinterpret_cast<std::uintptr_t>(data) + size - 1;
    return last / page == (last + kPaddingBytes) / page;
}

/// Voxels of an array [z, y, x], held as they lie where that can be, else copied.
StoredVolume stored_of(const py::array& given, const Vec3& spacing, const Vec3& origin) {
    if (given.ndim() != 3 || given.size() == 0)
        throw InputError("volume: found an array of shape " +
                         static_cast<std::string>(py::str(given.attr("shape"))) +
                         "; allowed: three dimensions, [z, y, x], none of them empty");
    StoredVolume stored;
    stored.where = "volume";
    stored.type = type_of(given);
    py::array array = py::array::ensure(given, py::array::c_style);
    if (!array) throw py::error_already_set();
    stored.big_endian = array.dtype().byteorder() == '>';
    stored.dims = {array.shape(2), array.shape(1), array.shape(0)};
    stored.spacing = spacing, stored.origin = origin;
    const auto* data = static_cast<const unsigned char*>(array.data());
    if (is_padded(data, stored.size())) {
        auto* const keeper = new py::array(std::move(array));
        stored.bytes = {data, [keeper](const void*) {
                            const py::gil_scoped_acquire lock;
                            delete keeper;
                        }};
    } else {
        const std::shared_ptr<void> copy = allocate_voxels(stored.size(), stored.where);
        std::memcpy(copy.get(), data, stored.size());
        stored.bytes = std::static_pointer_cast<const unsigned char>(copy);
    }
    return stored;
}

/// A scene as the program takes it, or its text (where there is a line break), an array instead of its volume if there
/// is one, and how that lies in the world.
struct Input {
    std::string scene, folder;  // @NAME of a scene: a file in `folder`
    std::vector<std::string> settings;
    std::optional<py::array> volume;
    std::array<double, 3> spacing, origin;
};

/// `of_data`: a scene of its own, made by a volume.
Scene scene_of(const Input& input, bool& of_data) {
    Scene scene;
    of_data = input.scene.empty() && input.volume;
    if (of_data) {
        scene = scene_with(scene_of_data("volume"), input.settings);
    } else if (input.scene.find('\n') != std::string::npos) {
        scene = parse_scene(input.scene, "scene", "", input.settings);
    } else {
        const std::string file = shelf_file(input.scene, input.folder);
        of_data = is_of_data(file, input.settings);
        return scene_asked_for(file, input.settings);
    }
    scene.precision = resolved_precision(scene);
    return scene;
}

struct Loaded {
    Scene scene;
    std::shared_ptr<const Volume> volume;
    std::vector<std::string> notes;
};

/// Called with the lock held, and gives it away while voxels are read.
Loaded load(const Input& input) {
    std::optional<StoredVolume> stored;
    if (input.volume)
        stored = stored_of(*input.volume, {input.spacing[0], input.spacing[1], input.spacing[2]},
                           {input.origin[0], input.origin[1], input.origin[2]});
    const py::gil_scoped_release unlocked;
    Loaded loaded;
    bool of_data = false;
    loaded.scene = scene_of(input, of_data);
    if (stored) {
        loaded.scene.volume.file.clear(), loaded.scene.volume.procedural.clear();
        check_spacing(stored->spacing, stored->where);
    }
    const VolumeSource source = volume_source(loaded.scene);
    loaded.volume =
        std::make_shared<const Volume>(stored ? levels_from_stored(*stored, source, {}, loaded.notes)
                                              : load_volume(source, {}, &loaded.notes));
    complete_from_data(loaded.scene, *loaded.volume, loaded.notes);
    if (of_data) frame_data(loaded.scene, *loaded.volume);
    const search::AutoFormats chosen = search::choose_formats(loaded.scene, loaded.volume);
    for (const auto* texts : {&chosen.notes, &chosen.warnings})
        loaded.notes.insert(loaded.notes.end(), texts->begin(), texts->end());
    return loaded;
}

template <class T>
py::array_t<T> array_of(const Image& image, const std::vector<T>& values) {
    return py::array_t<T>({image.height, image.width}, values.data());
}

/// "rgba": [row, column, 4]; other channels by name, [row, column]; words as signed integers.
py::dict arrays_of(const Image& image) {
    py::dict arrays;
    py::array_t<float> rgba({image.height, image.width, 4});
    float* const out = rgba.mutable_data();
    for (std::size_t c = 0; c < 4; ++c) {
        const Channel& channel = *image.find(std::string(1, "RGBA"[c]));
        for (std::size_t i = 0; i < channel.values.size(); ++i) out[4 * i + c] = channel.values[i];
    }
    arrays["rgba"] = rgba;
    for (const Channel& channel : image.channels) {
        if (channel.name.size() == 1 && std::strchr("RGBA", channel.name[0])) continue;
        if (channel.is_words())
            arrays[py::str(channel.name)] =
                array_of(image, std::vector<std::int32_t>(channel.words.begin(), channel.words.end()));
        else
            arrays[py::str(channel.name)] = array_of(image, channel.values);
    }
    return arrays;
}

LayoutRule layout_of(const std::string& name) {
    if (name == "auto") return LayoutRule::automatic;
    if (name == "linear") return LayoutRule::linear;
    if (name == "cells") return LayoutRule::cells;
    throw InputError("layout: found " + in_quotes(name) + "; allowed: auto, linear or cells");
}

void check_range(const char* name, int value, int least, int greatest) {
    if (value < least || value > greatest)
        throw InputError(std::string(name) + ": found " + std::to_string(value) +
                         "; allowed: " + std::to_string(least) + " to " + std::to_string(greatest));
}

py::tuple render_scene(const Input& input, int threads, const std::string& layout, bool error, bool reference,
                       bool audit, int frame) {
    check_range("threads", threads, 0, 4096);
    std::atomic<bool> cancelled = false;
    RenderOptions options;
    options.threads = threads, options.layout = layout_of(layout), options.audit = audit;
    options.cancelled = &cancelled;
    const Loaded loaded = load(input);
    check_range("frame", frame, 0, loaded.scene.camera.turntable - 1);
    if (audit && rounds_nothing(loaded.scene.precision.preset))
        throw InputError("audit: precision.preset is \"" + loaded.scene.precision.preset +
                         "\", which rounds no wire; allowed: any other preset");
    const auto work = [&]() -> std::pair<Rendering, std::string> {
        const Plan plan = plan_asked_for(loaded.scene, loaded.volume, frame);
        Rendering rendering = render(plan, options);
        Errors errors;
        if (error) errors = rounding_errors(plan, rendering.image, options, frame);
        if (reference)
            errors.against_reference = compare_colors(
                rendering.image, render_reference(plan, {.threads = threads, .cancelled = &cancelled}));
        Json json = json_of(plan, rendering, error || reference ? &errors : nullptr, audit);
        json["version"] = version();
        json["scene"] = json_of_scene(plan.scene), json["volume"] = json_of(*plan.volume);
        json["wires"] = json_of_wires(plan), json["notes"] = loaded.notes;
        json["warnings"] = warnings_of(plan, rendering);
        return {std::move(rendering), text_of_json(json)};
    };
    const auto [rendering, record] = interruptibly(cancelled, work);
    return py::make_tuple(arrays_of(rendering.image), record);
}

std::string plan_scene(const Input& input, int frame) {
    const Loaded loaded = load(input);
    check_range("frame", frame, 0, loaded.scene.camera.turntable - 1);
    const py::gil_scoped_release unlocked;
    Plan plan = plan_asked_for(loaded.scene, loaded.volume, frame);
    plan.notes.insert(plan.notes.begin(), loaded.notes.begin(), loaded.notes.end());
    return text_of_json(json_of_plan(plan));
}

py::dict trace_pixel(const Input& input, int column, int row) {
    const Loaded loaded = load(input);
    RayTrace trace;
    WireSpecs specs;
    bool real = false;
    {
        const py::gil_scoped_release unlocked;
        const Plan plan = plan_asked_for(loaded.scene, loaded.volume);
        if (column < 0 || column >= plan.camera.width || row < 0 || row >= plan.camera.height)
            throw InputError("pixel: " + std::to_string(column) + " " + std::to_string(row) +
                             " is outside the picture; allowed: 0 to " +
                             std::to_string(plan.camera.width - 1) + " and 0 to " +
                             std::to_string(plan.camera.height - 1));
        trace = trace_ray(plan, column, row);
        specs = plan.specs, real = plan.real;
    }
    const auto count = static_cast<py::ssize_t>(trace.events.size());
    py::array_t<std::int64_t> slab(count), raw(count);
    py::array_t<double> value(count), exact(count);
    py::list wire;
    for (py::ssize_t i = 0; i < count; ++i) {
        const RayTrace::Event& e = trace.events[static_cast<std::size_t>(i)];
        const auto w = static_cast<std::size_t>(e.event.wire);
        const Format& format = specs.spec[w].format;
        slab.mutable_at(i) = e.slab, raw.mutable_at(i) = real ? 0 : e.event.raw;
        exact.mutable_at(i) = e.event.exact / static_cast<double>(format.one());
        value.mutable_at(i) = real ? exact.at(i) : to_real(e.event.raw, format);
        wire.append(py::str(std::string(kWireInfo[w].name)));
    }
    py::dict result;
    result["slab"] = slab, result["wire"] = wire, result["raw"] = raw, result["value"] = value;
    result["exact"] = exact;
    result["rgba"] = py::array_t<double>(4, trace.color.data());
    return result;
}

/// Every table of a plan's stages as raw words.
struct CollectTables {
    py::list& tables;
    void add(int wire, const py::array& words) const {
        py::dict table;
        table["wire"] = wire < 0 ? py::object(py::none())
                                 : py::str(std::string(kWireInfo[static_cast<std::size_t>(wire)].name));
        table["words"] = words;
        tables.append(table);
    }
    void operator()(const Rescale&) const {}
    void operator()(const Table& table) const {
        if (table.rows() == 0) return;
        py::array_t<std::int64_t> words({table.rows(), table.columns()});
        for (int i = 0; i < table.rows(); ++i)
            for (int c = 0; c < table.columns(); ++c) words.mutable_at(i, c) = table.word(i, c);
        add(table.wire, words);
    }
    void operator()(const CellTable& cells) const {
        if (cells.rows() == 0) return;
        py::array_t<std::int64_t> words({cells.size(), cells.size(), 4});
        for (int i = 0; i < cells.size(); ++i)
            for (int j = 0; j < cells.size(); ++j)
                for (int c = 0; c < 4; ++c) words.mutable_at(i, j, c) = cells.word(i, j, c);
        add(cells.wire, words);
    }
};
py::list tables_of_scene(const Input& input) {
    const Loaded loaded = load(input);
    std::optional<Plan> plan;
    {
        const py::gil_scoped_release unlocked;
        plan = plan_asked_for(loaded.scene, loaded.volume);
    }
    py::list tables;
    visit_stages(*plan, CollectTables{tables});
    return tables;
}

Image image_of(const py::array_t<float, py::array::c_style | py::array::forcecast>& rgba) {
    if (rgba.ndim() != 3 || rgba.shape(2) < 1 || rgba.shape(2) > 4)
        throw InputError("compare: an array that is not [row, column, channel] with 1 to 4 channels");
    Image image{static_cast<int>(rgba.shape(1)), static_cast<int>(rgba.shape(0)), {}};
    const py::ssize_t channels = rgba.shape(2);
    for (py::ssize_t c = 0; c < channels; ++c) {
        std::vector<float>& values = image.add_float(std::string(1, "RGBA"[c])).values;
        for (std::size_t i = 0; i < values.size(); ++i)
            values[i] = rgba.data()[i * static_cast<std::size_t>(channels) + static_cast<std::size_t>(c)];
    }
    return image;
}

std::string compare_images(const Image& a, const Image& b, bool srgb) {
    const py::gil_scoped_release unlocked;
    return text_of_json(json_of(compare(a, b, srgb)));
}

std::string run_sweep_file(const std::string& name, const std::string& scenes,
                           const std::vector<std::string>& settings, const std::string& folder, int threads) {
    using namespace squint::sweep;
    check_range("threads", threads, 0, 4096);
    std::atomic<bool> cancelled = false;
    RunOptions options;
    options.folder = folder, options.threads = threads, options.command = "squint.sweep (Python)";
    options.cancelled = &cancelled;
    return interruptibly(cancelled, [&] {
        run_sweep(read_sweep(shelf_file(name, scenes), settings), options);
        return report_csv(report_data(folder));
    });
}

py::dict calculate_words(const std::vector<std::string>& words) {
    Calculation c;
    if (const std::string wrong = calculate(words, c); !wrong.empty()) throw InputError("number: " + wrong);
    py::dict result;
    result["spec"] = to_string(c.spec), result["format"] = to_string(c.spec.format);
    result["raw"] = c.raw, result["value"] = to_real(c.raw, c.spec.format);
    result["decimal"] = decimal({c.raw, c.spec.format.fraction_bits});
    result["hex"] = hex(c.raw, c.spec.format), result["bits"] = bits(c.raw, c.spec.format);
    result["error_last_bits"] = last_bits(c);
    result["inexact"] = c.inexact, result["overflow"] = c.overflow;
    return result;
}

}  // namespace

PYBIND11_MODULE(_squint, m) {
    m.doc() = "The compiled part of squint.";
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            if (thrown) std::rethrow_exception(std::move(thrown));
        } catch (const InputError& error) {
            PyErr_SetString(PyExc_ValueError, error.what());
        }
    });
    py::class_<Input>(m, "Input")
        .def(py::init([](std::string scene, std::string folder, std::vector<std::string> settings,
                         std::optional<py::array> volume, std::array<double, 3> spacing,
                         std::array<double, 3> origin) {
            return Input{std::move(scene),  std::move(folder), std::move(settings),
                         std::move(volume), spacing,           origin};
        }));
    m.def("render", render_scene);
    m.def("plan", plan_scene);
    m.def("pixel", trace_pixel);
    m.def("tables", tables_of_scene);
    m.def("compare_arrays", [](const py::array_t<float, py::array::c_style | py::array::forcecast>& a,
                               const py::array_t<float, py::array::c_style | py::array::forcecast>& b,
                               bool srgb) { return compare_images(image_of(a), image_of(b), srgb); });
    m.def("compare_files", [](const std::string& a, const std::string& b, bool srgb) {
        return compare_images(read_image(a), read_image(b), srgb);
    });
    m.def("sweep", run_sweep_file);
    m.def("rows", [](const std::string& run) { return sweep::report_csv(sweep::report_data(run)); });
    m.def("calculate", calculate_words);
    m.def("version", version);
}
