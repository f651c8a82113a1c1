// Otsu's thresholds, against every choice of thresholds tried in turn.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/segment/methods.h"
#include "engine/volume/builder.h"

namespace palpate {
namespace {

Volume line_of(const std::vector<float>& values, ScalarType type) {
    return make_volume(Grid{{uint32_t(values.size()), 1, 1}}, type,
                       [&](glm::uvec3 at) { return double{values[at.x]}; });
}

std::vector<float> labels_of(const Volume& volume, double classes) {
    const auto made =
        segment(*find_segment_method("otsu"), {volume, {}, {}}, {{"classes", classes}}, {});
    EXPECT_TRUE(made) << made.error().message;
    std::vector<float> labels;
    for (uint32_t x = 0; made && x < volume.size().x; ++x)
        labels.push_back(made->labels.value({x, 0, 0}));
    return labels;
}

// The sum of squares of values about the mean of their label: least where the variance between
// classes is largest, as both add up to the variance of all.
double within_classes(const std::vector<float>& values, const std::vector<float>& labels) {
    double all = 0.0;
    for (float label = 0; label < 6; ++label) {
        double count = 0.0, sum = 0.0, squares = 0.0;
        for (size_t i = 0; i < values.size(); ++i)
            if (labels[i] == label)
                ++count, sum += values[i], squares += double{values[i]} * values[i];
        if (count > 0.0)
            all += squares - sum * sum / count;
    }
    return all;
}

TEST(Otsu, ClassesVaryAsLittleAsAnyThresholdsCanMakeThem) {
    std::mt19937 random(1);
    std::vector<float> values;
    for (int i = 0; i < 40; ++i)
        values.push_back(float(random() % 30));
    const Volume volume = line_of(values, ScalarType::i16);
    for (const int classes : {2, 3}) {
        double least = INFINITY;
        for (float a = 1; a < 30; ++a)
            for (float b = classes == 3 ? a + 1 : 30; b <= 30; ++b) {
                std::vector<float> labels;
                for (const float v : values)
                    labels.push_back(float(v >= a) + float(v >= b));
                least = std::min(least, within_classes(values, labels));
            }
        EXPECT_NEAR(within_classes(values, labels_of(volume, classes)), least, 1e-9 * least)
            << classes;
    }
}

TEST(Otsu, GroupsOfValuesAreTheClassesInRisingOrder) {
    const std::vector<float> values{-1000, 40, 1003, -990, 60, 997, 50, -1010};
    const std::vector<float> expected{0, 1, 2, 0, 1, 2, 1, 0};
    EXPECT_EQ(labels_of(line_of(values, ScalarType::i16), 3), expected);
    EXPECT_EQ(labels_of(line_of(values, ScalarType::f32), 3), expected);
}

TEST(Otsu, SamplesWithoutDataHaveNoLabel) {
    EXPECT_EQ(labels_of(line_of({0, NAN, 5, NAN, 0, 6}, ScalarType::f32), 2),
              (std::vector<float>{0, 0, 1, 0, 0, 1}));
}

TEST(Otsu, FewerValuesThanClassesAreAClassEach) {
    EXPECT_EQ(labels_of(line_of({3, 4, 3}, ScalarType::i16), 3), (std::vector<float>{0, 1, 0}));
    EXPECT_EQ(labels_of(line_of({3, 3, 3}, ScalarType::i16), 2), (std::vector<float>{0, 0, 0}));
}

TEST(Otsu, HalfAClassIsRefused) {
    const auto made =
        segment(*find_segment_method("otsu"), {line_of({3, 4, 5}, ScalarType::i16), {}, {}},
                {{"classes", 2.5}}, {});
    ASSERT_FALSE(made);
    EXPECT_THAT(made.error().message, testing::HasSubstr("expected a whole number"));
}

} // namespace
} // namespace palpate
