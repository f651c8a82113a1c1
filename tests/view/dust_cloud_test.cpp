#include "apps/view/document/dust_cloud.h"

#include <gtest/gtest.h>

namespace palpate::view {
namespace {

constexpr double kGrain_mm3 = haptics::Dust::kGrain_mm3;

TEST(DustCloud, HasAGrainForEachShareOfWhatIsRemoved) {
    DustCloud cloud;
    cloud.frame(0.0, glm::dvec3(0.0), 0.0);
    EXPECT_EQ(cloud.made(), 0u);
    EXPECT_TRUE(cloud.grains().empty());
    double removed_mm3 = 0.0;
    for (int i = 1; i <= 10; ++i) {
        removed_mm3 += 0.72 * kGrain_mm3;
        cloud.frame(removed_mm3, glm::dvec3(0.0), 0.016 * i);
    }
    EXPECT_EQ(cloud.made(), 7u); // 10 times 0.72; remainders are kept
    EXPECT_EQ(cloud.grains().size(), 7u);
}

TEST(DustCloud, FliesFromTheToolNoFurtherThanItsReachAndIsGone) {
    const glm::dvec3 tool(10.0, -20.0, 30.0);
    DustCloud cloud;
    cloud.frame(500.0 * kGrain_mm3, tool, 1.0);
    ASSERT_EQ(cloud.grains().size(), 500u);
    for (const DustCloud::Grain& grain : cloud.grains()) {
        EXPECT_EQ(grain.place_mm, tool);
        EXPECT_EQ(grain.age, 0.0);
    }
    double before = 0.0;
    for (const double share : {0.25, 0.5, 0.99}) {
        cloud.frame(500.0 * kGrain_mm3, tool + 50.0, 1.0 + share * DustCloud::kLife_s);
        glm::dvec3 sum(0.0);
        double far = 0.0;
        for (const DustCloud::Grain& grain : cloud.grains()) {
            EXPECT_NEAR(grain.age, share, 1e-12);
            const double away = glm::distance(grain.place_mm, tool);
            EXPECT_LE(away, DustCloud::kReach_mm);
            far += away / 500.0;
            sum += (grain.place_mm - tool) / 500.0;
        }
        EXPECT_GT(far, before) << "it flies on, and does not follow the tool";
        // No direction is preferred: 500 independent directions would have a mean of about
        // 1 / sqrt(500) of their length.
        EXPECT_LT(glm::length(sum), 0.1 * far);
        before = far;
    }
    cloud.frame(500.0 * kGrain_mm3, tool, 1.0 + DustCloud::kLife_s);
    EXPECT_TRUE(cloud.grains().empty());
    EXPECT_EQ(cloud.made(), 500u);
}

TEST(DustCloud, KeepsTheNewestOfTooMany) {
    DustCloud cloud;
    cloud.frame(1e6 * kGrain_mm3, glm::dvec3(1.0), 0.0);
    EXPECT_EQ(cloud.made(), 1000000u);
    EXPECT_EQ(cloud.grains().size(), DustCloud::kMostGrains);
    cloud.frame((1e6 + 5.0) * kGrain_mm3, glm::dvec3(2.0), 0.1);
    EXPECT_EQ(cloud.grains().size(), DustCloud::kMostGrains);
    EXPECT_EQ(cloud.grains().back().age, 0.0);
}

} // namespace
} // namespace palpate::view
