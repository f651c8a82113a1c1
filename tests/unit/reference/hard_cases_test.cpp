// The fp64 twin passes the hard cases of ray casting; the GPU runs the same list.

#include "tests/support/hard_cases.h"

#include <gtest/gtest.h>

#include "engine/reference/twin.h"

namespace palpate {
namespace {

void run(const std::vector<hard_cases::Case>& cases) {
    ASSERT_FALSE(cases.empty());
    for (const auto& c : cases) {
        SCOPED_TRACE(c.name);
        c.check(render_twin(c.scene, c.data));
    }
}

void run(const std::vector<hard_cases::Same>& cases) {
    ASSERT_FALSE(cases.empty());
    for (const auto& c : cases) {
        const Image first = render_twin(c.variants[0].first, c.variants[0].second);
        for (size_t v = 1; v < c.variants.size(); ++v) {
            const Image other = render_twin(c.variants[v].first, c.variants[v].second);
            double difference = 0.0;
            for (size_t i = 0; i < first.samples.size(); ++i)
                difference =
                    std::max(difference, std::abs(double{first.samples[i]} - other.samples[i]));
            EXPECT_LE(difference, c.max_difference) << c.name << ", variant " << v;
        }
    }
}

TEST(HardCases, R1ZeroComponentsAndFaces) {
    run(hard_cases::zero_components_and_faces());
}
TEST(HardCases, R2CameraInside) {
    run(hard_cases::camera_inside());
}
TEST(HardCases, R3GrazingAnEdge) {
    run(hard_cases::grazing_an_edge());
}
TEST(HardCases, R6SameSlabOtherSpacing) {
    run(hard_cases::same_slab_other_spacing());
}
TEST(HardCases, R7TinyAndHugeDepth) {
    run(hard_cases::tiny_and_huge_depth());
}
TEST(HardCases, R8TenThousandFaint) {
    run(hard_cases::ten_thousand_faint());
}
TEST(HardCases, R9EarlyTermination) {
    run(hard_cases::early_termination());
}
TEST(HardCases, R10PartialSteps) {
    run(hard_cases::partial_steps());
}
TEST(HardCases, R13EveryCodeOfARamp) {
    run(hard_cases::every_code_of_a_ramp());
}
TEST(HardCases, R16OneSampleWithoutData) {
    run(hard_cases::one_sample_without_data());
}
TEST(HardCases, R17FarAwayOrTiny) {
    run(hard_cases::far_away_or_tiny());
}
TEST(HardCases, R20RampOverBricks) {
    run(hard_cases::ramp_over_bricks());
}
TEST(HardCases, R20BricksAtAllPhases) {
    run(hard_cases::bricks_at_all_phases());
}

} // namespace
} // namespace palpate
