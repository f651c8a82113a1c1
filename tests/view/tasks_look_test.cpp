// Tasks 6 to 21: slices are looked at and measured.

#include "engine/measure/measure.h"
#include "tests/view/task_session.h"

namespace palpate::view {
namespace {

class LookTask : public Task {};

constexpr double kHeadSpacing_mm = 5.0; // of a head of 41 samples over 200 mm

TEST_F(LookTask, T06_TheWindowIsThatOfBone) {
    begin(head());
    const GreyWindow first = state().window;
    play("06_window_by_preset");
    const auto& names = viewer().work().subject().window_names;
    const size_t bone =
        static_cast<size_t>(std::find(names.begin(), names.end(), "bone") - names.begin());
    ASSERT_LT(bone, names.size());
    EXPECT_EQ(state().window, viewer().work().subject().windows[bone]);
    EXPECT_NE(state().window, first);
}

TEST_F(LookTask, T07_TheWindowIsNarrowerAndHigher) {
    begin(head());
    const GreyWindow first = state().window;
    play("07_window_by_drag");
    EXPECT_LT(state().window.high - state().window.low, first.high - first.low);
    EXPECT_GT(state().window.high + state().window.low, first.high + first.low);
}

TEST_F(LookTask, T08_TheWindowHasTheEndsThatWereTyped) {
    begin(open_synthetic("synthetic:gyroid?size=24"));
    ASSERT_NE(state().window, (GreyWindow{-160.0, 240.0}));
    play("08_window_by_typed_ends");
    EXPECT_EQ(state().window, (GreyWindow{-160.0, 240.0}));
}

// Places of a script are not rounded to pixels; what is left is the rounding of transforms.
constexpr double kPlace_mm = 1e-6;

TEST_F(LookTask, T09_TheRulerHasTheLengthBetweenItsPoints) {
    begin(head());
    play("09_ruler");
    const nlohmann::json measures = dump()["measures"];
    ASSERT_EQ(measures.size(), 1u);
    EXPECT_NEAR(measures[0]["length_mm"], 20 * kHeadSpacing_mm, 2.0 * kPlace_mm);
    EXPECT_TRUE(state().measuring.selected); // its value is shown
}

TEST_F(LookTask, T10_TheAngleIsThatOfThreePoints) {
    begin(head());
    play("10_angle");
    const nlohmann::json measures = dump()["measures"];
    ASSERT_EQ(measures.size(), 1u);
    EXPECT_NEAR(measures[0]["angle_deg"], 90.0, glm::degrees(kPlace_mm));
}

// By the shoelace formula over the samples that the session names.
TEST_F(LookTask, T11_ThePolygonHasTheAreaOfItsCorners) {
    begin(head());
    play("11_polygon");
    const nlohmann::json measures = dump()["measures"];
    ASSERT_EQ(measures.size(), 1u);
    ASSERT_EQ(measures[0]["points_mm"].size(), 5u);
    constexpr double x[] = {10, 30, 34, 30, 10}, y[] = {10, 10, 20, 30, 30};
    double twice = 0.0, perimeter = 0.0;
    for (size_t i = 0; i < 5; ++i) {
        const size_t next = (i + 1) % 5;
        twice += x[i] * y[next] - x[next] * y[i];
        perimeter += std::hypot(x[next] - x[i], y[next] - y[i]);
    }
    const double area_mm2 = 0.5 * twice * kHeadSpacing_mm * kHeadSpacing_mm;
    EXPECT_NEAR(measures[0]["area_mm2"], area_mm2, perimeter * kHeadSpacing_mm * kPlace_mm);
}

TEST_F(LookTask, T12_TheBallHasMeanAndDeviationOfItsValues) {
    begin(head());
    play("12_sphere");
    const nlohmann::json measures = dump()["measures"];
    ASSERT_EQ(measures.size(), 1u);
    const Measure& ball = state().notes.measures[0];
    const double radius_mm = glm::distance(ball.points_mm[0], ball.points_mm[1]);
    EXPECT_NEAR(radius_mm, 6 * kHeadSpacing_mm, 2.0 * kPlace_mm);
    double n = 0.0, sum = 0.0, squares = 0.0;
    const Volume values = grey();
    for (uint32_t z = 0; z < 41; ++z)
        for (uint32_t y = 0; y < 41; ++y)
            for (uint32_t x = 0; x < 41; ++x)
                if (glm::distance(mm(glm::dvec3(x, y, z)), ball.points_mm[0]) <= radius_mm) {
                    const double value = values.value({x, y, z});
                    n += 1.0;
                    sum += value;
                    squares += value * value;
                }
    ASSERT_GT(n, 500.0);
    EXPECT_EQ(measures[0]["values"]["count"], n);
    EXPECT_NEAR(measures[0]["values"]["mean"], sum / n, 1e-6);
    // The deviation of a population and of a sample of it differ by less than 1 / n of it.
    const double sd = std::sqrt(squares / n - sum / n * sum / n);
    EXPECT_NEAR(measures[0]["values"]["sd"], sd, sd / n);
}

TEST_F(LookTask, T14_AllSlicesGoToThePointAndItsValueIsShown) {
    begin(head());
    play("14_crosshair_to_a_value");
    const nlohmann::json now = dump();
    EXPECT_EQ(now["crosshair_sample"], nlohmann::json({12, 27, 20}));
    EXPECT_EQ(now["at_crosshair"], fmt::format("(12, 27, 20)  {:g} HU", value_at({12, 27, 20})));
}

// The pointer meets the surface of a ball of 35 mm, which is 1.5 mm wide: a ray finds it
// to a step of half a sample of 50 / 23 mm, and slices go to the nearest sample.
TEST_F(LookTask, T15_SlicesGoToThePointOnTheSurfaceIn3D) {
    begin(open_synthetic("synthetic:ball?size=47"));
    play("15_crosshair_from_3d");
    const double sample_mm = 100.0 / 46.0;
    EXPECT_NEAR(glm::length(state().crosshair_mm), 35.0, 1.5 + (0.5 + 0.87) * sample_mm);
    const glm::dvec3 to_eye = glm::normalize(state().camera.eye_mm - state().camera.target_mm);
    EXPECT_GT(glm::dot(glm::normalize(state().crosshair_mm), to_eye), 0.95);
}

TEST_F(LookTask, T16_TheSliceIsTenFurther) {
    begin(head());
    const nlohmann::json first = dump()["crosshair_sample"];
    play("16_ten_slices_further");
    const nlohmann::json now = dump()["crosshair_sample"];
    EXPECT_EQ(now[0], first[0]);
    EXPECT_EQ(now[1], first[1]);
    EXPECT_EQ(now[2].get<int>(), first[2].get<int>() + 10);
}

TEST_F(LookTask, T17_OneViewFilledTheWindowAndFourAreBack) {
    begin(head());
    play("17_one_view_large_and_back");
    EXPECT_EQ(were_alone_, std::set<Panel>{Panel::axial});
    EXPECT_FALSE(state().alone);
    EXPECT_EQ(state().layout, Layout::four);
}

TEST_F(LookTask, T18_APartIsTwiceAsLargeInTheMiddle) {
    begin(head());
    const double first = state().slices[0].zoom;
    play("18_zoom_and_pan");
    EXPECT_NEAR(state().slices[0].zoom / first, 2.0, 0.05);
    const Box box = box_of(state(), Panel::axial).value();
    const glm::dvec2 at = pixel_of(state(), grid(), Panel::axial, mm({26, 14, 20})).value();
    EXPECT_LT(glm::distance(at, glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px)), 2.0);
}

// The plane of the sagittal slice is turned about the crosshair, so that it holds both points.
TEST_F(LookTask, T19_ASliceHoldsTwoPoints) {
    begin(head());
    play("19_plane_through_two_points");
    const SliceView& slice = state().slices[static_cast<size_t>(Panel::sagittal)];
    EXPECT_GT(std::abs(slice.towards.y), 0.1); // oblique
    const auto away_mm = [&](glm::dvec3 sample) {
        return std::abs(glm::dot(slice.towards, mm(sample) - state().crosshair_mm));
    };
    EXPECT_LT(away_mm({20, 20, 20}), 1e-6);
    // The ring is taken hold of up to a pixel beside its line, and 150 px from the crosshair: a
    // turn
    // of 1 / 150, over the 50 mm to the second point.
    EXPECT_LT(away_mm({28, 14, 20}), 50.0 / 150.0);
}

TEST_F(LookTask, T20_SlicesShowTheMaximumOver20mm) {
    begin(head());
    play("20_slab_maximum");
    EXPECT_EQ(state().slab_mm, 20.0);
    EXPECT_EQ(state().slab_mode, SlabMode::maximum);
}

TEST_F(LookTask, T21_ViewsAreAsOnOpening) {
    begin(head());
    const ViewState first = state();
    play("18_zoom_and_pan");
    play("19_plane_through_two_points");
    ASSERT_NE(state().slices, first.slices);
    play("21_straight_again");
    EXPECT_EQ(state().slices, first.slices);
    EXPECT_EQ(state().crosshair_mm, first.crosshair_mm);
}

} // namespace
} // namespace palpate::view
