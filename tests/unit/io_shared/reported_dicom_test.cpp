// DICOM files made after what users of other programs reported: the values that its README states.

#include <gmock/gmock.h>

#include "tests/unit/io_shared/shared_data.h"

namespace palpate {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class ReportedDicom : public SharedData {
 protected:
    static void expect_column(const LoadedVolume& loaded, int column, glm::dvec3 expected) {
        const glm::dvec3 found(loaded.volume.grid().world_from_index[column]);
        // Decimal strings of five digits at places up to 100 mm.
        EXPECT_LT(glm::distance(found, expected), 1e-9) << column;
    }
};

uint64_t differences(const Volume& a, const Volume& b, float offset) {
    uint64_t differ = 0;
    for (uint32_t z = 0; z < a.size().z; ++z)
        for (uint32_t y = 0; y < a.size().y; ++y)
            for (uint32_t x = 0; x < a.size().x; ++x)
                differ += a.value({x, y, z}) + offset != b.value({x, y, z});
    return differ;
}

TEST_F(ReportedDicom, ImplicitVrReadsAsExplicitVrDoes) {
    for (const auto& [implicit, known] :
         {std::pair{"enhanced_implicit", "dicom_enhanced_mr/IM-0001-0170-0001.dcm"},
          std::pair{"seg_implicit", "dicom_small/seg_liver_3frames.dcm"}}) {
        SCOPED_TRACE(implicit);
        const LoadedVolume a = loaded(known);
        const LoadedVolume b = loaded(fmt::format("reported/dicom_implicit/{}.dcm", implicit));
        ASSERT_EQ(a.volume.grid(), b.volume.grid());
        EXPECT_EQ(differences(a.volume, b.volume, 0), 0u);
    }
}

TEST_F(ReportedDicom, EchoesAreFramesInTheOrderOfEchoTime) {
    const LoadedVolume first = loaded("reported/frames_echo_restart");
    EXPECT_THAT(first.warnings, ElementsAre(HasSubstr("has 3 frames")));
    for (uint32_t t = 0; t < 3; ++t) {
        const LoadedVolume echo = loaded("reported/frames_echo_restart", {.frame = t});
        EXPECT_THAT(echo.notes, Contains(HasSubstr("ordered by EchoTime (5, 15, 25 ms)")));
        ASSERT_EQ(echo.volume.size().z, 24u);
        EXPECT_EQ(differences(first.volume, echo.volume, 7.0f * static_cast<float>(t)), 0u);
    }
}

TEST_F(ReportedDicom, NuclearSlicesFollowTheSignOfTheirSpacing) {
    const LoadedVolume nm = loaded("reported/multiframe/nm_negative_spacing.dcm");
    EXPECT_EQ(nm.volume.size(), glm::uvec3(32, 28, 24));
    expect_column(nm, 0, {4.4, 0, 0});
    expect_column(nm, 1, {0, 4.4, 0});
    expect_column(nm, 2, {0, 0, -4.41806});
    expect_column(nm, 3, {-70, -60, 100});
    EXPECT_THAT(nm.warnings, IsEmpty());
}

TEST_F(ReportedDicom, OnePositionOfAFileIsThatOfItsFirstSlice) {
    const LoadedVolume ct = loaded("reported/multiframe/ct_top_level_position.dcm");
    EXPECT_EQ(ct.volume.size(), glm::uvec3(32, 28, 24));
    expect_column(ct, 0, {0.5, 0, 0});
    expect_column(ct, 2, {0, 0, 1.5});
    expect_column(ct, 3, {1, 2, 3});
    EXPECT_THAT(ct.warnings, IsEmpty());
}

TEST_F(ReportedDicom, UltrasoundVolumesLieInTheAxesOfTheTransducer) {
    const LoadedVolume us = loaded("reported/multiframe/enhanced_us.dcm");
    EXPECT_EQ(us.volume.size(), glm::uvec3(32, 28, 24));
    expect_column(us, 0, {0.4, 0, 0});
    expect_column(us, 2, {0, 0, 0.6});
    expect_column(us, 3, {-5, -6, 10});
    EXPECT_THAT(us.warnings, ElementsAre(HasSubstr("transducer")));
}

} // namespace
} // namespace palpate
