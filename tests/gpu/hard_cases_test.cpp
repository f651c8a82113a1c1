// The hard cases of ray casting on the GPU: the list that the fp64 twin passes.

#include "tests/support/hard_cases.h"

#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

class HardCases : public GpuTest {
 protected:
    static Image picture(Renderer& renderer, const Scene& scene, const SceneData& data) {
        Result<Frame> frame = renderer.render(scene, data);
        EXPECT_TRUE(frame) << frame.error().message;
        return frame->eyes[0];
    }
    static void run(const std::vector<hard_cases::Case>& cases) {
        ASSERT_FALSE(cases.empty());
        Renderer renderer(device());
        for (const auto& c : cases) {
            SCOPED_TRACE(c.name);
            c.check(picture(renderer, c.scene, c.data));
        }
    }
    static void run(const std::vector<hard_cases::Same>& cases) {
        ASSERT_FALSE(cases.empty());
        Renderer renderer(device());
        for (const auto& c : cases) {
            const Image first = picture(renderer, c.variants[0].first, c.variants[0].second);
            for (size_t v = 1; v < c.variants.size(); ++v) {
                const Image other = picture(renderer, c.variants[v].first, c.variants[v].second);
                double worst = 0.0;
                for (size_t i = 0; i < first.samples.size(); ++i)
                    worst = std::max(worst, std::abs(double{first.samples[i]} - other.samples[i]));
                EXPECT_LE(worst, c.max_difference) << c.name << ", variant " << v;
            }
        }
    }
};

TEST_F(HardCases, R1ZeroComponentsAndFaces) {
    run(hard_cases::zero_components_and_faces());
}
TEST_F(HardCases, R2CameraInside) {
    run(hard_cases::camera_inside());
}
TEST_F(HardCases, R3GrazingAnEdge) {
    run(hard_cases::grazing_an_edge());
}
TEST_F(HardCases, R6SameSlabOtherSpacing) {
    run(hard_cases::same_slab_other_spacing());
}
TEST_F(HardCases, R7TinyAndHugeDepth) {
    run(hard_cases::tiny_and_huge_depth());
}
TEST_F(HardCases, R8TenThousandFaint) {
    run(hard_cases::ten_thousand_faint());
}
TEST_F(HardCases, R9EarlyTermination) {
    run(hard_cases::early_termination());
}
TEST_F(HardCases, R10PartialSteps) {
    run(hard_cases::partial_steps());
}
TEST_F(HardCases, R13EveryCodeOfARamp) {
    run(hard_cases::every_code_of_a_ramp());
}
TEST_F(HardCases, R16OneSampleWithoutData) {
    run(hard_cases::one_sample_without_data());
}
TEST_F(HardCases, R17FarAwayOrTiny) {
    run(hard_cases::far_away_or_tiny());
}
TEST_F(HardCases, R20RampOverBricks) {
    run(hard_cases::ramp_over_bricks());
}
TEST_F(HardCases, R20BricksAtAllPhases) {
    run(hard_cases::bricks_at_all_phases());
}

} // namespace
} // namespace palpate
