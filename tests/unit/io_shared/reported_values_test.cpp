// DICOM series with noise, values without data and spacings in other places, made after what users
// of other programs reported: the values that its README states.

#include <gmock/gmock.h>

#include <cmath>

#include "tests/unit/io_shared/shared_data.h"

namespace palpate {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class ReportedValues : public SharedData {};

TEST_F(ReportedValues, NoiseOfDirectionsMakesOneVolume) {
    for (const char* name : {"orientation_noise_2e-4", "orientation_noise_single"}) {
        SCOPED_TRACE(name);
        const LoadedVolume ct = loaded(fmt::format("reported/{}", name));
        EXPECT_EQ(ct.volume.size().z, 24u);
        EXPECT_NEAR(spacing_mm(ct.volume.grid()).z, 2.0, 1e-6);
        EXPECT_THAT(ct.warnings, ElementsAre(HasSubstr("direction cosines differ by up to")));
    }
}

TEST_F(ReportedValues, PaddingIsNoData) {
    const LoadedVolume ct = loaded("reported/pixel_padding");
    EXPECT_EQ(ct.volume.range().min, -1000.0f);
    EXPECT_EQ(ct.volume.range().max, 800.0f);
    EXPECT_GT(ct.volume.no_data_count(), 0u);
    EXPECT_TRUE(std::isnan(ct.volume.value({0, 0, 0})));
    EXPECT_THAT(ct.notes, Contains(HasSubstr("padding")));
}

TEST_F(ReportedValues, SmallValuesOfMonochrome1AreBright) {
    const LoadedVolume one = loaded("reported/default_window/MONOCHROME1.dcm");
    const LoadedVolume two = loaded("reported/default_window/MONOCHROME2.dcm");
    EXPECT_TRUE(one.inverted);
    EXPECT_FALSE(two.inverted);
    ASSERT_EQ(one.volume.size(), two.volume.size());
    EXPECT_EQ(one.volume.range(), two.volume.range());
    const glm::uvec3 middle = one.volume.size() / 2u;
    EXPECT_EQ(one.volume.value(middle), two.volume.value(middle));
}

TEST_F(ReportedValues, FloatPixelsAreRead) {
    const LoadedVolume image = loaded("reported/float_pixels");
    EXPECT_EQ(image.volume.size().z, 24u);
    EXPECT_LT(image.volume.range().min, image.volume.range().max);
}

TEST_F(ReportedValues, SpacingsAreFoundInOtherPlaces) {
    const LoadedVolume us = loaded("reported/other/ultrasound_region.dcm");
    EXPECT_NE(spacing_mm(us.volume.grid()).x, 1.0);
    EXPECT_THAT(us.warnings, Not(Contains(HasSubstr("pixel spacing (1 mm)"))));
    const LoadedVolume image = loaded("reported/other/imager_pixel_spacing.dcm");
    EXPECT_THAT(image.warnings, Contains(HasSubstr("at the detector")));
}

} // namespace
} // namespace palpate
