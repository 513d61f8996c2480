// Scene files and overrides: what is read, what is refused, and that texts read back as the same scene.
#include "scene/scene.h"

#include "core/error.h"
#include "scene/toml.h"
#include "tests/own_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <random>
#include <sstream>

namespace squint {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

constexpr std::string_view kFunction =
    "[transfer_function]\nunit_distance = 1\npoints = [[0, 1, 1, 1, 0], [255, 1, 1, 1, 1]]\n";

Scene scene_of(std::string_view text, const std::vector<std::string>& overrides = {}) {
    return parse_scene(std::string(kFunction) + std::string(text), "s.toml", "", overrides);
}

template <class F>
std::string message_of(F&& read) {
    try {
        read();
    } catch (const InputError& error) {
        return error.what();
    }
    return "accepted";
}
/// The message for a text below kFunction's three lines: line 4 is its first.
std::string refusal(std::string_view text, const std::vector<std::string>& overrides = {}) {
    return message_of([&] { scene_of(text, overrides); });
}
/// The message for a whole file.
std::string refusal_of_file(std::string_view text) {
    return message_of([&] { parse_scene(text, "s.toml", ""); });
}

// --- Reading -------------------------------------------------------------------------------------

TEST(SceneFile, SetsWhatItNamesAndLeavesTheRest) {
    const Scene scene = scene_of(
        "[volume]\nfile = 'head.nrrd'\nspacing = [1, 1, 2.5]\n"
        "[camera]\nprojection = 'perspective'\neye = [0, -300, 10]\n"
        "[sampling]\nstep = 0.5\n"
        "[classification]\nmethod = 'pi2d'\n"
        "[precision]\npreset = 'squeeze'\nsample = 'u12.8 rnd'\n"
        "[[lights]]\nheadlight = true\n[[lights]]\ndirection = [1, 2, 3]\n");
    EXPECT_EQ(scene.volume.file, "head.nrrd");
    EXPECT_EQ(scene.volume.procedural, "");
    EXPECT_EQ(scene.volume.spacing, (std::vector<double>{1, 1, 2.5}));
    EXPECT_EQ(scene.camera.projection, Projection::perspective);
    EXPECT_EQ(scene.camera.eye, Vec3(0, -300, 10));
    EXPECT_FALSE(scene.camera.center.has_value());
    EXPECT_EQ(scene.sampling.step, 0.5);
    EXPECT_EQ(scene.sampling.termination, 1.0 / 1024);
    EXPECT_EQ(scene.classification.method, Method::pi2d);
    EXPECT_EQ(scene.precision.override_[static_cast<std::size_t>(Wire::sample)], "u12.8 rnd");
    ASSERT_EQ(scene.lights.size(), 2u);
    EXPECT_TRUE(scene.lights[0].headlight);
    EXPECT_EQ(scene.lights[1].direction, Vec3(1, 2, 3));
}

TEST(SceneFile, TakesShorthands) {
    EXPECT_EQ(scene_of("[volume]\ndims = 64\n").volume.dims, (std::vector<std::int64_t>{64, 64, 64}));
    EXPECT_EQ(scene_of("[volume]\nspacing = 0.5\n").volume.spacing, (std::vector<double>{0.5, 0.5, 0.5}));
    const Scene lit = parse_scene("lights = 'headlight'\n" + std::string(kFunction), "s.toml", "");
    ASSERT_EQ(lit.lights.size(), 1u);
    EXPECT_TRUE(lit.lights[0].headlight);
    EXPECT_TRUE(parse_scene("lights = []\n" + std::string(kFunction), "s.toml", "").lights.empty());
}

TEST(SceneFile, IsTheSameWithWindowsLineBreaks) {
    EXPECT_EQ(parse_scene("[transfer_function]\r\npreset = 'phantom'\r\n", "s.toml", ""),
              parse_scene("[transfer_function]\npreset = 'phantom'\n", "s.toml", ""));
}

TEST(SceneFile, RemembersWhereASettingWasGiven) {
    const Scene scene = scene_of("[sampling]\nstep = 2\n", {"image.width=64"});
    EXPECT_EQ(where(scene, "sampling.step"), "s.toml:5:8: sampling.step");
    EXPECT_EQ(where(scene, "image.width"), "--set image.width");
    EXPECT_EQ(where(scene, "camera.eye"), "s.toml: camera.eye");
}

// --- Refusals ------------------------------------------------------------------------------------

TEST(SceneFile, NamesTheNearestSettingForAnUnknownOne) {
    EXPECT_EQ(refusal("[precision]\nsampel = 'u1.15'\n"),
              "s.toml:5:1: unknown setting \"sampel\"; did you mean \"sample\"?");
    EXPECT_EQ(refusal("[camra]\nheight = 1\n"),
              "s.toml:4:2: unknown setting \"camra\"; did you mean \"camera\"?");
    EXPECT_EQ(refusal_of_file("step = 1\n"),
              "s.toml:1:1: unknown setting \"step\"; did you mean \"sampling.step\"?");
    EXPECT_EQ(refusal("[[lights]]\ncolour = [1, 1, 1]\n"),
              "s.toml:5:1: unknown setting \"colour\"; did you mean \"color\"?");
    EXPECT_EQ(refusal("[image]\nzzzzzz = 1\n"),
              "s.toml:5:1: unknown setting \"zzzzzz\"; allowed in image: background, height or width");
    EXPECT_EQ(refusal("", {"sampling.step.x=1"}),
              "--set sampling.step.x: found a name below sampling.step; allowed: sampling.step itself");
    EXPECT_THAT(refusal("", {"sampeling.step=1"}),
                EndsWith("unknown setting \"sampeling\"; did you mean \"sampling\"?"));
    EXPECT_EQ(refusal("", {"sampling.stepp=1"}),
              "--set sampling.stepp: unknown setting \"stepp\"; did you mean \"step\"?");
}

TEST(SceneFile, SaysWhichTypeWasFoundAndWhichIsAllowed) {
    EXPECT_EQ(refusal("[sampling]\nstep = 'small'\n"),
              "s.toml:5:8: sampling.step: found the string \"small\"; allowed: a number above 0");
    EXPECT_EQ(refusal("[image]\nwidth = 2.5\n"),
              "s.toml:5:9: image.width: found 2.5; allowed: a whole number from 1 to 16384");
    EXPECT_EQ(refusal("[camera]\neye = [1, 2]\n"),
              "s.toml:5:7: camera.eye: found [1, 2]; allowed: three numbers [x, y, z], or \"auto\"");
    EXPECT_EQ(refusal("[output]\ndepth = 1\n"), "s.toml:5:9: output.depth: found 1; allowed: true or false");
    EXPECT_EQ(refusal("[volume]\nfile = [1, 2, 3]\n"),
              "s.toml:5:8: volume.file: found [1, 2, 3]; allowed: a path in quotes");
    EXPECT_EQ(refusal_of_file("image = 3\n"), "s.toml:1:9: image: found 3; allowed: a table of settings");
    EXPECT_EQ(refusal("[volume]\nfile = 1979-05-27\n"),
              "s.toml:5:8: volume.file: found a date or time; allowed: a path in quotes");
}

TEST(SceneFile, ListsTheNamesOfAnEnumeration) {
    EXPECT_EQ(refusal("[classification]\nmethod = 'pisp'\n"),
              "s.toml:5:10: classification.method: found \"pisp\"; did you mean \"pips\"? Allowed: pc, "
              "pc_mid, pi2d, "
              "pi2d_no_attenuation, pi1d, pi1d_engel, pips or leg");
    EXPECT_THAT(refusal("[volume]\nprocedural = 'fantom'\n"),
                HasSubstr("did you mean \"phantom\"? Allowed: "));
    EXPECT_THAT(refusal_of_file("[transfer_function]\npreset = 'ct_bnoe'\n"),
                HasSubstr("did you mean \"ct_bone\"? Allowed: "));
    EXPECT_EQ(refusal("[precision]\npreset = 'fast'\n"),
              "s.toml:5:10: precision.preset: found \"fast\"; allowed: default, squeeze, eight_bit, "
              "volumepro, vizard2, ultravis, wide, "
              "real, float32 or auto, or the path of "
              "a preset file");
}

TEST(SceneFile, RefusesNumbersOutOfRange) {
    struct Case {
        const char *override_, *allowed;
    };
    for (const auto& [text, allowed] : std::vector<Case>{
             {"sampling.step=0", "a number above 0"},
             {"sampling.step=-1", "a number above 0"},
             {"sampling.step=nan", "a number above 0"},
             {"sampling.step=inf", "a number above 0"},
             {"sampling.termination=1", "a number of at least 0 and below 1"},
             {"image.width=0", "a whole number from 1 to 16384"},
             {"image.height=16385", "a whole number from 1 to 16384"},
             {"image.background=[0, 0, 2]", "three numbers [r, g, b] from 0 to 1"},
             {"transfer_function.entries=1", "a whole number from 2 to 65536, or 0"},
             {"transfer_function.entries=65537", "a whole number from 2 to 65536, or 0"},
             {"shading.ka=1.5", "a number from 0 to 1"},
             {"shading.exponent=5000", "a number from 1 to 4096"},
             {"classification.order=6", "a whole number from 1 to 5, or \"auto\""},
             {"classification.table_size=63", "a whole number from 64 to 4096"},
             {"camera.turntable=0", "a whole number from 1 to 10000"},
             {"camera.fov_y=180", "a number above 0 and below 180"},
             {"camera.height=0", "a number above 0, or \"auto\""},
             {"camera.eye=[0, nan, 0]", "three numbers [x, y, z], or \"auto\""},
             {"volume.dims=[4, 0, 4]", "one or three whole numbers from 1 to 1073741824"},
             {"volume.spacing=[1, -1, 1]", "one or three numbers above 0"},
             {"volume.window=[5, 5]", "two numbers, the first below the second"},
             {"volume.bits=17", "a whole number from 0 to 16"},
             {"volume.offset=-1", "a whole number of 0 or more"},
         }) {
        const std::string key(text, std::string_view(text).find('='));
        EXPECT_THAT(refusal("", {text}), testing::AllOf(StartsWith("--set " + key + ": found "),
                                                        EndsWith("; allowed: " + std::string(allowed))));
        EXPECT_THAT(refusal_of_file(text), StartsWith("s.toml:1:")) << "the same in a file";
    }
}

TEST(SceneFile, PointsAtTheRowThatIsWrong) {
    const auto points = [](std::string_view rows) {
        return refusal_of_file("[transfer_function]\nunit_distance = 1\npoints = [\n" + std::string(rows) +
                               "]\n");
    };
    EXPECT_THAT(points("[0, 1, 1, 1, 0],\n[1, 1, 1]\n"),
                StartsWith("s.toml:5:1: transfer_function.points: found [1, 1, 1]; allowed: "));
    EXPECT_THAT(points("[9, 1, 1, 1, 0],\n[1, 1, 1, 1, 0]\n"),
                StartsWith("s.toml:5:1: transfer_function.points: found value 1 after 9; "));
    EXPECT_THAT(points("[0, 1, 1, 1, 1.5],\n"),
                StartsWith("s.toml:4:14: transfer_function.points: found 1.5; "));
    EXPECT_THAT(points("[nan, 1, 1, 1, 1],\n"),
                StartsWith("s.toml:4:1: transfer_function.points: found [nan, 1, 1, 1, 1]; "));
}

TEST(SceneFile, RefusesLightsThatShineNowhereOrAreTooMany) {
    EXPECT_EQ(
        refusal("[[lights]]\ndirection = [0, 0, 0]\n"),
        "s.toml:5:13: lights.direction: found [0, 0, 0]; allowed: three numbers [x, y, z], not all zero");
    EXPECT_THAT(refusal("[[lights]]\ncolor = [1, 2, 1]\n"),
                StartsWith("s.toml:5:9: lights.color: found [1, 2, 1]; "));
    std::string nine;
    for (int i = 0; i < 9; ++i) nine += "[[lights]]\n";
    EXPECT_THAT(refusal(nine), HasSubstr("lights: found 9 lights; allowed: at most 8"));
    EXPECT_THAT(refusal("[lights]\nheadlight = true\n"),
                HasSubstr("lights: found a table; allowed: [[lights]] tables"));
}

TEST(SceneFile, WantsExactlyOneTransferFunction) {
    EXPECT_EQ(refusal_of_file(""),
              "s.toml: transfer_function: found none; allowed: exactly one of points, color with opacity, "
              "preset, file");
    EXPECT_THAT(refusal("preset = 'phantom'\n"),
                HasSubstr("found points and preset; allowed: exactly one of"));
    EXPECT_THAT(refusal_of_file("[transfer_function]\nunit_distance = 1\ncolor = [[0, 1, 1, 1]]\n"),
                EndsWith("found no opacity; allowed: color and opacity together"));
    EXPECT_THAT(refusal_of_file("[transfer_function]\npoints = [[0, 1, 1, 1, 1]]\n"),
                StartsWith("s.toml: transfer_function.unit_distance: found none; allowed: a number above 0"));
    EXPECT_THAT(refusal_of_file("[transfer_function]\nunit_distance = 0\npoints = [[0, 1, 1, 1, 1]]\n"),
                StartsWith("s.toml:2:17: transfer_function.unit_distance: found 0; "));
    EXPECT_EQ(refusal_of_file("[transfer_function]\nfile = 'a.vp'\n"), "accepted");
    EXPECT_THAT(refusal_of_file("[transfer_function]\nfile = 'a.xml'\n"),
                StartsWith("s.toml:2:8: transfer_function.file: found \"a.xml\"; allowed: a ParaView"));
    EXPECT_THAT(refusal_of_file("[transfer_function]\nfile = 'a.json'\n"),
                HasSubstr("unit_distance: found none"));
}

TEST(SceneFile, RefusesWhatOnlySeveralSettingsTogetherShow) {
    EXPECT_EQ(refusal("[clip]\nlow = [0, 5, 0]\nhigh = [9, 5, 9]\n"),
              "s.toml:6:8: clip.high: found 5 along y, but clip.low has 5; allowed: a corner above clip.low "
              "along each axis");
    EXPECT_THAT(refusal("[volume]\nfile = 'a.nrrd'\nprocedural = 'sphere'\n"),
                HasSubstr("found file and procedural"));
    EXPECT_THAT(refusal("[camera]\nup = [0, 0, 0]\n"), HasSubstr("camera.up: found [0, 0, 0]; "));
}

TEST(SceneFile, RefusesBytesThatAreNotPlainText) {
    EXPECT_THAT(refusal("# caf\xe9\n"), StartsWith("s.toml:4:6: found byte 0xe9; allowed: UTF-8"));
    EXPECT_THAT(refusal("# caf\xc2\x9b\n"), StartsWith("s.toml:4:6: found byte 0xc2; "))
        << "a control character of eight bits";
    EXPECT_THAT(refusal(std::string_view("a\0b", 3)), StartsWith("s.toml:4:2: found byte 0x00; "));
    EXPECT_THAT(refusal("a\rb"), StartsWith("s.toml:4:2: found byte 0x0d; "));
    EXPECT_EQ(refusal_of_file("[transfer_function]\nfile = 'a\tb.vp' \t# tab\r\n"), "accepted");
}

TEST(SceneFile, RefusesBrokenTomlAtItsPlace) {
    EXPECT_THAT(refusal("[&"), StartsWith("s.toml"));  // aborts toml++ 3.3 where its asserts abort
    EXPECT_THAT(refusal("[image\nwidth = 3\n"), StartsWith("s.toml:4:7: not TOML: "));
    EXPECT_THAT(refusal("[image]\nwidth = 3\nwidth = 4\n"), StartsWith("s.toml:6:"));
    EXPECT_THAT(refusal("x = " + std::string(1000, '[')), StartsWith("s.toml:4:"));
}

TEST(SceneFile, RefusesFilesThatCannotBeRead) {
    EXPECT_THAT(message_of([] { read_scene("no/such.toml"); }), StartsWith("no/such.toml: cannot read: "));
    EXPECT_THAT(message_of([] { read_scene("."); }), StartsWith(".: cannot read: "));
}

// --- Overrides -----------------------------------------------------------------------------------

TEST(SceneOverrides, TheValueGivenLastWins) {
    EXPECT_EQ(scene_of("[sampling]\nstep = 2\n", {"sampling.step=3", "sampling.step = 0.5"}).sampling.step,
              0.5);
}

TEST(SceneOverrides, TakeBareWordsPathsListsAndTables) {
    const Scene scene = scene_of(
        "", {"volume.file=${DATA}/ct-head_1.nrrd", "classification.method=leg", "precision.sample=u1.15 trn",
             "lights=[{headlight=true}, {direction=[1,0,0]}]", "shading={ka=0.5, model='phong'}",
             "transfer_function.points=[[0,0,0,0,0],[9,1,1,1,1]]"});
    EXPECT_EQ(scene.volume.file, "${DATA}/ct-head_1.nrrd");
    EXPECT_EQ(scene.classification.method, Method::leg);
    EXPECT_EQ(scene.precision.override_[static_cast<std::size_t>(Wire::sample)], "u1.15 trn");
    EXPECT_EQ(scene.lights.size(), 2u);
    EXPECT_EQ(scene.shading.ka, 0.5);
    EXPECT_EQ(scene.shading.model, ShadingModel::phong);
    EXPECT_EQ(scene.transfer_function.points[1][0], 9);
}

TEST(SceneFile, IsUtf8InStringsKeysAndComments) {
    const std::string text =
        "# caf\xc3\xa9\n[volume]\nfile = '\xe2\x82\xac/k\xc3\xb6pfe.nrrd'  # \xf0\x9f\x98\x80\n"
        "[transfer_function]\nfile = \"\xc3\xbc @0: \\u00fc.vp\"\n";
    const Scene scene = parse_scene(text, "s.toml", "");
    EXPECT_EQ(scene.volume.file, "\xe2\x82\xac/k\xc3\xb6pfe.nrrd");
    EXPECT_EQ(scene.transfer_function.file, "\xc3\xbc @0: \xc3\xbc.vp");
    EXPECT_EQ(parse_scene("\xef\xbb\xbf" + text, "s.toml", "").volume.file, scene.volume.file)
        << "after a byte order mark";
    EXPECT_THAT(refusal("a = { '\xc3\xbc\xc3\xbc' = 1, b 2 }\n"), StartsWith("s.toml:4:19: not TOML: "))
        << "columns count characters";
    EXPECT_THAT(refusal("['\xc3\xbc']\n"), testing::HasSubstr("unknown setting \"\\u00FC\""));
}

TEST(SceneOverrides, TakePathsThatAreNotAscii) {
    for (const std::string path : {"Pr\xc3\xbc"
                                   "fung/k\xc3\xb6pfe.nrrd",
                                   "latin-\xfc.nrrd"})
        EXPECT_EQ(scene_with(built_in_scene(), {"volume.file=" + path}).volume.file, path);
    EXPECT_EQ(scene_with(built_in_scene(), {"volume.file='k\xc3\xb6pfe.nrrd'"}).volume.file,
              "k\xc3\xb6pfe.nrrd");
}

TEST(SceneOverrides, ReplaceSettingsThatExcludeThem) {
    const Scene preset = scene_of("", {"transfer_function.preset=phantom"});
    EXPECT_TRUE(preset.transfer_function.points.empty());
    EXPECT_EQ(preset.transfer_function.unit_distance, 0) << "the preset's own";
    const Scene kept =
        scene_of("", {"transfer_function.unit_distance=2", "transfer_function.preset=phantom"});
    EXPECT_EQ(kept.transfer_function.unit_distance, 2);
    EXPECT_EQ(scene_of("[volume]\nfile='a.nrrd'\n", {"volume.procedural=sphere"}).volume.file, "");
    EXPECT_EQ(scene_of("[volume]\nprocedural='sphere'\n", {"volume.file=a.nrrd"}).volume.procedural, "");
}

TEST(SceneOverrides, TakeAnOptionalSettingBack) {
    const Scene scene = scene_of("[camera]\neye = [1, 2, 3]\n[precision]\nsample = 'u1.15'\n",
                                 {"camera.eye=auto", "precision.sample=auto"});
    EXPECT_EQ(scene, scene_of(""));
}

TEST(SceneOverrides, AreRefusedByTheirKey) {
    EXPECT_EQ(refusal("", {"image.width"}), "--set image.width: found no value; allowed: key=value");
    EXPECT_THAT(refusal("", {"image.width="}), StartsWith("--set image.width: found no value; "));
    EXPECT_THAT(refusal("", {"=3"}), StartsWith("--set =: found no value"));
    EXPECT_THAT(refusal("", {"image.width=big"}),
                StartsWith("--set image.width: found the string \"big\"; allowed: a whole number"));
    EXPECT_THAT(refusal("", {"lights=[{headlight=true}"}),
                StartsWith("--set lights: found \"[{headlight=true}\", which is not"));
    EXPECT_THAT(refusal("", {"lights=[{headligth=true}]"}),
                StartsWith("--set lights: unknown setting \"headligth\"; did you mean"));
    EXPECT_THAT(refusal("", {"image.width=3\nimage.height=4"}), StartsWith("--set image.width: found "));
    EXPECT_THAT(refusal("", {"precision.sample=u1.15 round"}),
                StartsWith("--set precision.sample: found \"u1.15 round\"; allowed: a format"));
    EXPECT_THAT(refusal("", {"volume.file=[caf\xc3\xa9"}),
                StartsWith("--set volume.file: found \"[caf\\u00E9\", which is not"));
    EXPECT_THAT(refusal("", {"volume.file=caf\x1b.nrrd"}),
                StartsWith("--set volume.file: found \"caf\\u001B.nrrd\", which is not"));
}

// --- Texts that read back ------------------------------------------------------------------------

class RandomScenes {
  public:
    explicit RandomScenes(unsigned seed) : random_(seed) {}

