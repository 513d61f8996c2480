#include "core/transfer_import.h"

#include "core/error.h"
#include "core/srgb.h"
#include "tests/own_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

namespace {

using namespace squint;
using testing::HasSubstr;

const std::string kParaView =
    R"([{"ColorSpace": "RGB", "Creator": "ParaView", "Name": "two steps", "NanColor": [1, 1, 0],
  "RGBPoints": [0, 0.25, 0, 0, 100, 0.5, 0.5, 1],
  "Points": [0, 0, 0.5, 0, 60, 0.125, 0.5, 0, 60, 1, 0.5, 0]}])";

const std::string kSlicer =
    "1\n1\n0.9\n0.1\n0.2\n10\n"
    "8 -3024 0 -16.5 0 641 0.72 3071 0.71\n"
    "4 0 1 255 1\n"
    "12 -3024 0 0 0 -16.5 0.73 0.25 0.3 641 0.9 0.8 0.56\n";

/// A file of this test alone.
class ImportTest : public testing::Test {
  protected:
    std::string file(const std::string& text) {
        std::ofstream(path(), std::ios::binary) << text;
        return path();
    }
    std::string path() const { return folder_ / "function"; }

    TransferFunction paraview(const std::string& text, bool srgb = false, const std::string& map = "") {
        return import_paraview_json(file(text), map, srgb, 2.5);
    }
    TransferFunction slicer(const std::string& text, bool srgb = false) {
        return import_slicer_vp(file(text), srgb);
    }

    /// What a refusal says after the file's name; it is one line.
    std::string refusal(const std::function<void()>& import) {
        try {
            import();
        } catch (const InputError& error) {
            const std::string what = error.what();
            EXPECT_THAT(what, testing::StartsWith(path()));
            EXPECT_THAT(what, Not(HasSubstr("\n")));
            return what.substr(path().size());
        }
        return "";
    }
    std::string paraview_refusal(const std::string& text) {
        return refusal([&] { (void)paraview(text); });
    }
    std::string slicer_refusal(const std::string& text) {
        return refusal([&] { (void)slicer(text); });
    }

  private:
    const test::OwnFolder folder_;
};

std::string with(std::string text, const std::string& what, const std::string& instead) {
    const std::size_t at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    return text.replace(at, what.size(), instead);
}

TEST_F(ImportTest, AParaViewMapKeepsItsPointsAndTakesTheUnitDistanceGiven) {
    const TransferFunction function = paraview(kParaView);
    const std::vector<ColorPoint> color{{0, {0.25, 0, 0}}, {100, {0.5, 0.5, 1}}};
    const std::vector<OpacityPoint> opacity{{0, 0}, {60, 0.125}, {60, 1}};
    EXPECT_EQ(function.color, color);
    EXPECT_EQ(function.opacity, opacity);
    EXPECT_EQ(function.unit_distance, 2.5);
    EXPECT_EQ(paraview(kParaView.substr(1, kParaView.size() - 2)).color, color)
        << "an object that is in no list";
}

TEST_F(ImportTest, AParaViewMapOfColoursAloneRisesFromClearToOpaque) {
    const std::vector<OpacityPoint> rise{{-5, 0}, {7, 1}};
    EXPECT_EQ(paraview(R"({"RGBPoints": [-5, 0, 0, 0, 7, 1, 1, 1]})").opacity, rise);
}

TEST_F(ImportTest, SrgbColoursAreDecodedAtThePoints) {
    EXPECT_EQ(paraview(kParaView, true).color[1].color,
              Vec3(linear_from_srgb(0.5), linear_from_srgb(0.5), linear_from_srgb(1)));
    EXPECT_EQ(slicer(kSlicer, true).color[2].color,
              Vec3(linear_from_srgb(0.9), linear_from_srgb(0.8), linear_from_srgb(0.56)));
}

