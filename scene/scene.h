// A scene: everything that decides a picture.  Each setting is written once, in visit(): reading, help, --set
// and the record in the EXR all walk that list.
#pragma once

#include "core/camera.h"
#include "core/transfer_function.h"
#include "core/volume_source.h"
#include "scene/wires.h"

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace squint {

enum class PositionRule { p0_kv, accumulate };
enum class InterpolationRule { trilinear, nearest };
enum class LerpRule { one_product, two_products };  // Squeeze, equations 14 and 15, or 13
enum class GradientRule { central, central_samples, analytic, sobel, cubic_spline };
enum class Method { pc, pc_mid, pi2d, pi2d_no_attenuation, pi1d, pi1d_engel, pips, leg };
enum class TableLookup { bilinear, nearest };
enum class WallRule { twice, ends, none };  // where opaque values inside a slab are looked for
enum class AlphaEncoding { alpha, sqrt_alpha, transparency };  // what of an opacity table_alpha stores
enum class ShadingModel { none, phong, blinn_phong, cone, gooch };
enum class ConeSlope { energy, paper };
enum class CoolSide { shadow, light };
enum class InsideRule {
    mean,
    front,
    middle,
    adaptive,
    linear,
    nlpi,
    centroid,
    two_point
};  // where inside a slab its light is computed
enum class PowerRule { squaring, parabola, table };
enum class CompositingForm {
    automatic,
    w,
    w_carry,
    equation_9,
    alpha,
    back_to_front,
    unit255_shift,
    unit255_blinn,
    straight
};
enum class CompositingMode { over, mip, minip, average };
enum class Guarantee { pictures, scene };
enum class LayoutRule { automatic, linear, cells };

/// The names of an enumeration's values, in order.  Specialised below for each enumeration of a scene.
template <class E>
struct EnumNames;
#define SQUINT_NAMES(E, ...)                                       \
    template <>                                                    \
    struct EnumNames<E> {                                          \
        static constexpr std::string_view names[] = {__VA_ARGS__}; \
    }
SQUINT_NAMES(Projection, "orthographic", "perspective");
SQUINT_NAMES(PositionRule, "p0_kv", "accumulate");
SQUINT_NAMES(InterpolationRule, "trilinear", "nearest");
SQUINT_NAMES(LerpRule, "one_product", "two_products");
SQUINT_NAMES(GradientRule, "central", "central_samples", "analytic", "sobel", "cubic_spline");
SQUINT_NAMES(Method, "pc", "pc_mid", "pi2d", "pi2d_no_attenuation", "pi1d", "pi1d_engel", "pips", "leg");
SQUINT_NAMES(TableLookup, "bilinear", "nearest");
SQUINT_NAMES(WallRule, "twice", "ends", "none");
SQUINT_NAMES(AlphaEncoding, "alpha", "sqrt_alpha", "transparency");
SQUINT_NAMES(ShadingModel, "none", "phong", "blinn_phong", "cone", "gooch");
SQUINT_NAMES(ConeSlope, "energy", "paper");
SQUINT_NAMES(CoolSide, "shadow", "light");
SQUINT_NAMES(InsideRule, "mean", "front", "middle", "adaptive", "linear", "nlpi", "centroid", "two_point");
SQUINT_NAMES(PowerRule, "squaring", "parabola", "table");
SQUINT_NAMES(CompositingForm, "auto", "w", "w_carry", "equation_9", "alpha", "back_to_front", "unit255_shift",
             "unit255_blinn", "straight");
SQUINT_NAMES(CompositingMode, "over", "mip", "minip", "average");
SQUINT_NAMES(Guarantee, "pictures", "scene");
SQUINT_NAMES(LayoutRule, "auto", "linear", "cells");
#undef SQUINT_NAMES

template <class E>
constexpr std::string_view name_of(E value) {
    return EnumNames<E>::names[static_cast<std::size_t>(value)];
}

/// Two ascending values, or the least and greatest of the data, or nothing.
struct ValueRange {
    std::vector<double> ends;  // two, or none
    bool of_data = false;
};

struct TransferFunctionSettings {
    std::vector<std::vector<double>> points;   // [value, r, g, b, alpha]
    std::vector<std::vector<double>> color;    // [value, r, g, b]
    std::vector<std::vector<double>> opacity;  // [value, alpha]
    std::string preset;                        // CT in HU, or the built-in scene's
    std::string file;                          // written by another program: see FunctionFile
    std::string map;                           // which map of a ParaView file with several
    std::string color_space = "linear";        // or "srgb"
    double unit_distance = 0;                  // required with points or a ParaView file
    int entries = 0;                           // 0: one per level, at most 4096
    ValueRange range;                          // what the points are stretched to
};

struct ImageSettings {
    int width = 512, height = 512;
    Vec3 background{0, 0, 0};  // of the preview only: the EXR has no background
};

struct SamplingSettings {
    double step = 1;                  // in units of the smallest voxel spacing
    double termination = 1.0 / 1024;  // a ray ends when T falls below this; 0: never early
    PositionRule position = PositionRule::p0_kv;
    InterpolationRule interpolation = InterpolationRule::trilinear;
    LerpRule lerp = LerpRule::one_product;
};

struct ClipSettings {
    std::optional<Vec3> low, high;  // opposite corners of a box, in world units
};

struct Light {
    bool headlight = false;
    Vec3 direction{0, 0, 1};  // towards the light, in world space; any length but zero
    Vec3 color{1, 1, 1};
};
inline constexpr int kMostLights = 8;

struct ShadingSettings {
    ShadingModel model = ShadingModel::blinn_phong;  // none where there is no light
    GradientRule gradient = GradientRule::central;
    double ka = 0.25, kd = 0.6, ks = 0.15;
    double exponent = 32;
    PowerRule power = PowerRule::squaring;
    bool two_sided = false;
    double exaggeration = 0;                          // of a normal against its surroundings
    double gradient_floor = 0;                        // levels per smallest voxel spacing; 0: no fading
    std::optional<InsideRule> inside = std::nullopt;  // absent: the method's best
    ConeSlope cone_slope = ConeSlope::energy;
    CoolSide cool_side = CoolSide::shadow;
    Vec3 cool{0, 0, 0.55}, warm{0.3, 0.3, 0};   // gooch: its own tones (Gooch et al. 1998)
    double cool_share = 0.2, warm_share = 0.6;  // and the matter's shares in them
};

/// The orders that a method has: n of pips and leg, of every other method 1 alone.
struct Orders {
    int least = 1, most = 1;
};
constexpr Orders orders_of(Method method) {
    if (method == Method::pips) return {1, 5};
    if (method == Method::leg) return {2, 4};
    return {};
}

struct ClassificationSettings {
    Method method = Method::pc;
    std::optional<int> order;  // n of pips and leg
    int table_size = 256;      // pi2d: nodes a side
    TableLookup lookup = TableLookup::bilinear;
    AlphaEncoding encoding = AlphaEncoding::alpha;
    WallRule opaque_prediction = WallRule::twice;  // none: for experiments, thin opaque surfaces are lost
    bool as_printed = false;                       // for experiments only: pips with the errors of the paper

    /// The order; where none is given, the least that the method has.
    int order_or_least() const { return order.value_or(orders_of(method).least); }
};

struct CompositingSettings {
    CompositingMode mode = CompositingMode::over;
    CompositingForm form = CompositingForm::automatic;  // automatic: the precision preset's
};

struct OutputSettings {
    bool depth = false;  // Z of the first hit, and Z.mean weighted by opacity; world units from the eye plane
    bool normals = false;       // N.x N.y N.z of the first hit
    bool samples = false;       // slabs composited
    bool transparency = false;  // T
    bool fixed = false;         // fixed.R ...: raw words
};

struct PrecisionSettings {
    std::string preset = "default";  // one of kPrecisionPresets, or a file
    double budget = 0.5;             // of `auto`, LSB8
    Guarantee guarantee = Guarantee::pictures;
    std::array<std::optional<std::string>, kWires>
        override_;  // by wire: "u1.15 trn sat"; parts may be left out
};

struct Scene {
    VolumeSource volume;
    TransferFunctionSettings transfer_function;
    CameraSettings camera;
    ImageSettings image;
    SamplingSettings sampling;
    ClipSettings clip;
    std::vector<Light> lights;
    ShadingSettings shading;
    ClassificationSettings classification;
    CompositingSettings compositing;
    OutputSettings output;
    PrecisionSettings precision;
    std::string folder;  // paths in the scene are relative to it

    // Not settings, but for messages: the file, and where each setting was given ("head.toml:7:1", "--set").
    std::string name;
    std::map<std::string, std::string, std::less<>> given_at;
};

/// Compares the settings as written, not where they were given.
bool operator==(const Scene& a, const Scene& b);

/// Calls visit(key, setting, help) for every plain setting of a scene.  `lights`, a list of tables, has
/// visit_light().
template <class S, class V>
void visit_scene(S& scene, V&& visit) {
    auto& volume = scene.volume;
    visit("volume.file", volume.file,
          "NRRD, MetaImage, NIfTI, DICOM, VTI or raw file, or a folder of DICOM, TIFF or PNG slices; "
          "${VARIABLE} expands");
    visit("volume.procedural", volume.procedural, "built-in volume, used when no file is named");
    visit("volume.dims", volume.dims, "voxels along x, y, z: required for raw, optional for procedural");
    visit("volume.type", volume.type, "raw files: u8, i8, u16, i16, u32, i32, u64, i64, f32 or f64");
    visit("volume.endian", volume.endian, "raw files: little or big");
    visit("volume.offset", volume.offset, "raw files: bytes before the first voxel");
    visit("volume.spacing", volume.spacing, "world units between voxels along x, y, z; overrides the file's");
    visit("volume.window", volume.window,
          "[least, greatest] value kept; of floats that have none: all finite ones");
    visit("volume.bits", volume.bits,
          "float and procedural data: bits the values are quantised to; 0: 16 for floats");
    visit("volume.scale", volume.value_scale,
          "value = scale * stored + value_offset, in the file's units (HU); default: what the file declares, "
          "or "
          "1");
    visit("volume.value_offset", volume.value_offset, "see scale; default: what the file declares, or 0");
    visit("volume.nan", volume.nan, "the value of voxels that are not a number; they are refused without");
    visit("volume.component", volume.component,
          "which of several numbers a voxel, or of several times, counted from 0");
    visit("volume.series", volume.series,
          "DICOM: which of the folder's series, counted from 1; 0: its only one");
    visit("volume.space", volume.space,
          "file: world axes as the file states them; lps: a NRRD's turned to LPS");
    auto& tf = scene.transfer_function;
    visit("transfer_function.points", tf.points, "list of [value, r, g, b, alpha], values ascending");
    visit("transfer_function.color", tf.color, "list of [value, r, g, b]; with opacity, instead of points");
    visit("transfer_function.opacity", tf.opacity, "list of [value, alpha]");
    visit("transfer_function.preset", tf.preset, "built-in function by name: ct_bone, ct_skin, ...");
    visit("transfer_function.file", tf.file,
          "ParaView .json colour map, Slicer .vp or .vp.json, ImageVis3D .1dt");
    visit("transfer_function.map", tf.map, "of a .json file that holds several: the name of the colour map");
    visit("transfer_function.color_space", tf.color_space, "linear, or srgb: colours are decoded first");
    visit("transfer_function.unit_distance", tf.unit_distance,
          "world units of matter that an alpha is given for (required)");
    visit("transfer_function.entries", tf.entries, "samples of the function; 0: one per level, at most 4096");
    visit("transfer_function.range", tf.range,
          "values that the first and the last point are moved to, the others between them in proportion; "
          "\"data\": the least and the greatest in the volume; []: left where they are");
    auto& camera = scene.camera;
    visit("camera.projection", camera.projection, "orthographic or perspective");
    visit("camera.eye", camera.eye, "world position; overrides azimuth and elevation");
    visit("camera.center", camera.center, "world position looked at; default: the volume's middle");
    visit("camera.up", camera.up, "up in the picture; default: z, or y where the view is along z");
    visit("camera.azimuth", camera.azimuth, "degrees about z; 0 looks along +y");
    visit("camera.elevation", camera.elevation, "degrees above the horizon");
    visit("camera.height", camera.height,
          "orthographic: world units from bottom to top; default: all of the volume");
    visit("camera.fov_y", camera.fov_y, "perspective: vertical field of view in degrees");
    visit("camera.turntable", camera.turntable, "pictures in a full turn");
    visit("image.width", scene.image.width, "pixels");
    visit("image.height", scene.image.height, "pixels");
    visit("image.background", scene.image.background, "linear colour under the preview; EXR holds none");
    visit("sampling.step", scene.sampling.step, "between samples, in units of the smallest voxel spacing");
    visit("sampling.termination", scene.sampling.termination, "a ray ends when T falls below this; 0: never");
    visit("sampling.position", scene.sampling.position, "p0_kv (exact, quantised once) or accumulate");
    visit("sampling.interpolation", scene.sampling.interpolation, "trilinear or nearest");
    visit("sampling.lerp", scene.sampling.lerp,
          "one_product, v0 + w (v1 - v0), or two_products, v0 (1 - w) + v1 w, each rounded");
    visit("clip.low", scene.clip.low, "corner of the box kept, world units");
    visit("clip.high", scene.clip.high, "opposite corner");
    auto& shading = scene.shading;
    visit("shading.model", shading.model,
          "none, phong, blinn_phong, cone or gooch; absent where there is no light");
    visit("shading.gradient", shading.gradient,
          "central, central_samples, analytic, sobel or cubic_spline (of Catmull and Rom)");
    visit("shading.ka", shading.ka, "ambient weight");
    visit("shading.kd", shading.kd, "diffuse weight");
    visit("shading.ks", shading.ks, "specular weight");
    visit("shading.exponent", shading.exponent, "specular exponent; a power of two for squaring");
    visit("shading.power", shading.power, "squaring, parabola or table");
    visit("shading.two_sided", shading.two_sided, "light both sides of a surface");
    visit("shading.exaggeration", shading.exaggeration,
          "a normal is turned from the mean about it, of 5^3 voxels: e of N + e (N - N_mean); 0: off");
    visit("shading.gradient_floor", shading.gradient_floor,
          "light counts by the length of the gradient over this, at most 1, in levels per smallest voxel "
          "spacing; 0: always "
          "in full");
    visit(
        "shading.inside", shading.inside,
        "where inside a slab its light is taken: mean of the ends' gradients, front, middle, adaptive (1, 2 "
        "or 4 pieces as it turns), linear (fades from end to end), nlpi (with the normal kept at length "
        "one), "
        "centroid (of the light) or two_point (places of half the light each); default: the method's, which "
        "the plan names; pc and pc_mid have one sample");
    visit("shading.cone_slope", shading.cone_slope, "cone: energy, (n + 1) / 2 of exponent n, or paper, n");
    visit("shading.cool_side", shading.cool_side, "gooch: what turns cool, shadow or light (as printed)");
    visit("shading.cool", shading.cool, "gooch: colour of the cool side");
    visit("shading.warm", shading.warm, "gooch: colour of the warm side");
    visit("shading.cool_share", shading.cool_share,
          "gooch: what the cool side has of kd times the matter's colour");
    visit("shading.warm_share", shading.warm_share, "gooch: what the warm side has of it");
    auto& classification = scene.classification;
    visit("classification.method", classification.method,
          "pc, pc_mid, pi2d, pi2d_no_attenuation, pi1d, pi1d_engel, pips or leg");
    visit("classification.order", classification.order,
          "n of pips (1 to 5; default 1) and leg (2 to 4; default 2)");
    visit("classification.table_size", classification.table_size, "entries a side of pi2d, 64 to 4096");
    visit("classification.lookup", classification.lookup, "pi2d: bilinear or nearest");
    visit(
        "classification.encoding", classification.encoding,
        "what of an opacity is stored in table_alpha's format: alpha, sqrt_alpha or transparency, 1 - alpha");
    visit(
        "classification.opaque_prediction", classification.opaque_prediction,
        "where opaque values inside a slab are looked for: ends (between the values at its ends), twice (at "
        "three samples inside, too, where a cell on its way has both sides of one) or none");
    visit("classification.as_printed", classification.as_printed,
          "pips as Lee & Shin print it: sums by rectangles, the series at every depth, poles and all, opaque "
          "prediction one way only");
    visit("compositing.mode", scene.compositing.mode, "over, mip, minip or average");
    visit("compositing.form", scene.compositing.form,
          "w, w_carry (remainders carried on), equation_9, alpha, back_to_front, unit255_shift, "
          "unit255_blinn or "
          "straight (C is divided by its opacity); auto: w, but unit255_shift for the preset eight_bit and "
          "equation_9 for squeeze, volumepro, vizard2 and ultravis");
    visit("output.depth", scene.output.depth, "channels Z and Z.mean");
    visit("output.normals", scene.output.normals, "channels N.x N.y N.z");
    visit("output.samples", scene.output.samples, "channel samples");
    visit("output.transparency", scene.output.transparency, "channel T");
    visit("output.fixed", scene.output.fixed, "channels fixed.R fixed.G fixed.B fixed.T: the raw words");
    visit(
        "precision.preset", scene.precision.preset,
        "default, squeeze, eight_bit, volumepro, vizard2, ultravis, wide, real, float32, auto (formats from "
        "budget) or a preset file");
    visit("precision.budget", scene.precision.budget,
          "auto: the most that roundings may take from any pixel, LSB8, proven");
    visit("precision.guarantee", scene.precision.guarantee,
          "auto: what the bound is of: the pictures of the command, or every view of the scene");
    for (int i = 0; i < kWires; ++i) {
        const auto& wire = kWireInfo[static_cast<std::size_t>(i)];
        visit("precision." + std::string(wire.name), scene.precision.override_[static_cast<std::size_t>(i)],
              wire.meaning);
    }
}

template <class L, class V>
void visit_light(L& light, V&& visit) {
    visit("headlight", light.headlight, "shines along the camera's axis");
    visit("direction", light.direction, "towards the light, world space");
    visit("color", light.color, "linear colour");
}

/// The scene rendered when none is named: the phantom with skin, bone and vessels, PIPS(1), and one light.
Scene built_in_scene();

/// Reads a scene file, then `key=value` overrides in order (TOML values; bare words are strings).  Throws
/// InputError `file:line:column: what, what was found, what is allowed`.
Scene read_scene(const std::string& path, const std::vector<std::string>& overrides = {});
Scene scene_with(Scene base, const std::vector<std::string>& overrides);
/// The same from text; messages call it `name`.
Scene parse_scene(std::string_view text, const std::string& name, const std::string& folder,
                  const std::vector<std::string>& overrides = {});

/// Where a setting was given, for the beginning of a message: "head.toml:7:8: sampling.step" or "--set
/// sampling.step".
std::string where(const Scene& scene, std::string_view key);

/// The path to open for a path as written in a setting: replaces ${VARIABLE} from the environment and takes
/// it relative to `folder`.  Throws InputError beginning with `setting` where a variable is unset or empty,
/// or ${ is not closed.
std::string expand_path(const std::string& text, const std::string& folder, const std::string& setting);
/// The volume's source with its path expanded, for load_volume().  The scene keeps the path as written: no
/// record names a folder of this machine.
VolumeSource volume_source(const Scene& scene);

/// The built-in precision presets.
inline constexpr std::string_view kPrecisionPresets[] = {
    "default", "squeeze", "eight_bit", "volumepro", "vizard2", "ultravis", "wide", "real", "float32", "auto"};
/// The precision settings with a preset file, where one is named, merged under the scene's own wires:
/// `preset` is then a built-in one.  A preset file is TOML with one table, [precision]: a built-in `preset`,
/// and wires. Throws InputError.
PrecisionSettings resolved_precision(const Scene& scene);

/// The whole scene as key -> TOML value, with every key ("auto" where absent): for EXR attributes and
/// records. Each pair, joined by `=`, is an override that sets the same value again.
std::vector<std::pair<std::string, std::string>> resolved(const Scene& scene);
/// A TOML file that reads back as the same scene.
std::string to_toml(const Scene& scene);

/// Help: a line a setting, with key, default and meaning.
std::string scene_help();
/// docs/scene.md: every key with its default, allowed values and meaning.
std::string scene_reference_markdown();

/// The scene's transfer function, from points, preset or file, stretched to `range` over the volume's values.
/// Throws InputError.
TransferFunction resolve_transfer_function(const Scene& scene, const Volume& volume);
/// The program of a transfer function's file, by the end of its name.  Slicer's bring a unit distance.
enum class FunctionFile { paraview, slicer_text, slicer_json, imagevis3d, unknown };
FunctionFile function_file(std::string_view name);
inline bool brings_unit_distance(FunctionFile file) {
    return file == FunctionFile::slicer_text || file == FunctionFile::slicer_json;
}
/// All names for `transfer_function.preset`: those of CT in HU, and `phantom` for the built-in volume.
std::vector<std::string> transfer_function_presets();

}  // namespace squint
