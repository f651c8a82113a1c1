// DICOM files made after what users of other programs reported: the values that its README states.

#include <gmock/gmock.h>

#include "tests/unit/io_shared/shared_data.h"

namespace palpate {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ReportedDicom : public SharedData {};

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

} // namespace
} // namespace palpate