    Scene next() {
        Scene scene;
        visit_scene(scene,
                    [&](std::string_view key, auto& setting, std::string_view) { fill(key, setting); });
        if (heads())
            scene.volume.procedural = "sphere", scene.volume.file.clear();
        else
            scene.volume.file = "a \"b\"\\ \xc3\xa9\n.nrrd", scene.volume.procedural.clear();
        scene.volume.window = heads() ? std::vector<double>{} : std::vector<double>{-number(), 1 + number()};
        if (scene.clip.low && scene.clip.high)
            *scene.clip.high = *scene.clip.low + Vec3(1 + number(), 1, 0.1);
        function(scene.transfer_function);
        for (int n = whole(0, kMostLights); n > 0; --n)
            scene.lights.push_back({heads(), Vec3(number(), number(), 1), Vec3(number(), 0, 1)});
        return scene;
    }

  private:
    bool heads() { return (random_() & 1u) != 0; }
    int whole(int low, int high) {
        return low + static_cast<int>(random_() % static_cast<unsigned>(high - low + 1));
    }
    double number() { return std::uniform_real_distribution<double>(0, 1)(random_); }

    void fill(std::string_view key, std::string& text) {
        if (key == "volume.type") text = heads() ? "" : "u16";
        if (key == "volume.endian") text = heads() ? "big" : "little";
        if (key == "transfer_function.color_space") text = heads() ? "srgb" : "linear";
        if (key == "precision.preset") text = heads() ? "wide" : "${HOME}/found.toml";
    }
    template <class E>
    requires std::is_enum_v<E>
    void fill(std::string_view, E& value) {
        value = static_cast<E>(whole(0, static_cast<int>(std::size(EnumNames<E>::names)) - 1));
    }
    void fill(std::string_view, bool& flag) { flag = heads(); }
    void fill(std::string_view key, double& value) {
        value = key == "shading.exponent" ? 1 + number() * 4000 : number() * 0.99 + 1e-9;
    }
    template <class I>
    requires std::is_integral_v<I>
    void fill(std::string_view key, I& value) {
        if (key == "classification.table_size")
            value = static_cast<I>(whole(64, 4096));
        else
            value = static_cast<I>(whole(key == "transfer_function.entries" ? 2 : 1, 5));
    }
    void fill(std::string_view, Vec3& value) { value = Vec3(number(), number(), number()); }
    void fill(std::string_view, ValueRange& range) {
        range.of_data = heads();
        range.ends = range.of_data || heads() ? std::vector<double>{} : std::vector<double>{-number(), 1e9};
    }
    void fill(std::string_view, std::vector<double>& list) { list = {number() + 1e-6, 1e-300, 12345678.9}; }
    void fill(std::string_view, std::vector<std::int64_t>& list) { list = {whole(1, 9), 1 << 30, 1}; }
    void fill(std::string_view, std::vector<std::vector<double>>&) {}  // see function()
    void fill(std::string_view, std::optional<std::string>& spec) {
        if (heads())
            spec = std::vector<std::string>{"u1.15", "s3.0 trn_zero",
                                            "wrap"}[static_cast<std::size_t>(whole(0, 2))];
    }
    template <class T>
    void fill(std::string_view key, std::optional<T>& value) {
        if (heads()) fill(key, value.emplace());
    }

