// Tests of what a button of the hand does beside carving, by a hand on a path; and of limits that
// confine tools on labels.

#include <algorithm>

#include <gtest/gtest.h>

#include "apps/view/document/pulled_mesh.h"
#include "engine/volume/content_hash.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

class HandMoves : public testing::Test {
 protected:
    Work work_{Source{open_synthetic("synthetic:ball?size=48")}, {800, 600}, 1.0, false};
    ViewState state_ = work_.subject().home;
    double time_s_ = 1.0;

    // A hand without force that goes along x between two times, and is pressed from 0.2 s before to
    // 0.2 s after.
    void start(double from_mm, double to_mm, double begin_s, double end_s) {
        std::vector<haptics::HandPose> poses;
        for (int i = 0; i <= 40; ++i) {
            const double t = 0.05 * i;
            const double way = std::clamp((t - begin_s) / (end_s - begin_s), 0.0, 1.0);
            poses.push_back({.time_s = t,
                             .tool = {.position_mm = {from_mm + way * (to_mm - from_mm), 0, 0}},
                             .buttons = t > begin_s - 0.2 && t < end_s + 0.2 ? 1u : 0u});
        }
        work_.hand().touch().set_up(
            {.device = "exact", .path = haptics::HandPath(poses), .algorithm = "none"});
        work_.obey(order::StartHand{}, state_);
        ASSERT_TRUE(work_.hand().touch().running()) << work_.take_message().shown(false);
    }
    void wait(double seconds) {
        for (; seconds > 1e-9; seconds -= 0.05) {
            work_.hand().follow(state_, time_s_);
            work_.session().settle();
            time_s_ += 0.05;
        }
    }
    void dab(const Tool& tool, double radius_mm, double x_mm) {
        state_.tool = &tool;
        state_.radius_mm = radius_mm;
        work_.obey(order::StrokeDown{{x_mm, 0, 0}, time_s_ += 0.05}, state_);
        work_.obey(order::StrokeUp{{x_mm, 0, 0}, time_s_ += 0.05}, state_);
        work_.session().settle();
    }
    uint64_t hash(const char* name) { return content_hash(*work_.edited().document.find(name)); }
};

TEST_F(HandMoves, AFaceOfTheMeshGoesAsFarAsTheHand) {
    dab(kDrawTool, 20.0, 0.0);
    work_.obey(order::MakeMesh{}, state_);
    ASSERT_TRUE(work_.mesh_pulling().mesh()) << work_.take_message().shown(false);
    const auto at_x = [&] {
        return work_.mesh_pulling().mesh()->met({{90, 0, 0}, {-1, 0, 0}}).value();
    };
    const double before = at_x().x;
    state_.stylus.first = Carve::pull;
    state_.radius_mm = 5.0;
    start(before, before + 5.0, 0.5, 1.5);
    wait(0.2);
    EXPECT_EQ(at_x().x, before) << "not pressed yet";
    wait(1.7);
    EXPECT_TRUE(work_.mesh_pulling().is_pulled());
    // The held point goes as far as the hand, within 0.02 edges of some 3 mm. A ray along x meets
    // the face where it has turned, which is flat within 0.1 mm of its middle.
    EXPECT_NEAR(at_x().x, before + 5.0, 0.2);
    EXPECT_EQ(work_.edited().undo_steps, 1u) << "no step until it is put into its label";
}

TEST_F(HandMoves, WithoutAMeshThePullSaysWhatIsMissing) {
    state_.stylus.first = Carve::pull;
    start(0.0, 5.0, 0.2, 1.0);
    wait(0.6);
    EXPECT_NE(work_.take_message().shown(false).find("no mesh to pull"), std::string::npos);
}

TEST_F(HandMoves, SeedsArePaintedAndLabelsStay) {
    const uint64_t labels = hash(Work::kLabels), seeds = hash(Work::kSeeds);
    state_.stylus.first = Carve::seed;
    state_.radius_mm = 4.0;
    start(0.0, 10.0, 0.5, 1.5);
    wait(1.9);
    EXPECT_EQ(hash(Work::kLabels), labels);
    EXPECT_NE(hash(Work::kSeeds), seeds);
    const EditState edited = work_.edited();
    EXPECT_EQ(edited.undo_steps, 1u);
    EXPECT_EQ(edited.document.find(Work::kSeeds)->range().max, float{1});
}

TEST_F(HandMoves, TheCrosshairGoesWhereTheToolIs) {
    state_.stylus.first = Carve::crosshair;
    start(-12.0, 12.0, 0.5, 1.0);
    wait(1.9);
    // In the middle of the nearest sample.
    const double half_mm = 0.5 * spacing_mm(work_.subject().grid).x + 1e-9;
    EXPECT_NEAR(state_.crosshair_mm.x, 12.0, half_mm);
    EXPECT_NEAR(state_.crosshair_mm.y, 0.0, half_mm);
    EXPECT_EQ(work_.edited().undo_steps, 0u);
}

// Threshold paint: of what the brush passes over, the samples with values in the range.
TEST_F(HandMoves, TheBrushIsConfinedToValues) {
    const Volume grey = *work_.edited().document.find(Work::kGrey);
    const auto count = [&](auto holds) {
        const EditState edited = work_.edited();
        const Volume& labels = *edited.document.find(Work::kLabels);
        size_t all = 0;
        for (uint32_t z = 0; z < grey.size().z; ++z)
            for (uint32_t y = 0; y < grey.size().y; ++y)
                for (uint32_t x = 0; x < grey.size().x; ++x)
                    all += labels.value({x, y, z}) > 0 && holds(double{grey.value({x, y, z})});
        return all;
    };
    const auto any = [](double) { return true; };
    const auto within = [](double value) { return value >= 200.0 && value <= 800.0; };
    dab(kDrawTool, 6.0, 35.0); // about the surface of the ball, where values pass 500
    const size_t brush = count(any), in_range = count(within);
    ASSERT_GT(in_range, 0u);
    ASSERT_LT(in_range, brush);
    work_.obey(order::Undo{}, state_);
    work_.session().settle();
    ASSERT_EQ(count(any), 0u);
    state_.only_values = GreyWindow{200.0, 800.0};
    dab(kDrawTool, 6.0, 35.0);
    EXPECT_EQ(count(any), in_range);
    EXPECT_EQ(count(within), in_range);
    dab(kEraseTool, 6.0, 35.0);
    EXPECT_EQ(count(any), 0u);
}

} // namespace
} // namespace palpate::view