TEST_F(ImportTest, AParaViewMapOutsideTheSubsetIsRefused) {
    EXPECT_THAT(
        paraview_refusal(with(kParaView, "\"RGB\"", "\"Lab/CIEDE2000\"")),
        HasSubstr("ColorSpace \"Lab/CIEDE2000\", allowed are RGB, HSV, Lab, CIELAB, Diverging and Step"));
    EXPECT_THAT(paraview_refusal(with(kParaView, "\"RGB\"", "7")),
                HasSubstr("ColorSpace \"7\", allowed are"));
    EXPECT_THAT(paraview_refusal(with(kParaView, "0.125, 0.5, 0", "0.125, 0.5, 1")),
                HasSubstr("point 2: midpoint 0.5 and sharpness 1"));
    EXPECT_THAT(paraview_refusal(with(kParaView, "0.25, 0, 0", "0.25, -0.1, 0")),
                HasSubstr("RGBPoints, point 1: -0.1"));
    EXPECT_THAT(paraview_refusal(with(kParaView, "0.25, 0, 0", "0.25, 0")),
                HasSubstr("7 numbers, allowed is 4 for every point"));
    EXPECT_THAT(paraview_refusal(with(kParaView, "60, 0.125", "160, 0.125")),
                HasSubstr("value 60 after 160"));
    EXPECT_THAT(paraview_refusal(with(kParaView, "60, 1", "60, 1.5")), HasSubstr("alpha 1.5"));
    EXPECT_THAT(paraview_refusal("[]"), HasSubstr("a list of 0 colour maps"));
    EXPECT_THAT(paraview_refusal("[{}, {}]"),
                HasSubstr("a list of 2 colour maps: transfer_function.map chooses one"));
    EXPECT_THAT(paraview_refusal("7"), HasSubstr("not a ParaView colour map"));
    EXPECT_THAT(paraview_refusal(R"({"IndexedColors": [1, 0, 0]})"),
                HasSubstr("a map of categories (IndexedColors)"));
    EXPECT_THAT(paraview_refusal("{}"), HasSubstr("there is no RGBPoints"));
    EXPECT_THAT(paraview_refusal(R"({"RGBPoints": [0, 1, "red", 1]})"), HasSubstr("holds \"red\""));
    EXPECT_THAT(paraview_refusal(R"({"RGBPoints": {}})"), HasSubstr("not a list"));
    EXPECT_THAT(paraview_refusal(R"({"RGBPoints": []})"), HasSubstr("0 numbers"));
    EXPECT_THAT(paraview_refusal(R"({"RGBPoints": [0, 1e999, 0, 0]})"),
                HasSubstr("not the JSON it should be: "));
    EXPECT_THAT(paraview_refusal("{\"a\n\""), HasSubstr("not the JSON it should be: "));
    EXPECT_THAT(paraview_refusal(std::string(100000, '[')), HasSubstr("not the JSON it should be: "));
}

TEST_F(ImportTest, AListOfMapsIsChosenFromByName) {
    const std::string two = R"([{"Name": "a", "RGBPoints": [0, 0, 0, 0, 1, 1, 1, 1]},
                                {"Name": "b", "RGBPoints": [0, 0, 0, 0, 2, 1, 1, 1]}])";
    EXPECT_EQ(paraview(two, false, "b").color.back().value, 2);
    EXPECT_THAT(paraview_refusal(two),
                HasSubstr("a list of 2 colour maps: transfer_function.map chooses one of a, b"));
    EXPECT_THAT(refusal([&] { (void)paraview(two, false, "c"); }),
                HasSubstr("no colour map \"c\": transfer_function.map chooses one of a, b"));
}

TEST_F(ImportTest, CommentsAndTrailingCommasAreLetPass) {
    const std::string text =
        "// a map\n[{\"Name\": \"a, ]\\\"\", /* , */ \"RGBPoints\": [0, 0, 0, 0, 7, 1, 1, 1, // white\n "
        "],},]";
    EXPECT_EQ(paraview(text).color.back().value, 7);
    EXPECT_THAT(paraview_refusal("{\"RGBPoints\": [0,, 1]}"), HasSubstr("not the JSON it should be"));
}

/// The colour of an imported map half way and at the quarters, against a map of two or three points.
std::vector<Vec3> colors_of(const TransferFunction& function, std::vector<double> values) {
    std::vector<Vec3> colors;
    for (const double value : values) colors.push_back(function.color_at(value));
    return colors;
}
void expect_near(const Vec3& found, const Vec3& expected, double tolerance, const char* what) {
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(found[i], expected[i], tolerance) << what << ", channel " << i;
}
std::string two_points(const char* space, const char* more = "") {
    return std::string("{\"ColorSpace\": \"") + space + "\"" + more +
           ", \"RGBPoints\": [0, 1, 0, 0, 1, 0, 0, 1]}";
}

