// A file of one's own and one command: a picture.
#include "tests/cli/program.h"

namespace squint::test {
namespace {

class OwnFile : public Program {
  protected:
    void SetUp() override { ASSERT_EQ(squint("volume phantom --dims 24 --bits 12 -o scan.nrrd").code, 0); }
    std::string hash_of(const std::string& arguments) const {
        const Outcome outcome = squint("render " + arguments + " -q --size 24x16 --json -");
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return outcome.code == 0 ? outcome.json()["pictures"][0]["hash"].get<std::string>() : outcome.err;
    }
};

TEST_F(OwnFile, AVolumeWhereASceneIsExpectedGivesAPicture) {
    const Outcome outcome = squint("render scan.nrrd -o scan.png --size 24x16");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("scan.nrrd: no transfer function is given: one from the histogram is taken"),
              std::string::npos)
        << outcome.err;
    EXPECT_TRUE(has("scan.png"));
    EXPECT_FALSE(has("scan.exr"));
    EXPECT_TRUE(contents(folder / "scan.png").starts_with("\x89PNG"));
    EXPECT_EQ(squint("render scan.nrrd -q -o scan.jpg --size 24x16").code, 0);
    EXPECT_TRUE(contents(folder / "scan.jpg").starts_with("\xff\xd8"));
    EXPECT_EQ(squint("render scan.nrrd -q -o both.exr --preview both.png --size 24x16").code, 0);
    EXPECT_TRUE(has("both.exr") && has("both.png"));
    expect_refusal(squint("render scan.nrrd -o a.png --preview b.png"), "a second preview");
    expect_refusal(squint("render scan.nrrd -o a.gif"), "the name must end in .exr, .png, .jpg, .jpeg");
}

TEST_F(OwnFile, ThePrintedSceneRendersTheSamePicture) {
    const Outcome printed = squint("render scan.nrrd --print-scene --size 24x16");
    ASSERT_EQ(printed.code, 0) << printed.err;
    EXPECT_EQ(files(), std::vector<std::string>{"scan.nrrd"});
    write("scan.toml", printed.out);
    EXPECT_EQ(hash_of("scan.toml"), hash_of("scan.nrrd"));
}

TEST_F(OwnFile, TheBuiltInFunctionDoesNotFallOnOtherData) {
    EXPECT_EQ(hash_of("--set volume.file=scan.nrrd"), hash_of("scan.nrrd"));
    const Outcome named = squint("render scan.nrrd --size 24x16 --set transfer_function.preset=phantom");
    EXPECT_EQ(named.err.find("no transfer function"), std::string::npos) << named.err;
    EXPECT_NE(hash_of("scan.nrrd --set transfer_function.preset=phantom"), hash_of("scan.nrrd"));
    write("bare.toml", "[volume]\nfile = \"scan.nrrd\"\n");
    const Outcome bare = squint("render bare.toml --size 24x16");
    EXPECT_EQ(bare.code, 0) << bare.err;
    EXPECT_NE(bare.err.find("no transfer function is given"), std::string::npos) << bare.err;
}

TEST_F(OwnFile, CtIsRecognisedByItsAirAndItsTissue) {
    const std::string ct = "scan.nrrd --set volume.scale=1 --set volume.value_offset=-1250 ";
    const Outcome outcome = squint("render " + ct + " --print-scene");
    EXPECT_NE(outcome.out.find("preset = \"ct_skin_and_bone\""), std::string::npos) << outcome.out;
}

TEST_F(OwnFile, EveryFormatOfTheSameVoxelsGivesTheSamePicture) {
    if (shell("/usr/bin/python3 '" SQUINT_SOURCE_DIR "/tests/core/import/write_volumes.py' . origin").code !=
        0)
        GTEST_SKIP() << "python3-nibabel, python3-pydicom, teem-apps, imagemagick and openimageio-tools "
                        "write the files";
    const std::string same = " --set transfer_function.preset=ct_bone",
                      stack = " --set volume.spacing=[0.5,0.75,1.25] --set volume.value_offset=-1000";
    const std::string expected = hash_of("teem.nrrd" + same);
    for (const std::string& file :
         {std::string("a.nrrd"), std::string("dicom"), std::string("rle"), std::string("a.nii.gz"),
          std::string("ras.nii.gz"), std::string("a.mha"), std::string("packed.mha"), std::string("raw.vti"),
          std::string("ras.nrrd --set volume.space=lps"), "pages.tif" + stack, "pngs" + stack,
          "tifs" + stack})
        EXPECT_EQ(hash_of(file + same), expected) << file;
    EXPECT_EQ(hash_of("two_series --series 1" + same), expected);
    expect_refusal(squint("render two_series -o a.png" + same), "2 series");
}

TEST_F(OwnFile, TurnedAxesGiveOnePictureFromEveryFormat) {
    if (shell("/usr/bin/python3 '" SQUINT_SOURCE_DIR "/tests/core/import/write_volumes.py' .").code != 0)
        GTEST_SKIP() << "python3-nibabel, python3-pydicom, teem-apps, imagemagick and openimageio-tools "
                        "write the files";
    const auto render = [&](const std::string& file, const std::string& output) {
        const Outcome outcome = squint(
            "render " + file + " -o " + output +
            ".exr --size 48x32 --set transfer_function.preset=ct_bone --set camera.center=[-19,24,-17] "
            "--set camera.height=24 --set output.normals=true --set clip.low=[-21,20,-40]");
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return outcome.err;
    };
    EXPECT_NE(render("turned.nrrd", "expected").find("turned by 25 degrees"), std::string::npos);
    render("a.nrrd", "plain");
    EXPECT_EQ(squint("compare expected.exr plain.exr --max-error 8").code, 1) << "turned is not plain";
    for (const char* name : {"turned.mha", "turned.nii", "turned.vti", "turned"}) {
        render(name, "found");
        // What the turn's last digits, of floats in NIfTI and ten in DICOM, move is far below a display's step.
        const Outcome same = squint("compare found.exr expected.exr --max-error 0.5");
        EXPECT_EQ(same.code, 0) << name << same.out << same.err;
    }
    EXPECT_NE(squint("info turned.nrrd").out.find("along x   0.9130"), std::string::npos)
        << squint("info turned.nrrd").out;
    EXPECT_EQ(squint("volume turned.nrrd -o again.nrrd").code, 0);
    const auto axes_of = [&](const std::string& name) {
        const std::string text = squint("info " + name).out;
        return text.substr(text.find("along x"), text.find("scalars") - text.find("along x"));
    };
    EXPECT_EQ(axes_of("again.nrrd").substr(0, 80), axes_of("turned.nrrd").substr(0, 80));
    EXPECT_EQ(squint("pixel turned.nrrd 24 16 --size 48x32 --json").code, 0);
    EXPECT_EQ(hash_of("rounded.nrrd"), hash_of("quarter.nrrd"));
    expect_refusal(squint("render tilted -o a.png"), "axes 0 and 2 meet at 75 degrees");
}

TEST_F(OwnFile, TheCameraIsAimedAtTheDataWhereTheSceneDoesNotAimIt) {
    const auto is_aimed = [&](const std::string& arguments) {
        const std::string scene = squint("render " + arguments + " --print-scene").out;
        EXPECT_NE(scene.find("[volume]"), std::string::npos) << arguments;
        return scene.find("\ncenter = ") != std::string::npos;
    };
    EXPECT_TRUE(is_aimed("scan.nrrd"));
    EXPECT_TRUE(is_aimed("scan.nrrd --set camera.azimuth=80 --set camera.turntable=4"));
    EXPECT_FALSE(is_aimed("scan.nrrd --set camera.height=99"));
    EXPECT_FALSE(is_aimed("scan.nrrd --set camera.eye=[0,-99,0]"));
    EXPECT_FALSE(is_aimed("scan.nrrd --set camera.projection=perspective"));
    write("bare.toml", "[volume]\nfile = \"scan.nrrd\"\n");
    EXPECT_FALSE(is_aimed("bare.toml")) << "a scene's camera is its own";
}

TEST_F(OwnFile, ATurntableEndsWithTheLineThatMakesAFilm) {
    const Outcome outcome = squint("render scan.nrrd -o turn.png --size 12x8 --set camera.turntable=2");
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_TRUE(has("turn.0000.png") && has("turn.0001.png"));
    EXPECT_TRUE(
        outcome.err.ends_with("film: ffmpeg -framerate 25 -i 'turn.%04d.png' -pix_fmt yuv420p 'turn.mp4'\n"))
        << outcome.err;
}

}  // namespace
}  // namespace squint::test
