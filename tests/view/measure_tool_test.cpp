// The measuring tool.

#include "apps/view/tools/measure_tool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/view/subjects.h"

namespace palpate::view {
namespace {

constexpr Panel kSlices[] = {Panel::axial, Panel::coronal, Panel::sagittal};

// The pointer goes away from the crosshair's handles and double clicks.
void click(TestHand& hand, glm::dvec2 at) {
    hand.move(at);
    hand.press(Button::left);
    hand.release(Button::left);
    hand.time_s += 1.0;
}

TEST(MeasureTool, ARulerLiesWhereTheCameraSaysThatItsPixelsAre) {
    std::mt19937 random(1);
    for (int i = 0; i < 200; ++i) {
        const Subject subject = subject_of(random_grid(random));
        TestHand hand{subject};
        const Panel panel = kSlices[random() % 3];
        const auto index = static_cast<size_t>(panel);
        const glm::dvec2 from = hand.middle(panel) - glm::dvec2(random() % 100, random() % 90),
                         to = hand.middle(panel) + glm::dvec2(6 + random() % 100, random() % 90);
        hand.key("m");
        if (random() % 2) {
            hand.drag(from, to, Button::left);
        } else {
            click(hand, from);
            EXPECT_EQ(hand.state.measuring.begun.size(), 1u);
            click(hand, to);
        }
        ASSERT_EQ(hand.state.notes.measures.size(), 1u);
        EXPECT_TRUE(hand.orders.empty());
        EXPECT_EQ(hand.state.crosshair_mm, subject.home.crosshair_mm);
        const Measure& ruler = hand.state.notes.measures[0];
        // By the picture's own camera.
        const Box box = box_of(hand.state, panel).value();
        const Camera camera = camera_of(subject.home.slices[index], subject.home.crosshair_mm,
                                        subject.grid, box.size_px);
        const glm::uvec2 size(box.size_px);
        const View view = make_view(camera, size);
        const auto place = [&](glm::dvec2 pixel) {
            const Ray ray = ray_through(view, pixel - glm::dvec2(box.low_px), size);
            return ray.origin_mm +
                   glm::dot(subject.home.crosshair_mm - ray.origin_mm, view.forward) *
                       ray.direction;
        };
        EXPECT_LT(glm::distance(ruler.points_mm[0], place(from)), 1e-6);
        EXPECT_LT(glm::distance(ruler.points_mm[1], place(to)), 1e-6);
        const double mm = mm_per_px(subject.home.slices[index], subject.grid, box.size_px);
        EXPECT_NEAR(glm::distance(ruler.points_mm[0], ruler.points_mm[1]),
                    glm::distance(from, to) * mm, 1e-6);
    }
}

TEST(MeasureTool, AHandleFollowsThePointerAndTheOthersStay) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1, 1, 2)));
    TestHand hand{subject};
    hand.key("m");
    const glm::dvec2 at = hand.middle(Panel::coronal);
    hand.drag(at, at + glm::dvec2(50, 10), Button::left);
    const glm::dvec3 first = hand.state.notes.measures[0].points_mm[0];
    hand.drag(at + glm::dvec2(50, 10), at + glm::dvec2(20, 70), Button::left);
    ASSERT_EQ(hand.state.notes.measures.size(), 1u);
    EXPECT_EQ(hand.state.notes.measures[0].points_mm[0], first);
    EXPECT_LT(glm::distance(
                  hand.state.notes.measures[0].points_mm[1],
                  point_under(hand.state, subject.grid, Panel::coronal, at + glm::dvec2(20, 70))),
              1e-9);
    EXPECT_FALSE(hand.state.measuring.held);
    hand.key("delete");
    EXPECT_TRUE(hand.state.notes.measures.empty());
}

TEST(MeasureTool, ASphereMovesByItsCentreAndGrowsByItsRim) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    TestHand hand{subject};
    for (int i = 0; i < 4; ++i)
        hand.key("m");
    ASSERT_EQ(hand.state.measuring.kind, MeasureKind::sphere);
    const glm::dvec2 at = hand.middle(Panel::axial);
    hand.drag(at, at + glm::dvec2(60, 0), Button::left);
    const Measure before = hand.state.notes.measures.at(0);
    hand.drag(at, at + glm::dvec2(-30, 20), Button::left);
    const Measure moved = hand.state.notes.measures.at(0);
    EXPECT_LT(glm::distance(moved.points_mm[1] - moved.points_mm[0],
                            before.points_mm[1] - before.points_mm[0]),
              1e-9);
    EXPECT_GT(glm::distance(moved.points_mm[0], before.points_mm[0]), 1.0);
    hand.drag(at + glm::dvec2(30, 20), at + glm::dvec2(80, 20), Button::left);
    const Measure grown = hand.state.notes.measures.at(0);
    EXPECT_EQ(grown.points_mm[0], moved.points_mm[0]);
    const double mm =
        mm_per_px(subject.home.slices[0], subject.grid, box_of(hand.state, Panel::axial)->size_px);
    EXPECT_NEAR(glm::distance(grown.points_mm[1], grown.points_mm[0]), 110.0 * mm, 1e-9);
}