TEST_F(ImportTest, AMapIsInterpolatedInItsColourSpaceAsVtkDoes) {
    // Codes that VTK's own test of vtkColorTransferFunction has for red to blue at 0.5, and by hand.
    const double code = 0.51 / 255;
    expect_near(paraview(two_points("RGB")).color_at(0.5), {0.5, 0, 0.5}, 1e-15, "RGB");
    expect_near(paraview(two_points("HSV")).color_at(0.5), {0, 1, 0}, 0.01, "HSV runs through green");
    expect_near(paraview(two_points("HSV", ", \"HSVWrap\": 1")).color_at(0.5), {1, 0, 1}, 0.01,
                "the shorter way");
    // L*a*b* of red (53.23, 80.11, 67.22) and blue (32.30, 79.20, -107.86): their mean is (42.77, 79.65, -20.32).
    expect_near(paraview(two_points("Lab")).color_at(0.5), {201 / 255.0, 0, 136 / 255.0}, 1.01 / 255, "Lab");
    EXPECT_EQ(paraview(two_points("CIELAB")).color, paraview(two_points("Lab")).color);
    // Moreland's cool to warm: from (59, 76, 192) to (180, 4, 38) the middle is (221, 221, 221).
    const std::string cool_to_warm = R"({"ColorSpace": "Diverging", "RGBPoints":
        [0, 0.23137254902, 0.298039215686, 0.752941176471, 1, 0.705882352941, 0.0156862745098, 0.149019607843]})";
    expect_near(paraview(cool_to_warm).color_at(0.5), Vec3(221, 221, 221) / 255, code, "diverging");
    // And two more of its published table of 33 colours, the 9th and the 25th: (141, 176, 254), (244, 154, 123).
    expect_near(paraview(cool_to_warm).color_at(0.25), Vec3(141, 176, 254) / 255, 1.01 / 255,
                "diverging, cool");
    expect_near(paraview(cool_to_warm).color_at(0.75), Vec3(244, 154, 123) / 255, 1.01 / 255,
                "diverging, warm");
    EXPECT_EQ(colors_of(paraview(two_points("Step")), {-1, 0.25, 0.75, 2}),
              (std::vector<Vec3>{{1, 0, 0}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}}));
}

TEST_F(ImportTest, EveryColourSpaceMeetsItsPointsAndStaysOnADisplay) {
    std::mt19937 random(4);
    const auto part = [&] { return static_cast<double>(random() % 256) / 255; };
    for (const char* space : {"RGB", "HSV", "Lab", "Diverging", "Step"})
        for (int i = 0; i < 200; ++i) {
            const Vec3 a(part(), part(), part()), b(part(), part(), part());
            std::string text = std::string("{\"ColorSpace\": \"") + space + "\", \"RGBPoints\": [0";
            for (int k = 0; k < 3; ++k) text += ", " + std::to_string(a[k]);
            text += ", 1";
            for (int k = 0; k < 3; ++k) text += ", " + std::to_string(b[k]);
            const TransferFunction function = paraview(text + "]}");
            expect_near(function.color_at(1), b, 1e-6, space);
            if (space != std::string("Step")) expect_near(function.color_at(0), a, 1e-6, space);
            for (const ColorPoint& point : function.color)
                for (int k = 0; k < 3; ++k) EXPECT_TRUE(point.color[k] >= 0 && point.color[k] <= 1) << space;
        }
}