    void function(TransferFunctionSettings& tf) {
        const int kind = whole(0, 3);
        double value = -1000 * number();
        for (int n = whole(1, 6); n > 0; --n, value += number() * (heads() ? 1 : 0)) {
            if (kind == 0) tf.points.push_back({value, number(), 0, 1, number()});
            if (kind == 1)
                tf.color.push_back({value, number(), 0, 1}), tf.opacity.push_back({value, number()});
        }
        if (kind == 2) tf.preset = "phantom";
        if (kind == 3) tf.file = "${HOME}/x.vp";
    }

    std::mt19937 random_;
};

TEST(SceneTexts, TomlReadsBackAsTheSameScene) {
    for (unsigned seed = 0; seed < 200; ++seed) {
        const Scene scene = RandomScenes(seed).next();
        const std::string text = to_toml(scene);
        ASSERT_EQ(resolved(parse_scene(text, "s.toml", "")), resolved(scene)) << "seed " << seed << '\n'
                                                                              << text;
    }
}

TEST(SceneTexts, ARecordGivenAsOverridesIsTheSameScene) {
    for (unsigned seed = 0; seed < 50; ++seed) {
        const Scene scene = RandomScenes(seed).next();
        std::vector<std::string> overrides;
        for (const auto& [key, value] : resolved(scene)) overrides.push_back(key + '=' + value);
        ASSERT_EQ(resolved(scene_with(built_in_scene(), overrides)), resolved(scene)) << "seed " << seed;
    }
}

TEST(SceneTexts, EverySettingHasALineOfHelpAndAPlaceInTheRecord) {
    const std::string help = scene_help();
    const auto record = resolved(Scene{});
    EXPECT_EQ(static_cast<std::size_t>(std::count(help.begin(), help.end(), '\n')), record.size());
    for (const auto& [key, value] : record) EXPECT_THAT("\n" + help, HasSubstr("\n" + key + " ")) << value;
}

TEST(SceneTexts, TheReferencePageIsTheOneThatIsCommitted) {
    std::ifstream file(SQUINT_SOURCE_DIR "/docs/scene.md");
    std::stringstream page;
    page << file.rdbuf();
    EXPECT_EQ(page.str(), scene_reference_markdown())
        << "docs/scene.md is old: its first lines say how to write it anew";
}

TEST(SceneTexts, TheBuiltInSceneReadsBack) {
    EXPECT_EQ(parse_scene(to_toml(built_in_scene()), "s.toml", ""), built_in_scene());
}

// --- Paths and preset files ----------------------------------------------------------------------

TEST(ScenePaths, ExpandVariablesAndAreRelativeToTheScene) {
    ::setenv("SQUINT_TEST_FOLDER", "/data", 1);
    ::unsetenv("SQUINT_TEST_UNSET");
    EXPECT_EQ(expand_path("head.nrrd", "", "f"), "head.nrrd");
    EXPECT_EQ(expand_path("head.nrrd", "scenes", "f"), "scenes/head.nrrd");
    EXPECT_EQ(expand_path("/head.nrrd", "scenes", "f"), "/head.nrrd");
    EXPECT_EQ(expand_path("${SQUINT_TEST_FOLDER}/${SQUINT_TEST_FOLDER}.nrrd", "scenes", "f"),
              "/data//data.nrrd");
    EXPECT_EQ(expand_path("", "scenes", "f"), "");
    EXPECT_THAT(message_of([] { expand_path("${SQUINT_TEST_UNSET}/a", "", "s.toml:2:8: volume.file"); }),
                StartsWith("s.toml:2:8: volume.file: found \"${SQUINT_TEST_UNSET}/a\", but the variable "
                           "SQUINT_TEST_UNSET is not set"));
    EXPECT_THAT(message_of([] { expand_path("${A", "", "f"); }),
                StartsWith("f: found \"${A\", where ${ is not closed"));
}

TEST(ScenePaths, AreRecordedAsWritten) {
    ::setenv("SQUINT_TEST_FOLDER", "/data", 1);
    const Scene scene = scene_of("[volume]\nfile = '${SQUINT_TEST_FOLDER}/a.nrrd'\n");
    EXPECT_EQ(volume_source(scene).file, "/data/a.nrrd");
    EXPECT_THAT(to_toml(scene), HasSubstr("file = \"${SQUINT_TEST_FOLDER}/a.nrrd\""));
}

class PresetFile : public testing::Test {
  protected:
    PrecisionSettings precision(std::string_view preset_file, const std::vector<std::string>& overrides) {
        const test::OwnFolder folder;
        std::ofstream(folder / "found.toml") << preset_file;
        Scene scene = scene_of("[precision]\npreset = 'found.toml'\n", overrides);
        scene.folder = folder.string();
        return resolved_precision(scene);
    }
    static std::string wire(const PrecisionSettings& precision, Wire wire) {
        return precision.override_[static_cast<std::size_t>(wire)].value_or("none");
    }
};

TEST_F(PresetFile, LiesUnderTheScenesOwnWires) {
    const PrecisionSettings found =
        precision("[precision]\npreset = 'squeeze'\nsample = 'u12.8 trn'\ncolor = 'u1.9'\n",
                  {"precision.sample=rnd", "precision.weight=u1.4"});
    EXPECT_EQ(found.preset, "squeeze");
    EXPECT_EQ(wire(found, Wire::sample), "u12.8 rnd");
    EXPECT_EQ(wire(found, Wire::color), "u1.9");
    EXPECT_EQ(wire(found, Wire::weight), "u1.4");
    EXPECT_EQ(wire(found, Wire::transparency), "none");
}

TEST_F(PresetFile, HoldsPrecisionOnly) {
    EXPECT_THAT(message_of([&] { precision("[image]\nwidth = 3\n", {}); }),
                HasSubstr("found.toml:1:2: found \"image\"; allowed in a preset file: [precision] only"));
    EXPECT_THAT(message_of([&] { precision("[precision]\npreset = 'a.toml'\n", {}); }),
                HasSubstr("a built-in preset"));
    EXPECT_THAT(message_of([&] { precision("[precision]\nsampel = 'rnd'\n", {}); }),
                HasSubstr("did you mean \"sample\"?"));
}

}  // namespace
}  // namespace squint
