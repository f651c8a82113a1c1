#include "engine/decode/dicom_resample.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate::io {
namespace {

// Images of 7 x 5 samples on turned axes, at the given places along the normal; each is moved
// sideways by `shift_mm` (along the columns) for each millimetre along the normal.
std::vector<DicomFrame> images(const std::vector<double>& along_mm, double shift_mm) {
    const glm::dvec3 row = glm::normalize(glm::dvec3(1, 0.3, -0.2));
    const glm::dvec3 column = glm::normalize(glm::cross(glm::dvec3(0.1, -0.2, 1), row));
    const glm::dvec3 normal = glm::cross(row, column);
    std::vector<DicomFrame> frames;
    for (size_t i = 0; i < along_mm.size(); ++i) {
        DicomFrame& frame = frames.emplace_back();
        frame.file = std::to_string(i);
        frame.size = {7, 5};
        frame.axes = glm::dmat2x3(row, column);
        frame.spacing_mm = glm::dvec2(0.6, 0.9);
        frame.position = glm::dvec3(12, -34, 56) + along_mm[i] * (normal + shift_mm * column);
    }
    return frames;
}

double ramp(glm::dvec3 world_mm) {
    return 3.5 * world_mm.x - 1.25 * world_mm.y + 7.75 * world_mm.z + 11;
}

// Resamples the ramp and returns how many samples of the grid hold data; each must be the ramp's.
size_t samples_of_ramp(const std::vector<DicomFrame>& frames) {
    const auto stack = make_stack({.path = "f", .resample_slices = true}, {"", "", "", frames});
    EXPECT_TRUE(stack) << stack.error().message;
    EXPECT_TRUE(stack->resampled);
    std::vector<float> out(sample_count(stack->grid));
    size_t asked = 0;
    const auto values_of = [&](const DicomFrame& frame) -> Result<std::vector<double>> {
        ++asked;
        std::vector<double> values;
        for (uint32_t y = 0; y < frame.size.y; ++y)
            for (uint32_t x = 0; x < frame.size.x; ++x)
                values.push_back(ramp(*frame.position +
                                      (*frame.axes)[0] * frame.spacing_mm->x * double(x) +
                                      (*frame.axes)[1] * frame.spacing_mm->y * double(y)));
        return values;
    };
    EXPECT_TRUE(resample_stack(*stack, values_of, out));
    EXPECT_EQ(asked, frames.size());
    // Values stay below 2^11, so that float rounds by 2^-14; doubles by far less.
    size_t with_data = 0, at = 0;
    for (uint32_t z = 0; z < stack->grid.size.z; ++z)
        for (uint32_t y = 0; y < stack->grid.size.y; ++y)
            for (uint32_t x = 0; x < stack->grid.size.x; ++x, ++at)
                if (!std::isnan(out[at])) {
                    ++with_data;
                    EXPECT_NEAR(out[at], ramp(world_point(stack->grid, {x, y, z})), 0x1p-13);
                }
    return with_data;
}

TEST(DicomResample, ALinearFieldInUnevenSlicesIsExact) {
    // All of 7 x 5 samples and of the slices: 31.72 mm in steps of at most 4.22 mm are 8.
    EXPECT_EQ(samples_of_ramp(images({0, 4.22, 8.44, 9.58, 16.96, 24.34, 31.72}, 0)), 7u * 5 * 9);
}

TEST(DicomResample, ALinearFieldInTiltedSlicesIsExact) {
    // 2.5 mm a slice shift it by 0.7 mm, 0.78 rows: a slice of the grid lies on one of the images,
    // which holds 4 of the grid's rows between its 5, or 5 where it lies on them.
    const std::vector<double> even{0, 2.5, 5, 7.5, 10, 12.5};
    EXPECT_EQ(samples_of_ramp(images(even, 0.28)), 7u * (5 + 4 * 5));
    // A shift of whole rows: every sample is met.
    EXPECT_EQ(samples_of_ramp(images(even, 0.36)), 7u * 5 * 6);
}

TEST(DicomResample, ALinearFieldInUnevenTiltedSlicesIsExact) {
    EXPECT_GT(samples_of_ramp(images({0, 2.5, 5, 8.1, 12, 13.7}, 0.28)), 7u * 2 * 6);
}

} // namespace
} // namespace palpate::io
