#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/volume/grid.h"
#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/sample_files.h"

namespace palpate::io {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class MetaImage : public testing::Test {
 protected:
    Result<DecodedHere> decode(const std::string& bytes, std::optional<uint32_t> frame = {}) const {
        return decode_here(folder_.write("v.mha", bytes), frame);
    }
    std::string refusal(const std::string& bytes) const {
        const Result<DecodedHere> result = decode(bytes);
        return result ? "not refused" : result.error().message;
    }
    TemporaryFolder folder_;
};

TEST_F(MetaImage, EveryEncodingGivesTheSameVolume) {
    std::string big = meta_image_header("");
    big.replace(big.find("False"), 5, "True");
    const std::string files[] = {
        meta_image_header("") + twelve_shorts(),
        big + twelve_shorts(true),
        meta_image_header("CompressedData = True\nCompressedDataSize = 3\n") +
            deflated(twelve_shorts(), 15),
        meta_image_header("BinaryData = False\n") + "1 2 3 4 5 6 7 8 9 10 11 12\n",
        meta_image_header("HeaderSize = -1\n") + "abc" + twelve_shorts(),
        meta_image_header("Comment = x: y = z\n") + twelve_shorts(),
    };
    for (const std::string& bytes : files) {
        const auto result = decode(bytes);
        ASSERT_TRUE(result) << result.error().message;
        EXPECT_EQ(result->values, kOneToTwelve);
        EXPECT_EQ(world_point(result->decoded.grid, {1, 1, 1}), glm::dvec3(12, 23, 34));
        EXPECT_THAT(result->decoded.warnings, IsEmpty());
    }
}

TEST_F(MetaImage, DetachedDataLieInTheHeadersFolder) {
    folder_.write("v.raw", "head" + twelve_shorts());
    for (const char* size : {"4", "-1"}) {
        const auto result = decode_here(folder_.write(
            "v.mhd", meta_image_header("HeaderSize = " + std::string(size) + "\n", "v.raw")));
        ASSERT_TRUE(result) << result.error().message;
        EXPECT_EQ(result->values, kOneToTwelve);
    }
    folder_.write("v.zraw", deflated(twelve_shorts(), 15));
    EXPECT_EQ(decode(meta_image_header("CompressedData = True\n", "v.zraw"))->values, kOneToTwelve);
    EXPECT_THAT(refusal(meta_image_header("", "/etc/passwd")), HasSubstr("outside"));
    EXPECT_THAT(refusal(meta_image_header("", "../v.raw")), HasSubstr("outside"));
    EXPECT_THAT(refusal(meta_image_header("", "none.raw")), HasSubstr("no such file"));
    EXPECT_THAT(refusal(meta_image_header("", "LIST")), HasSubstr("list of them"));
    EXPECT_THAT(refusal(meta_image_header("", "s%03d.raw 1 4 1")), HasSubstr("list of them"));
}

TEST_F(MetaImage, EachRunOfTheMatrixIsTheDirectionOfOneAxis) {
    const auto result =
        decode(meta_image_header("TransformMatrix = 0 1 0 0 0 -1 1 0 0\n") + twelve_shorts());
    ASSERT_TRUE(result);
    const glm::dmat4& m = result->decoded.grid.world_from_index;
    EXPECT_EQ(m[0], glm::dvec4(0, 2, 0, 0));
    EXPECT_EQ(m[1], glm::dvec4(0, 0, -3, 0));
    EXPECT_EQ(m[2], glm::dvec4(4, 0, 0, 0));
    EXPECT_EQ(m[3], glm::dvec4(10, 20, 30, 1));
}

TEST_F(MetaImage, UnitsScaleModalityAndFramesAreRead) {
    const auto result = decode(meta_image_header("DistanceUnits = cm\nModality = MET_MOD_CT\n"
                                                 "ElementToIntensityFunctionSlope = 2\n"
                                                 "ElementToIntensityFunctionOffset = -1000\n") +
                               twelve_shorts());
    ASSERT_TRUE(result);
    EXPECT_EQ(world_point(result->decoded.grid, {1, 1, 1}), glm::dvec3(120, 230, 340));
    EXPECT_EQ(result->decoded.modality, "CT");
    EXPECT_EQ(result->decoded.rescale, (std::vector<Rescale>{{2, -1000}}));

    const std::string frames =
        "NDims = 4\nDimSize = 3 2 1 2\nElementType = MET_SHORT\nElementSpacing = 1 1 1 1\n"
        "ElementDataFile = LOCAL\n" +
        twelve_shorts();
    EXPECT_EQ(decode(frames, 1)->values.front(), 7);
    const auto plain = decode(
        "NDims = 2\nDimSize = 4 3\nElementType = MET_SHORT\n"
        "ElementNumberOfChannels = 1\nElementDataFile = LOCAL\n" +
        twelve_shorts());
    ASSERT_TRUE(plain);
    EXPECT_EQ(plain->decoded.grid.size, glm::uvec3(4, 3, 1));
    EXPECT_THAT(plain->decoded.warnings[0], HasSubstr("ElementSpacing"));
    const auto rgb = decode(
        "NDims = 2\nDimSize = 2 2\nElementType = MET_UCHAR\n"
        "ElementSpacing = 1 1\nElementNumberOfChannels = 3\n"
        "ElementDataFile = LOCAL\n123456789abc");
    EXPECT_EQ(rgb->claim.components, 3u);
}

TEST_F(MetaImage, HostileHeadersAreRefusedByField) {
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string header = meta_image_header("");
        header.replace(header.find(from), from.size(), to);
        return refusal(header + twelve_shorts());
    };
    EXPECT_THAT(with("NDims = 3", "NDims = 0"), HasSubstr("NDims"));
    EXPECT_THAT(with("NDims = 3", "NDims = 1e9"), HasSubstr("NDims"));
    EXPECT_THAT(with("DimSize = 3 2 2", "DimSize = 3 2"), HasSubstr("3 sizes"));
    EXPECT_THAT(with("DimSize = 3 2 2", "DimSize = 3 -2 2"), HasSubstr("found -2"));
    EXPECT_THAT(with("DimSize = 3 2 2", "DimSize = 2147483647 2147483647 2147483647"),
                HasSubstr("not a possible size"));
    EXPECT_THAT(with("DimSize = 3 2 2", "DimSize = 300 200 200"), HasSubstr("24 bytes"));
    EXPECT_THAT(with("MET_SHORT", "MET_FLOAT_MATRIX"), HasSubstr("ElementType"));
    EXPECT_THAT(with("ElementSpacing = 2 3 4", "ElementSpacing = 2 3"), HasSubstr("3 numbers"));
    EXPECT_THAT(with("ElementSpacing = 2 3 4", "ElementSpacing = 2 0 4"), HasSubstr("above 0 mm"));
    EXPECT_THAT(with("ElementSpacing = 2 3 4", "ElementSpacing = 2 nan 4"),
                HasSubstr("not finite"));
    EXPECT_THAT(with("Offset = 10", "Offset = inf"), HasSubstr("not finite"));
    EXPECT_THAT(with("Offset = ", "TransformMatrix = 1 0 0 1 0 0 0 0 1\nOffset = "),
                HasSubstr("one plane"));
    EXPECT_THAT(with("ObjectType = Image", "ObjectType = Scene"), HasSubstr("\"Scene\""));
    EXPECT_THAT(with("ElementDataFile = LOCAL\n", ""), HasSubstr("expected"));
    EXPECT_THAT(with("Offset", "NDims"), HasSubstr("two fields NDims"));
    EXPECT_THAT(refusal(meta_image_header("HeaderSize = -2\n")), HasSubstr("HeaderSize"));
    EXPECT_THAT(refusal(meta_image_header("HeaderSize = 5\n") + twelve_shorts()),
                HasSubstr("local data"));
    EXPECT_THAT(refusal(meta_image_header("HeaderSize = -1\nCompressedData = True\n") +
                        deflated(twelve_shorts(), 15)),
                HasSubstr("packed data"));
    EXPECT_THAT(refusal(meta_image_header("CompressedData = True\n") + "no zlib stream here."),
                HasSubstr("damaged"));
    EXPECT_THAT(refusal(std::string(2 << 20, '\n')), HasSubstr("ElementDataFile"));
}

} // namespace
} // namespace palpate::io
