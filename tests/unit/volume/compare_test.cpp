#include "engine/volume/compare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/volume/builder.h"
#include "engine/volume/edit.h"

namespace palpate {
namespace {

const Grid kCompared = make_grid({40, 33, 3}, {0.5, 0.5, 3.0}, {-10.0, 20.0, 5.0});

Volume ramp() {
    return make_volume(kCompared, ScalarType::f32, [](glm::uvec3 i) { return i.x + 100.0 * i.z; });
}

TEST(CompareVolumes, FindsNothingBetweenAVolumeAndItsCopy) {
    const auto found = compare_volumes(ramp(), ramp(), 0.0);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->geometry_mm, 0.0);
    EXPECT_TRUE(found->same_type);
    EXPECT_EQ(found->max_abs, 0.0);
    EXPECT_EQ(found->differing, 0u);
}

TEST(CompareVolumes, MeasuresWhatAHandMeasures) {
    VolumeEdit edit(ramp());
    edit.set({0, 0, 0}, 3.0);     // + 3
    edit.set({39, 32, 2}, 234.0); // - 5
    edit.set({5, 6, 1}, std::numeric_limits<double>::quiet_NaN());
    const auto found = compare_volumes(ramp(), edit.commit(), 3.0);
    ASSERT_TRUE(found);
    const double measured = 40.0 * 33.0 * 3.0 - 1.0;
    EXPECT_EQ(found->max_abs, 5.0);
    EXPECT_DOUBLE_EQ(found->rmse, std::sqrt((9.0 + 25.0) / measured));
    EXPECT_DOUBLE_EQ(found->mean_signed, -2.0 / measured);
    EXPECT_EQ(found->nan_mismatch, 1u);
    EXPECT_EQ(found->differing, 2u); // the difference of 3 is within the bound
}

// Spacing z from 3 to 3.5 mm moves the far corners by 2 * 0.5 mm, shifting x by 2 mm moves all.
TEST(CompareVolumes, MeasuresHowFarGridsLieApart) {
    const Grid other = make_grid(kCompared.size, {0.5, 0.5, 3.5}, {-8.0, 20.0, 5.0});
    const auto found = compare_volumes(ramp(), with_grid(ramp(), other), 0.0);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->geometry_mm, std::sqrt(4.0 + 1.0), 1e-12);
    EXPECT_EQ(found->differing, 0u);
}

TEST(CompareVolumes, RefusesOtherSizes) {
    const Volume small = make_volume(make_grid({40, 33, 2}, {1, 1, 1}), ScalarType::u8,
                                     [](glm::uvec3) { return 0.0; });
    const auto found = compare_volumes(ramp(), small, 0.0);
    ASSERT_FALSE(found);
    EXPECT_NE(found.error().message.find("40 x 33 x 2"), std::string::npos);
    EXPECT_FALSE(compare_labels(ramp(), small));
}

// Label 2 fills x < 10 in A and x < 15 in B, label 300 is in A alone.
TEST(CompareLabels, CountsVoxelsOfEachLabel) {
    const Volume a = make_volume(kCompared, ScalarType::u16, [](glm::uvec3 i) {
        return i.x < 10 ? 2.0 : i.x == 39 ? 300.0 : 0.0;
    });
    const Volume b =
        make_volume(kCompared, ScalarType::u8, [](glm::uvec3 i) { return i.x < 15 ? 2.0 : 0.0; });
    const auto found = compare_labels(a, b);
    ASSERT_TRUE(found);
    ASSERT_EQ(found->size(), 2u);
    const LabelAgreement& two = (*found)[0];
    EXPECT_EQ(two.label, 2u);
    EXPECT_EQ(two.first, 990u);
    EXPECT_EQ(two.second, 1485u);
    EXPECT_EQ(two.both, 990u);
    EXPECT_DOUBLE_EQ(two.dice(), 2.0 * 990.0 / (990.0 + 1485.0));
    EXPECT_DOUBLE_EQ(two.jaccard(), 990.0 / 1485.0);
    EXPECT_EQ((*found)[1].label, 300u);
    EXPECT_EQ((*found)[1].dice(), 0.0);
}

} // namespace
} // namespace palpate
