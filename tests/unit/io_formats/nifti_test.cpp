#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/volume/grid.h"
#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/sample_files.h"

namespace palpate::io {
namespace {

using testing::HasSubstr;

class Nifti : public testing::Test {
 protected:
    Result<DecodedHere> decode(const std::string& bytes, const std::string& name = "v.nii",
                               std::optional<uint32_t> frame = {}) const {
        return decode_here(folder_.write(name, bytes), frame);
    }
    // The sentence of a refusal; says so when there is none.
    std::string refusal(const std::string& bytes, const std::string& name = "v.nii") const {
        const Result<DecodedHere> result = decode(bytes, name);
        return result ? "not refused" : result.error().message;
    }
    TemporaryFolder folder_;
};

TEST_F(Nifti, BothVersionsAndByteOrdersGiveTheSameVolume) {
    for (const int version : {1, 2})
        for (const bool big_endian : {false, true})
            for (const bool packed : {false, true}) {
                const std::string bytes =
                    NiftiBytes(version, big_endian).with(twelve_shorts(big_endian));
                const auto result = packed ? decode(deflated(bytes), "v.nii.gz") : decode(bytes);
                ASSERT_TRUE(result) << result.error().message;
                EXPECT_EQ(result->values, kOneToTwelve);
                EXPECT_EQ(result->decoded.grid.size, glm::uvec3(3, 2, 2));
                EXPECT_EQ(world_point(result->decoded.grid, {1, 1, 1}), glm::dvec3(-2, -3, 4));
                EXPECT_TRUE(result->decoded.warnings.empty());
                EXPECT_TRUE(result->decoded.rescale.empty());
            }
}

TEST_F(Nifti, EveryTypeOfNumberIsRead) {
    const auto check = [&](int16_t code, ComponentType type, auto zero) {
        using T = decltype(zero);
        const std::vector<T> values{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
        for (const bool big_endian : {false, true}) {
            const auto result =
                decode(NiftiBytes(1, big_endian).datatype(code).with(bytes_of(values, big_endian)));
            ASSERT_TRUE(result) << result.error().message;
            EXPECT_EQ(result->claim.type, type);
            EXPECT_EQ(result->values, std::vector<double>(values.begin(), values.end()));
        }
    };
    check(2, ComponentType::u8, uint8_t{});
    check(256, ComponentType::i8, int8_t{});
    check(4, ComponentType::i16, int16_t{});
    check(512, ComponentType::u16, uint16_t{});
    check(8, ComponentType::i32, int32_t{});
    check(768, ComponentType::u32, uint32_t{});
    check(1024, ComponentType::i64, int64_t{});
    check(1280, ComponentType::u64, uint64_t{});
    check(16, ComponentType::f32, float{});
    check(64, ComponentType::f64, double{});
}

TEST_F(Nifti, OtherTypesAreRefusedByName) {
    const auto sentence = [&](int16_t code) {
        return refusal(NiftiBytes().datatype(code).with(std::string(500, '\0')));
    };
    EXPECT_THAT(sentence(32), HasSubstr("complex"));
    EXPECT_THAT(sentence(1792), HasSubstr("complex"));
    EXPECT_THAT(sentence(128), HasSubstr("RGB"));
    EXPECT_THAT(sentence(2304), HasSubstr("RGB"));
    EXPECT_THAT(sentence(1536), HasSubstr("128-bit"));
    EXPECT_THAT(sentence(1), HasSubstr("bits"));
    EXPECT_THAT(sentence(99), HasSubstr("99"));
}

TEST_F(Nifti, SformIsPreferredAndKeepsItsShear) {
    const auto result = decode(NiftiBytes()
                                   .sform(2, {2, 0.5, 0, 10, 0, 3, 0.25, 20, 0, 0, 4, 30})
                                   .qform(1, {0, 0, 0, 7, 7, 7})
                                   .with(twelve_shorts()));
    ASSERT_TRUE(result);
    const glm::dmat4& m = result->decoded.grid.world_from_index;
    EXPECT_EQ(m[0], glm::dvec4(-2, 0, 0, 0));
    EXPECT_EQ(m[1], glm::dvec4(-0.5, -3, 0, 0));
    EXPECT_EQ(m[2], glm::dvec4(0, -0.25, 4, 0));
    EXPECT_EQ(m[3], glm::dvec4(-10, -20, 30, 1));
}

TEST_F(Nifti, QformTurnsAndMirrors) {
    // A half turn about z (b, c, d = 0, 0, 1) and a mirrored third axis.
    const auto result = decode(NiftiBytes()
                                   .sform(0, {})
                                   .qform(1, {0, 0, 1, 10, 20, 30})
                                   .pixdim({-1, 2, 3, 4})
                                   .with(twelve_shorts()));
    ASSERT_TRUE(result);
    const glm::dmat4& m = result->decoded.grid.world_from_index;
    EXPECT_EQ(m[0], glm::dvec4(2, 0, 0, 0));
    EXPECT_EQ(m[1], glm::dvec4(0, 3, 0, 0));
    EXPECT_EQ(m[2], glm::dvec4(0, 0, -4, 0));
    EXPECT_EQ(m[3], glm::dvec4(-10, -20, 30, 1));
}

TEST_F(Nifti, QformOfAQuarterTurnAgreesWithTheRotationItNames) {
    // 90 degrees about x: a = b = sqrt(1/2); y goes to z, z to -y (RAS).
    const auto result = decode(
        NiftiBytes(2).sform(0, {}).qform(1, {std::sqrt(0.5), 0, 0, 0, 0, 0}).with(twelve_shorts()));
    ASSERT_TRUE(result);
    // Entries are sums of four squares and products of the quaternion, each rounded once: 4 ulp
    // of 1 times the spacing of at most 4.
    const double tolerance = 4 * 4 * 2.3e-16;
    EXPECT_LE(glm::length(world_point(result->decoded.grid, {0, 1, 0}) - glm::dvec3(0, 0, 3)),
              tolerance);
    EXPECT_LE(glm::length(world_point(result->decoded.grid, {0, 0, 1}) - glm::dvec3(0, 4, 0)),
              tolerance);
}

TEST_F(Nifti, WithoutAPositionSpacingIsUsedWithAWarning) {
    const auto result = decode(NiftiBytes().sform(0, {}).with(twelve_shorts()));
    ASSERT_TRUE(result);
    EXPECT_EQ(spacing_mm(result->decoded.grid), glm::dvec3(2, 3, 4));
    ASSERT_EQ(result->decoded.warnings.size(), 1u);
    EXPECT_THAT(result->decoded.warnings[0], HasSubstr("left and right may be swapped"));
}

TEST_F(Nifti, UnitsOfLengthBecomeMillimetres) {
    for (const auto& [code, mm] : {std::pair{0, 1.0}, {1, 1000.0}, {2, 1.0}, {3, 0.001}}) {
        const auto result = decode(NiftiBytes().units(code | 8).with(twelve_shorts()));
        ASSERT_TRUE(result);
        EXPECT_EQ(world_point(result->decoded.grid, {0, 0, 1}), glm::dvec3(0, 0, 4 * mm));
        EXPECT_TRUE(result->decoded.warnings.empty());
    }
    EXPECT_EQ(decode(NiftiBytes().units(5).with(twelve_shorts()))->decoded.warnings.size(), 1u);
}

TEST_F(Nifti, ScaleIsHandedOnAndSlopeZeroMeansNone) {
    for (const int version : {1, 2}) {
        SCOPED_TRACE(version);
        const auto rescale = [&](double slope, double inter) {
            return decode(NiftiBytes(version).scale(slope, inter).with(twelve_shorts()))
                ->decoded.rescale;
        };
        EXPECT_EQ(rescale(2.5, -1000), (std::vector<Rescale>{{2.5, -1000}}));
        EXPECT_TRUE(rescale(0, 5).empty());
        EXPECT_TRUE(rescale(1, 0).empty());
        EXPECT_TRUE(rescale(NAN, 5).empty());
        EXPECT_EQ(rescale(2, NAN), (std::vector<Rescale>{{2, 0}}));
    }
}

TEST_F(Nifti, FramesAreChosen) {
    std::vector<int16_t> values(24);
    for (size_t i = 0; i < 24; ++i)
        values[i] = static_cast<int16_t>(i + 1);
    const std::string bytes = NiftiBytes().dim({4, 3, 2, 2, 2}).with(bytes_of(values));
    EXPECT_EQ(decode(bytes)->values, kOneToTwelve);
    EXPECT_THAT(decode(bytes)->decoded.warnings[0], HasSubstr("2 frames"));
    for (const bool packed : {false, true}) {
        const auto second =
            packed ? decode(deflated(bytes), "v.nii.gz", 1) : decode(bytes, "v.nii", 1);
        EXPECT_EQ(second->values.front(), 13);
        EXPECT_EQ(second->values.back(), 24);
        EXPECT_TRUE(second->decoded.warnings.empty());
    }
    EXPECT_THAT(decode(bytes, "v.nii", 2).error().message, HasSubstr("no frame 2"));
}

TEST_F(Nifti, DimensionsOfOneAndUnusedZerosAreFine) {
    EXPECT_TRUE(decode(NiftiBytes().dim({7, 3, 2, 2, 1, 0, 1, 0}).with(twelve_shorts())));
    const auto flat = decode(NiftiBytes()
                                 .dim({2, 6, 2, 0})
                                 .sform(1, {2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0})
                                 .with(twelve_shorts()));
    ASSERT_TRUE(flat) << flat.error().message;
    EXPECT_EQ(flat->decoded.grid.size, glm::uvec3(6, 2, 1));
    EXPECT_EQ(flat->decoded.grid.world_from_index[2], glm::dvec4(0, 0, 1, 0));
}

TEST_F(Nifti, HostileSizesAreRefusedWithNumbers) {
    const auto sentence = [&](std::vector<int64_t> dims, int version = 1) {
        return refusal(NiftiBytes(version).dim(dims).with(twelve_shorts()));
    };
    EXPECT_THAT(sentence({0, 3, 2, 2}), HasSubstr("found 0"));
    EXPECT_THAT(sentence({8, 3, 2, 2}), HasSubstr("found 8"));
    EXPECT_THAT(sentence({3, 0, 2, 2}), HasSubstr("dimension 1, found 0"));
    EXPECT_THAT(sentence({3, 3, -2, 2}), HasSubstr("dimension 2, found -2"));
    EXPECT_THAT(sentence({4, 3, 2, 2, -1}), HasSubstr("dimension 4, found -1"));
    EXPECT_THAT(sentence({5, 3, 2, 2, 1, 3}), HasSubstr("several components (3"));
    EXPECT_THAT(sentence({3, 32767, 32767, 32767}), HasSubstr("24 bytes"));
    const int64_t big = INT32_MAX;
    EXPECT_THAT(sentence({3, big, big, big}, 2), HasSubstr("not a possible size"));
    EXPECT_THAT(sentence({3, big + 1, 1, 1}, 2), HasSubstr("2147483648"));
    EXPECT_THAT(sentence({4, 1 << 20, 1 << 20, 1 << 20, big}, 2), HasSubstr("not a possible size"));
    EXPECT_THAT(sentence({4, 1, 1, 1, big}, 2), HasSubstr("24 bytes"));
    EXPECT_THAT(refusal(deflated(NiftiBytes().dim({3, 32767, 32767, 1}).with("")), "v.nii.gz"),
                HasSubstr("can expand to"));
}

TEST_F(Nifti, LimitOfMemoryIsHeld) {
    const std::string bytes = NiftiBytes().dim({3, 100, 100, 100}).with(std::string(2000000, '\0'));
    const auto result = decode_here(folder_.write("v.nii", bytes), {}, 3000000);
    ASSERT_FALSE(result);
    EXPECT_THAT(result.error().message, HasSubstr("3000000"));
}

TEST_F(Nifti, HostilePositionsAreRefused) {
    const double nan = std::nan("");
    const auto with_sform = [&](const std::vector<double>& rows) {
        return refusal(NiftiBytes().sform(1, rows).with(twelve_shorts()));
    };
    EXPECT_THAT(with_sform({nan, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}), HasSubstr("not finite"));
    EXPECT_THAT(with_sform({1, 0, 0, INFINITY, 0, 1, 0, 0, 0, 0, 1, 0}), HasSubstr("not finite"));
    EXPECT_THAT(with_sform({1, 2, 0, 0, 2, 4, 0, 0, 0, 0, 1, 0}), HasSubstr("one plane"));
    EXPECT_THAT(with_sform({0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}), HasSubstr("above 0 mm"));
    EXPECT_THAT(refusal(NiftiBytes().sform(0, {}).qform(1, {nan, 0, 0}).with(twelve_shorts())),
                HasSubstr("not finite"));
    EXPECT_THAT(refusal(NiftiBytes().sform(0, {}).pixdim({1, 0, 1, 1}).with(twelve_shorts())),
                HasSubstr("above 0 mm"));
}

// As Connectome Workbench writes it: flags, then size and code of each extension.
TEST_F(Nifti, NamesOfLabelsAreReadFromAnExtension) {
    const std::string xml =
        "<?xml version=\"1.0\"?><CaretExtension><VolumeInformation Index=\"0\"><LabelTable>"
        "<Label Key=\"0\"><![CDATA[???]]></Label>"
        "<Label Key=\"2\" Red=\"0\" Green=\"0.5\" Blue=\"1\" Alpha=\"1\"><![CDATA[kidney "
        "right]]></Label><Label Key=\"3\">kidney left</Label></LabelTable></VolumeInformation>"
        "</CaretExtension>";
    const auto with = [&](const std::string& text, bool big_endian, int version,
                          int32_t code = 30) {
        const auto number = [&](int32_t value) {
            return bytes_of(std::vector<int32_t>{value}, big_endian);
        };
        std::string padded = text;
        padded.resize((text.size() + 8 + 15) / 16 * 16 - 8);
        const std::string other = number(32) + number(6) + std::string(24, 'c'); // a comment
        const std::string all =
            other + number(static_cast<int32_t>(padded.size() + 8)) + number(code) + padded;
        const size_t header = version == 2 ? 540 : 348;
        std::string bytes = NiftiBytes(version, big_endian)
                                .vox_offset(static_cast<double>(header + 4 + all.size()))
                                .with(all + twelve_shorts(big_endian));
        bytes[header] = 1; // extensions follow
        return bytes;
    };
    for (const int version : {1, 2})
        for (const bool big_endian : {false, true}) {
            const auto result = decode(with(xml, big_endian, version));
            ASSERT_TRUE(result) << result.error().message;
            EXPECT_EQ(result->values, kOneToTwelve);
            const std::vector<LabelName> expected{{2, "kidney right", glm::dvec3(0, 0.5, 1)},
                                                  {3, "kidney left", {}}};
            EXPECT_EQ(result->decoded.labels, expected);
        }
    EXPECT_EQ(decode(with(xml, false, 1, 0))->decoded.labels.size(), 2u); // of an unknown code
    EXPECT_TRUE(decode(with(xml, false, 1, 6))->decoded.labels.empty());  // a comment
    const auto damaged = decode(with("<CaretExtension><Vol", false, 1));
    ASSERT_TRUE(damaged) << damaged.error().message;
    EXPECT_TRUE(damaged->decoded.labels.empty());
    EXPECT_THAT(damaged->decoded.warnings,
                testing::ElementsAre(HasSubstr("the table of its labels is left out")));
}

// A matrix that is of no use gives way to the qform, in both versions and byte orders.
TEST_F(Nifti, AnSformOfNoUseGivesWayToTheQform) {
    const double nan = std::nan("");
    const std::vector<double> useless[] = {
        {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0},
        {0, 0, 0, 5, 0, 0, 0, 6, 0, 0, 0, 7},
        {1, 2, 0, 0, 2, 4, 0, 0, 0, 0, 1, 0},
        {nan, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
    };
    for (const std::vector<double>& rows : useless)
        for (const int version : {1, 2})
            for (const bool big_endian : {false, true})
                for (const int code : {1, 2, 4}) {
                    const auto file = [&](int qform_code, const std::vector<double>& quaternion) {
                        return NiftiBytes(version, big_endian)
                            .sform(code, rows)
                            .qform(qform_code, quaternion)
                            .with(twelve_shorts(big_endian));
                    };
                    // Half a turn about x; RAS turns to LPS.
                    const auto result = decode(file(2, {1, 0, 0, -5, -6, -7}));
                    ASSERT_TRUE(result) << result.error().message;
                    EXPECT_EQ(result->values, kOneToTwelve);
                    EXPECT_EQ(world_point(result->decoded.grid, {0, 0, 0}), glm::dvec3(5, 6, -7));
                    EXPECT_EQ(world_point(result->decoded.grid, {1, 1, 1}), glm::dvec3(3, 9, -11));
                    EXPECT_THAT(result->decoded.warnings,
                                testing::ElementsAre(testing::AllOf(
                                    HasSubstr(fmt::format("its sform (code {})", code)),
                                    HasSubstr("its qform (code 2) is taken"))));
                    const std::string both = refusal(file(2, {nan, 0, 0, 0, 0, 0}));
                    EXPECT_THAT(both, HasSubstr(fmt::format("neither its sform (code {}", code)));
                    EXPECT_THAT(both, HasSubstr("nor its qform (code 2"));
                    EXPECT_THAT(refusal(file(0, {1, 0, 0, 0, 0, 0})),
                                HasSubstr("it has no qform (code 0)"));
                }
}

// Extensions that claim more than lies before the voxels, or than the file holds.
TEST_F(Nifti, ExtensionsOfImpossibleSizeAreLeftOutWithAWarning) {
    for (const int version : {1, 2})
        for (const bool big_endian : {false, true})
            for (const bool packed : {false, true})
                for (const int32_t size : {16, 24, 32, 48, 1 << 20, 0x7fffffff, -16, 7, 0}) {
                    const size_t header = version == 2 ? 540 : 348;
                    const auto number = [&](int32_t value) {
                        return bytes_of(std::vector<int32_t>{value}, big_endian);
                    };
                    std::string bytes = NiftiBytes(version, big_endian)
                                            .vox_offset(static_cast<double>(header + 4 + 32))
                                            .with(number(size) + number(6) + std::string(24, '\0') +
                                                  twelve_shorts(big_endian));
                    bytes[header] = 1; // extensions follow
                    const auto path = folder_.write(packed ? "v.nii.gz" : "v.nii",
                                                    packed ? deflated(bytes) : bytes);
                    const auto result = decode_here(path);
                    ASSERT_TRUE(result) << result.error().message;
                    EXPECT_EQ(result->values, kOneToTwelve);
                    const bool fits = size == 0 || (size >= 8 && size <= 32);
                    ASSERT_EQ(result->decoded.warnings.size(), fits ? 0u : 1u) << size;
                    if (!fits) {
                        EXPECT_THAT(result->decoded.warnings[0],
                                    HasSubstr(fmt::format("it claims {} bytes", size)));
                    }
                }
    // Voxels that should begin behind the end of the file.
    EXPECT_THAT(refusal(NiftiBytes().vox_offset(4096).with(twelve_shorts())),
                HasSubstr("should begin at byte 4096, but the file holds 376 bytes"));
}

TEST_F(Nifti, OffsetOfVoxelsIsChecked) {
    const auto sentence = [&](double offset, int version = 1) {
        return refusal(NiftiBytes(version).vox_offset(offset).with(twelve_shorts()));
    };
    EXPECT_TRUE(decode(NiftiBytes().vox_offset(0).with(twelve_shorts())));
    EXPECT_TRUE(decode(NiftiBytes().vox_offset(368).with("extension 16 by." + twelve_shorts())));
    EXPECT_THAT(sentence(348), HasSubstr("352 or more, found 348"));
    EXPECT_THAT(sentence(-4), HasSubstr("found -4"));
    EXPECT_THAT(sentence(352.5), HasSubstr("whole"));
    EXPECT_THAT(sentence(NAN), HasSubstr("whole"));
    EXPECT_THAT(sentence(1e15, 2), HasSubstr("holds 568 bytes"));
}

TEST_F(Nifti, LongerPayloadIsAWarningWithBothNumbers) {
    for (const bool packed : {false, true}) {
        const std::string bytes = NiftiBytes().with(twelve_shorts() + "abc");
        const auto result = packed ? decode(deflated(bytes), "v.nii.gz") : decode(bytes);
        ASSERT_TRUE(result);
        EXPECT_EQ(result->values, kOneToTwelve);
        ASSERT_EQ(result->decoded.warnings.size(), 1u);
        EXPECT_THAT(result->decoded.warnings[0], HasSubstr("27 bytes"));
        EXPECT_THAT(result->decoded.warnings[0], HasSubstr("24"));
    }
}

TEST_F(Nifti, AnalyzePairsHaveSpacingAndAWarning) {
    NiftiBytes header;
    header.put<int32_t>(344, 0).vox_offset(0).scale(5, 5);
    folder_.write("a.img", twelve_shorts());
    const auto result = decode(header.with(""), "a.hdr");
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_EQ(spacing_mm(result->decoded.grid), glm::dvec3(2, 3, 4));
    EXPECT_TRUE(result->decoded.rescale.empty());
    EXPECT_EQ(result->decoded.warnings.size(), 1u);
    EXPECT_THAT(refusal(header.with(twelve_shorts()), "a.nii"), HasSubstr("mark n+1"));
}

TEST_F(Nifti, PackedMembersThatFollowOneAnotherAreOneFile) {
    const std::string bytes = NiftiBytes().with(twelve_shorts());
    const auto result =
        decode(deflated(bytes.substr(0, 360)) + deflated(bytes.substr(360)), "v.nii.gz");
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_EQ(result->values, kOneToTwelve);
}

TEST_F(Nifti, DamageInPackedBytesIsFound) {
    std::string packed = deflated(NiftiBytes().with(twelve_shorts()));
    packed[packed.size() - 8] ^= 1; // the checksum
    EXPECT_THAT(refusal(packed, "v.nii.gz"), HasSubstr("damaged"));
}

} // namespace
} // namespace palpate::io