TEST_F(ImportTest, ASlicerJsonPropertyKeepsItsPointsAndUnitDistance) {
    const std::string text = R"({"volumeProperties": [{"components": [{"scalarOpacityUnitDistance": 0.5,
        "rgbTransferFunction": {"points": [{"x": -10, "color": [0, 0.25, 1]}, {"x": 90, "color": [1, 1, 1]}]},
        "scalarOpacity": {"points": [{"x": -10, "y": 0, "midpoint": 0.5, "sharpness": 0}, {"x": 70, "y": 0.75}]},
        "gradientOpacity": {"points": [{"x": 0, "y": 1}, {"x": 255, "y": 1}]}}]}]})";
    const auto read = [&](const std::string& json) { return import_slicer_json(file(json), false); };
    const auto refused = [&](const std::string& json) { return refusal([&] { (void)read(json); }); };
    const TransferFunction function = read(text);
    EXPECT_EQ(function.color, (std::vector<ColorPoint>{{-10, {0, 0.25, 1}}, {90, {1, 1, 1}}}));
    EXPECT_EQ(function.opacity, (std::vector<OpacityPoint>{{-10, 0}, {70, 0.75}}));
    EXPECT_EQ(function.unit_distance, 0.5);
    EXPECT_EQ(import_slicer_vp(file(text), false).color, function.color) << "whatever its name ends in";
    EXPECT_THAT(refused(with(text, "\"x\": 255, \"y\": 1", "\"x\": 255, \"y\": 0.5")),
                HasSubstr("gradient opacity of 0.5, allowed is 1 everywhere"));
    EXPECT_THAT(refused(with(text, "\"sharpness\": 0", "\"sharpness\": 1")),
                HasSubstr("scalarOpacity, point 1: midpoint 0.5 and sharpness 1"));
    EXPECT_THAT(refused(with(text, "\"y\": 0.75", "\"y\": \"high\"")), HasSubstr("\"y\" is \"high\""));
    EXPECT_THAT(refused(with(text, "0.25, 1]", "0.25]")), HasSubstr("a colour of 2 numbers"));
    EXPECT_THAT(refused(with(text, "scalarOpacity\"", "opacity\"")),
                HasSubstr("there is no \"scalarOpacity\""));
    EXPECT_THAT(refused(R"({"volumeProperties": [{"components": [{}, {}]}]})"), HasSubstr("2 components"));
    EXPECT_THAT(refused("[]"), HasSubstr("there is no \"volumeProperties\""));
}

TEST_F(ImportTest, AnImageVis3DFunctionHasAColourForEachValue) {
    const auto read = [&](const std::string& text) { return import_imagevis3d(file(text), false, 2); };
    const TransferFunction function = read("3\n0 0 0 0\n0.5 0.25 1 0.125\r\n1 1 1 1\n");
    EXPECT_EQ(function.color, (std::vector<ColorPoint>{{0, {0, 0, 0}}, {1, {0.5, 0.25, 1}}, {2, {1, 1, 1}}}));
    EXPECT_EQ(function.opacity, (std::vector<OpacityPoint>{{0, 0}, {1, 0.125}, {2, 1}}));
    EXPECT_EQ(function.unit_distance, 2);
    const auto refused = [&](const std::string& text) { return refusal([&] { (void)read(text); }); };
    for (const char* wrong :
         {"", "1\n0 0 0 0", "3\n0 0 0 0\n1 1 1 1", "2 0 0 0 0 1 1 1", "2.5 0 0 0 0 1 1 1 1"})
        EXPECT_THAT(refused(wrong), HasSubstr("allowed are a count of 2 to")) << wrong;
    EXPECT_THAT(refused("2 0 0 0 0 1 1 x 1"), HasSubstr("\"x\" is not a number"));
    EXPECT_THAT(refused("2 0 0 0 0 1 1 2 1"), HasSubstr("colours, point 2: 2"));
}

TEST_F(ImportTest, NoRefusalIsLongerThanTwoLines) {
    for (const std::string& text :
         {"[{\"RGBPoints\": [\"" + std::string(5000, '1'), std::string(5000, '[') + "x",
          "{\"RGBPoints\": [\"" + std::string(5000, 'x') + "\"]}",
          "{\"ColorSpace\": \"" + std::string(5000, 'x') + "\"}"})
        EXPECT_LT(paraview_refusal(text).size(), 200u);
    EXPECT_THAT(paraview_refusal("{\"ColorSpace\": \"\xc3\xbc\"}"), HasSubstr("ColorSpace \"\\u00FC\""));
}

TEST_F(ImportTest, ASlicerPropertyKeepsItsPoints) {
    const TransferFunction function = slicer(kSlicer);
    const std::vector<ColorPoint> color{
        {-3024, {0, 0, 0}}, {-16.5, {0.73, 0.25, 0.3}}, {641, {0.9, 0.8, 0.56}}};
    const std::vector<OpacityPoint> opacity{{-3024, 0}, {-16.5, 0}, {641, 0.72}, {3071, 0.71}};
    EXPECT_EQ(function.color, color);
    EXPECT_EQ(function.opacity, opacity);
    EXPECT_EQ(function.unit_distance, 1);
    EXPECT_EQ(slicer(with(kSlicer, "4 0 1 255 1", "0")).opacity, opacity) << "no gradient opacity";
    std::string dos = kSlicer;
    for (std::size_t at = 0; (at = dos.find('\n', at)) != std::string::npos; at += 2) dos.insert(at, "\r");
    EXPECT_EQ(slicer(dos).color, color) << "lines that end as on Windows";
}

