// Labels that floats hold, or were computed with floats, are the whole numbers nearest to them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/io/narrow.h"
#include "tests/unit/io_formats/generated_files.h"

namespace palpate::io {
namespace {

using testing::HasSubstr;

template <class T>
Result<LoadedVolume> labels_of(const std::vector<T>& values, ComponentType type,
                               const std::vector<Rescale>& rescale = {}) {
    VoxelClaim claim;
    claim.size = {values.size(), 1, 1};
    claim.type = type;
    Decoded decoded;
    decoded.grid = make_grid(claim.size, {1, 1, 1});
    decoded.rescale = rescale;
    return narrow("f", decoded, claim, std::as_bytes(std::span(values)), VolumeKind::labels,
                  1 << 30);
}

// Stored values, slope and intercept that give labels 0 .. `last`, all rounded to float.
template <class T>
void expect_labels(std::mt19937& random, ComponentType type, int last, float step, float shift) {
    std::vector<T> stored;
    std::vector<int> expected;
    const float slope = 1.0f / step, intercept = -shift / step;
    for (int i = 0; i < 20; ++i) {
        expected.push_back(i == 0 ? last : below(random, last + 1));
        stored.push_back(static_cast<T>(step * static_cast<float>(expected.back()) + shift));
    }
    const auto loaded = labels_of(stored, type, {{slope, intercept}});
    ASSERT_TRUE(loaded) << loaded.error().message << " of step " << step << " and shift " << shift;
    for (uint32_t i = 0; i < expected.size(); ++i)
        EXPECT_EQ(loaded->volume.value({i, 0, 0}), float(expected[i])) << step << " " << shift;
    EXPECT_EQ(loaded->volume.type(), last > 255 ? ScalarType::u16 : ScalarType::u8);
}

TEST(LabelRounding, SlopesThatFloatsRoundGiveWholeLabels) {
    std::mt19937 random(5);
    for (const float step : {255.0f, 3.0f, 7.0f, 49.0f, 85.0f})
        for (const float shift : {0.0f, 1.0f, 5.0f}) {
            expect_labels<uint16_t>(random, ComponentType::u16, 100, step, shift);
            expect_labels<int32_t>(random, ComponentType::i32, 65535, step, shift);
            expect_labels<float>(random, ComponentType::f32, 300, step, shift);
            expect_labels<double>(random, ComponentType::f64, 40000, step, shift);
            expect_labels<int16_t>(random, ComponentType::i16, 60, -step, shift);
        }
    expect_labels<uint8_t>(random, ComponentType::u8, 1, 255.0f, 0.0f);
    for (const float step : {0.1f, 0.7f, 1e-3f, 1e6f})
        expect_labels<float>(random, ComponentType::f32, 1000, step, 0.0f);
}

TEST(LabelRounding, FloatsBesideWholeNumbersAreThose) {
    std::vector<float> values;
    std::vector<int> expected;
    for (const int label : {0, 1, 2, 7, 255, 256, 1000, 65535})
        for (const float toward : {-1e9f, 1e9f}) { // one float below and one above
            const auto whole = static_cast<float>(label);
            values.push_back(label == 0 ? toward * 0x1p-54f : std::nextafter(whole, toward));
            expected.push_back(label);
        }
    const auto loaded = labels_of(values, ComponentType::f32);
    ASSERT_TRUE(loaded) << loaded.error().message;
    for (uint32_t i = 0; i < expected.size(); ++i)
        EXPECT_EQ(loaded->volume.value({i, 0, 0}), float(expected[i]));
    EXPECT_EQ(loaded->volume.type(), ScalarType::u16);
}

// The bound is 2^-22 of a value of 1 or more, and 2^-22 below: four roundings.
TEST(LabelRounding, FractionsBeyondRoundingAreRefused) {
    for (const double off : {1e-6, 1e-5, 0.001, 0.5})
        for (const double label : {0.0, 1.0, 2.0})
            for (const double sign : {-1.0, 1.0}) {
                const auto loaded =
                    labels_of(std::vector<double>{5, label + sign * off}, ComponentType::f64);
                ASSERT_FALSE(loaded) << label << " " << sign * off;
                EXPECT_THAT(loaded.error().message, HasSubstr("fractions"));
            }
    EXPECT_THAT(labels_of(std::vector<uint8_t>{0, 100, 200}, ComponentType::u8, {{1.0 / 255, 0}})
                    .error()
                    .message,
                HasSubstr("fractions"));
    EXPECT_THAT(labels_of(std::vector<double>{65535.6}, ComponentType::f64).error().message,
                HasSubstr("fractions"));
    EXPECT_THAT(labels_of(std::vector<double>{-1 + 1e-9}, ComponentType::f64).error().message,
                HasSubstr("0 .. 65535"));
}

} // namespace
} // namespace palpate::io
