#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/sample_files.h"

namespace palpate::io {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

DecodedHere decoded(const std::string& bytes, const std::string& name = "v.mgh",
                    std::optional<uint32_t> frame = {}) {
    const TemporaryFolder folder;
    auto result = decode_here(folder.write(name, bytes), frame);
    if (!result)
        throw std::runtime_error(result.error().message);
    return std::move(*result);
}

std::string refusal(const std::string& bytes) {
    const TemporaryFolder folder;
    const auto result = decode_here(folder.write("v.mgh", bytes));
    return result ? "read" : result.error().message;
}

TEST(Mgh, EveryTypeIsReadToTheBit) {
    const std::pair<int, double> types[] = {{0, 1}, {1, -100000}, {3, 0.5}, {4, 1}, {10, 1}};
    for (const auto& [type, step] : types)
        for (const bool packed : {false, true}) {
            const std::string bytes = mgh({.type = type});
            const DecodedHere found =
                decoded(packed ? deflated(bytes) : bytes, packed ? "v.mgz" : "v.mgh");
            ASSERT_EQ(found.values.size(), 12u);
            for (size_t i = 0; i < 12; ++i)
                EXPECT_EQ(found.values[i], step * static_cast<double>(i + 1)) << type;
            EXPECT_THAT(found.decoded.warnings, IsEmpty()); // the footer is no surplus
        }
}

// c_ras is where index size / 2 lies, so sample (0, 0, 0) is at c - M diag(spacing) size / 2; in
// LPS the first two rows change sign.
TEST(Mgh, LiesWhereTheCentreSays) {
    const glm::dmat4 straight = decoded(mgh()).decoded.grid.world_from_index;
    EXPECT_EQ(straight[0], glm::dvec4(2, 0, 0, 0));
    EXPECT_EQ(straight[1], glm::dvec4(0, 0, -3, 0));
    EXPECT_EQ(straight[2], glm::dvec4(0, -4, 0, 0));
    EXPECT_EQ(straight[3], glm::dvec4(-(10.0 + 3), -(20.0 - 4), 30 + 3, 1));

    // Turned by 30 degrees about z and then by 20 about x; the file holds floats.
    const double a = 0.5235987755982988, b = 0.3490658503988659;
    const double turned[3][3] = {
        {std::cos(a), std::sin(a) * std::cos(b), std::sin(a) * std::sin(b)},
        {-std::sin(a), std::cos(a) * std::cos(b), std::cos(a) * std::sin(b)},
        {0, -std::sin(b), std::cos(b)}};
    MghFields fields{.size = {3, 2, 2}, .spacing = {0.5f, 0.75f, 3.25f}};
    fields.center = {-12.5f, 101.25f, 7.0f};
    for (int i = 0; i < 9; ++i)
        fields.directions[i] = static_cast<float>(turned[i / 3][i % 3]);
    const glm::dmat4 oblique = decoded(mgh(fields)).decoded.grid.world_from_index;
    const double half[3] = {1.5, 1, 1}, sign[3] = {-1, -1, 1};
    for (int row = 0; row < 3; ++row) {
        double first = fields.center[row];
        for (int axis = 0; axis < 3; ++axis) {
            const double step = turned[axis][row] * fields.spacing[axis];
            first -= step * half[axis];
            // Floats hold cosines to 2^-25, times 3.25 mm.
            EXPECT_NEAR(oblique[axis][row], sign[row] * step, 1e-7);
        }
        EXPECT_NEAR(oblique[3][row], sign[row] * first, 3e-7);
    }
}

// FreeSurfer's assumption where the flag is 0: 1 mm, coronal, centred.
TEST(Mgh, WithoutGeometryIsCoronalWithAWarning) {
    const DecodedHere found = decoded(mgh({.has_geometry = false}));
    const glm::dmat4& m = found.decoded.grid.world_from_index;
    EXPECT_EQ(m[0], glm::dvec4(1, 0, 0, 0));
    EXPECT_EQ(m[1], glm::dvec4(0, 0, -1, 0));
    EXPECT_EQ(m[2], glm::dvec4(0, -1, 0, 0));
    EXPECT_EQ(m[3], glm::dvec4(-1.5, 1, 1, 1));
    EXPECT_THAT(found.decoded.warnings, ElementsAre(HasSubstr("neither spacing nor position")));
}

TEST(Mgh, FramesAreChosen) {
    const std::string bytes = mgh({.frames = 3});
    EXPECT_EQ(decoded(bytes, "v.mgh", 2).values.front(), 25.0);
    const DecodedHere first = decoded(deflated(bytes), "v.mgh.gz");
    EXPECT_EQ(first.values.front(), 1.0);
    EXPECT_THAT(first.decoded.warnings, ElementsAre(HasSubstr("3 frames")));
}

TEST(Mgh, RefusesWithExpectedAndFound) {
    EXPECT_THAT(refusal(mgh({.version = 2})), HasSubstr("version 1, found 2"));
    EXPECT_THAT(refusal(mgh({.type = 9})), HasSubstr("found 9"));
    EXPECT_THAT(refusal(mgh({.frames = 0})), HasSubstr("number of frames of 1 or more, found 0"));
    EXPECT_THAT(refusal(mgh({.size = {3, -2, 2}})), HasSubstr("size along y of 1 or more"));
    EXPECT_THAT(refusal(mgh({.spacing = {1, 0, 1}})), HasSubstr("above 0 mm along axis y"));
    EXPECT_THAT(refusal(mgh().substr(0, 283)), HasSubstr("284 bytes, found 283"));
    EXPECT_THAT(refusal(mgh().substr(0, 284 + 23)), HasSubstr("holds 23 bytes of voxels"));
}

} // namespace
} // namespace palpate::io