TEST_F(ImportTest, ASlicerPropertyOutsideTheSubsetIsRefused) {
    EXPECT_THAT(slicer_refusal(with(kSlicer, "255 1\n", "255 0.5\n")),
                HasSubstr("gradient opacity of 0.5, allowed is 1 everywhere"));
    EXPECT_THAT(slicer_refusal(with(kSlicer, "8 -3024", "9 -3024")),
                HasSubstr("8 numbers, the count before them says 9"));
    EXPECT_THAT(slicer_refusal(with(kSlicer, "8 -3024", "-8 -3024")),
                HasSubstr("does not begin with a count"));
    EXPECT_THAT(slicer_refusal(with(kSlicer, "8 -3024", "1e300 -3024")),
                HasSubstr("does not begin with a count"));
    EXPECT_THAT(slicer_refusal(with(kSlicer, "8 -3024", "nan -3024")),
                HasSubstr("does not begin with a count"));
    EXPECT_THAT(slicer_refusal(with(kSlicer, "8 -3024 0", "7 -3024")),
                HasSubstr("7 numbers, allowed is 2 for every point"));
    EXPECT_THAT(slicer_refusal(with(kSlicer, "641 0.72", "641 0,72")), HasSubstr("\"0,72"));
    EXPECT_THAT(slicer_refusal(with(kSlicer, "641 0.72", "641 nan")),
                HasSubstr("opacity point 3: alpha nan"));
    EXPECT_THAT(slicer_refusal(with(kSlicer, "0.73", "73")), HasSubstr("colour, point 2: 73"));
    EXPECT_THAT(slicer_refusal(with(kSlicer, "0.9\n0.1", "0.9 0.1")), HasSubstr("8 lines, allowed are 9"));
    EXPECT_THAT(slicer_refusal(with(kSlicer, "0.9\n", "much\n")), HasSubstr("line 3: \"much\""));
    EXPECT_THAT(slicer_refusal(""), HasSubstr("0 lines"));
    EXPECT_THAT(slicer_refusal("{\"volumeProperties\": []}"), HasSubstr("0 volume properties"));
}

TEST_F(ImportTest, MissingAndHugeFilesAreRefused) {
    EXPECT_THAT(refusal([&] { (void)import_slicer_vp(path(), false); }),
                HasSubstr("cannot read: No such file"));
    EXPECT_THAT(refusal([&] { (void)import_paraview_json(path(), "", false, 1); }),
                HasSubstr("cannot read: No such file"));
    EXPECT_THAT(slicer_refusal(std::string((16u << 20) + 1, ' ')), HasSubstr("more than 16777216 bytes"));
    std::filesystem::remove(path());
    std::filesystem::create_directory(path());
    EXPECT_THAT(refusal([&] { (void)import_slicer_vp(path(), false); }),
                HasSubstr("cannot read: Is a directory"));
}

TEST_F(ImportTest, ADamagedFileIsReadOrRefusedInOneLine) {
    std::mt19937 random(9);
    const std::string odd = "0123456789.,-+e[]{}\"\n \t\0nainf\xff";
    int read = 0, refused = 0;
    for (int i = 0; i < 500; ++i) {
        std::string text = i % 2 ? kSlicer : kParaView;
        for (unsigned edits = random() % 4 + 1; edits > 0; --edits) {
            const std::size_t at = random() % text.size();
            if (random() % 3 == 0) {
                text.erase(at, random() % 8 + 1);
            } else {
                text[at] = odd[random() % odd.size()];
            }
            if (text.empty()) text = " ";
        }
        bool whole = false;
        const std::string said = refusal([&] {
            check(i % 2 ? slicer(text) : paraview(text));
            whole = true;
        });
        EXPECT_NE(whole, !said.empty()) << "case " << i << " of seed 9";
        (whole ? read : refused)++;
    }
    EXPECT_GT(read, 20);
    EXPECT_GT(refused, 100);
}

}  // namespace