TEST(MeasureTool, APolygonStaysInThePlaneInWhichItWasBegun) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    for (const int way : {0, 1, 2}) { // how it ends
        TestHand hand{subject};
        for (int i = 0; i < 3; ++i)
            hand.key("m");
        ASSERT_EQ(hand.state.measuring.kind, MeasureKind::polygon);
        const glm::dvec2 at = hand.middle(Panel::sagittal) - glm::dvec2(60, 50);
        click(hand, at);
        click(hand, at + glm::dvec2(100, 0));
        hand.wheel(3.0); // another slice: the corner goes to the first one's
        click(hand, at + glm::dvec2(100, 80));
        click(hand, hand.middle(Panel::axial)); // across its plane: nothing
        EXPECT_EQ(hand.state.measuring.begun.size(), 3u);
        if (way == 0)
            click(hand, at + glm::dvec2(3, 2));
        else if (way == 1)
            hand.key("enter");
        else {
            hand.move(at + glm::dvec2(0, 80));
            for (int i = 0; i < 2; ++i) {
                hand.press(Button::left);
                hand.release(Button::left);
            }
        }
        ASSERT_EQ(hand.state.notes.measures.size(), 1u) << way;
        const auto& corners = hand.state.notes.measures[0].points_mm;
        EXPECT_EQ(corners.size(), way == 2 ? 4u : 3u);
        for (const glm::dvec3 p : corners)
            EXPECT_NEAR(glm::dot(p - subject.home.crosshair_mm, subject.home.slices[2].towards),
                        0.0, 1e-9);
        EXPECT_TRUE(check(hand.state.notes.measures[0]));
    }
}

TEST(MeasureTool, InTheVolumeAClickTakesWhatIsSeenAndADragTurns) {
    Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    // A plane through the middle, seen from the front.
    const glm::dvec3 middle = center_mm(subject.grid), normal(0, -1, 0);
    subject.pick = [&](const Ray& ray) -> std::optional<glm::dvec3> {
        return ray.origin_mm + glm::dot(middle - ray.origin_mm, normal) /
                                   glm::dot(ray.direction, normal) * ray.direction;
    };
    TestHand hand{subject};
    hand.key("m");
    const glm::dvec2 at = hand.middle(Panel::volume), other = at + glm::dvec2(40, -30);
    const Camera camera = hand.state.camera;
    click(hand, at);
    click(hand, other);
    EXPECT_EQ(hand.state.camera, camera);
    ASSERT_EQ(hand.state.notes.measures.size(), 1u);
    const auto points = hand.state.notes.measures[0].points_mm;
    for (const auto& [point, pixel] : {std::pair(points[0], at), {points[1], other}}) {
        EXPECT_NEAR(glm::dot(point - middle, normal), 0.0, 1e-9);
        EXPECT_LT(
            glm::distance(pixel_of(hand.state, subject.grid, Panel::volume, point).value(), pixel),
            1e-6);
    }
    // Its handle stays on what is seen.
    hand.drag(other, other + glm::dvec2(-10, 50), Button::left);
    EXPECT_EQ(hand.state.camera, camera);
    const glm::dvec3 moved = hand.state.notes.measures[0].points_mm[1];
    EXPECT_NEAR(glm::dot(moved - middle, normal), 0.0, 1e-9);
    EXPECT_LT(glm::distance(pixel_of(hand.state, subject.grid, Panel::volume, moved).value(),
                            other + glm::dvec2(-10, 50)),
              1e-6);
    hand.drag(at + glm::dvec2(60, 60), at + glm::dvec2(90, 60), Button::left);
    EXPECT_NE(hand.state.camera, camera);
    EXPECT_EQ(hand.state.notes.measures.size(), 1u);
    EXPECT_TRUE(hand.state.measuring.begun.empty());
}

TEST(MeasureTool, EscapeLeavesNothingHalfPlaced) {
    const Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    TestHand hand{subject};
    hand.key("m");
    hand.key("m");
    ASSERT_EQ(hand.state.measuring.kind, MeasureKind::angle);
    click(hand, hand.middle(Panel::axial));
    click(hand, hand.middle(Panel::axial) + glm::dvec2(30, 0));
    hand.key("escape");
    EXPECT_TRUE(hand.state.measuring.begun.empty());
    EXPECT_TRUE(hand.state.notes.measures.empty());
    // Handles of another slice cannot be taken hold of.
    hand.key("m");
    hand.key("m");
    hand.key("m"); // a ruler again
    const glm::dvec2 at = hand.middle(Panel::axial);
    hand.drag(at, at + glm::dvec2(50, 0), Button::left);
    EXPECT_EQ(measure_handles(hand.state, subject.grid, Panel::axial).size(), 2u);
    hand.wheel(1.0);
    EXPECT_EQ(measure_handles(hand.state, subject.grid, Panel::axial).size(), 0u);
}

} // namespace
} // namespace palpate::view
