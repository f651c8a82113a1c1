#include <gmock/gmock.h>

#include "engine/decode/slice_list.h"
#include "engine/io/volume_io.h"
#include "tests/unit/io/loaded.h"
#include "tests/unit/io/sample_files.h"

namespace palpate {
namespace {

using test::Folder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// 3 x 2 samples; value 1000 z + 10 y + x.
std::string slice(uint16_t z) {
    const auto at = [z](int x, int y) { return static_cast<uint16_t>(1000 * z + 10 * y + x); };
    return test::png({{at(0, 0), at(1, 0), at(2, 0)}, {at(0, 1), at(1, 1), at(2, 1)}});
}

TEST(NaturalOrder, ComparesRunsOfDigitsAsNumbers) {
    using io::natural_less;
    EXPECT_TRUE(natural_less("s2", "s10"));
    EXPECT_FALSE(natural_less("s10", "s2"));
    EXPECT_TRUE(natural_less("s009", "s10"));
    EXPECT_TRUE(natural_less("a9b1", "a9b02"));
    EXPECT_TRUE(natural_less("a", "a1"));
    EXPECT_FALSE(natural_less("same1", "same1"));
    EXPECT_TRUE(natural_less("s1", "s01") != natural_less("s01", "s1"));
}

TEST(Slices, AreOrderedByNumberWithoutPadding) {
    const Folder folder("slices");
    for (const uint16_t z : {8, 9, 10, 11})
        test::write(folder / fmt::format("ct.{}.png", z), slice(z));
    for (const auto& path : {folder.path(), folder / "ct.%d.png", folder / "ct.*.png"}) {
        const LoadedVolume volume = loaded(path);
        ASSERT_EQ(volume.volume.size(), glm::uvec3(3, 2, 4));
        EXPECT_EQ(volume.volume.value({2, 1, 0}), 8012.0f);
        EXPECT_EQ(volume.volume.value({0, 0, 3}), 11000.0f);
        EXPECT_THAT(volume.warnings, ElementsAre(HasSubstr("1 x 1 x 1 mm is assumed")));
    }
    EXPECT_THAT(error_of(folder / "mr_%d.png"), HasSubstr("no file matches"));
    EXPECT_THAT(error_of(folder / "ct.%03d.png"), HasSubstr("no file matches"));
    EXPECT_THAT(error_of(folder / "ct.%d.png", {.frame = 1}), HasSubstr("no frame 1"));
}

TEST(Slices, SayWhichNumberIsMissing) {
    const Folder folder("slices");
    for (const uint16_t z : {1, 2, 4})
        test::write(folder / fmt::format("s{:03}.png", z), slice(z));
    EXPECT_THAT(loaded(folder.path()).warnings,
                testing::Contains(AllOf(HasSubstr("s002.png"), HasSubstr("s004.png"))));
}

TEST(Slices, OfDifferentSizesAreRefusedWithFilesAndNumbers) {
    const Folder folder("slices");
    test::write(folder / "s1.png", slice(1));
    test::write(folder / "s2.png", test::png({{1, 2}, {3, 4}}));
    EXPECT_THAT(error_of(folder.path()),
                AllOf(HasSubstr("mixed sizes"), HasSubstr("s1.png is 3 x 2"),
                      HasSubstr("s2.png is 2 x 2")));
}

TEST(Slices, TakeTheirPlaceFromTheSidecar) {
    const Folder folder("slices");
    for (const uint16_t z : {1, 2})
        test::write(folder / fmt::format("s{}.png", z), slice(z));
    test::write(folder / "slices.json",
                R"({"spacing_mm": [0.5, 0.25, 2], "origin_mm": [1, 2, 3], "modality": "CT",
                    "directions": [[1, 0, 0], [0, 0, -1], [0, 1, 0]]})");
    const LoadedVolume volume = loaded(folder.path());
    // A CT by the sidecar, whose values reach 0 at least.
    EXPECT_THAT(volume.warnings, testing::ElementsAre(testing::HasSubstr("taken as HU + 1024")));
    EXPECT_EQ(volume.modality, "CT");
    const glm::dmat4& m = volume.volume.grid().world_from_index;
    EXPECT_EQ(m[0], glm::dvec4(0.5, 0, 0, 0));
    EXPECT_EQ(m[1], glm::dvec4(0, 0, -0.25, 0));
    EXPECT_EQ(m[2], glm::dvec4(0, 2, 0, 0));
    EXPECT_EQ(m[3], glm::dvec4(1, 2, 3, 1));
}

TEST(Slices, WithoutAHeaderAreReadAsTheSidecarSays) {
    for (const bool big : {false, true}) {
        const Folder folder("slices");
        for (int z = 1; z <= 3; ++z) {
            std::string bytes = "head";
            for (int i = 0; i < 6; ++i) {
                std::string word = test::little(static_cast<uint16_t>(i - 100 * z), 2);
                if (big)
                    std::swap(word[0], word[1]);
                bytes += word;
            }
            test::write(folder / fmt::format("raw.{}", z), bytes);
        }
        test::write(folder / "slices.json",
                    fmt::format(R"({{"pattern": "raw.%d", "size": [3, 2], "type": "i16",
                                     "header_bytes": 4, "endianness": "{}",
                                     "spacing_mm": [1, 1, 1]}})",
                                big ? "big" : "little"));
        const LoadedVolume volume = loaded(folder.path());
        ASSERT_EQ(volume.volume.size(), glm::uvec3(3, 2, 3));
        EXPECT_EQ(volume.volume.value({2, 1, 2}), 5.0f - 300.0f);
        EXPECT_THAT(volume.warnings, IsEmpty());

        test::write(folder / "raw.2", "head0123456789ABxyz");
        EXPECT_THAT(loaded(folder.path()).warnings,
                    ElementsAre(AllOf(HasSubstr("19 bytes"), HasSubstr("16 are read"))));
        test::write(folder / "raw.2", "head0123456789");
        EXPECT_THAT(error_of(folder.path()),
                    AllOf(HasSubstr("raw.2"), HasSubstr("expected 16 bytes"), HasSubstr("14")));
    }
}

TEST(Sidecar, NamesTheKeyThatIsWrong) {
    const Folder folder("slices");
    const auto message = [&](const std::string& json) {
        test::write(folder / "slices.json", json);
        const auto sidecar = io::load_sidecar(folder / "slices.json");
        return sidecar ? "no error" : sidecar.error().message;
    };
    EXPECT_THAT(message(R"({"spacing": [1, 1, 1]})"),
                HasSubstr("unknown key \"spacing\"; did you mean \"spacing_mm\"?"));
    EXPECT_THAT(message(R"({"spacing_mm": [1, 0, 1]})"), HasSubstr("spacing_mm"));
    EXPECT_THAT(message(R"({"type": "int"})"), HasSubstr("type: expected one of \"u8\""));
    EXPECT_THAT(message(R"({"pattern": "../s%d"})"), HasSubstr("pattern"));
    EXPECT_THAT(message(R"({"size": [-1, 4]})"), HasSubstr("size"));
    EXPECT_THAT(message("[1]"), HasSubstr("object"));
    EXPECT_THAT(message("{"), HasSubstr("slices.json"));
}

TEST(Folders, WithNothingToReadSaySo) {
    const Folder folder("slices");
    EXPECT_THAT(error_of(folder.path()), HasSubstr("expected a folder of DICOM files"));
    EXPECT_THAT(error_of(folder / "none.nii"), HasSubstr("no such file"));
    EXPECT_THAT(error_of("/dev/zero"), HasSubstr("device or pipe"));
}

} // namespace
} // namespace palpate
