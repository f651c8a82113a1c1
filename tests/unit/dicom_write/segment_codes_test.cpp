#include "engine/io/segment_codes.h"

#include <gmock/gmock.h>

#include <set>

#include "tests/unit/io/sample_files.h"

namespace palpate {
namespace {

using test::Folder;
using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(SegmentCodes, KnowStructuresByNameAndSide) {
    const SegmentCodes codes;
    for (const char* name : {"liver", "Liver", " LIVER "}) {
        EXPECT_EQ(codes.code_of(5, name).type, (DicomCode{"SCT", "10200004", "Liver"})) << name;
        EXPECT_FALSE(codes.code_of(5, name).modifier);
    }
    for (const char* name : {"kidney_right", "Right kidney", "kidney-R"}) {
        EXPECT_EQ(codes.code_of(2, name).type.value, "64033007") << name;
        ASSERT_TRUE(codes.code_of(2, name).modifier) << name;
        EXPECT_EQ(codes.code_of(2, name).modifier->meaning, "Right") << name;
    }
    EXPECT_EQ(codes.code_of(1, "heart_atrium_left").type.value, "82471001");
    EXPECT_EQ(codes.code_of(1, "Tumour").category.value, "49755003");
    EXPECT_EQ(codes.code_of(1, "vertebrae_L4").type.value, "11994002");
    for (const char* name : {"", "left", "my own thing", "deliver"})
        EXPECT_EQ(codes.code_of(9, name), SegmentCode{}) << name;
}

// Any of them fits what DICOM has room for, and no name stands for two.
TEST(SegmentCodes, OfTheTableAreDistinct) {
    std::set<std::string> names;
    for (const io::KnownStructure& known : io::known_structures()) {
        EXPECT_LE(std::string(known.code).size(), 16u);
        EXPECT_LE(std::string(known.meaning).size(), 64u);
        EXPECT_EQ(std::string(known.code).find_first_not_of("0123456789"), std::string::npos);
        std::string rest = known.names;
        for (size_t end = 0; end != std::string::npos;) {
            end = rest.find(',');
            EXPECT_TRUE(names.insert(rest.substr(0, end)).second) << rest;
            EXPECT_EQ(SegmentCodes().code_of(1, rest.substr(0, end)).type.value, known.code)
                << rest;
            rest.erase(0, end == std::string::npos ? end : end + 1);
        }
    }
}

TEST(SegmentCodes, AFileGoesFirst) {
    const Folder folder("codes");
    test::write(folder / "codes.txt",
                "# ours\n\nliver; SCT|123037004|Anatomical Structure; 99OUR|L1|Our liver\n"
                "7; SCT|49755003|Altered ; SCT|52988006|Lesion; SCT|7771000|Left");
    const auto codes = SegmentCodes::load(folder / "codes.txt");
    ASSERT_TRUE(codes) << codes.error().message;
    EXPECT_EQ(codes->code_of(1, "Liver").type, (DicomCode{"99OUR", "L1", "Our liver"}));
    EXPECT_EQ(codes->code_of(7, "Liver").type.meaning, "Lesion");
    EXPECT_EQ(codes->code_of(7, "").modifier->meaning, "Left");
    EXPECT_EQ(codes->code_of(2, "spleen").type.value, "78961009");
}

TEST(SegmentCodes, AWrongLineIsNamed) {
    const Folder folder("codes");
    for (const char* line :
         {"liver", "liver; SCT|1|A", "liver; SCT|1; SCT|2|B", "liver; SCT|1|A; SCT||B",
          "liver; SCT|1|A; SCT|2|B; left", "; SCT|1|A; SCT|2|B",
          "liver; SCT|1|A; SCT|12345678901234567|B", "liver; SCT|1|A; SCT|2|B; SCT|3|C; SCT|4|D"}) {
        test::write(folder / "codes.txt", std::string("# first\n") + line + "\n");
        const auto codes = SegmentCodes::load(folder / "codes.txt");
        ASSERT_FALSE(codes) << line;
        EXPECT_THAT(
            codes.error().message,
            AllOf(HasSubstr("codes.txt:2: expected NAME; CATEGORY; TYPE"), HasSubstr(line)));
    }
}

} // namespace
} // namespace palpate
