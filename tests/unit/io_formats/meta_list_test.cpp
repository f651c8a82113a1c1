// MetaImage: lists of files.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/decode/volume_files.h"
#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/generated_files.h"

namespace palpate::io {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class MetaLists : public testing::Test {
 protected:
    static std::string header_of(const Sizes& sizes, bool has_frames, const NumberType& type,
                                 bool big, Written as, const std::string& more) {
        return fmt::format(
            "ObjectType = Image\nNDims = {}\nBinaryData = {}\nBinaryDataByteOrderMSB = {}\n"
            "CompressedData = {}\nDimSize = {} {} {}{}\nElementSpacing = 1 2 3{}\n"
            "ElementType = {}\n{}",
            has_frames ? 4 : 3, as == Written::text ? "False" : "True", big ? "True" : "False",
            as == Written::packed ? "True" : "False", sizes.x, sizes.y, sizes.z,
            has_frames ? fmt::format(" {}", sizes.t) : "", has_frames ? " 1" : "", type.meta, more);
    }
    std::filesystem::path write(const Sizes& sizes, bool has_frames, const NumberType& type,
                                bool big, Written as, size_t parts, const std::string& field,
                                int first = 1, int step = 1) {
        const std::vector<int> numbers = numbers_of(sizes, has_frames ? "xyzt" : "xyz");
        std::string names;
        for (size_t i = 0; i < parts; ++i) {
            const std::string name = fmt::format("a slice {:02}.raw", first + step * int(i));
            folder_.write(name, written(numbers, i * numbers.size() / parts, numbers.size() / parts,
                                        type, big, as, 15));
            names += name + (i % 2 == 0 ? "\r\n" : "  \n");
        }
        return folder_.write("v.mhd", header_of(sizes, has_frames, type, big, as,
                                                "ElementDataFile = " + field + "\n") +
                                          (field.starts_with("LIST") ? names : ""));
    }
    TemporaryFolder folder_;
};

TEST_F(MetaLists, HoldSlicesOrFrames) {
    std::mt19937 random(4);
    const std::vector<NumberType> types = number_types();
    const Sizes sizes{4, 3, 6, 2};
    struct Case {
        bool has_frames;
        size_t parts;
        std::string field;
        int first = 1, step = 1;
    };
    const Case cases[] = {{false, 6, "LIST"},
                          {false, 6, "LIST 2"},
                          {false, 6, "LIST 2D"},
                          {false, 18, "LIST 1D"},
                          {false, 6, "a slice %02d.raw"},
                          {false, 6, "a slice %02d.raw 7", 7},
                          {false, 6, "a slice %02d.raw 1 6 1"},
                          {false, 6, "a slice %02d.raw 10 20", 10, 2},
                          {false, 6, "a slice %02d.raw 30 20 -2", 30, -2},
                          {true, 2, "LIST"},
                          {true, 2, "LIST 3D"},
                          {true, 12, "LIST 2D"},
                          {true, 2, "a slice %02d.raw 1 2 1"}};
    for (const Case& c : cases)
        for (const Written as : {Written::raw, Written::packed, Written::text}) {
            const bool big = below(random, 2) == 1;
            const NumberType& type = types[static_cast<size_t>(below(random, 7))];
            const auto path =
                write(sizes, c.has_frames, type, big, as, c.parts, c.field, c.first, c.step);
            EXPECT_EQ(volume_files(path).size(), c.parts + 1);
            for (int t = 0; t < (c.has_frames ? sizes.t : 1); ++t) {
                const auto result = decode_here(path, static_cast<uint32_t>(t));
                ASSERT_TRUE(result) << c.field << result.error().message;
                EXPECT_EQ(result->values, frame_of(sizes, t)) << c.field;
                EXPECT_THAT(result->decoded.warnings, IsEmpty());
            }
        }
}

TEST_F(MetaLists, ThatDoNotFitAreRefusedByCause) {
    const Sizes sizes{4, 3, 6, 1};
    const NumberType type = number_type<int16_t>("", "MET_SHORT");
    const auto refusal = [&](const std::string& field, const std::string& names = "") {
        write(sizes, false, type, false, Written::raw, 6, "LIST");
        const auto result = decode_here(
            folder_.write("v.mhd", header_of(sizes, false, type, false, Written::raw,
                                             "ElementDataFile = " + field + "\n" + names)));
        return result ? "not refused" : result.error().message;
    };
    std::string all;
    for (int i = 1; i <= 5; ++i)
        all += fmt::format("a slice {:02}.raw\n", i);
    EXPECT_EQ(refusal("LIST", all + "a slice 06.raw"), "not refused");
    EXPECT_THAT(refusal("LIST", all),
                HasSubstr("expected 6 data files in the list of them, found 5"));
    EXPECT_THAT(refusal("LIST", all + "a slice 06.raw\na slice 01.raw\n"), HasSubstr("found 7"));
    EXPECT_THAT(refusal("LIST", all + "none.raw\n"), HasSubstr("no such file"));
    EXPECT_THAT(refusal("LIST", all + "../v.mhd\n"), HasSubstr("outside"));
    EXPECT_THAT(refusal("LIST", all + "v.mhd\n"), HasSubstr("expected 24 bytes"));
    EXPECT_THAT(refusal("a slice %02d.raw 1 4 1"), HasSubstr("found 4"));
    EXPECT_THAT(refusal("a slice %02d.raw 2"), HasSubstr("no such file"));
    EXPECT_THAT(refusal("a slice %02d.raw 1 6 0"), HasSubstr("range of"));
    EXPECT_THAT(refusal("a slice %02d.raw 9223372036854775807"), HasSubstr("range of"));
    EXPECT_THAT(refusal("a slice %02d.raw -9223372036854775808 9223372036854775807"),
                HasSubstr("range of"));
    EXPECT_THAT(refusal("a slice %s.raw 1 6 1"), HasSubstr("list of them"));
}

} // namespace
} // namespace palpate::io
