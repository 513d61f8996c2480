// The same voxels written by other programs, in every format that is read; and series that cannot be.
#include "core/import/child.h"
#include "tests/core/volume_files.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <cstdlib>
#include <memory>
#include <random>

namespace squint {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

/// A folder that write_volumes.py filled, once for all tests.
class Import : public VolumeFiles {
  protected:
    static void SetUpTestSuite() {
        setenv("SQUINT_READ", SQUINT_READ_PROGRAM, 1);
        written() = std::make_unique<const test::OwnFolder>();
        const std::string script = SQUINT_SOURCE_DIR "/tests/core/import/write_volumes.py";
        complete() =
            std::system(("/usr/bin/python3 '" + script + "' '" + written()->string() + "' >/dev/null 2>&1")
                            .c_str()) == 0;
    }
    static void TearDownTestSuite() { written() = nullptr; }
    void SetUp() override {
        if (!complete())
            GTEST_SKIP() << "python3-nibabel, python3-pydicom, teem-apps, imagemagick and openimageio-tools "
                            "write the files";
    }
    static std::unique_ptr<const test::OwnFolder>& written() {
        static std::unique_ptr<const test::OwnFolder> folder;
        return folder;
    }
    static bool& complete() {
        static bool done = false;
        return done;
    }
    static std::string at(const std::string& name) { return (*written() / name).string(); }
    /// A refusal without the folder's path.
    std::string refused(VolumeSource source) const {
        source.file = at(source.file);
        std::string message = refusal(source);
        const std::string prefix = written()->string() + "/";
        for (std::size_t i; (i = message.find(prefix)) != std::string::npos;) message.erase(i, prefix.size());
        return message;
    }
};

TEST_F(Import, EveryFormatGivesTheSameVolume) {
    const Volume expected = load_path(at("a.nrrd"));
    EXPECT_EQ(expected.value_offset, -1000);
    for (const char* name :
         {"a.nii", "a.nii.gz", "ras.nii.gz", "two.nii", "pair.img", "pair.hdr", "q.nii", "dicom", "rle",
          "a.mha", "packed.mha", "a.mhd", "teem.nrrd", "text.vti", "base64.vti", "packed.vti", "raw.vti"}) {
        SCOPED_TRACE(name);
        const Volume volume = load_path(at(name));
        EXPECT_EQ(volume.content_hash, expected.content_hash);
        EXPECT_EQ(volume.dims, expected.dims);
        EXPECT_EQ(volume.spacing, expected.spacing);
        EXPECT_EQ(volume.origin, expected.origin);
        EXPECT_EQ(volume.scalar_bits, expected.scalar_bits);
        EXPECT_EQ(volume.value_scale, expected.value_scale);
        EXPECT_EQ(volume.value_offset, expected.value_offset);
        EXPECT_EQ(volume.space, std::string_view(name).ends_with(".vti") ? "" : "left-posterior-superior");
    }
    EXPECT_EQ(load({.file = at("ras.nrrd"), .space = "lps"}).content_hash, expected.content_hash);
    EXPECT_EQ(load({.file = at("ras.nrrd"), .space = "lps"}).origin, expected.origin);
    EXPECT_EQ(load_path(at("dicom")).modality, "CT");
}

TEST_F(Import, TurnedAxesAreTakenAndNoVoxelIsMoved) {
    const Volume plain = load_path(at("a.nrrd"));
    // 25 degrees about (1, 2, 3), as write_volumes.py has it.
    const Vec3 axis = Vec3(1, 2, 3).normalized();
    const double c = std::cos(25 / 57.29577951308232), s = std::sin(25 / 57.29577951308232);
    for (const char* name : {"turned.nrrd", "turned.mha", "turned.nii", "turned.vti", "turned"}) {
        SCOPED_TRACE(name);
        const Volume volume = load_path(at(name));
        EXPECT_EQ(volume.content_hash, plain.content_hash);
        for (const Vec3& voxel : {Vec3(0), Vec3(19, 0, 0), Vec3(3, 15, 4), Vec3(19, 15, 11)}) {
            const Vec3 p = plain.world_from_voxel(voxel);
            const Vec3 there = p * c + axis.cross(p) * s + axis * (axis.dot(p) * (1 - c));
            // NIfTI's matrix is of floats, DICOM's numbers have ten decimals.
            EXPECT_LT((volume.world_from_voxel(voxel) - there).length(), 64 * 0x1p-24);
            EXPECT_LT((volume.voxel_from_world(there) - voxel).length(), 128 * 0x1p-24);
        }
        EXPECT_THAT(notes_of({.file = at(name)}),
                    testing::ElementsAre(HasSubstr("axes are turned by 25 degrees against x, y, z")));
    }
    const Volume lps = load_path(at("turned.nrrd")),
                 ras = load({.file = at("turned_ras.nrrd"), .space = "lps"});
    EXPECT_EQ(ras.turn, lps.turn);
    EXPECT_EQ(ras.origin, lps.origin);
    EXPECT_EQ(ras.content_hash, lps.content_hash);
    const Volume quarter = load_path(at("quarter.nrrd")), rounded = load_path(at("rounded.nrrd"));
    EXPECT_FALSE(quarter.turned() || rounded.turned());
    EXPECT_EQ(quarter.dims, Index3(16, 20, 12));
    EXPECT_EQ(rounded.content_hash, quarter.content_hash);
    EXPECT_EQ(rounded.spacing, quarter.spacing);
    EXPECT_EQ(rounded.origin, quarter.origin);
}

TEST_F(Import, SlopesTimesAndFloatsAreTaken) {
    const Volume plain = load_path(at("a.nii")), scaled = load_path(at("scaled.nii"));
    EXPECT_EQ(scaled.value_scale, 0.5);
    EXPECT_EQ(scaled.value_offset + scaled.value_scale * scaled.at(3, 4, 5), 0.5 * plain.at(3, 4, 5) - 3);
    EXPECT_THAT(refused({.file = "times.nii.gz"}), HasSubstr("volume.component = 0 to 2 chooses it"));
    EXPECT_EQ(load({.file = at("times.nii.gz"), .component = 2}).value_offset, plain.value_offset + 20);
    EXPECT_THAT(refused({.file = "times"}), HasSubstr("2 slices at each place (times or echoes)"));
    EXPECT_EQ(load({.file = at("times"), .component = 1}).value_offset, plain.value_offset + 10);
    EXPECT_THAT(refused({.file = "nan.nii"}), HasSubstr("voxel (5, 4, 3) is nan"));
    EXPECT_EQ(load({.file = at("nan.nii"), .nan = 0}).scalar_bits, 16);
    EXPECT_THAT(notes_of({.file = at("float.nii")}),
                testing::ElementsAre(HasSubstr("16 bits over [-1000, ")));
    // Each slice k with slope 1 + k / 4: its values come back within half a level of 16 bits.
    const Volume slopes = load_path(at("slopes"));
    for (const int k : {0, 3, 11})
        EXPECT_NEAR(slopes.value_offset + slopes.value_scale * slopes.at(2, 3, k),
                    (1 + 0.25 * k) * plain.at(2, 3, k) - 1000, slopes.value_scale / 2);
}

TEST_F(Import, StacksOfPicturesTakeTheirOrderFromTheirNumbers) {
    const Volume plain = load_path(at("a.nrrd"));
    for (const char* name : {"pages.tif", "pngs", "tifs"}) {
        SCOPED_TRACE(name);
        const VolumeSource source{.file = at(name), .spacing = {0.5, 0.75, 1.25}, .value_offset = -1000};
        const Volume stack = load(source);
        EXPECT_EQ(stack.dims, plain.dims);
        EXPECT_EQ(stack.spacing, plain.spacing);
        EXPECT_EQ(scalars_of(stack), scalars_of(plain));
        EXPECT_EQ(stack.value_offset, plain.value_offset);
        EXPECT_TRUE(notes_of(source).empty());
        EXPECT_THAT(notes_of({.file = at(name)}),
                    testing::ElementsAre(HasSubstr("pictures state no spacing: 1 is taken")));
    }
    EXPECT_THAT(refused({.file = "colours"}), HasSubstr("volume.component = 0 to 2 chooses it"));
    EXPECT_THAT(refused({.file = "unlike"}), HasSubstr("slice 1 has 5x3 pixels"));
}

TEST_F(Import, ASeriesOfWhichNoVolumeCanBeMadeIsRefusedByName) {
    EXPECT_EQ(
        refused({.file = "gap"}),
        "gap: a gap between the slices at -25 and -22.5 mm: 2.5 mm, but 1.25 between the others; allowed: "
        "even steps");
    EXPECT_THAT(refused({.file = "mixed"}), HasSubstr("slices of 20x16 and of 20x8 pixels in one series"));
    EXPECT_THAT(refused({.file = "jpeg2000"}), HasSubstr("\"JPEG 2000 (Lossless only)\" cannot be read"));
    EXPECT_THAT(refused({.file = "colour"}), HasSubstr("3 samples a pixel (colour)"));
    EXPECT_THAT(refused({.file = "frames"}), HasSubstr("4 frames in one file"));
    EXPECT_EQ(refused({.file = "two_series"}),
              "two_series: 2 series: 1 (CT, 20x16, 12 slices); 2 (CT, 20x16, 4 slices); --series N or "
              "volume.series = N chooses one");
    EXPECT_EQ(load({.file = at("two_series"), .series = 2}).dims, Index3(20, 16, 4));
    EXPECT_THAT(refused({.file = "two_series", .series = 3}), HasSubstr("no series 3"));
    EXPECT_THAT(refused({.file = "tilted"}), AllOf(HasSubstr("axes 0 and 2 meet at 75 degrees"),
                                                   HasSubstr("only right angles are allowed")));
    EXPECT_THAT(refused({.file = "sheared.nii"}), HasSubstr("only right angles are allowed"));
    std::filesystem::create_directory(folder / "empty");
    EXPECT_THAT(refusal_of((folder / "empty").string()), HasSubstr("a folder without DICOM"));
}

TEST_F(Import, NothingThatNamesAPatientLeavesTheReader) {
    for (const char* name :
         {"dicom", "two_series", "gap", "mixed", "times", "jpeg2000", "slopes", "tilted"}) {
        std::vector<std::string> said;
        try {
            const Volume volume = load_volume({.file = at(name)}, {}, &said);
            said.insert(said.end(), {volume.name, volume.modality, volume.space});
        } catch (const InputError& error) {
            said.push_back(error.what());
        }
        for (const std::string& text : said)
            for (const char* secret : {"Roe", "Jane", "4711", "2019", "1961", "0815", "Elsewhere", "head"})
                EXPECT_THAT(text, Not(HasSubstr(secret))) << name;
    }
}

// --- Readers that die, hang or lie -----------------------------------------------------------------------------

/// read_in_child() with a program of the test's own in squint-read's place.
class Child : public VolumeFiles {
  protected:
    void TearDown() override {
        setenv("SQUINT_READ", SQUINT_READ_PROGRAM, 1);
        VolumeFiles::TearDown();
    }
    std::string with_reader(const std::string& script) {
        const std::string program = file("reader", "#!/bin/bash\n" + script);
        std::filesystem::permissions(program, std::filesystem::perms::owner_all);
        setenv("SQUINT_READ", program.c_str(), 1);
        return refusal_of(file("a.nii", std::string(400, 'x')));
    }
};

TEST_F(Child, ItsDeathIsOneLine) {
    EXPECT_EQ(with_reader("kill -SEGV $$"),
              "a.nii: its reader died (Segmentation fault): the file is damaged or hostile");
    EXPECT_EQ(with_reader("kill -ABRT $$"),
              "a.nii: its reader died (Aborted): the file is damaged or hostile");
    EXPECT_THAT(with_reader("kill -XCPU $$"), HasSubstr("processor time or the memory that it is allowed"));
    EXPECT_EQ(with_reader("exit 3"), "a.nii: its reader ended with code 3: the file is damaged or hostile");
    EXPECT_THAT(with_reader("yes"), HasSubstr("was stopped"));
    EXPECT_EQ(with_reader("printf 'error a\\tb\\nc\\n'; exit 2"), "a?b");
    setenv("SQUINT_READ", "/nowhere/squint-read", 1);
    EXPECT_THAT(refusal_of(file("a.nii", "x")), HasSubstr("cannot be run"));
}

TEST_F(Child, AHeaderThatLiesIsRefused) {
    const std::string
        head =
            "squint-read 1\ntype u8\ndims 2 2 2\ncomponents 1 1\nstep 1 0 0\nstep 0 1 0\nstep 0 0 1\n"
            "first 0 0 0\n",
        spill = "head -c 72 /dev/zero >&3; ";
    const auto with = [&](const std::string& text, const std::string& before) {
        return with_reader(before + "printf '" + text + "'");
    };
    EXPECT_EQ(with(head + "end\n", spill), "no refusal");
    EXPECT_THAT(with(head + "end\n", ""), HasSubstr("handed back 0 bytes of voxels, but 72 are needed"));
    EXPECT_THAT(with(head, spill), HasSubstr("handed back no header of this version"));
    EXPECT_THAT(with("squint-read 2\nend\n", spill), HasSubstr("handed back no header of this version"));
    EXPECT_THAT(with("squint-read 1\ntype u12\nend\n", spill),
                HasSubstr("handed back no header of this version"));
    EXPECT_THAT(with(head + "dims 1 1 9999999999999999\nend\n", spill), StartsWith("a.nii: "));
    EXPECT_THAT(with(head + "components 0 1\nend\n", spill), HasSubstr("0 components"));
    EXPECT_THAT(with(head + "components 2 0\nend\n", spill), HasSubstr("handed back no header"));
    EXPECT_THAT(with(head + "first nan 0 0\nend\n", spill), HasSubstr("handed back no header"));
    EXPECT_THAT(with(head + "step 0 0 0\nend\n", spill), HasSubstr("handed back no header"));
}

// --- Damaged files ---------------------------------------------------------------------------------------------

/// Of this process and of its children that have ended.
double processor_seconds() {
    double sum = 0;
    for (const auto whose : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
        rusage used;
        getrusage(whose, &used);
        for (const timeval& time : {used.ru_utime, used.ru_stime})
            sum += static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    }
    return sum;
}

/// Flips, cuts and stuffs bytes of each file: every load ends within 5 s of processor time (a loaded machine may take
/// longer), with a volume or one line.  SQUINT_DAMAGED sets how many a format, SQUINT_SEED which.
TEST_F(Import, DamagedFilesCostOneLineEach) {
    const char* wanted = std::getenv("SQUINT_DAMAGED");
    const char* first = std::getenv("SQUINT_SEED");
    const int most = wanted ? std::atoi(wanted) : 12;
    const unsigned seed = first ? static_cast<unsigned>(std::atoi(first)) : 2024;
    int files = 0, refusals = 0, deaths = 0;
    double slowest = 0;
    for (const char* name :
         {"a.nii", "a.nii.gz", "a.mha", "packed.mha", "a.nrrd", "text.vti", "base64.vti", "packed.vti",
          "raw.vti", "dicom/IM3000", "rle/IM3000", "pages.tif", "pngs/slice0.png"}) {
        std::ifstream in(at(name), std::ios::binary);
        const std::string whole{std::istreambuf_iterator<char>(in), {}};
        ASSERT_FALSE(whole.empty()) << name;
        std::mt19937 random(seed);
        // A picture costs ten times as much: OpenImageIO's libraries are loaded for each.
        const std::string_view end = std::string_view(name).substr(std::string_view(name).size() - 4);
        const int count = end == ".tif" || end == ".png" ? (most + 3) / 4 : most;
        for (int i = 0; i < count; ++i) {
            std::string damaged = whole;
            const auto place = [&] {  // mostly in the header
                const std::size_t end =
                    random() % 4 ? std::min<std::size_t>(damaged.size(), 1200) : damaged.size();
                return random() % end;
            };
            for (unsigned change = 0; change <= random() % 6; ++change) {
                const std::size_t p = place();
                switch (random() % 5) {
                    case 0:
                        damaged[p] = static_cast<char>(random());
                        break;
                    case 1:
                        damaged[p] = static_cast<char>(damaged[p] ^ (1 << random() % 8));
                        break;
                    case 2:
                        damaged.resize(std::max<std::size_t>(p, 1));
                        break;
                    case 3:
                        damaged.insert(p, std::string(1 + random() % 64, static_cast<char>(random())));
                        break;
                    default:
                        for (std::size_t b = p; b < std::min(p + 4, damaged.size()); ++b) damaged[b] = '\xff';
                }
            }
            std::string extension = std::filesystem::path(name).extension().string();
            if (std::string_view(name).ends_with(".nii.gz")) extension = ".nii.gz";
            const std::string path = file("damaged" + (extension.empty() ? ".dcm" : extension), damaged);
            const double before = processor_seconds();
            const std::string message = refusal({.file = path}, {.max_bytes = std::int64_t{1} << 28});
            const double took = processor_seconds() - before;
            EXPECT_LT(took, 5) << name << " " << i << " " << message;
            EXPECT_FALSE(message.empty());
            EXPECT_THAT(message, Not(HasSubstr("\n"))) << name << " " << i;
            ++files, refusals += message != "no refusal";
            deaths += message.find("its reader") != std::string::npos;
            slowest = std::max(slowest, took);
        }
    }
    EXPECT_GT(refusals, most);
    std::printf("%d damaged files: %d refused, %d of them by a reader's death; the slowest took %.2f s\n",
                files, refusals, deaths, slowest);
}

}  // namespace
}  // namespace squint
