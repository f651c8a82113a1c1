// Files whose elements do not follow one another as their lengths say.

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>

#include "engine/io/volume_io.h"
#include "tests/unit/io/dicom_bytes.h"
#include "tests/unit/io/dicom_codec.h"
#include "tests/unit/io/sample_files.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using test::DicomData;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class DicomStructures : public testing::Test {
 protected:
    std::string error_of(const std::string& bytes) const {
        const fs::path path = folder_ / "a.dcm";
        test::write(path, bytes);
        const Result<LoadedVolume> loaded = load_volume(path);
        return loaded ? "" : loaded.error().message;
    }
    test::Folder folder_{"structure"};
};

// The place where an element of an explicit little-endian file begins.
size_t place_of(const std::string& file, uint16_t group, uint16_t number) {
    return file.find(test::little(group, 2) + test::little(number, 2));
}

TEST_F(DicomStructures, AWrongLengthIsNamedWithTagAndByte) {
    std::string file = test::dicom_slice(0);
    const size_t at = place_of(file, 0x28, 0x10);
    file[at + 7] = '\x7f';
    const std::string error = error_of(file);
    EXPECT_THAT(error, AllOf(HasSubstr("a.dcm: is damaged"), HasSubstr("(0028,0010)"),
                             HasSubstr("at byte " + std::to_string(at)),
                             HasSubstr("claims 32514 bytes"), Not(HasSubstr("gdcm"))));
}

TEST_F(DicomStructures, AnUnknownRepresentationIsNamed) {
    std::string file = test::dicom_slice(0);
    file[place_of(file, 0x28, 0x10) + 4] = '\x1b';
    EXPECT_THAT(error_of(file), AllOf(HasSubstr("(0028,0010)"), HasSubstr("representation"),
                                      Not(HasSubstr("\x1b"))));
}

TEST_F(DicomStructures, TextOfTheHeaderIsQuotedInOneLine) {
    std::string file = test::dicom_slice(0);
    file[file.find(test::kExplicitLittle) + 1] = '\n';
    EXPECT_THAT(error_of(file), AllOf(HasSubstr("'1\\n2.840.10008.1.2.1'"), Not(HasSubstr("\n"))));
}

TEST_F(DicomStructures, EveryFileThatIsCutOffIsRefusedInWords) {
    const std::string file = test::dicom_slice(0);
    for (size_t size = 0; size < file.size(); size += 13) {
        const std::string error = error_of(file.substr(0, size));
        EXPECT_THAT(error, AllOf(HasSubstr("a.dcm: "), Not(HasSubstr("gave up")),
                                 Not(HasSubstr("crashed"))))
            << size;
    }
}

TEST_F(DicomStructures, ADamagedHeaderInAFolderIsPassedOver) {
    for (int z = 0; z < 4; ++z)
        test::write(folder_ / ("s" + std::to_string(z)), test::dicom_slice(z));
    std::string file = test::dicom_slice(4);
    file[place_of(file, 0x28, 0x10) + 7] = '\x7f';
    test::write(folder_ / "broken", file);
    test::write(folder_ / "cut", file.substr(0, 150)); // within the meta header
    const Result<LoadedVolume> loaded = load_volume(folder_.path());
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->volume.size(), glm::uvec3(8, 4, 4));
    EXPECT_THAT(loaded->warnings,
                Contains(AllOf(HasSubstr("broken: is passed over"), HasSubstr("(0028,0010)"))));
    EXPECT_THAT(loaded->warnings, Contains(HasSubstr("cut: is passed over")));
}

