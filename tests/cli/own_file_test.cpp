// A file of one's own and one command: a picture.
#include "tests/cli/program.h"

namespace squint::test {
namespace {

class OwnFile : public Program {
  protected:
    void SetUp() override {
        Program::SetUp();
        ASSERT_EQ(squint("volume phantom --dims 24 --bits 12 -o scan.nrrd").code, 0);
    }
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
    if (shell("/usr/bin/python3 '" SQUINT_SOURCE_DIR "/tests/core/import/write_volumes.py' .").code != 0)
        GTEST_SKIP() << "python3-nibabel and python3-pydicom write the files";
    const std::string same = " --set transfer_function.preset=ct_bone";
    const std::string expected = hash_of("a.nrrd" + same);
    for (const char* name :
         {"dicom", "a.nii.gz", "ras.nii.gz", "a.mha", "raw.vti", "ras.nrrd --set volume.space=lps"})
        EXPECT_EQ(hash_of(name + same), expected) << name;
    const std::string stack = " --set volume.spacing=[0.5,0.75,1.25] --set volume.value_offset=-1000" + same;
    EXPECT_EQ(hash_of("pages.tif" + stack), hash_of("pngs" + stack));
    EXPECT_EQ(hash_of("two_series --series 1" + same), expected);
    expect_refusal(squint("render two_series -o a.png" + same), "2 series");
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
