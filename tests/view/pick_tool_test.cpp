// The tool that takes what is under the pointer into use.

#include "apps/view/tools/pick_tool.h"

#include <gtest/gtest.h>

#include "tests/view/subjects.h"

namespace palpate::view {
namespace {

// Label 7 where x is below 20 mm; the grey value of a sample is ten times its place on the y axis.
Subject picked_from() {
    Subject subject = subject_of(make_grid(glm::uvec3(64), glm::dvec3(1)));
    subject.label_at = [](glm::dvec3 p) { return static_cast<uint16_t>(p.x < 20.0 ? 7 : 0); };
    subject.value_at = [](glm::dvec3 p) { return std::optional(10.0 * std::round(p.y)); };
    subject.home.tool = &kPickTool;
    return subject;
}

glm::dvec2 pixel_at(const TestHand& hand, glm::dvec2 mm) {
    return pixel_of(hand.state, hand.subject.grid, Panel::axial, {mm, hand.state.crosshair_mm.z})
        .value();
}

TEST(PickTool, TakesTheLabelUnderThePointer) {
    const Subject subject = picked_from();
    TestHand hand{subject};
    hand.drag(pixel_at(hand, {10, 30}), pixel_at(hand, {50, 40}), Button::left);
    ViewState expected = subject.home;
    EXPECT_EQ(hand.state.label, 7);
    EXPECT_FALSE(hand.state.only_values) << "the press was all";
    EXPECT_EQ(hand.state.crosshair_mm, expected.crosshair_mm);
}

TEST(PickTool, TakesTheRangeOfTheValuesThatADragPasses) {
    const Subject subject = picked_from();
    TestHand hand{subject};
    hand.move(pixel_at(hand, {40, 30}));
    hand.press(Button::left);
    hand.move(pixel_at(hand, {40, 45}));
    hand.move(pixel_at(hand, {50, 25})); // and back
    hand.release(Button::left);
    EXPECT_EQ(hand.state.label, subject.home.label);
    EXPECT_EQ(hand.state.only_values, (GreyWindow{250.0, 450.0}));
}

TEST(PickTool, LeavesEverythingWhereThereIsNothingToTake) {
    const Subject subject = picked_from();
    TestHand hand{subject};
    hand.drag(pixel_at(hand, {40, 30}), pixel_at(hand, {40, 30}), Button::left);
    EXPECT_FALSE(hand.state.only_values) << "one value is no range";
    EXPECT_EQ(hand.state.label, subject.home.label);
    ASSERT_EQ(hand.orders.size(), 1u);
    hand.given<order::Tell>(0);
}

TEST(PickTool, TakesWhatIsSeenIn3D) {
    Subject subject = picked_from();
    subject.pick = [](const Ray&) { return std::optional(glm::dvec3(10, 5, 5)); };
    TestHand hand{subject};
    const glm::dvec2 at = hand.middle(Panel::volume);
    hand.drag(at, at + glm::dvec2(40, 0), Button::left);
    EXPECT_EQ(hand.state.label, subject.home.label) << "a drag turns the camera";
    EXPECT_NE(hand.state.camera, subject.home.camera);
    hand.drag(at, at, Button::left);
    EXPECT_EQ(hand.state.label, 7);
}

} // namespace
} // namespace palpate::view