TEST_F(DicomStructures, EveryWayOfWritingIsFollowed) {
    const std::string file = test::dicom_slice(0);
    for (const char* syntax : {"1.2.840.10008.1.2", "1.2.840.10008.1.2.2"})
        EXPECT_EQ(error_of(test::encoded(file, syntax)), "") << syntax;
    DicomData data = test::samples(8, 4, 16, 16, true);
    test::place(data, "0\\0\\0", "1\\0\\0\\0\\1\\0", "1\\1");
    data.put(0x7fe0, 0x10, "OW", std::string(64, '\1'));
    // Sequences and items without lengths, and one of unknown representation, which is implicit.
    const std::string open = test::little(0xffffffff, 4);
    const std::string item = test::little(0xe000fffe, 4);
    const std::string ends = test::little(0xe00dfffe, 4) + test::little(0, 4) +
                             test::little(0xe0ddfffe, 4) + test::little(0, 4);
    const std::string whole = data.file(test::kCtClass, "1.2.3");
    const size_t at = place_of(whole, 0x20, 0x32);
    const std::string head = test::little(0x08, 2) + test::little(0x1140, 2);
    const std::string text = test::little(0x08, 2) + test::little(0x60, 2);
    const auto with = [&](const std::string& sequence) {
        return std::string(whole).insert(at, sequence);
    };
    const std::string nested = head + "SQ" + test::little(0, 2) + open + item + open + text + "CS" +
                               test::little(2, 2) + "CT" + ends;
    const std::string unknown = head + "UN" + test::little(0, 2) + open + item + open + text +
                                test::little(2, 4) + "CT" + ends;
    EXPECT_EQ(error_of(with(nested)), "");
    EXPECT_EQ(error_of(with(unknown)), "");
    EXPECT_THAT(error_of(with(nested.substr(0, nested.size() - 8))),
                AllOf(HasSubstr("(0008,1140)"), HasSubstr("where an item is due")));
    EXPECT_THAT(error_of(with(head + "OB" + test::little(0, 2) + open + item + test::little(0, 4) +
                              ends.substr(8))),
                HasSubstr("(0008,1140) at byte " + std::to_string(at) +
                          " has no length and is no sequence"));
    // An end of a sequence that never began; depth without end.
    EXPECT_THAT(error_of(with(test::little(0xe0ddfffe, 4) + test::little(0, 4))),
                HasSubstr("lies where no item begins or ends"));
    std::string deep;
    for (int i = 0; i < 100; ++i)
        deep += head + "SQ" + test::little(0, 2) + open + item + open;
    EXPECT_THAT(error_of(with(deep)), HasSubstr("nested more than 32 deep"));
}

// A file whose codec fails, though its elements are whole.
TEST_F(DicomStructures, AFileThatItsCodecDoesNotDecodeIsPassedOver) {
    for (const bool resample : {false, true}) {
        for (int z = 0; z < 5; ++z) {
            std::string file =
                test::encoded(test::dicom_slice(z, 2.5, 8, 8), test::kJpegLsLossless);
            const size_t at = file.find(test::kJpegLsLossless);
            ASSERT_NE(at, std::string::npos);
            if (z == 2) // named JPEG 2000, second part: a codestream of JPEG-LS is none
                file.replace(at, 22, "1.2.840.10008.1.2.4.92");
            test::write(folder_ / ("s" + std::to_string(z)), file);
        }
        const Result<LoadedVolume> loaded =
            load_volume(folder_.path(), {.resample_slices = resample});
        ASSERT_TRUE(loaded) << loaded.error().message;
        EXPECT_THAT(loaded->warnings, Contains(AllOf(HasSubstr("s2: is passed over"),
                                                     HasSubstr("cannot be decoded"))));
        ASSERT_EQ(loaded->volume.size(), glm::uvec3(8, 8, 5));
        EXPECT_EQ(loaded->volume.value({3, 2, 1}), -877.0f);
        EXPECT_EQ(loaded->volume.value({3, 2, 3}), -677.0f);
        if (resample)
            EXPECT_EQ(loaded->volume.value({3, 2, 2}), -777.0f);
        else
            EXPECT_TRUE(std::isnan(loaded->volume.value({3, 2, 2})));
    }
    // If none is decoded, the refusal names one and why.
    for (int z = 0; z < 5; ++z) {
        std::string file = test::encoded(test::dicom_slice(z, 2.5, 8, 8), test::kJpegLsLossless);
        file.replace(file.find(test::kJpegLsLossless), 22, "1.2.840.10008.1.2.4.92");
        test::write(folder_ / ("s" + std::to_string(z)), file);
    }
    const Result<LoadedVolume> none = load_volume(folder_.path());
    ASSERT_FALSE(none);
    EXPECT_THAT(none.error().message, AllOf(HasSubstr("s0: "), HasSubstr("cannot be decoded")));
}

} // namespace
} // namespace palpate
