#include "engine/scene/value_survey.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "engine/volume/builder.h"

namespace palpate {
namespace {

Volume made(glm::uvec3 size, ScalarType type, const std::function<double(glm::uvec3)>& value) {
    return make_volume(make_grid(size, {1, 1, 1}), type, value);
}

// Any number in 0 .. 1 that follows from the place alone.
double noise(glm::uvec3 at) {
    const uint32_t h = (at.x * 73856093u ^ at.y * 19349663u ^ at.z * 83492791u) * 2654435761u;
    return (h >> 8) * 0x1p-24;
}

TEST(ValueSurvey, FindsTheBackgroundAndWhatLiesAbove) {
    // 0 in three quarters of the volume, 100 .. 200 in the rest, and a bit below 0.
    const Volume volume = made(glm::uvec3(40), ScalarType::f32, [](glm::uvec3 at) {
        return at.z < 30 ? (at.x == 0 && at.z < 8 ? -5.0 : 0.0) : 100.0 + 100.0 * noise(at);
    });
    const ValueSurvey survey = survey_values(volume);
    EXPECT_EQ(survey.low, 0.0) << "and not the 1 % of -5";
    EXPECT_NEAR(survey.high, 200.0, 1.5);
    EXPECT_GT(survey.projected_high, 190.0);
    EXPECT_FALSE(looks_like_labels(volume, survey));
}

TEST(ValueSurvey, AHotSpotIsNotTakenForTheBackground) {
    // As a PET: 1 % of the volume at 10 .. 20, nothing elsewhere.
    const Volume volume = made(glm::uvec3(50), ScalarType::f32, [](glm::uvec3 at) {
        const bool hot = at.x < 11 && at.y < 11 && at.z < 11;
        return hot ? 10.0 + 10.0 * noise(at) : 0.0;
    });
    const ValueSurvey survey = survey_values(volume);
    EXPECT_EQ(survey.low, 0.0);
    EXPECT_GT(survey.high, 18.0);
    EXPECT_GT(survey.projected_high, 10.0);
}

TEST(ValueSurvey, MetalDoesNotDarkenAProjection) {
    const Volume volume = made(glm::uvec3(64), ScalarType::i16, [](glm::uvec3 at) {
        if (at == glm::uvec3(32))
            return 30000.0;
        return 10.0 < at.x && at.x < 50 ? 500.0 + 100.0 * noise(at) : -1000.0;
    });
    const ValueSurvey survey = survey_values(volume);
    EXPECT_EQ(survey.low, -1000.0);
    EXPECT_LT(survey.projected_high, 601.0);
    EXPECT_GT(survey.projected_high, 590.0);
}

// The commonest value is the largest: a background where the box's edges have it, else an object.
TEST(ValueSurvey, TellsABrightBackgroundFromABrightObject) {
    const auto inside = [](glm::uvec3 at) { return glm::length(glm::dvec3(at) - 12.0) < 8.0; };
    for (const double sd : {0.0, 30.0}) {
        const ValueSurvey background =
            survey_values(made(glm::uvec3(25), ScalarType::f32, [&](glm::uvec3 at) {
                return (inside(at) ? 600.0 : 3000.0) + sd * (noise(at) - 0.5);
            }));
        ASSERT_TRUE(background.bright_background.has_value());
        EXPECT_NEAR(*background.bright_background, 3000.0, 0.1 * sd);
        EXPECT_NEAR(background.low, 600.0, sd);
        EXPECT_NEAR(background.projected_low, 600.0, sd);
        EXPECT_NEAR(background.high, 3000.0, sd);
        const ValueSurvey object =
            survey_values(made(glm::uvec3(17), ScalarType::f32, [&](glm::uvec3 at) {
                return (glm::length(glm::dvec3(at) - 8.0) < 8.5 ? 3000.0 : 600.0) + sd * noise(at);
            }));
        EXPECT_FALSE(object.bright_background.has_value());
        EXPECT_NEAR(object.low, 600.0, sd + 1.0);
        EXPECT_NEAR(object.high, 3000.0, sd + 1.0);
    }
}

// Signed data about a common 0 keep what is negative.
TEST(ValueSurvey, AValueAmidOthersIsNoBackground) {
    const ValueSurvey survey =
        survey_values(made(glm::uvec3(30), ScalarType::f32, [](glm::uvec3 at) {
            return at.z < 12 ? 0.0 : 100.0 * (noise(at) - 0.5);
        }));
    EXPECT_LT(survey.low, -40.0);
    EXPECT_GT(survey.high, 40.0);
}

TEST(ValueSurvey, SingleSamplesFarOutAreLeftOut) {
    for (const double outlier : {1e6, 1e30}) {
        const ValueSurvey survey =
            survey_values(made(glm::uvec3(40), ScalarType::f32, [=](glm::uvec3 at) {
                if (at.x % 8 == 3 && at.y % 8 == 2 && at.z % 8 == 5)
                    return outlier;
                return glm::length(glm::dvec3(at) - 20.0) < 10.0 ? 100.0 + noise(at) : 0.0;
            }));
        EXPECT_LT(survey.high, 102.0);
        EXPECT_LT(survey.projected_high, 102.0);
    }
}

TEST(ValueSurvey, KnowsLabelsByTheirNeighbours) {
    const auto labels = [](glm::uvec3 at) {
        return at.x < 5 || at.y < 5 ? 0.0 : 1.0 + at.x / 10 + 4 * (at.z / 10);
    };
    const auto grey = [&](glm::uvec3 at) { return std::floor(200.0 * noise(at)); };
    const auto survives = [](const Volume& volume) {
        return looks_like_labels(volume, survey_values(volume));
    };
    EXPECT_TRUE(survives(made({40, 30, 20}, ScalarType::u8, labels)));
    EXPECT_TRUE(survives(made({40, 30, 20}, ScalarType::u16, labels)));
    EXPECT_FALSE(survives(made({40, 30, 20}, ScalarType::i16, labels))) << "labels are unsigned";
    EXPECT_FALSE(survives(made({40, 30, 20}, ScalarType::u8, grey)));
    EXPECT_FALSE(survives(made({40, 30, 20}, ScalarType::u8, [](glm::uvec3) { return 7.0; })))
        << "no background";
    EXPECT_FALSE(survives(made({3, 3, 1}, ScalarType::u8, labels))) << "too few to tell";
}

TEST(ValueSurvey, IsOrderlyForOneValueNoDataAndOneSample) {
    for (const double value : {0.0, -7.0, std::nan("")})
        for (const glm::uvec3 size : {glm::uvec3(1), glm::uvec3(300, 1, 1), glm::uvec3(33)}) {
            const ValueSurvey survey =
                survey_values(made(size, ScalarType::f32, [=](glm::uvec3) { return value; }));
            EXPECT_LT(survey.low, survey.high);
            EXPECT_LT(survey.low, survey.projected_high);
            EXPECT_TRUE(std::isfinite(survey.low) && std::isfinite(survey.high) &&
                        std::isfinite(survey.projected_high));
        }
}

} // namespace
} // namespace palpate
